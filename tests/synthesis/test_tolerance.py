from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from legbench.control import LegTargets, PositionJump, PositionJumpConfig
from legbench.design.dependent import design_of
from legbench.design.requirements import PAPER
from legbench.errors import ConfigError, DesignError
from legbench.metrics import Reference, rate
from legbench.plant.sim import SimPlant
from legbench.plant.start import Start
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


@pytest.mark.parametrize("reference", list(Reference))
def test_a_batch_is_rated_as_each_leg_alone(reference: Reference) -> None:
    release = replace(SHORT, duration=0.2, reference=reference)
    legs = scatter(LEG, Tolerances(), 2, 3)
    together = rate_legs([LEG] * 2, legs, release).values
    support = release.options.setup.support
    config = PositionJumpConfig(z2=release.z2, dz2=release.dz2, delay=0.0)
    for leg, value in zip(legs, together, strict=True):
        controller = PositionJump(config, LegTargets(designs=LEG, support=support))
        begin = controller.start_motor_pos
        own = LegTargets(designs=leg, support=support)
        start = Start(joint_pos=own.link_at_rest(begin), motor_pos=begin)
        rows = []
        with SimPlant(leg, release.options, start) as plant:
            seen = plant.reset()
            target = controller.step(seen).motor_pos
            rest = own.link_at_rest(target) if reference is Reference.EQUILIBRIUM else target
            for _ in range(200):
                seen = plant.step(controller.step(seen))
                rows.append(seen.joint_pos - rest)
        assert value == pytest.approx(rate(np.array(rows)), abs=1e-9)


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
    with pytest.raises(ConfigError, match="a yield needs legs; 0 and 6"):
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
