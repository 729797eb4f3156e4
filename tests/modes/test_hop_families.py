"""Cycles of several hops, where a hop that is not stable ends, and hops followed over a setting."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from dense_hop import DenseHop, Rules

pytest.importorskip("heyoka")

from legbench.analytic import LegModel
from legbench.analytic.taylor import TaylorLeg
from legbench.control import JumpConfig
from legbench.design import LegDesign, load_design
from legbench.errors import ConfigError
from legbench.modes.cycles import HopCycle, end_of, find_cycle, multiplied, repeats
from legbench.modes.drive import JumpLaw
from legbench.modes.fixed_point import UNITS, differences
from legbench.modes.hop import Apex, return_map, settle
from legbench.modes.hop_family import follow_hop
from legbench.modes.hop_setting import tools_at
from legbench.modes.settings import Setting

MODELS = Path(__file__).parents[2] / "models"
OPTIMAL, PROTOTYPE = (load_design(MODELS / f"{name}.toml") for name in ("optimal", "prototype"))
JUMP = JumpConfig()
START = Apex(height=0.3, speed=0.0, z1=0.0, z2=0.6, dz1=0.0, dz2=0.0)


def leg_of(design: LegDesign, jump: JumpConfig = JUMP) -> tuple[TaylorLeg, JumpLaw]:
    law = JumpLaw(jump, design)
    return TaylorLeg(LegModel.of(design), probe=law.probe), law


def settled(design: LegDesign, jump: JumpConfig = JUMP, hops: int = 60) -> HopCycle:
    leg, law = leg_of(design, jump)
    return find_cycle(leg, law, settle(leg, law, START, hops)[-1:])


@pytest.fixture(scope="module")
def hop() -> HopCycle:
    return settled(OPTIMAL)


@pytest.fixture(scope="module")
def end(hop: HopCycle) -> HopCycle:
    _, found = end_of(*leg_of(OPTIMAL), hop, 400)
    assert found is not None
    return found


def test_the_hop_of_the_optimal_leg_is_lost_to_a_polar_one_that_alternates(hop: HopCycle) -> None:
    assert hop.period == 1
    assert not hop.stable
    value = hop.multipliers[0]
    assert value.imag == 0.0
    assert -1.08 < value.real < -1.06
    polar = np.abs(hop.directions[:, 0])
    assert np.max(polar[[0, 3, 5]]) < 1e-3 * np.max(polar[[1, 2, 4]])


def test_it_ends_in_a_hop_of_period_two(hop: HopCycle, end: HopCycle) -> None:
    assert end.period == 2
    assert end.stable
    assert [abs(apex.z1) for apex in end.apexes] == pytest.approx([0.023] * 2, rel=0.02)
    assert end.apexes[0].z1 == pytest.approx(-end.apexes[1].z1, abs=1e-6)
    assert end.duration == pytest.approx(2.0 * hop.duration, rel=0.02)


def test_cycles_close_by_an_independent_path(hop: HopCycle, end: HopCycle) -> None:
    for cycle in (hop, end):
        for apex, following in zip(cycle.apexes, [*cycle.apexes[1:], cycle.apexes[0]], strict=True):
            rules = Rules(JUMP, OPTIMAL)
            story = DenseHop(LegModel.of(OPTIMAL), rules).run(
                apex.height, apex.speed, *apex.angles()
            )
            assert story.ending == "apex"
            off = (np.array(story.apex) - following.vector()) / UNITS
            assert np.max(np.abs(off)) < 1e-4


def test_multipliers_of_a_cycle_are_those_of_differences(end: HopCycle) -> None:
    leg, law = leg_of(OPTIMAL)
    slopes = [differences(leg, law, apex) for apex in end.apexes]
    values, _ = multiplied(slopes)
    assert np.allclose(np.abs(values[:3]), np.abs(end.multipliers[:3]), rtol=0.0, atol=1e-5)


@pytest.mark.parametrize("name", ["hop", "end"])
def test_deviations_grow_along_the_direction_by_the_multiplier(
    name: str, request: pytest.FixtureRequest
) -> None:
    cycle: HopCycle = request.getfixturevalue(name)
    leg, law = leg_of(OPTIMAL)
    aside = 1e-5 * np.real(cycle.directions[:, 0]) * UNITS
    at = Apex.of(cycle.apexes[0].vector() + aside)
    for _ in range(cycle.period):
        done = return_map(leg, law, at)
        assert done.after is not None
        at = done.after
    moved = at.vector() - cycle.apexes[0].vector()
    wanted = np.real(cycle.multipliers[0]) * aside
    assert np.max(np.abs(moved - wanted) / UNITS) < 0.01 * np.max(np.abs(aside) / UNITS)


def test_a_stable_hop_ends_in_itself() -> None:
    cycle = settled(PROTOTYPE)
    assert cycle.stable
    _, found = end_of(*leg_of(PROTOTYPE), cycle, 100)
    assert found is not None
    assert found.period == 1
    assert np.allclose(found.apexes[0].vector(), cycle.apexes[0].vector(), atol=1e-8)


def test_repetition_is_told_from_the_last_apexes() -> None:
    def apexes(heights: list[float]) -> list[Apex]:
        return [START._replace(height=height) for height in heights]

    assert repeats(apexes([0.1, 0.2] + 20 * [0.3])) == 1
    assert repeats(apexes([0.5] + 20 * [0.3, 0.31])) == 2
    assert repeats(apexes(20 * [0.3, 0.31, 0.32])) == 3
    assert repeats(apexes(np.linspace(0.1, 0.3, 40).tolist())) is None


def test_a_guess_that_is_no_cycle_is_named() -> None:
    leg, law = leg_of(OPTIMAL)
    low = START._replace(height=0.21)
    with pytest.raises(ConfigError, match=r"below the ground|no hop of period 2|does not return"):
        find_cycle(leg, law, [low, START])


@pytest.mark.long
def test_damping_steadies_the_hop_and_the_family_says_where(hop: HopCycle) -> None:
    seen: list[tuple[int, int]] = []
    family = follow_hop(
        OPTIMAL,
        JUMP,
        Setting.DAMPING,
        hop,
        1.2,
        progress=lambda done, total: seen.append((done, total)),
    )
    assert family.ended == "damping = 1.2"
    assert seen[-1] == (100, 100)
    (change,) = family.changes
    assert change.stable_after
    assert change.kind.startswith("a multiplier of -1")
    assert change.value == pytest.approx(1.136, abs=0.003)
    # Another path: the hop settled on, with the dampers at either side.
    for value, stable in ((change.value - 0.02, False), (change.value + 0.02, True)):
        damping = (value * OPTIMAL.damping[0], value * OPTIMAL.damping[1])
        assert settled(replace(OPTIMAL, damping=damping)).stable is stable


@pytest.mark.parametrize(
    ("setting", "to", "design", "jump"),
    [
        (Setting.Z2, 0.47, PROTOTYPE, replace(JUMP, z2=0.47)),
        (Setting.DZ2, 0.14, PROTOTYPE, replace(JUMP, dz2=0.14)),
        (
            Setting.MISMATCH,
            0.04,
            replace(PROTOTYPE, stiffness=(2.3 * 1.02, 2.3 * 0.98)),
            JUMP,
        ),
    ],
)
def test_a_family_leads_to_the_hop_that_settles_there(
    setting: Setting, to: float, design: LegDesign, jump: JumpConfig
) -> None:
    family = follow_hop(PROTOTYPE, JUMP, setting, settled(PROTOTYPE), to)
    assert family.ended == f"{setting} = {to:g}"
    values = np.array([member.value for member in family.members])
    assert np.all(np.diff(values) * np.sign(to - values[0]) > 0.0)
    last, before = family.members[-1], family.members[-2]
    there = settled(design, jump, 120).apexes[0].vector()
    share = (to - before.value) / (last.value - before.value)
    ends = [member.cycle.apexes[0].vector() for member in (before, last)]
    between = ends[0] + share * (ends[1] - ends[0])
    assert np.max(np.abs(between - there) / UNITS) < 0.05


def test_a_family_that_ends_says_why_and_where() -> None:
    low = replace(JUMP, dz2=0.04)
    cycle = settled(PROTOTYPE, low, 150)
    family = follow_hop(PROTOTYPE, low, Setting.DZ2, cycle, 0.005)
    assert family.ended.startswith("no hop continues it at dz2 = 0.03")
    assert "below the ground" in family.ended
    assert all(member.value > 0.03 for member in family.members)


@pytest.mark.parametrize(
    ("setting", "to", "message"),
    [
        (Setting.DZ2, 0.25, r"z2 - dz2 = 0\.2 rad \(link\) puts the knee at"),
        (Setting.DZ2, -0.1, r"dz2 is -0\.1 rad; a push needs a positive amplitude"),
        (Setting.DAMPING, -1.0, r"damping is -1 times the design's; it cannot be negative"),
        (Setting.DAMPING, float("nan"), "damping is nan times the design's"),
        (Setting.MISMATCH, 2.5, r"mismatch is 2\.5; a spring has no stiffness beyond"),
        (Setting.Z2, 0.45, r"z2 is 0\.45 already; a family needs another value"),
    ],
)
def test_values_that_no_hop_has_are_refused(
    setting: Setting, to: float, message: str, hop: HopCycle
) -> None:
    with pytest.raises(ConfigError, match=message):
        follow_hop(OPTIMAL, JUMP, setting, hop, to)


def test_the_leg_is_built_once_for_settings_of_the_controller() -> None:
    leg, _ = tools_at(OPTIMAL, JUMP, Setting.DZ2, 0.1)
    assert tools_at(OPTIMAL, JUMP, Setting.DZ2, 0.12, leg)[0] is leg
    assert tools_at(OPTIMAL, JUMP, Setting.DAMPING, 1.2, leg)[0] is not leg
