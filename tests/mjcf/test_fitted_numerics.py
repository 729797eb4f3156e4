"""Step and bars of legs that are not the paper's: random feasible ones, light ones, stiff ones."""

from dataclasses import replace

import numpy as np
import pytest
from mjcf_legs import MODELS_BY_NAME, options

from legbench.design import LegDesign
from legbench.design.dependent import design_of, margins, solve_dependent
from legbench.design.requirements import Bounds, Requirements
from legbench.design.setup import SUPPORTS
from legbench.design.statics import motor_holding
from legbench.errors import ConfigError
from legbench.kinematics import joint_to_modal, modal_to_joint
from legbench.mjcf import Linkage, LinkageKind, Numerics
from legbench.mjcf.fitting import HEAVIEST_BAR, PARTS, STEP
from legbench.plant.batch import BatchPlant
from legbench.plant.sim import SimPlant
from legbench.plant.start import Start
from legbench.signals import Command

REDUCED = Linkage(kind=LinkageKind.REDUCED)


def random_legs(count: int) -> list[LegDesign]:
    """Feasible legs of the paper's requirements, evenly drawn from Table I."""
    random, bounds, requirements = np.random.default_rng(0), Bounds(), Requirements()
    found: list[LegDesign] = []
    while len(found) < count:
        free = bounds.lower + (bounds.upper - bounds.lower) * random.random(7)
        if np.all(margins(requirements, solve_dependent(requirements, free)) > 0.0):
            found.append(design_of(requirements, free, f"random {len(found)}"))
    return found


LEGS = random_legs(10)


def departure(
    design: LegDesign, linkage: str, setup: str = "ffs", timestep: float | None = None
) -> float:
    """Largest |z1| in a second after an undamped release by 0.3 rad of z2 [rad]."""
    leg = replace(design, damping=(0.0, 0.0))
    chosen = replace(options(setup, linkage), numerics=Numerics(timestep=timestep))
    support = SUPPORTS[chosen.setup.kind]
    begin, rest = (modal_to_joint(np.array([0.0, z2])) for z2 in (1.3, 1.0))
    start = Start(joint_pos=begin, motor_pos=motor_holding(leg, begin, support))
    motor_pos, largest = motor_holding(leg, rest, support), 0.0
    with SimPlant(leg, chosen, start) as plant:
        plant.reset()
        for _ in range(1000):
            seen = plant.step(Command(motor_pos=motor_pos, phase=np.array(1)))
            largest = max(largest, abs(float(joint_to_modal(seen.joint_pos)[0])))
    return largest


@pytest.mark.parametrize(
    "leg",
    [*LEGS[:4], *(pytest.param(leg, marks=pytest.mark.long) for leg in LEGS[4:])],
    ids=lambda leg: leg.name,
)
def test_a_feasible_leg_keeps_its_mode(leg: LegDesign) -> None:
    assert departure(leg, "reduced") < 1e-6


@pytest.mark.long
def test_the_step_of_the_papers_legs_would_not_keep_every_mode() -> None:
    lost = [leg.name for leg in LEGS if departure(leg, "reduced", timestep=STEP) > 1e-6]
    assert lost == ["random 1", "random 7"]


@pytest.mark.long
@pytest.mark.parametrize("setup", ["hfts", "ffs"])
def test_light_bars_get_the_step_that_they_need(setup: str) -> None:
    """Bars that are light add nothing but what the solver makes of them: it falls with the step."""
    leg = LEGS[8]
    assert leg.shank.mass < 0.006
    assert Linkage().density(leg) < 0.2 * HEAVIEST_BAR
    assert departure(leg, "bars", setup) < 3e-4
    assert departure(leg, "bars", setup, timestep=STEP) > 2e-3


def test_the_papers_legs_have_the_papers_step_and_bars() -> None:
    for design in MODELS_BY_NAME.values():
        assert Linkage().density(design) == HEAVIEST_BAR
        for linkage in (Linkage(), REDUCED):
            fitted = Numerics().fitted([design], linkage)
            assert (fitted.timestep, fitted.loop_solref) == (STEP, (STEP, 1.0))


def test_a_step_that_is_given_is_kept_and_its_loops_follow(optimal: LegDesign) -> None:
    stiff = replace(optimal, stiffness=(3124.0, 3124.0))
    fitted = Numerics(timestep=0.0005).fitted([stiff], Linkage())
    assert (fitted.timestep, fitted.loop_solref) == (0.0005, (0.0005, 1.0))
    fitted = Numerics(loop_solref=(0.005, 1.0)).fitted([optimal], Linkage())
    assert (fitted.timestep, fitted.loop_solref) == (STEP, (0.005, 1.0))


@pytest.mark.parametrize("linkage", [Linkage(), REDUCED], ids=["bars", "reduced"])
def test_stiffer_springs_have_a_shorter_step_until_there_is_none(
    optimal: LegDesign, linkage: Linkage
) -> None:
    steps = []
    for stiffness in (3.124, 31.24, 312.4, 1000.0):
        leg = replace(optimal, stiffness=(stiffness, stiffness))
        step = Numerics().fitted([leg], linkage).timestep
        assert step is not None
        assert STEP / step == pytest.approx(round(STEP / step))
        steps.append(step)
    assert steps == sorted(steps, reverse=True)
    assert len(set(steps)) == 4
    assert steps[-1] >= STEP / PARTS[-1]
    stiff = replace(optimal, stiffness=(3124.0, 3124.0))
    with pytest.raises(ConfigError, match=r"'optimal': .* step of .* s; down to .* s .* or set"):
        Numerics().fitted([stiff], linkage)


def test_a_segment_may_be_too_light_for_bars(optimal: LegDesign) -> None:
    light = replace(optimal, foot=replace(optimal.foot, mass=0.001))
    with pytest.raises(ConfigError, match=r"its foot weighs .* kg/m .* or take linkage 'reduced'"):
        Linkage().density(light)
    assert Linkage(bar_density=0.001).density(light) == 0.001


def test_legs_in_step_share_the_finest_of_their_steps(optimal: LegDesign) -> None:
    stiff = replace(optimal, stiffness=(31.24, 31.24))
    begin = modal_to_joint(np.array([0.0, 1.0]))
    both = Start(joint_pos=np.array([begin, begin]), motor_pos=np.array([begin, begin]))
    chosen = options("hfts", "reduced")
    with BatchPlant([optimal, stiff], chosen, both) as plant:
        assert plant.model.opt.timestep == STEP / 4
