"""What a leg's springs do not explain tells a link encoder that is wrong, however the leg sways."""

import math
import shutil
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from can_rig import BUS
from guard_rig import fault, see_encoders

from legbench.analytic import floating_terms
from legbench.analytic.matrices import pair_coriolis, pair_gravity, pair_mass
from legbench.analytic.terms import PairTerms
from legbench.commissioning.broken_plant import Part
from legbench.commissioning.dead_part_stage import Bench, Death, Emulation
from legbench.commissioning.dead_parts import try_dead_part, watch_healthy
from legbench.design import load_design
from legbench.design.setup import Setup, SetupKind
from legbench.drives.setup.bus_file import load_bus
from legbench.errors import ConfigError
from legbench.imperfections import Imperfections
from legbench.limits.guard import Guard
from legbench.limits.momentum import (
    AVERAGE_SHARES,
    AVERAGE_TIME,
    LegMomentum,
    MomentumReading,
    Pair,
    SupportPoint,
    left_over,
    motion_of,
)
from legbench.limits.momentum_watch import MomentumWatch
from legbench.limits.safety import SafetyLimits
from legbench.limits.support_watch import CONTACT_TIME, FLIGHT_TIME
from legbench.plant.leg_momentum import momentum_of, momentum_on
from legbench.plants import LIMITS_NAME
from legbench.servo import ServoConfig

DESIGN = load_design(Path(BUS).parents[1] / "models" / "prototype.toml")
"""A leg whose two axes differ in inertia, stiffness and damping."""
PERFECT = Imperfections()
PERIOD = 1e-3
POSTURE = (-0.4, 0.5)


def momentum(kind: SetupKind = SetupKind.JUMP, step: float = 0.0) -> LegMomentum:
    found = momentum_of(DESIGN, Setup(kind=kind), step, PERFECT)
    assert found is not None
    return found


def held(kind: SetupKind) -> list[PairTerms]:
    """Constants about each point of a setup, from the equations of motion."""
    terms, flat = floating_terms(DESIGN), floating_terms(DESIGN, gravity=0.0)
    return {
        SetupKind.JUMP: [terms.pinned(), terms.falling()],
        SetupKind.FFS: [terms.pinned()],
        SetupKind.VFTS: [terms.hanging()],
        SetupKind.HFTS: [flat.hanging()],
    }[kind]


def moving(
    terms: PairTerms, seed: int, period: float
) -> tuple[MomentumReading, MomentumReading, MomentumReading]:
    """Three readings of a leg that obeys the equations of motion, as matrices."""
    dice = np.random.default_rng(seed)
    q, v, a = np.array([-0.4, 0.5]) + dice.normal(0, 0.2, 2), *dice.normal(0, (5, 50), (2, 2)).T
    torque = pair_mass(terms, q) @ a + pair_coriolis(terms, q, v) @ v + pair_gravity(terms, q)
    motor = q + (torque + np.asarray(DESIGN.damping) * v) / np.asarray(DESIGN.stiffness)
    both = (float(motor[0]), float(motor[1]))
    shown = [(q + v * t + 0.5 * a * t * t).tolist() for t in (-period, 0.0, 1.5 * period)]
    pause = (period, period, 1.5 * period)
    first, second, third = (
        MomentumReading(time, both, (one[0], one[1]))
        for time, one in zip(pause, shown, strict=True)
    )
    return first, second, third


@pytest.mark.parametrize("kind", SetupKind)
def test_the_equations_of_motion_leave_nothing_unexplained(kind: SetupKind) -> None:
    leg = momentum(kind)
    for support, terms in zip(leg.supports, held(kind), strict=True):
        for seed in range(20):
            torque = left_over(support, motion_of(leg, moving(terms, seed, 1e-5)))
            assert torque == pytest.approx((0.0, 0.0), abs=2e-3)


