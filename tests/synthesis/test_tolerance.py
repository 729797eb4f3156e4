from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from legbench.analytic import LegModel
from legbench.analytic.many import ManyLegs, motion
from legbench.control import LegTargets
from legbench.design import LegDesign
from legbench.design.dependent import design_of
from legbench.design.requirements import PAPER
from legbench.design.setup import Setup, SetupKind
from legbench.design.statics import GRAVITY
from legbench.errors import ConfigError, DesignError
from legbench.metrics import Reference, rate
from legbench.mjcf import BuildOptions, Linkage, LinkageKind, Numerics
from legbench.plant.sim import SimPlant
from legbench.plant.start import Start
from legbench.signals import Command
from legbench.synthesis.release import Release, rate_legs
from legbench.synthesis.scatter import scatter
from legbench.synthesis.tolerance import (
    TOLERANCES,
    Tolerances,
    load_tolerances,
    tolerances_from_mapping,
)
from legbench.synthesis.yields import ScatterCost, measure_yield

LEG = design_of(PAPER, np.array([0.95, 0.4837, 0.15, 0.5, 0.15, 1 / 16, 0.5]))
SHORT = Release(duration=0.3)
NONE = Tolerances(mass=0.0, com=0.0, inertia=0.0, length=0.0, stiffness=0.0, damping=0.0)


def test_without_tolerances_every_leg_is_the_design() -> None:
    assert scatter(LEG, NONE, 3, 0) == [LEG] * 3


@pytest.mark.parametrize("name", TOLERANCES)
def test_each_tolerance_scatters_its_own_numbers_by_its_own_size(name: str) -> None:
    tolerances = Tolerances().only(name)
    made = scatter(LEG, tolerances, 400, 1)
    size = getattr(tolerances, name)
    if name in ("stiffness", "damping"):
        numbers = np.array([getattr(leg, name) for leg in made])
        centre = np.array(getattr(LEG, name))
    elif name == "length":
        numbers = np.array([[leg.thigh.length, leg.foot.length] for leg in made])
        centre = np.array([LEG.thigh.length, LEG.foot.length])
    else:
        numbers = np.array([[getattr(s, name) for s in leg.segments] for leg in made])
        centre = np.array([getattr(s, name) for s in LEG.segments])
    expected = size if name in ("com", "length") else size * centre
    np.testing.assert_allclose(numbers.std(axis=0) / expected, 1.0, atol=0.12)
    np.testing.assert_allclose((numbers.mean(axis=0) - centre) / expected, 0.0, atol=0.2)
    same = replace(made[0], thigh=LEG.thigh, shank=LEG.shank, foot=LEG.foot)
    if name not in ("stiffness", "damping", "mass"):
        assert same == LEG


def test_the_same_seed_makes_the_same_errors_of_any_design() -> None:
    other = replace(LEG, trunk_mass=2.0 * LEG.trunk_mass)
    first, second = (scatter(leg, Tolerances(), 2, 5)[1] for leg in (LEG, other))
    assert first.thigh == second.thigh
    assert second.trunk_mass == pytest.approx(2.0 * first.trunk_mass)


def deflections(release: Release, leg: LegDesign, reference: Reference) -> tuple[Start, np.ndarray]:
    """Start of a leg that is commanded as `LEG`, and what its deflection is measured from."""
    commanded = LegTargets(designs=LEG, support=release.support)
    own = LegTargets(designs=leg, support=release.support)
    begin = commanded.motor_at(release.z2 + release.dz2, "z2 + dz2")
    motor = commanded.motor_at(release.z2, "z2")
    rest = own.link_at_rest(motor) if reference is Reference.EQUILIBRIUM else motor
    return Start(joint_pos=own.link_at_rest(begin), motor_pos=motor), rest


@pytest.mark.parametrize("reference", list(Reference))
@pytest.mark.parametrize("setup", [SetupKind.HFTS, SetupKind.VFTS, SetupKind.FFS])
def test_legs_together_are_rated_as_the_equations_of_each_alone(
    setup: SetupKind, reference: Reference
) -> None:
    release = replace(SHORT, reference=reference, setup=setup)
    legs = scatter(LEG, Tolerances(), 3, 3)
    together = rate_legs([LEG] * 3, legs, release).values
    for leg, value in zip(legs, together, strict=True):
        start, rest = deflections(release, leg, reference)
        model = LegModel.of(leg, gravity=0.0 if setup is SetupKind.HFTS else GRAVITY)
        motor = (float(start.motor_pos[0]), float(start.motor_pos[1]))
        move = model.stance_acceleration if setup is SetupKind.FFS else model.hanging_acceleration

        def rates(_time: float, y: np.ndarray, move: Any = move, motor: Any = motor) -> list[float]:
            q1, q2, v1, v2 = y.tolist()
            return [v1, v2, *move(motor, (q1, q2), (v1, v2))]

        solved = solve_ivp(
            rates,
            (0.0, release.duration),
            [*start.joint_pos, 0.0, 0.0],
            method="DOP853",
            rtol=1e-11,
            atol=1e-13,
            t_eval=np.linspace(0.001, release.duration, round(release.duration / 0.001)),
        )
        assert value == pytest.approx(
            rate(solved.y[:2].T - rest), abs=2e-7 if setup is SetupKind.FFS else 5e-6
        )


