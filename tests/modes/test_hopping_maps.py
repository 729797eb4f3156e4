"""The apex return map, its periodic hops, the template, and the basin on disk."""

import json
import math
from pathlib import Path

import numpy as np
import pytest
from exact_leg import exact_design
from scipy.integrate import solve_ivp
from scipy.optimize import least_squares

from legbench.analytic import LegModel
from legbench.control import Jump, JumpConfig, LegTargets
from legbench.design import load_design
from legbench.design.setup import Setup
from legbench.design.statics import Support
from legbench.errors import ConfigError
from legbench.loop import run
from legbench.plant.analytic import AnalyticPlant
from legbench.plant.start import Start

pytest.importorskip("heyoka")

from legbench.analytic.taylor import TaylorLeg
from legbench.modes.basin import BasinTask, Fate, GridAxis, map_basin
from legbench.modes.drive import JumpLaw, Passive
from legbench.modes.fixed_point import UNITS, FixedPoint, derivative, differences, fixed_point
from legbench.modes.hop import Apex, Ending, apex_of, return_map, settle
from legbench.modes.passive import FreeHop, depths, free_hop, rebound
from legbench.modes.slip import Slip, slip_groups

PROTOTYPE = load_design(Path(__file__).parents[2] / "models" / "prototype.toml")
JUMP = JumpConfig()
START = Apex(height=0.27, speed=0.0, z1=0.0, z2=0.6, dz1=0.0, dz2=0.0)
HELD = Passive((-0.456, 0.456))
TABLE_2 = load_design(Path(__file__).parents[2] / "models" / "table2.toml")
DEEP = np.linspace(0.9 * math.sqrt(0.5), 1.45, 150)


@pytest.fixture(scope="module")
def law() -> JumpLaw:
    return JumpLaw(JUMP, PROTOTYPE)


@pytest.fixture(scope="module")
def leg(law: JumpLaw) -> TaylorLeg:
    return TaylorLeg(LegModel.of(PROTOTYPE), probe=law.probe)


@pytest.fixture(scope="module")
def point(leg: TaylorLeg, law: JumpLaw) -> FixedPoint:
    return fixed_point(leg, law, settle(leg, law, START, 30)[-1])


@pytest.fixture(scope="module")
def exact() -> TaylorLeg:
    return TaylorLeg(LegModel.of(exact_design()), probe=HELD.probe)


@pytest.fixture(scope="module")
def rounded() -> TaylorLeg:
    return TaylorLeg(LegModel.of(TABLE_2, undamped=True), probe=HELD.probe)


def test_an_apex_is_what_its_state_says(leg: TaylorLeg) -> None:
    apex = Apex(height=0.3, speed=0.2, z1=0.05, z2=0.7, dz1=-0.4, dz2=1.5)
    back = apex_of(leg.model, apex.state(leg.model))
    assert np.allclose(back.vector(), apex.vector(), rtol=0.0, atol=1e-14)


def test_the_periodic_hop_repeats_and_draws_its_neighbours(
    leg: TaylorLeg, law: JumpLaw, point: FixedPoint
) -> None:
    assert point.residual < 1e-9
    assert point.stable
    away = np.array([1e-5, 0.0, 1e-4, 0.0, 1e-3, 0.0])
    done = return_map(leg, law, Apex.of(point.apex.vector() + away))
    assert done.after is not None
    moved = (done.after.vector() - point.apex.vector()) / UNITS
    wanted = derivative(leg, law, point.apex) @ (away / UNITS)
    assert np.max(np.abs(moved - wanted)) < 0.02 * np.max(np.abs(wanted))
    apexes = settle(leg, law, Apex.of(point.apex.vector() + 10.0 * away), 20)
    gaps = [np.max(np.abs(apex.vector() - point.apex.vector())) for apex in apexes]
    assert gaps[20] < 0.05 * gaps[0]


def test_the_derivative_of_the_map_is_its_differences(
    leg: TaylorLeg, law: JumpLaw, point: FixedPoint
) -> None:
    exact = derivative(leg, law, point.apex)
    assert np.allclose(exact, differences(leg, law, point.apex), rtol=0.0, atol=1e-6)
    aside = Apex.of(point.apex.vector() + 0.1 * UNITS)
    assert np.allclose(
        derivative(leg, law, aside), differences(leg, law, aside), rtol=0.0, atol=1e-6
    )


def test_a_hop_keeps_three_numbers_of_six(point: FixedPoint) -> None:
    sizes = np.abs(point.multipliers)
    assert np.all(sizes[:3] > 0.1)
    # The standing leg has four numbers, and lift-off is one condition on them. Differences leave
    # 1e-9 of the other three.
    assert np.all(sizes[3:] < 1e-12)


