"""Figures of a summary against what they are means, sums and spans of."""

import numpy as np
import pytest
from metrics_runs import Hop, clock, manifest, recording

from legbench.kinematics import modal_to_joint
from legbench.metrics.analysis import Analysis
from legbench.metrics.caveats import warnings_of
from legbench.metrics.summary import summarise
from legbench.signals import MEASURED

LOSSES = ("motor_work", "damper_loss", "impact_loss", "stop_loss", "contact_loss", "other_loss")
UNRATED = (
    "nothing was rated: no stance or flight lies complete within the run; give it a longer duration"
)


def test_a_budget_is_shown_as_its_mean_over_the_limit_cycle() -> None:
    hop = Hop(hops=9.1)
    count = len(hop.signals()["time"])
    noise = np.random.default_rng(2).normal(size=(2, count, 2))
    joint_pos = hop.signals()["joint_pos"] + 0.3 * noise[1]
    run = hop.recording(energy=noise[0], joint_vel=noise[1], joint_pos=joint_pos)
    seen, analysis = summarise(run), Analysis(run)
    assert 0 < seen.first < seen.jumps
    for name in LOSSES:
        each = getattr(analysis.budget, name)
        assert getattr(seen, name) == pytest.approx(np.mean(each[seen.first :]), rel=1e-12), name
        assert np.ptp(each) > 0.0


@pytest.mark.parametrize(("rows", "cycle_us", "factor"), [(11, 50.0, 18.18), (1, 50.0, 0.0)])
def test_a_run_is_as_fast_as_its_cycles(rows: int, cycle_us: float, factor: float) -> None:
    run = recording(3.0 + clock(rows), manifest(), cycle_us=np.full(rows, cycle_us))
    seen = summarise(run)
    assert seen.duration == pytest.approx(0.001 * (rows - 1), abs=1e-12)
    assert seen.real_time_factor == pytest.approx(factor, abs=0.01)


@pytest.mark.parametrize(
    ("rows", "step", "period", "verdict"),
    [
        (9, 0.25, 0.25, "unsound"),
        (2, 0.25, 0.25, "unsound"),
        (1, 0.25, 0.25, "unknown"),
        (9, 0.3749, 0.25, "unsound"),
        (9, 0.375, 0.25, "unknown"),  # One and a half periods: rows have been left out.
        (9, 4.0, 0.25, "unknown"),
        (9, 4.0, None, "unsound"),  # Nobody knows how many rows there were.
    ],
)
def test_energy_from_nowhere_is_judged_where_every_cycle_has_its_row(
    rows: int, step: float, period: float | None, verdict: str
) -> None:
    energy = np.ones((rows, 2))
    energy[1:, 0] += 0.5
    entries = manifest(setup={"kind": "hfts"}, period=period)
    free = np.tile([-0.6, 0.6], (rows, 1))
    time = step * np.arange(rows, dtype=np.float64)
    run = recording(time, entries, energy=energy, joint_pos=free, motor_pos=free)
    assert summarise(run).numerics == verdict


def test_cycles_without_a_duration_have_no_factor() -> None:
    run = recording(clock(9), manifest(), cycle_us=np.zeros(9))
    assert np.isnan(summarise(run).real_time_factor)


def test_the_polar_angle_of_a_fixed_setup_counts_from_the_first_action_on() -> None:
    x1 = np.array([0.9, 0.9, 0.1, -0.4, 0.3])
    joint = np.stack([x1 - 0.5, x1 + 0.5], axis=-1)
    fixed = manifest(setup={"kind": "ffs"})
    phase = np.array([0, 0, 1, 1, 1])
    assert summarise(recording(clock(5), fixed, phase=phase, joint_pos=joint)).polar_max == (
        pytest.approx(0.4)
    )
    resting = recording(clock(5), fixed, joint_pos=joint)
    assert np.isnan(summarise(resting).polar_max)


def test_a_jump_shows_no_periods_and_a_fixed_setup_no_phases() -> None:
    hop = summarise(Hop(hops=9.1).recording())
    assert (hop.periods, hop.rating_periods, hop.rating_periods_equilibrium) == ([], [], [])
    assert hop.rating_stance
    time = clock(2000)
    z2, rate = 1.0 - 0.1 * np.cos(25.0 * time), 2.5 * np.sin(25.0 * time)
    still = np.zeros_like(time)
    run = recording(
        time,
        manifest(setup={"kind": "ffs"}, controller={"kind": "other"}),
        phase=np.ones(2000),
        joint_pos=modal_to_joint(np.stack([still, z2], axis=-1)),
        joint_vel=modal_to_joint(np.stack([still, rate], axis=-1)),
    )
    seen = summarise(run)
    assert seen.periods == pytest.approx([2.0 * np.pi / 25.0] * 7, abs=1e-4)
    assert len(seen.rating_periods) == len(seen.rating_periods_equilibrium) == 7
    assert (seen.rating_stance, seen.rating_flight, seen.jumps) == ([], [], 0)


def test_each_caveat_is_told_where_it_holds_and_only_there() -> None:
    assert warnings_of(Analysis(Hop().recording())) == []
    assert warnings_of(Analysis(Hop().real())) == []
    (told,) = warnings_of(Analysis(recording(np.zeros(0), manifest())))
    assert told == "the run has no rows: there is nothing to rate"
    short = Hop(hops=0.4)
    (told,) = warnings_of(Analysis(short.recording()))
    assert told == UNRATED
    (told,) = warnings_of(Analysis(short.real()))
    assert told == UNRATED
    stays = np.ones(len(short.signals()["time"]), dtype=np.bool_)
    (told,) = warnings_of(Analysis(short.recording(contact=stays)))
    assert told == (
        "nothing was rated: the leg never leaves the ground; push harder (a larger dz2)"
    )


def test_what_an_analysis_has_read_cannot_be_changed_and_the_recording_stays_as_it_was() -> None:
    run = Hop().recording()
    analysis = Analysis(run)
    for name in ("joint_pos", "phase", "contact"):
        with pytest.raises(ValueError, match="read-only"):
            analysis[name][0] = 1
        assert analysis[name] is analysis[name]
        np.testing.assert_array_equal(analysis[name], run[name])
        assert run[name].flags.writeable


@pytest.mark.parametrize("name", MEASURED)
def test_a_signal_that_no_row_knows_is_named_and_one_known_row_is_enough(name: str) -> None:
    hop = Hop()
    run = hop.recording()
    unknown = np.full_like(run[name], np.nan)
    told = warnings_of(Analysis(hop.recording(**{name: unknown})))
    assert told[0].startswith(f"{name} are not known in any row, as of drives with one encoder")
    if name == "joint_pos":
        # All that is rated follows from the links: nothing more is to be said.
        assert len(told) == 1
    unknown[7] = run[name][7]
    told = warnings_of(Analysis(hop.recording(**{name: unknown})))
    assert not any("not known" in text for text in told)


def test_several_signals_that_no_row_knows_are_named_together() -> None:
    hop = Hop()
    unknown = np.full_like(hop.recording()["joint_pos"], np.nan)
    names = MEASURED[:2]
    told = warnings_of(Analysis(hop.recording(**dict.fromkeys(names, unknown))))
    assert told[0].startswith(f"{' and '.join(names)} are not known in any row")
