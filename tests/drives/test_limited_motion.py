"""What the limits are told of each cycle, and when a command is expected to have acted."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from types import SimpleNamespace
from typing import Any, cast

import pytest
from drives_rig import LIMITS, MS, node

from legbench.drives.master.axis_link import AxisLink
from legbench.drives.master.joint import joint_of
from legbench.drives.master.limited_motion import LimitedMotion, guard_of
from legbench.drives.master.tick import Tick
from legbench.drives.protocol.datatypes import DataType
from legbench.drives.protocol.pdo import Mapped
from legbench.drives.setup.config import BusConfig, PdoConfig
from legbench.drives.setup.encoders import Side
from legbench.drives.setup.pdos import POSITION_ACTUAL, STATUSWORD

STIFFNESS = (4.0, 5.0)
TORQUE = Mapped(0x6077, 0, DataType.INTEGER16)
ONE_TPDO = (PdoConfig(number=1, objects=(STATUSWORD, POSITION_ACTUAL, TORQUE)),)


@dataclass
class Told:
    """A guard that lets everything through, half a milliradian lower, and keeps what it is told."""

    checks: list[dict[str, Any]] = field(default_factory=list[dict[str, Any]])
    encoders: list[dict[str, Any]] = field(default_factory=list[dict[str, Any]])
    momenta: int = 0
    expected: list[Sequence[float]] = field(default_factory=list[Sequence[float]])
    began: list[Sequence[float]] = field(default_factory=list[Sequence[float]])
    applied: tuple[float, ...] = ()

    def check(self, **told: Any) -> None:
        self.checks.append(told)

    def check_encoders(self, **told: Any) -> None:
        self.encoders.append(told)

    def check_momentum(self) -> None:
        self.momenta += 1

    def expect(self, commands: Sequence[float]) -> None:
        self.expected.append(commands)

    def start_at(self, motor_pos: Sequence[float]) -> None:
        self.began.append(motor_pos)
        self.applied = tuple(motor_pos)

    def command(self, motor_pos: Sequence[float]) -> tuple[float, ...]:
        self.applied = tuple(value - 0.0005 for value in motor_pos)
        return self.applied


class Leg:
    """Two drives whose process data is set by hand."""

    def __init__(self, *, one_encoder: bool = False) -> None:
        nodes = [node(place) for place in (0, 1)]
        if one_encoder:
            nodes = [
                replace(
                    each,
                    link=None,
                    side=side,
                    torque_object=TORQUE,
                    torque_scale=0.01,
                    tpdos=ONE_TPDO,
                )
                for each, side in zip(nodes, (Side.MOTOR, Side.LINK), strict=True)
            ]
        self.axes = [AxisLink(each) for each in nodes]
        polls = [SimpleNamespace(celsius=value) for value in (41.0, None)]
        self.guard = Told()
        self.motion = LimitedMotion(
            cast(Any, SimpleNamespace(axes=self.axes, polls=polls)),
            cast(Any, self.guard),
            STIFFNESS,
            **({"two_encoders": False} if one_encoder else {}),
        )

    def show(self, motor: Sequence[float], second: Sequence[float]) -> None:
        """Feed positions, and those of the links or the torques in counts of 0.01 N m."""
        for axis, here, other in zip(self.axes, motor, second, strict=True):
            data = b"\x37\x12" + axis.node.motor.to_counts(here).to_bytes(4, "little", signed=True)
            link = axis.node.link
            counts = round(other) if link is None else link.to_counts(other)
            axis.begin_cycle()
            assert axis.feed(axis.tpdo_ids[0], data + counts.to_bytes(2, "little", signed=True))

    def check(self, at_ms: int, skipped: int = 0) -> dict[str, Any]:
        """What the guard is told of a cycle."""
        tick = Tick(at_ms * MS, 0, skipped, 0, True)
        self.motion.check(self.motion.sample(tick))
        return self.guard.checks[-1]

    def judge(self, at_ms: int, skipped: int = 0) -> dict[str, Any]:
        """What the guard is told of the encoders of a cycle."""
        before = len(self.guard.encoders)
        self.motion.meanwhile()
        self.check(at_ms, skipped)
        (told,) = self.guard.encoders[before:]
        return {**told, "expected_pos": self.guard.expected[-1]}


def test_encoders_are_judged_only_while_the_leg_is_commanded_and_its_momentum_when_asked() -> None:
    leg = Leg()
    leg.show((0.1, -0.2), (0.1, -0.2))
    # As long as nothing is commanded a motor may be moved by hand.
    leg.motion.meanwhile()
    leg.check(1)
    assert leg.guard.encoders == leg.guard.expected == []
    leg.motion.begin()
    leg.check(2)
    assert (len(leg.guard.encoders), leg.guard.momenta) == (1, 1)
    leg.motion.meanwhile()
    assert (len(leg.guard.encoders), leg.guard.momenta) == (1, 2)


def test_a_command_is_expected_to_have_acted_two_looks_later() -> None:
    leg = Leg()
    leg.show((0.1, -0.2), (0.1, -0.2))
    for axis, target in zip(leg.axes, (0.3, -0.4), strict=True):
        axis.aim(target)
    leg.motion.begin()
    # From the targets that the drives hold, not from where their motors are.
    held = tuple(axis.target_pos for axis in leg.axes)
    assert held == pytest.approx((0.3, -0.4), abs=1e-5)
    assert leg.guard.began == [held]
    assert leg.judge(2)["expected_pos"] == held
    sent = []
    for step in range(3):
        applied, words = leg.motion.aim((0.31 + step, -0.41 - step))
        assert applied == pytest.approx((0.3095 + step, -0.4105 - step))
        assert [axis.target_pos for axis in leg.axes] == pytest.approx(applied, abs=1e-5)
        assert words == [axis.machine.controlword for axis in leg.axes]
        sent.append(applied)
        assert leg.judge(3 + step)["expected_pos"] == (held if step == 0 else sent[step - 1])


def test_the_limits_are_told_what_was_measured_and_how_long_ago_the_last_was() -> None:
    leg = Leg()
    leg.show((0.1, -0.2), (0.15, -0.1))
    leg.motion.begin()
    leg.judge(5)
    told = leg.judge(8, skipped=2)
    assert (told["elapsed"], told["interval"]) == (3, pytest.approx(0.003, rel=1e-12))
    told = leg.judge(9)
    assert (told["elapsed"], told["interval"]) == (1, pytest.approx(0.001, rel=1e-12))
    # With two encoders the one of the position loop is the motor's.
    assert told["motor_pos"] == leg.motion.led_pos == pytest.approx((0.1, -0.2), abs=1e-5)
    assert told["joint_pos"] == pytest.approx((0.15, -0.1), abs=1e-4)
    assert told["fresh"] == (True, True)
    told = leg.check(10)
    assert told["joint_pos"] == pytest.approx((0.15, -0.1), abs=1e-4)
    assert told["spring_torque"] == pytest.approx((4.0 * -0.05, 5.0 * -0.1), abs=1e-3)
    assert told["temperature"] == (41.0, None)


def test_with_one_encoder_the_limits_are_told_which_one_the_loop_is_closed_over() -> None:
    leg = Leg(one_encoder=True)
    leg.show((0.1, -0.2), (80, -50))
    leg.motion.begin()
    told = leg.judge(1)
    assert told["motor_pos"] == leg.motion.led_pos == pytest.approx((0.1, -0.2), abs=1e-5)
    assert told["joint_pos"] == pytest.approx((0.1 - 0.8 / 4.0, -0.2), abs=1e-5)
    seen = leg.motion.sample(Tick(MS, 0, 0, 0, True))
    # The knee's encoder counts the other way, and its torque does, too: 0.8 N m and 0.5 N m.
    assert leg.check(2)["spring_torque"] == seen.spring_torque == pytest.approx((0.8, 0.5))
    assert seen.motor_pos == pytest.approx((0.1, -0.2 + 0.5 / 5.0), abs=1e-5)
    # A spring without stiffness tells nothing of its other side.
    shown, hidden, torque = joint_of(leg.axes[0], 0.0)
    assert (shown, torque) == (pytest.approx(0.1, abs=1e-5), pytest.approx(0.8))
    assert hidden != hidden


@pytest.mark.parametrize("place", [0, 1])
def test_a_spring_is_wound_by_the_difference_of_two_encoders_or_by_its_torque(place: int) -> None:
    leg = Leg()
    leg.show((0.1, -0.2), (0.15, -0.05))
    motor, link, torque = joint_of(leg.axes[place], 0.5)
    assert (motor, link) == pytest.approx(((0.1, 0.15), (-0.2, -0.05))[place], abs=1e-4)
    assert torque == 0.5 * (motor - link)
    single = Leg(one_encoder=True)
    single.show((0.1, -0.2), (80, -50))
    motor, link, torque = joint_of(single.axes[place], 0.5)
    assert torque == pytest.approx((0.8, 0.5)[place])
    assert motor - link == pytest.approx(torque / 0.5)


def test_a_spring_for_each_drive_and_limits_of_what_the_drives_tell() -> None:
    leg = Leg()
    for springs in ((4.0,), (4.0, 5.0, 6.0)):
        with pytest.raises(ValueError, match=f"{len(springs)} springs for 2 drives"):
            LimitedMotion(
                cast(Any, SimpleNamespace(axes=leg.axes)), guard_of(CONFIG, LIMITS), springs
            )


CONFIG = BusConfig(nodes=(node(0), node(1)))
