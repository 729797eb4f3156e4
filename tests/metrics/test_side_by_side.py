"""Runs laid over each other at an event: what the clock alone would call a difference is none."""

from dataclasses import replace
from pathlib import Path
from types import MappingProxyType, SimpleNamespace
from typing import Any

import numpy as np
import pytest
from metrics_runs import MODELS, Hop, clock, guest, manifest, recording, remade

from legbench.design.toml import load_design
from legbench.errors import RecordingError
from legbench.kinematics import modal_to_joint
from legbench.metrics import Analysis, compare, summarise
from legbench.metrics.events import CommonEvent, common_event, event_time, event_times
from legbench.metrics.side_by_side import side_by_side
from legbench.metrics.stance import MINIMUM_PHASE
from legbench.phases import PhaseInfo, Role
from legbench.recording.reader import Recording

REST = PhaseInfo(code=0, name="rest", role=Role.REST)
FOLDED = PhaseInfo(code=1, name="folded", role=Role.ACTING)
STRETCHED = PhaseInfo(code=2, name="stretched", role=Role.ACTING)
HOP = Hop()


def delayed(run: Recording, rows: int, name: str = "late") -> Recording:
    """The same motion begun later: its first row held for so many rows."""
    columns = {
        each: np.concatenate([np.repeat(values[:1], rows), values])
        for each, values in run.columns.items()
    }
    time = clock(len(run.time) + rows) + run.time[0]
    return replace(run, path=Path(f"runs/{name}"), time=time, columns=MappingProxyType(columns))


def test_touchdowns_and_liftoffs_are_those_of_the_closed_form() -> None:
    run = Analysis(HOP.recording())
    down, up = event_times(run, CommonEvent.TOUCHDOWN), event_times(run, CommonEvent.LIFTOFF)
    np.testing.assert_allclose(down, [HOP.touchdown(n) for n in range(len(down))], atol=1e-4)
    np.testing.assert_allclose(up, [HOP.liftoff(n) for n in range(len(up))], atol=1e-3)
    assert len(down) >= 4
    assert event_time(run, CommonEvent.TOUCHDOWN, 2) == down[1]
    assert event_time(run, CommonEvent.TOUCHDOWN, -1) == down[-1]
    assert event_time(run, CommonEvent.CLOCK) == 0.0


def test_a_leg_that_is_put_down_in_its_first_rows_does_not_land() -> None:
    at = 1.0 + MINIMUM_PHASE
    later = float(np.nextafter(at, 2.0))
    ends = np.array([1.0, at, later, 1.5])
    phases = SimpleNamespace(start=ends, end=ends)
    run: Any = SimpleNamespace(
        time=np.array([1.0, 1.25]), gait=SimpleNamespace(stance=phases, flight=phases)
    )
    for event in (CommonEvent.TOUCHDOWN, CommonEvent.LIFTOFF):
        assert event_times(run, event).tolist() == [later, 1.5]
    nothing = Analysis(recording(np.zeros(0), manifest()))
    assert event_times(nothing, CommonEvent.TOUCHDOWN).tolist() == []
    # Time zero is there once, and always.
    assert event_times(nothing, CommonEvent.CLOCK).tolist() == [0.0]


def test_switches_lie_between_acting_phases() -> None:
    phase = np.array([0, 0, 1, 1, 2, 2, 2, 1, 0, 1])
    run = Analysis(guest(phase, (REST, FOLDED, STRETCHED), setup={"kind": "ffs"}))
    np.testing.assert_allclose(event_times(run, CommonEvent.SWITCH), [0.004, 0.007])
    np.testing.assert_allclose(event_times(run, CommonEvent.ACTION), [0.002])
    assert common_event([run]) is CommonEvent.SWITCH
    resting = Analysis(guest(0 * phase, (REST, FOLDED), setup={"kind": "ffs"}))
    assert common_event([run, resting]) is CommonEvent.CLOCK