@pytest.mark.parametrize("joint", [0, 1])
def test_an_angle_that_is_wrong_leaves_its_spring_unexplained(joint: int) -> None:
    leg, support = momentum(), momentum().supports[1]
    wrong = [0.0, 0.0]
    wrong[joint] = 1e-3
    for seed in range(20):
        shown = [
            one._replace(joint=(one.joint[0] + wrong[0], one.joint[1] + wrong[1]))
            for one in moving(held(SetupKind.JUMP)[1], seed, 1e-5)
        ]
        polar, knee = left_over(support, motion_of(leg, shown))
        spring = DESIGN.stiffness[joint] * 1e-3
        # The inertia that the wrong angle stands for is wrong by a thousandth, too.
        assert polar == pytest.approx(spring, rel=0.3)
        assert knee == pytest.approx(spring if joint else -spring, rel=0.3)


@pytest.mark.parametrize("step", [2 * math.pi / 4096, 2 * math.pi / 65536])
def test_averages_are_as_long_as_rounding_asks(step: float) -> None:
    support, allowed = momentum().supports[0], 0.06
    cycles = support.average_cycles(step, allowed, PERIOD)
    dice = np.random.default_rng(0)
    rounding = dice.uniform(-0.5 * step, 0.5 * step, (2, 200_000)).sum(axis=0)
    torque = (max(support.inertia) + support.coupling) * np.diff(rounding, 2) / PERIOD**2
    lengths = [round(share * cycles) for share in AVERAGE_SHARES]
    for length in (*lengths, cycles - sum(lengths)):
        torque = np.convolve(torque, np.ones(length) / length, "valid")
    shortest = cycles == round(AVERAGE_TIME / PERIOD)
    assert torque.std() < allowed
    assert shortest or torque.std() > 0.8 * allowed


SPIN = SupportPoint(inertia=(0.02, 0.02), coupling=0.01, moment=(0.0, 0.0))
"""A support without weight, about which a leg at rest leaves what its springs carry."""


def springs(*supports: SupportPoint) -> LegMomentum:
    return replace(momentum(), supports=supports, stiffness=(4.0, 4.0))


def wound(by: float) -> MomentumReading:
    """A leg at rest whose springs together carry the torque of one that is wound by an angle."""
    return MomentumReading(PERIOD, (POSTURE[0] + 0.5 * by, POSTURE[1] + 0.5 * by), POSTURE)


def apart(by: float, other: float | None = None, posture: Pair = POSTURE) -> MomentumReading:
    """A leg at rest whose springs are wound against each other by angles [rad]."""
    motors = (posture[0] - by, posture[1] + (by if other is None else other))
    return MomentumReading(PERIOD, motors, posture)


def alarm(
    watch: MomentumWatch,
    reading: MomentumReading,
    *,
    well: MomentumReading | None = None,
    stands: bool = False,
) -> int | None:
    """Cycles until a reading that repeats itself is doubted, after a second of one that is well."""
    for _ in range(1100):
        assert watch.see(well or wound(0.0)) is None
    for cycle in range(300):
        if watch.see(reading, stands=stands) is not None:
            return cycle
    return None


REACH = SPIN.average_cycles(0.0, 0.12, PERIOD)
"""Cycles over which its averages reach."""
CONTACT, FLIGHT = round(CONTACT_TIME / PERIOD), round(FLIGHT_TIME / PERIOD)
CROUCHED = (-0.9, 1.0)
HEAVY = replace(SPIN, moment=(4.0 / math.sin(0.9), 4.0 / math.sin(1.0)))
"""Ground on which a leg that crouches winds its springs of 4 N m/rad apart by 1 rad each."""
HOPPING = springs(HEAVY, SPIN)


def test_a_torque_within_the_limit_is_never_doubted_and_one_beyond_it_is() -> None:
    leg = springs(SPIN)
    assert alarm(MomentumWatch(leg, 0.03, PERIOD), wound(0.0299)) is None
    late = alarm(MomentumWatch(leg, 0.03, PERIOD), wound(0.0301))
    soon = alarm(MomentumWatch(leg, 0.03, PERIOD), wound(0.0301), stands=True)
    assert late is not None
    assert soon is not None
    assert late - soon == CONTACT + REACH - FLIGHT


