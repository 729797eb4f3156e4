"""Stability along families of modes, branches, damped modes, and responses to moving motors."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
from exact_leg import exact_design  # pyright: ignore[reportMissingImports]
from independent import (  # pyright: ignore[reportMissingImports]
    bang_bang,
    motors_at,
    moved,
    polar_trace,
    straight_period,
)
from scipy.optimize import brentq

pytest.importorskip("heyoka")

from legbench.control import BangBang, BangBangConfig, LegTargets
from legbench.design import load_design
from legbench.design.setup import Setup, SetupKind
from legbench.design.statics import Support
from legbench.errors import ConfigError
from legbench.modes.branches import Branch, branches
from legbench.modes.damped import follow_damped
from legbench.modes.family import Family, follow
from legbench.modes.linear import RADIAL
from legbench.modes.response import Response, respond
from legbench.modes.ridden import ride
from legbench.modes.scene import Holding, Scene, make_scene
from legbench.modes.trajectory import branch_paths, family_paths, paths_to_json
from legbench.modes.trajectory_file import write_paths
from legbench.plant.analytic import AnalyticPlant
from legbench.plant.start import Start

MODELS = Path(__file__).parents[2] / "models"
OPTIMAL, PROTOTYPE = (load_design(MODELS / f"{name}.toml") for name in ("optimal", "prototype"))
EXACT = exact_design()


def still(posture: np.ndarray) -> np.ndarray:
    return np.concatenate([posture, [0.0, 0.0]])


@pytest.fixture(scope="module")
def family() -> Family:
    return follow(make_scene(OPTIMAL, Holding.HFTS, 1.1), "radial", 0.2)


@pytest.fixture(scope="module")
def branched(family: Family) -> tuple[Branch, ...]:
    return branches(family, most=8)


def test_the_radial_mode_loses_its_stability_and_gains_it_back(family: Family) -> None:
    lost, gained = family.passings
    assert lost.changes
    assert gained.changes
    assert not lost.stable_after
    assert gained.stable_after
    assert (lost.periods, gained.periods) == (1, 1)
    assert lost.orbit.energy == pytest.approx(0.06, rel=0.02)
    stable = [(one.energy, one.monodromy.stable) for one in family.orbits]
    assert sum(not steady for _, steady in stable) >= 2
    assert all(steady != (0.06 < energy < 0.103) for energy, steady in stable)


def test_changes_of_stability_are_those_of_another_integration(family: Family) -> None:
    scene = family.shooting.scene

    def unstable(energy: float) -> float:
        width = np.sqrt(2.0 * energy / scene.model.stiffness[0])
        start = still(np.asarray(scene.rest) + width * RADIAL)
        return polar_trace(scene, start, straight_period(scene, start)) - 2.0

    for passing, low, high in zip(family.passings, (0.04, 0.08), (0.08, 0.14), strict=True):
        energy = brentq(unstable, low, high, xtol=1e-6)
        assert passing.orbit.energy == pytest.approx(energy, rel=1e-3)


def test_branches_leave_where_stability_changes(
    family: Family, branched: tuple[Branch, ...]
) -> None:
    assert len(branched) == 4
    scene = family.shooting.scene
    for branch in branched:
        first = branch.orbits[0]
        assert first.energy == pytest.approx(branch.passing.orbit.energy, rel=0.05)
        assert first.polar < 0.05
        assert branch.orbits[-1].polar > 0.1
        for orbit in branch.orbits[::3]:
            assert abs(orbit.extra) < 1e-9
            end = moved(scene, orbit.start, orbit.period)
            assert np.max(np.abs(end - orbit.start) * [1.0, 1.0, 0.02, 0.02]) < 1e-8
    straight, circling = branched[:2], branched[2:]
    assert all(orbit.brakes for branch in straight for orbit in branch.orbits)
    assert not any(orbit.brakes for branch in circling for orbit in branch.orbits)
    assert all(orbit.monodromy.stable for branch in straight for orbit in branch.orbits)
    assert not any(orbit.monodromy.stable for branch in circling for orbit in branch.orbits)
    # The leg's mirror image in z1 is the leg: the two sides are mirror images.
    for one, other in zip(straight[0].orbits, straight[1].orbits, strict=False):
        assert one.period == pytest.approx(other.period, rel=1e-4)


def test_orbits_are_written_as_trajectories(
    family: Family, branched: tuple[Branch, ...], tmp_path: Path
) -> None:
    paths = [*family_paths(family), *branch_paths(family, branched)]
    write_paths(paths, tmp_path / "new" / "orbits.parquet")
    table = pq.read_table(tmp_path / "new" / "orbits.parquet").to_pydict()
    content = json.loads(json.dumps(paths_to_json(paths)))
    assert len(content) == len(family.orbits) + sum(len(one.orbits) for one in branched)
    assert set(table["family"]) == {"radial", *(f"radial branch {n}" for n in (1, 2, 3, 4))}
    assert table["q1"][: len(content[0]["q1"])] == content[0]["q1"]
    for one in (content[0], content[-1]):
        ends = [[one[name][place] for name in ("q1", "q2", "v1", "v2")] for place in (0, -1)]
        assert np.allclose(*ends, rtol=0.0, atol=1e-7)
        middle = np.array([one[name][50] for name in ("q1", "q2", "v1", "v2")])
        half = moved(family.shooting.scene, np.array(ends[0]), one["time"][50])
        assert np.allclose(middle, half, rtol=0.0, atol=1e-8)
        assert one["time"][-1] == one["period"]
    with pytest.raises(ConfigError, match=r"cannot write /proc/none/orbits\.parquet"):
        write_paths(paths, Path("/proc/none/orbits.parquet"))


def test_equal_dampers_of_a_matched_leg_change_no_mode() -> None:
    scene = make_scene(EXACT, Holding.FFS, 0.9)
    damped = follow_damped(scene, "radial", 0.1, (0.0073, 0.0073))
    for orbit in damped.orbits:
        assert orbit.extra == pytest.approx(-0.0073, abs=1e-9)
        assert orbit.polar < 1e-8
        undamped = moved(scene, orbit.start, orbit.period)
        assert np.allclose(undamped, orbit.start, rtol=0.0, atol=1e-7)


@pytest.mark.parametrize("name", ["radial", "polar"])
def test_a_damped_mode_shrinks_as_its_damping_ratio_says(name: str) -> None:
    scene = make_scene(PROTOTYPE, Holding.FFS, 0.9)
    damping = PROTOTYPE.damping
    damped = follow_damped(scene, name, 0.1, damping)
    assert damped.ended == "the energy asked for"
    orbit = damped.orbits[len(damped.orbits) // 2]
    drive = (damping[0] + orbit.extra, damping[1] + orbit.extra)
    end = moved(scene, orbit.start, orbit.period, damping=drive)
    assert np.allclose(end, orbit.start, rtol=0.0, atol=1e-7)
    after = moved(scene, orbit.start, orbit.period, damping=damping)

    def energy(state: np.ndarray) -> float:
        kinetic = 0.5 * state[2:] @ scene.mass(state[:2]) @ state[2:]
        return float(scene.potential(state[:2]) + kinetic)

    kept = energy(after) / energy(orbit.start)
    # Without the drive energy falls as that of a linear oscillator, to the next order of damping.
    assert kept == pytest.approx(np.exp(-4.0 * np.pi * orbit.damping_ratio), rel=0.02)


def test_damping_that_leaves_no_mode_is_named() -> None:
    scene = make_scene(EXACT, Holding.FFS, 0.9)
    with pytest.raises(ConfigError, match="the radial mode of the damped leg is not found"):
        follow_damped(scene, "radial", 0.1, (1e-4, 5.0))
    with pytest.raises(ConfigError, match=r"damping is \(-1.0, 0.0\) N m s/rad; it must be zero"):
        follow_damped(scene, "radial", 0.1, (-1.0, 0.0))
    with pytest.raises(ConfigError, match="energy is 0 J; it must be positive"):
        follow_damped(scene, "radial", 0.0, (0.01, 0.01))


def switched(
    scene: Scene, response: Response, state: np.ndarray, damping: tuple[float, float]
) -> np.ndarray:
    """State after one period of the motors, by another integration."""
    for sign, time in ((1.0, response.folded), (-1.0, response.stretched)):
        motor = motors_at(scene, sign * response.dz2)
        state = moved(scene, state, time, damping=damping, motor=motor)
    return state


def test_responses_close_and_their_multipliers_are_differences() -> None:
    scene = make_scene(PROTOTYPE, Holding.FFS, 1.0)
    curve = respond(scene, PROTOTYPE.damping, 0.03)
    assert curve.ended == "the slowest motors asked for"
    for response in curve.responses[::40]:
        assert np.allclose(
            switched(scene, response, response.start, PROTOTYPE.damping),
            response.start,
            rtol=0.0,
            atol=1e-7,
        )
    lost = [one for one in curve.responses if not one.stable]
    assert lost
    response = lost[len(lost) // 2]
    columns = [
        (
            switched(scene, response, response.start + 1e-6 * aside, PROTOTYPE.damping)
            - switched(scene, response, response.start - 1e-6 * aside, PROTOTYPE.damping)
        )
        / 2e-6
        for aside in np.eye(4)
    ]
    largest = np.max(np.abs(np.linalg.eigvals(np.stack(columns, axis=-1))))
    assert largest == pytest.approx(abs(response.multipliers[0]), abs=1e-5)


def test_weak_motors_excite_as_a_linear_oscillator() -> None:
    damping = (0.0073, 0.0073)
    scene = make_scene(EXACT, Holding.HFTS, 0.9)
    curve = respond(scene, damping, 1e-4)
    widest = max(curve.responses, key=lambda one: one.radial)
    inertia = float(RADIAL @ scene.mass(np.asarray(scene.rest)) @ RADIAL)
    omega = np.sqrt(scene.model.stiffness[0] / inertia)
    ratio = 0.5 * damping[0] / (inertia * omega)
    # The first harmonic of a square wave, 4/pi, over twice the damping ratio.
    assert widest.radial == pytest.approx(1e-4 * 4.0 / np.pi / (2.0 * ratio), rel=0.01)
    assert widest.freq == pytest.approx(omega / (2.0 * np.pi), rel=0.01)


def test_bang_bang_in_the_equations_rides_the_curve() -> None:
    damping, threshold, dz2 = PROTOTYPE.damping, 0.05, 0.08
    scene = make_scene(PROTOTYPE, Holding.FFS, 1.0)
    curve = ride(scene, damping, threshold, 0.04, 0.1)
    assert curve.ended == "the largest dz2 asked for"
    cycles = sorted(curve.cycles, key=lambda one: abs(one.dz2 - dz2))
    at = cycles[0]
    assert at.stable
    assert np.allclose(switched(scene, at, at.start, damping), at.start, rtol=0.0, atol=1e-7)
    beside = at.start + np.array([0.01, -0.01, 0.05, -0.05])
    end, durations = bang_bang(scene, beside, damping, at.dz2, threshold, 60)
    assert np.allclose(end, at.start, rtol=0.0, atol=1e-4)
    assert np.allclose(durations[-2:], [at.folded, at.stretched], rtol=1e-4, atol=0.0)
    config = BangBangConfig(z2=1.0, dz2=at.dz2, threshold=threshold)
    controller = BangBang(config, LegTargets(designs=PROTOTYPE, support=Support.FOOT))
    motor = controller.start_motor_pos
    start = Start(joint_pos=np.asarray(scene.rest), motor_pos=motor)
    plant = AnalyticPlant(PROTOTYPE, Setup(kind=SetupKind.FFS), start)
    seen = []
    observation = plant.reset()
    controller.reset(observation)
    for _ in range(9_000):
        observation = plant.step(controller.step(observation))
        seen.append(observation.joint_pos)
    z2 = np.array(seen[-2000:]) @ RADIAL
    # The sampled controller switches a millisecond or two late, which feeds the motion more.
    assert np.ptp(z2) / 2.0 == pytest.approx(at.radial, rel=0.03)
    rises = np.flatnonzero(np.diff(np.sign(z2 - z2.mean())) > 0.0)
    assert 1e3 / np.diff(rises).mean() == pytest.approx(at.freq, rel=0.01)


def test_responses_that_make_no_sense_are_named() -> None:
    scene = make_scene(PROTOTYPE, Holding.FFS, 1.0)
    damping = PROTOTYPE.damping
    with pytest.raises(ConfigError, match="dz2 is 0 rad; motors that do not move"):
        respond(scene, damping, 0.0)
    with pytest.raises(ConfigError, match="without it nothing bounds the response"):
        respond(scene, (0.0, 0.0), 0.01)
    with pytest.raises(ConfigError, match=r"threshold is 1 N m; it must be positive and below"):
        ride(scene, damping, 1.0, 0.05, 0.1)
    with pytest.raises(ConfigError, match=r"the largest dz2 is 0.04 rad; it must exceed"):
        ride(scene, damping, 0.05, 0.05, 0.04)


def test_a_response_that_meets_a_stop_ends_there_by_name() -> None:
    weak = replace(OPTIMAL, damping=(0.002, 0.002))
    curve = respond(make_scene(weak, Holding.FFS, 1.0), weak.damping, 0.05)
    assert curve.ended.startswith("the knee reaches its limit of 0.3 rad at ")
    assert curve.responses[-1].radial > 0.7


def test_a_multiplier_of_minus_one_leads_to_orbits_of_twice_the_period() -> None:
    scene = make_scene(OPTIMAL, Holding.FFS, 1.3)
    family = follow(scene, "radial", 0.35)
    doubled = [one for one in family.passings if one.periods == 2]
    assert [one.stable_after for one in doubled] == [False, True]
    found = branches(family, most=5)
    assert [branch.passing.periods for branch in found] == [2, 2, 2, 2]
    for branch in found:
        last, once = branch.orbits[-1], branch.passing.orbit.period
        assert last.period == pytest.approx(2.0 * once, rel=0.1)
        whole = moved(scene, last.start, last.period)
        assert np.max(np.abs(whole - last.start)) < 1e-7
        half = moved(scene, last.start, 0.5 * last.period)
        assert np.max(np.abs(half - last.start)) > 0.1
    # Each leaves the mode with the stability that the mode has not got there.
    assert [branch.orbits[0].monodromy.stable for branch in found] == [True, True, False, False]


def test_an_internal_resonance_is_told_where_the_pair_turns_by_a_third() -> None:
    family = follow(make_scene(OPTIMAL, Holding.FFS, 1.3), "radial", 0.06)
    (passing,) = family.passings
    assert (passing.turns, passing.periods, passing.changes) == (1, 3, False)
    assert passing.orbit.monodromy.pair[0] ** 3 == pytest.approx(1.0, abs=1e-6)