def test_legs_are_rated_as_their_simulation() -> None:
    release = replace(SHORT, duration=0.2)
    (leg,) = scatter(LEG, Tolerances(), 1, 3)
    value = rate_legs([LEG], [leg], release).values[0]
    start, rest = deflections(release, leg, release.reference)
    numerics = Numerics(timestep=0.00025, loop_solref=(0.0005, 1.0))
    options = BuildOptions(
        setup=Setup(kind=release.setup),
        linkage=Linkage(kind=LinkageKind.REDUCED),
        numerics=numerics,
    )
    with SimPlant(leg, options, start) as plant:
        plant.reset()
        holding = Command.holding(start.motor_pos)
        rows = [plant.step(holding).joint_pos - rest for _ in range(200)]
    assert value == pytest.approx(rate(np.array(rows)), abs=1e-5)


def test_a_rating_does_not_depend_on_the_other_legs() -> None:
    legs = scatter(LEG, Tolerances(), 450, 3)
    together = rate_legs([LEG] * 450, legs, replace(SHORT, duration=0.05))
    for index in (0, 399, 400, 449):
        alone = rate_legs([LEG], [legs[index]], replace(SHORT, duration=0.05))
        assert alone.values[0] == together.values[index]


def test_a_leg_that_meets_its_stop_is_turned_back_as_by_the_law_of_one() -> None:
    (leg,) = scatter(replace(LEG, limits=replace(LEG.limits, knee=(1.7, 2.9))), Tolerances(), 1, 3)
    start, _ = deflections(SHORT, leg, Reference.EQUILIBRIUM)
    model = LegModel.of(leg)
    motor = (float(start.motor_pos[0]), float(start.motor_pos[1]))

    def rates(_time: float, y: np.ndarray) -> list[float]:
        q1, q2, v1, v2 = y.tolist()
        return [v1, v2, *model.stance_acceleration(motor, (q1, q2), (v1, v2))]

    alone = solve_ivp(
        rates, (0.0, 0.3), [*start.joint_pos, 0.0, 0.0], method="RK45", max_step=2e-4, rtol=1e-6
    )
    knee = alone.y[1] - alone.y[0]
    assert 1.6 < np.min(knee) < 1.69
    many = ManyLegs.of([model, LegModel.of(LEG)], standing=True)
    posture, held = np.tile(start.joint_pos, (2, 1)), np.tile(start.motor_pos, (2, 1))
    *_, (joint_pos, _) = motion(many, posture, held, 2e-4, 1500)
    assert np.max(np.abs(joint_pos[0] - alone.y[:2, -1])) < 1e-4
    ratings = rate_legs([LEG], [leg], SHORT)
    assert not ratings.faulted.any()


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"setup": SetupKind.JUMP}, "released in a fixed setup: hfts, vfts or ffs"),
        ({"duration": 0.0}, r"duration is 0 s; it must be 0\.002 s or more"),
    ],
)
def test_a_release_that_makes_no_sense(wrong: dict[str, Any], message: str) -> None:
    with pytest.raises(ConfigError, match=message):
        Release(**wrong)


def test_a_matched_leg_keeps_its_mode_and_unequal_springs_take_it() -> None:
    unequal = replace(LEG, stiffness=(2.9, 3.4))
    ratings = rate_legs([LEG] * 2, [LEG, unequal], SHORT)
    assert ratings.values[0] > 1.0 - 1e-6
    assert ratings.values[1] < 0.99
    assert not ratings.faulted.any()


def test_yield_names_the_worst_tolerance() -> None:
    found = measure_yield(LEG, Tolerances(), legs=20, legs_each=6, release=SHORT)
    assert found.nominal > 1.0 - 1e-6
    assert found.mean < found.nominal
    assert 0 <= found.kept <= found.legs == 20
    assert next(iter(found.causes)) == "stiffness"
    means = [mean for _, mean in found.causes.values()]
    assert means == sorted(means)
    with pytest.raises(ConfigError, match="legs is 0; a yield needs 1 leg or more"):
        measure_yield(LEG, Tolerances(), legs=0, legs_each=6)


def test_scatter_costs_what_rating_it_takes() -> None:
    free = ScatterCost(tolerances=NONE, legs=2, release=SHORT)([LEG])
    dear = ScatterCost(tolerances=Tolerances(), legs=4, release=SHORT, weight=2.0)([LEG])
    assert free[0] < 1e-6
    legs = scatter(LEG, Tolerances(), 4, 0)
    lost = 1.0 - rate_legs([LEG] * 4, legs, SHORT).values.mean()
    assert dear[0] == pytest.approx(2.0 * lost, abs=1e-12)


def test_a_leg_that_cannot_stand_loses_everything() -> None:
    soft = replace(LEG, stiffness=(0.3, 0.3))
    cost = ScatterCost(tolerances=NONE, legs=1, release=SHORT)([soft, LEG])
    assert cost[0] == 1.0
    assert cost[1] < 1e-6
    with pytest.raises(ConfigError, match="does not hold the leg up there"):
        rate_legs([soft], [soft], SHORT)


def test_tolerance_files(tmp_path: Path) -> None:
    path = tmp_path / "sls.toml"
    path.write_text('[units]\nlength = "mm"\n[tolerances]\ncom = 0.5\nmass = 0.01\n')
    assert load_tolerances(path) == Tolerances(com=0.0005, mass=0.01)
    with pytest.raises(DesignError, match=r"\[tolerances\] has unknown keys: weight"):
        tolerances_from_mapping({"tolerances": {"weight": 0.1}})
    with pytest.raises(DesignError, match=r"tolerance of mass is 0\.5; .* below 0\.333"):
        Tolerances(mass=0.5)
    with pytest.raises(DesignError, match="tolerance of com is nan"):
        Tolerances(com=float("nan"))