def crouched(by: float, more: float = 0.0) -> MomentumReading:
    """A leg that crouches, its springs wound against each other, and both further on [rad]."""
    (first, second), posture = apart(by, posture=CROUCHED)[1:]
    return MomentumReading(PERIOD, (first + more, second + more), posture)


@pytest.mark.parametrize(("by", "patience"), [(0.0, FLIGHT), (1.0, CONTACT)])
def test_a_leg_in_flight_or_in_a_stance_is_doubted_soon(by: float, patience: int) -> None:
    watch = MomentumWatch(HOPPING, 0.03, PERIOD)
    found = alarm(watch, crouched(by, 0.1), well=crouched(by))
    assert found is not None
    assert patience < found < patience + REACH


def test_a_leg_between_ground_and_flight_is_doubted_once_both_would_explain() -> None:
    # Springs that carry half of what they do on the ground.
    found = [
        alarm(MomentumWatch(HOPPING, 0.03, PERIOD), crouched(0.5), well=crouched(0.0), stands=one)
        for one in (False, True)
    ]
    assert None not in found
    late, soon = found
    assert (late or 0) - (soon or 0) == 2 * REACH + CONTACT - FLIGHT


@pytest.mark.parametrize(
    ("first", "then", "on", "off", "doubted"),
    [(0.04, 0.04, 6, 9, True), (0.04, -0.04, 6, 9, False), (0.03, 0.03, 9, 12, False)],
    ids=["mostly", "of both signs", "less than half of the time"],
)
def test_torque_is_evidence_as_far_as_it_is_of_one_sign_and_not_explained(
    first: float, then: float, on: int, off: int, *, doubted: bool
) -> None:
    watch, doubts = MomentumWatch(HOPPING, 0.03, PERIOD), 0
    for _ in range(1100):
        assert watch.see(crouched(0.0)) is None
    age = longest = 0
    for more in ([first] * on + [0.0] * off + [then] * on + [0.0] * off) * 10:
        doubts += watch.see(crouched(0.0, more)) is not None
        assert watch.residual is not None
        age = age + 1 if watch.residual > 4.0 * 0.03 else 0
        longest = max(longest, age)
    assert 0 < longest <= FLIGHT
    assert (doubts > 0) == doubted


def test_evidence_from_before_the_springs_are_known_is_outweighed_by_what_is_explained() -> None:
    """A leg that is pushed for long while it cannot be doubted yet is not doubted much later."""
    watch = MomentumWatch(HOPPING, 0.03, PERIOD)
    pushed, well, touched = crouched(0.0, 0.1), crouched(0.0), crouched(0.0, 0.04)
    for reading in [pushed] * 700 + [well] * 400:
        assert watch.see(reading) is None
    left = []
    for reading in [touched] * 7 + [well] * 30:
        assert watch.see(reading) is None
        left.append(watch.residual or 0.0)
    assert max(left) > 4.0 * 0.03
    assert alarm(watch, pushed, well=well) is not None


def test_single_steps_of_coarse_encoders_are_no_evidence_against_a_leg_that_stands() -> None:
    # A leg that sways on the ground by 0.06 rad in a second, as while its drives are enabled.
    step, omega, swing = 2.0 * math.pi / 4096, 2.0 * math.pi, 0.03
    leg, terms = momentum(step=step), held(SetupKind.JUMP)[0]
    watch = MomentumWatch(leg, 0.025, PERIOD)
    for cycle in range(1600):
        at = omega * PERIOD * cycle
        q = np.array([-0.33, 0.52]) + swing * math.cos(at)
        v = np.full(2, -swing * omega * math.sin(at))
        a = np.full(2, -swing * omega**2 * math.cos(at))
        torque = pair_mass(terms, q) @ a + pair_coriolis(terms, q, v) @ v + pair_gravity(terms, q)
        motor = q + (torque + np.asarray(DESIGN.damping) * v) / np.asarray(DESIGN.stiffness)
        shown = step * np.round(q / step)
        reading = MomentumReading(PERIOD, (motor[0], motor[1]), (shown[0], shown[1]))
        assert watch.see(reading) is None


