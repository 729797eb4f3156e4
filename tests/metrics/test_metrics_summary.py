import json
from typing import Any

import numpy as np
import pytest
from metrics_runs import Hop, clock, manifest, recording, remade, truncated

from legbench.design.setup import SetupKind
from legbench.metrics.analysis import Analysis
from legbench.metrics.summary import summarise

FIXED = [kind.value for kind in SetupKind if kind is not SetupKind.JUMP]


def strict(summary: Any) -> dict[str, Any]:
    return json.loads(json.dumps(summary.to_json(), allow_nan=False))


def test_a_whole_hop_fills_every_figure() -> None:
    hop = Hop(hops=9.1)
    run = hop.recording()
    seen = strict(summarise(run))
    assert [name for name, value in seen.items() if value is None] == ["cause"]
    gait = Analysis(run).gait
    assert len(seen["rating_stance"]) == len(gait.stance) == 8
    assert len(seen["rating_flight"]) == len(gait.flight) == 9
    assert seen["rating_periods"] == []
    assert seen["jumps"] == 7
    assert seen["run"] == "runs/one"
    np.testing.assert_allclose(seen["rating_stance"] + seen["rating_flight"], 1.0, atol=1e-12)
    assert seen["real_time_factor"] == pytest.approx(4.0, rel=1e-3)


@pytest.mark.parametrize("rows", [0, 1, 2, 3, 5, 60, 250, 400, 900, 1300])
@pytest.mark.parametrize("real", [False, True])
@pytest.mark.parametrize("kind", [None, *FIXED])
def test_a_torn_run_gives_what_it_has(rows: int, real: bool, kind: str | None) -> None:
    run = truncated(Hop().real() if real else Hop().recording(), slice(0, rows))
    if kind is not None:
        controller = {"kind": "position-jump", "z2": 1.0, "dz2": 0.1}
        run = remade(run, manifest(setup={"kind": kind}, controller=controller))
    seen = strict(summarise(run))
    assert len(seen["rating_periods"]) == len(seen["periods"])
    assert len(seen["rating_stance"]) == len(seen["rating_stance_equilibrium"])
    if rows < 50:
        assert seen["rating_stance"] == seen["rating_flight"] == []
        assert seen["trunk_excursion"] is None
        assert seen["hop_freq"] is None
    if kind is not None:
        assert (seen["jumps"], seen["rating_stance"], seen["rating_flight"]) == (0, [], [])


def test_the_reference_of_the_manifest_decides_which_rating_has_no_suffix() -> None:
    hop = Hop()
    skewed = hop.signals()["joint_pos"] + np.array([0.05, 0.0])
    by_motor = summarise(hop.recording(joint_pos=skewed))
    entries = manifest(conventions={"modal": "orthonormal", "rating_reference": "equilibrium"})
    by_equilibrium = summarise(hop.recording(joint_pos=skewed, entries=entries))
    assert by_motor.rating_reference == "motor"
    assert by_equilibrium.rating_reference == "equilibrium"
    assert by_equilibrium.rating_stance == by_motor.rating_stance_equilibrium
    assert by_motor.rating_stance != by_motor.rating_stance_equilibrium
    # In flight nothing is carried: the equilibrium is the motor's position.
    assert by_motor.rating_flight == by_motor.rating_flight_equilibrium


def test_how_a_run_ended_is_told() -> None:
    entries = manifest(status="fault", cause="leg-crossed")
    seen = strict(summarise(recording(np.zeros(0), entries)))
    assert (seen["status"], seen["cause"]) == ("fault", "leg-crossed")
    assert seen["duration"] is None


def test_a_fixed_setup_is_rated_by_period() -> None:
    time = clock(2000)
    swing = 0.1 * np.cos(30.0 * time)
    joint = np.stack([-0.7 - swing, 0.7 + swing], axis=-1)
    rate = np.stack([3.0 * np.sin(30.0 * time), -3.0 * np.sin(30.0 * time)], axis=-1)
    run = recording(
        time,
        manifest(setup={"kind": "hfts"}, controller={"kind": "bang-bang", "dz2": 0.1}),
        phase=np.full(2000, 3),
        joint_pos=joint + 0.02,
        joint_vel=rate,
        motor_pos=np.tile([-0.68, 0.72], (2000, 1)),
    )
    seen = summarise(run)
    np.testing.assert_allclose(seen.periods, 2.0 * np.pi / 30.0, atol=1e-5)
    np.testing.assert_allclose(seen.rating_periods, 1.0, atol=1e-12)
    assert seen.rating_periods == seen.rating_periods_equilibrium
    assert seen.polar_max == pytest.approx(0.02, abs=1e-12)