@pytest.mark.parametrize("number", [1, 3, -1])
def test_a_delayed_run_is_the_same_run_after_its_event(number: int) -> None:
    run = HOP.recording()
    late = delayed(run, 37)
    assert compare(run, late).joint_max > 0.1
    pair = [Analysis(run), Analysis(late)]
    found = side_by_side(pair, number=number, span=0.2)
    (apart,) = found.apart
    assert found.event is CommonEvent.TOUCHDOWN
    assert found.times[1] - found.times[0] == pytest.approx(0.037, abs=1e-9)
    assert max(apart.joint_max, apart.z2_max, apart.x1_max) < 1e-9
    assert apart.run == "runs/late"
    assert (apart.other_leg, apart.otherwise_unlike) == ([], [])
    by_clock = side_by_side(pair, event=CommonEvent.CLOCK, span=0.2).apart[0]
    assert by_clock.joint_max > 0.05


def test_a_known_distance_is_measured_in_each_coordinate() -> None:
    entries = manifest(
        setup={"kind": "ffs"}, controller={"kind": "position-jump", "z2": 1.0, "dz2": 0.1}
    )
    time = clock(1000)

    def swung(polar: float, radial: float) -> Analysis:
        swing = np.sin(2.0 * np.pi * 1.5 * time)
        joint = modal_to_joint(np.stack([polar * swing, 1.0 + radial * swing], axis=-1))
        return Analysis(recording(time, entries, joint_pos=joint))

    runs = [swung(0.0, 0.1), swung(0.02, 0.1), swung(0.0, 0.13)]
    first, second = side_by_side(runs, event=CommonEvent.CLOCK).apart
    assert first.z2_max == pytest.approx(0.0, abs=1e-12)
    # x1 = (q1 + q2) / 2 is z1 over the root of two.
    assert first.x1_max == pytest.approx(0.02 / np.sqrt(2.0), rel=1e-4)
    assert second.z2_max == pytest.approx(0.03, rel=1e-4)
    assert second.x1_max == pytest.approx(0.0, abs=1e-12)
    assert second.duration == pytest.approx(0.999)


def test_runs_are_compared_from_50_ms_before_to_1_s_after_their_first_event() -> None:
    entries = manifest(setup={"kind": "ffs"}, controller={"kind": "position-jump", "dz2": 0.1})
    run = Analysis(recording(clock(3000) - 1.0, entries))
    (apart,) = side_by_side([run, run], event=CommonEvent.CLOCK).apart
    assert apart.duration == pytest.approx(1.049, abs=1e-9)
    hop = Analysis(HOP.recording())
    found = side_by_side([hop, hop])
    assert (found.event, found.number) == (CommonEvent.TOUCHDOWN, 1)
    assert found.times[0] == pytest.approx(HOP.touchdown(0), abs=1e-4)


def test_different_legs_are_told_from_different_settings() -> None:
    run = HOP.recording()
    optimal = remade(run, manifest(load_design(MODELS / "optimal.toml")))
    faster = remade(run, manifest(controller={"kind": "jump", "z2": 0.8, "dz2": 0.3}))
    found = side_by_side([Analysis(each) for each in (run, optimal, faster)])
    legs, settings = found.apart
    assert "design.thigh.mass" in legs.other_leg
    assert all(name.startswith("design.") for name in legs.other_leg)
    assert legs.otherwise_unlike == settings.other_leg == []
    assert settings.otherwise_unlike == ["controller.settings.dz2"]


def test_figures_are_those_of_the_runs_alone() -> None:
    runs = [Hop(speed=0.8).recording(), Hop(speed=0.9).recording()]
    found = side_by_side([Analysis(each) for each in runs])
    told: list[dict[str, Any]] = found.to_json()["runs"]
    for each, run, time in zip(told, runs, found.times, strict=True):
        assert each.pop("event_time") == time
        assert each == summarise(run).to_json()


def test_events_that_are_not_there_are_refused() -> None:
    run = Analysis(HOP.recording())
    count = len(event_times(run, CommonEvent.TOUCHDOWN))
    for number in (0, count + 1, -count - 1):
        with pytest.raises(RecordingError, match=rf"has {count} events of kind touchdown, so none"):
            side_by_side([run, run], event=CommonEvent.TOUCHDOWN, number=number)
    early = Analysis(replace(HOP.recording(), time=HOP.recording().time + 9.0))
    for runs in ([early, early], [run, early], [early, run]):
        with pytest.raises(RecordingError, match="no rows around their event"):
            side_by_side(runs, event=CommonEvent.CLOCK, span=0.5)