@pytest.mark.parametrize(
    "gap",
    [
        MomentumReading(2.0 * PERIOD, (0.5, 0.5), POSTURE),
        MomentumReading(PERIOD, (0.5, 0.5), (DESIGN.limits.hip[1], 2.0)),
    ],
    ids=["a missed cycle", "a hip at its stop"],
)
def test_what_cannot_be_known_begins_the_watch_anew(gap: MomentumReading) -> None:
    watch = MomentumWatch(springs(SPIN), 0.03, PERIOD)
    for _ in range(10):
        for _ in range(30):
            assert watch.see(wound(0.2)) is None
        assert watch.see(gap) is None
        assert watch.residual is None


def test_a_knee_stop_that_pushes_rules_no_support_out() -> None:
    leg = springs(SPIN, SPIN)
    at_stop = (0.0, DESIGN.limits.knee[0])
    assert alarm(MomentumWatch(leg, 0.03, PERIOD), apart(0.4, posture=at_stop)) is None
    assert alarm(MomentumWatch(leg, 0.03, PERIOD), apart(0.4)) is not None


def test_springs_unlike_the_design_are_learned_and_a_sudden_torque_is_not() -> None:
    # Weight that springs of 4 N m/rad hold when they are wound apart by 1 rad.
    moment = (-4.0 / math.sin(POSTURE[0]), 4.0 / math.sin(POSTURE[1]))
    leg = springs(replace(SPIN, moment=moment))
    unlike = apart(0.95, 1.05)
    assert alarm(MomentumWatch(leg, 0.03, PERIOD), unlike, well=unlike) is None
    assert alarm(MomentumWatch(leg, 0.03, PERIOD), unlike, well=apart(1.0)) is not None


def guarded(sway: float, leg: LegMomentum | None) -> str | None:
    """How a guard doubts a leg at rest whose springs are wound along q1 + q2, if it does."""
    limits = SafetyLimits(sway=sway, standing=0.02, joint_speed=60.0, link_error=0.025)
    guard = Guard(limits, PERIOD, momentum=leg)
    motors = (POSTURE[0] + 0.2, POSTURE[1] + 0.2)
    guard.start_at(motors)
    seen = {"commands": motors, "motor_pos": motors, "joint_pos": POSTURE}
    for _ in range(1300):
        assert fault(see_encoders, guard, **seen) is None
        doubt = fault(guard.check_momentum)
        assert fault(guard.check_momentum) is None
        if doubt is not None:
            return doubt
    return None


def test_momentum_is_asked_where_a_sway_may_hide_a_drift_alone() -> None:
    assert guarded(0.05, springs(SPIN)) is None
    assert guarded(0.2, None) is None
    doubt = guarded(0.2, springs(SPIN))
    assert doubt is not None
    assert doubt.startswith("joint encoder: the springs' torques contradict")
    assert "link_error of 0.025 rad" in doubt


def calls_in_a_cycle(leg: LegMomentum | None) -> int:
    """Calls that a guard makes to look at a leg that does not sway."""
    guard = Guard(SafetyLimits(sway=0.05, standing=0.02, link_error=0.025), PERIOD, momentum=leg)
    guard.start_at(POSTURE)
    seen = {"commands": POSTURE, "motor_pos": POSTURE, "joint_pos": POSTURE}
    see_encoders(guard, **seen)
    found: list[str] = []
    before = sys.getprofile()
    sys.setprofile(lambda frame, event, _: found.append(event) if event == "call" else None)
    try:
        see_encoders(guard, **seen)
    finally:
        sys.setprofile(before)
    return len(found)