def test_the_derivative_of_a_passive_hop_with_impact_is_its_differences(exact: TaylorLeg) -> None:
    q = HELD.motor
    base = exact.model.mass_centre_from_hip(q)[1] - exact.model.foot_from_hip(q)[1]
    start = Apex(height=base + 0.05, speed=0.1, z1=0.05, z2=0.6, dz1=0.2, dz2=0.5)
    slope = derivative(exact, HELD, start)
    assert np.allclose(slope, differences(exact, HELD, start), rtol=1e-5, atol=1e-5)


def test_the_sampled_controller_hops_as_its_continuous_limit(point: FixedPoint) -> None:
    targets = LegTargets(designs=PROTOTYPE, support=Support.FOOT)
    controller = Jump(JUMP, targets)
    motor = controller.start_motor_pos
    start = Start(joint_pos=targets.link_at_rest(motor), motor_pos=motor)
    plant = AnalyticPlant(PROTOTYPE, Setup(), start)
    assert run(plant, controller, 3500).status == "complete"
    landed = [event.time for event in plant.transitions if event.touchdown]
    landed = [b for a, b in zip([0.0, *landed], landed, strict=False) if b - a > 0.1]
    periods = np.diff(landed)[-3:]
    assert np.max(np.abs(periods / point.hop.duration - 1.0)) < 0.02


def is_free(leg: TaylorLeg, found: FreeHop) -> bool:
    apex = found.point.apex
    done = return_map(leg, Passive(found.motor), apex)
    assert done.after is not None
    back = np.max(np.abs(done.after.vector() - apex.vector()))
    mirrored = abs(done.touchdown - (done.duration - done.liftoff)) < 1e-4
    return bool(mirrored and back < 1e-9 and done.impact < 1e-12)


def test_hops_without_impact_exist_and_lose_nothing(exact: TaylorLeg) -> None:
    half = HELD.motor[1]
    found = depths(exact, half, np.linspace(0.75, 1.4, 60))
    assert len(found) >= 1
    first = free_hop(exact, half, found[0])
    assert first is not None
    assert is_free(exact, first)
    assert np.max(np.abs(first.point.apex.vector()[[1, 2, 4, 5]])) < 1e-9
    assert abs(first.motor_z1) < 1e-9
    assert first.symmetric_loss < 1e-12


def test_the_rounded_leg_hops_without_impact_at_a_polar_set_point(rounded: TaylorLeg) -> None:
    half = 0.4113
    found = [free_hop(rounded, half, depth) for depth in depths(rounded, half, DEEP)]
    assert len(found) == 3
    for one in found:
        assert one is not None
        assert is_free(rounded, one)
        assert 1e-3 < abs(one.motor_z1) < 0.05
        assert one.symmetric_loss > 1e-6


@pytest.mark.parametrize(("name", "least", "most"), [("exact", 0.0, 1e-9), ("rounded", 1e-3, 1.0)])
def test_motors_at_z1_zero_leave_one_condition_too_many(
    name: str, least: float, most: float, request: pytest.FixtureRequest
) -> None:
    leg, half = request.getfixturevalue(name), 0.4113

    def moving(posture: np.ndarray) -> list[float]:
        folded, lean = posture.tolist()
        apex = rebound(leg, (-half, half), (lean - folded, lean + folded))
        return [1.0] * 3 if apex is None else [apex.dz1, apex.dz2, 10.0 * apex.speed]

    depth = depths(leg, half, DEEP)[1]
    best = least_squares(moving, [depth, 0.0], xtol=1e-15, ftol=1e-15, gtol=1e-15)
    assert least <= float(np.max(np.abs(best.fun))) <= most


def test_a_free_hop_that_would_meet_a_stop_is_none() -> None:
    undamped = TaylorLeg(LegModel.of(PROTOTYPE, undamped=True), probe=HELD.probe)
    found = [free_hop(undamped, 0.3297, depth) for depth in depths(undamped, 0.3297, DEEP)]
    assert [one is not None for one in found] == [True, False]


def test_passive_hops_never_gain_and_lose_what_the_impact_takes(exact: TaylorLeg) -> None:
    q = HELD.motor
    base = exact.model.mass_centre_from_hip(q)[1] - exact.model.foot_from_hip(q)[1]
    start = Apex(height=base + 0.05, speed=0.0, z1=0.0, z2=q[1] * math.sqrt(2.0), dz1=0.0, dz2=0.0)
    done = return_map(exact, HELD, start)
    assert done.after is not None
    assert done.impact > 1e-3
    assert done.after.height < start.height


def test_a_leg_that_only_stands_is_told_from_one_that_hops(leg: TaylorLeg) -> None:
    z2 = 0.95 * math.sqrt(2.0)
    half = z2 * math.sqrt(0.5)
    held = Passive((-half, half))
    height = leg.model.mass_centre_from_hip(held.motor)[1] - leg.model.foot_from_hip(held.motor)[1]
    damped = TaylorLeg(LegModel.of(exact_design(damping=0.3)), probe=held.probe)
    start = Apex(height=height + 0.001, speed=0.0, z1=0.0, z2=z2, dz1=0.0, dz2=0.0)
    assert return_map(damped, held, start).ending is Ending.STANDS
    with pytest.raises(ConfigError, match="does not return: it ended as 'stands'"):
        fixed_point(damped, held, start)


def test_starts_below_the_ground_are_named(leg: TaylorLeg, law: JumpLaw) -> None:
    with pytest.raises(ConfigError, match="mm below the ground"):
        return_map(leg, law, Apex(height=0.1, speed=0.0, z1=0.0, z2=0.6, dz1=0.0, dz2=0.0))


def test_template_in_closed_form_is_the_integrated_one() -> None:
    slip = Slip(mass=1.0, stiffness=552.0, length=0.24)
    drop = 0.05
    speed = math.sqrt(2.0 * slip.gravity * drop)

    def rates(_time: float, y: np.ndarray) -> list[float]:
        return [y[1], slip.gravity - slip.rate**2 * y[0]]

    def back(_time: float, y: np.ndarray) -> float:
        return float(y[0])

    back.terminal, back.direction = True, -1.0  # type: ignore[attr-defined]
    solved = solve_ivp(rates, (0.0, 1.0), [0.0, speed], events=back, rtol=1e-11, atol=1e-13)
    assert abs(float(solved.t_events[0][0]) - slip.contact_time(drop)) < 1e-9
    fine = solve_ivp(
        rates, (0.0, solved.t[-1]), [0.0, speed], rtol=1e-11, atol=1e-13, max_step=1e-4
    )
    assert abs(float(np.max(fine.y[0])) - slip.compression(drop)) < 1e-6
    assert slip_groups(slip, drop).returned == 1.0


def test_template_has_the_stiffness_of_the_leg() -> None:
    model = LegModel.of(exact_design())
    half = math.acos(0.95)
    slip = Slip.of(model, half)
    assert math.isclose(slip.stiffness, 905.0, rel_tol=1e-9)
    assert math.isclose(slip.length, 0.253, rel_tol=1e-9)


def task(point: FixedPoint, count: int = 5) -> BasinTask:
    height = point.apex.height
    return BasinTask(
        design=PROTOTYPE,
        jump=JUMP,
        motor=(0.0, 0.0),
        undamped=False,
        centre=point.apex,
        across=GridAxis(name="z1", low=-0.2, high=0.2, count=count),
        up=GridAxis(name="height", low=height - 0.08, high=height + 0.05, count=count),
    )


def test_a_basin_map_is_resumed_where_it_stopped(point: FixedPoint, tmp_path: Path) -> None:
    asked, path = task(point), tmp_path / "basin.jsonl"
    steps: list[int] = []
    whole = map_basin(asked, path, workers=1, progress=lambda done, _: steps.append(done))
    assert steps == [1, 2, 3, 4, 5]
    assert {Fate.RETURNS, Fate.BURIED} == {Fate(value) for value in np.unique(whole).tolist()}
    lines = path.read_text(encoding="utf-8").splitlines()
    path.write_text("\n".join([*lines[:3], lines[3][:9]]), encoding="utf-8")
    steps.clear()
    again = map_basin(asked, path, workers=1, progress=lambda done, _: steps.append(done))
    assert steps == [3, 4, 5]
    assert np.array_equal(whole, again)
    with pytest.raises(ConfigError, match="belongs to another map"):
        map_basin(task(point, 6), path, workers=1)


def test_two_processes_map_what_one_does(point: FixedPoint, tmp_path: Path) -> None:
    asked = task(point, 3)
    one = map_basin(asked, tmp_path / "one.jsonl", workers=1)
    two = map_basin(asked, tmp_path / "two.jsonl", workers=2)
    assert np.array_equal(one, two)
    assert json.loads(asked.text())["hops"] == asked.hops


def test_bad_axes_are_named() -> None:
    with pytest.raises(ConfigError, match="axis 'width' is unknown; an apex has height, speed"):
        GridAxis(name="width", low=0.0, high=1.0, count=3)
    with pytest.raises(ConfigError, match="runs from 1 to 0 in 3 points"):
        GridAxis(name="z1", low=1.0, high=0.0, count=3)