def test_a_leg_that_does_not_sway_costs_no_averages() -> None:
    # Whether its sway may hide a drift, and that the watch has nothing to forget.
    assert calls_in_a_cycle(momentum()) - calls_in_a_cycle(None) <= 3


def test_what_is_known_of_a_leg_follows_setup_and_encoders() -> None:
    boom = Setup(kind=SetupKind.FFS, boom_radius=2.0)
    assert momentum_of(DESIGN, boom, 0.0, PERFECT) is None
    noisy = momentum_of(DESIGN, Setup(), 1e-4, Imperfections(link_noise=(1e-3, 0.0)))
    assert noisy is not None
    assert noisy.link_step == pytest.approx(1e-3 * math.sqrt(12.0))
    bus = load_bus(Path(BUS))
    found = momentum_on(bus, DESIGN, Setup(), PERFECT)
    assert found is not None
    assert found.link_step == pytest.approx(2.0 * math.pi / 65536)
    one_sided = replace(bus, nodes=(bus.nodes[0], replace(bus.nodes[1], link=None)))
    assert momentum_on(one_sided, DESIGN, Setup(), PERFECT) is None


def test_a_link_error_that_would_come_too_late_is_refused() -> None:
    with pytest.raises(ConfigError, match=r"link_error is 0\.2 rad, the upper end is 0\.1 rad"):
        SafetyLimits(link_error=0.2)


SWAYING = Bench(
    design=load_design(Path(BUS).parents[1] / "models" / "optimal.toml"),
    bus_file=Path(BUS),
    lean=0.08,
)
"""The paper's leg, which sways by 0.16 rad along q1 + q2 as after minutes of hopping."""
SERVO = ServoConfig(bandwidth=30.0, encoder_counts=65536)


@pytest.mark.parametrize(
    ("controller", "servo"),
    [
        ("jump", SERVO),
        # A link that stands while rounding looks like torque: coarse encoders, a slow servo.
        ("position-jump", ServoConfig(bandwidth=15.0, encoder_counts=4096)),
    ],
)
def test_a_leg_that_sways_is_left_alone(controller: str, servo: ServoConfig) -> None:
    assert watch_healthy(SWAYING, Emulation.SIM, controller, servo, 1.7) is None


@pytest.mark.parametrize(
    ("emulation", "drive", "part"),
    [
        (Emulation.SIM, 0, Part.LINK_DRIFT),
        (Emulation.SIM, 1, Part.LINK_DRIFT),
        (Emulation.SIM, 0, Part.LINK_FROZEN),
        (Emulation.SIM, 1, Part.REPEATING),
        # The test below does it in cycles of 4 ms.
        pytest.param(Emulation.CAN, 0, Part.LINK_DRIFT, marks=pytest.mark.long),
    ],
)
def test_a_link_encoder_that_dies_while_the_leg_sways_is_found_in_time(
    emulation: Emulation, drive: int, part: Part
) -> None:
    death = Death(part=part, drive=drive, onset=1.124)
    found = try_dead_part(SWAYING, emulation, "jump", death, SERVO)
    assert found.within(part), found


def test_a_leg_that_sways_is_watched_in_cycles_of_4_ms_as_of_1(tmp_path: Path) -> None:
    text = Path(BUS).read_text(encoding="utf-8").replace("tpdo_deadline_us = 720", "")
    slow = replace(SWAYING, bus_file=tmp_path / "leg.toml")
    slow.bus_file.write_text(text.replace("period_us = 1000", "period_us = 4000"), encoding="utf-8")
    shutil.copy(Path(BUS).parent / LIMITS_NAME, tmp_path)
    assert load_bus(slow.bus_file).period_us == 4000
    # A leg that is taken for broken before the part dies ends the trial by its fault.
    death = Death(part=Part.LINK_DRIFT, drive=0, onset=1.124)
    found = try_dead_part(slow, Emulation.CAN, "jump", death, SERVO)
    assert found.within(death.part), found
    assert found.cause == "joint encoder"
