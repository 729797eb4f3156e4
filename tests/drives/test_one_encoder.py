"""Joints whose drives have one encoder: what is known, who can run, what a run says of it."""

import math
from dataclasses import replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest
from can_rig import BUS, LIMITS
from guard_rig import see_encoders

from legbench import load_design, phase_figure, run, summarise
from legbench.control import BangBangConfig, ControllerSettings, JumpConfig, PositionJumpConfig
from legbench.control.needs import needs_of, run_on
from legbench.drives.master.axis_link import AxisLink
from legbench.drives.master.joint import joint_of
from legbench.drives.protocol.datatypes import DataType
from legbench.drives.protocol.pdo import Mapped
from legbench.drives.setup.bus_file import load_bus
from legbench.drives.setup.config import NodeConfig
from legbench.drives.setup.encoders import Side
from legbench.drives.setup.pdos import POSITION_ACTUAL, STATUSWORD, packed
from legbench.drives.setup.waivers import describe_waivers
from legbench.errors import ConfigError, PlantFault, RecordingError
from legbench.experiment import Experiment
from legbench.limits.guard import ALL, Guard
from legbench.limits.safety import SafetyLimits
from legbench.plant.can_choice import CanChoice
from legbench.plant.landing import End
from legbench.recording.reader import Recording
from legbench.signals import MEASURED

ROOT = Path(__file__).parents[2]
TORQUE = Mapped(0x6077, 0, DataType.INTEGER16)
UNKNOWN_SPRINGS = 'waive = ["spring watch"]\n'


def bus_text(sides: str, *, torque: bool = False, waived: bool = False) -> str:
    """The bench's bus file with encoders at `motor`, `link` or `both` sides of each spring."""
    text = BUS.read_text(encoding="utf-8")
    head, *nodes = text.split("[[node]]")
    for place, node in enumerate(nodes):
        before, _, rest = node.partition("[node.motor]")
        motor, _, rest = rest.partition("[node.link]")
        link, _, after = rest.partition("[node.parameters]")
        if torque:
            before += '\ntorque_object = "6077:00 i16"\ntorque_scale = 0.01\n'
        tables = f"[node.motor]{motor}" if sides == "motor" else ""
        if sides == "link":
            tables = "[node.link]" + link.replace("bits = 16", "bits = 32")
            before = "\n".join(x for x in before.splitlines() if not x.startswith("soft_limits"))
        nodes[place] = f"{before}\n{tables}\n[node.parameters]{after}"
    return (UNKNOWN_SPRINGS if waived else "") + head + "".join(f"[[node]]{one}" for one in nodes)


def ran(
    folder: Path, text: str, controller: ControllerSettings, duration: float = 1.2, **more: Any
) -> Recording:
    """A run of the emulated leg on a bus file with this text."""
    (folder / "leg.toml").write_text(text, encoding="utf-8")
    (folder / "limits.toml").write_bytes(LIMITS.read_bytes())
    choice = CanChoice(bus=folder / "leg.toml", interface="legbench", end=End.STOP, **more)
    design = load_design(ROOT / "models" / "optimal.toml")
    chosen = Experiment(design=design, controller=controller, plant=choice, duration=duration)
    return run(chosen)


# --- what a drive tells ----------------------------------------------------------------------


def one_sided(side: Side, torque: Mapped | None) -> NodeConfig:
    """The first drive of the bench with one encoder."""
    answers = (STATUSWORD, POSITION_ACTUAL, *((torque,) if torque else ()))
    node = load_bus(BUS).nodes[0]
    return replace(
        node, link=None, side=side, torque_object=torque, torque_scale=0.01, tpdos=packed(answers)
    )


@pytest.mark.parametrize("side", list(Side))
def test_what_is_not_told_is_no_number_and_never_zero(side: Side) -> None:
    axis = AxisLink(one_sided(side, None))
    data = b"\x37\x12" + axis.node.motor.to_counts(0.3).to_bytes(4, "little", signed=True)
    assert axis.feed(0x181, data)
    motor, link, torque = joint_of(axis, 4.0)
    assert math.isnan(torque)
    shown, hidden = (motor, link) if side is Side.MOTOR else (link, motor)
    assert shown == pytest.approx(0.3, abs=axis.node.motor.resolution)
    assert math.isnan(hidden)
    assert axis.node.knows == {"motor_pos" if side is Side.MOTOR else "joint_pos"}


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("side", list(Side))
def test_a_torque_stands_for_that_of_the_spring(side: Side, sign: int) -> None:
    node = one_sided(side, TORQUE)
    axis = AxisLink(replace(node, motor=replace(node.motor, sign=sign)))
    counts = axis.node.motor.to_counts(0.3).to_bytes(4, "little", signed=True)
    # 120 counts of 0.01 N m in the direction in which the encoder counts.
    assert axis.feed(0x181, b"\x37\x12" + counts + (120).to_bytes(2, "little"))
    motor, link, torque = joint_of(axis, 4.0)
    assert torque == pytest.approx(sign * 1.2)
    # Whichever side is measured, the spring is wound by torque over stiffness.
    assert motor - link == pytest.approx(sign * 0.3)
    assert (motor if side is Side.MOTOR else link) == pytest.approx(0.3, abs=1e-4)


def test_a_link_encoder_beside_another_one_is_refused() -> None:
    with pytest.raises(ConfigError, match="'motor1' has two encoders at its link"):
        replace(load_bus(BUS).nodes[0], side=Side.LINK)


@pytest.mark.parametrize("side", list(Side))
def test_units_that_do_not_fit_are_those_of_the_encoder_that_is_there(
    side: Side, tmp_path: Path
) -> None:
    text = "\n".join(x for x in bus_text(side).splitlines() if not x.startswith("bits"))
    text = text.replace("offset_counts = 0", "offset_counts = 0\nbits = 16")
    (tmp_path / "leg.toml").write_text(text, encoding="utf-8")
    with pytest.raises(ConfigError, match=f"'motor1': {side} bits is 16, but 6064h:00 has 32"):
        load_bus(tmp_path / "leg.toml")


# --- limits ----------------------------------------------------------------------------------


def test_limits_of_what_is_not_known_do_not_act_and_all_others_do() -> None:
    limits = SafetyLimits(joint_range=((-1.0, 1.0),) * 2, spring_torque=2.0, following_error=0.1)
    nan = (math.nan, math.nan)
    guard = Guard(limits, 0.001, known=[frozenset(["motor_pos"])] * 2, two_encoders=False)
    guard.start_at((0.0, 0.0))
    guard.check(joint_pos=nan, spring_torque=nan)
    see_encoders(guard, (0.0, 0.0), motor_pos=(0.0, 0.0), joint_pos=nan)

    def far() -> None:
        see_encoders(guard, (0.0, 0.0), motor_pos=(0.0, 0.5), joint_pos=nan)

    for _ in range(limits.following_cycles):
        far()
    with pytest.raises(PlantFault, match=r"motor 2 shows 0\.500 rad"):
        far()
    # What is to be known and is no number ends a run.
    known = Guard(limits, 0.001, known=[ALL, ALL])
    with pytest.raises(PlantFault, match="spring 1 carries nan N m"):
        known.check(joint_pos=(0.0, 0.0), spring_torque=nan)
    with pytest.raises(PlantFault, match="joint 1 is at nan rad"):
        known.check(joint_pos=nan, spring_torque=(0.0, 0.0))


def test_a_spring_whose_torque_nobody_knows_is_waived_by_name(tmp_path: Path) -> None:
    words = (
        "the spring torque of 'motor1' is not known, and its limit would not act: .*give "
        r'torque_object and torque_scale, or waive = \["spring watch"\] in the bus file'
    )
    with pytest.raises(ConfigError, match=words):
        ran(tmp_path, bus_text("motor"), PositionJumpConfig())
    (tmp_path / "leg.toml").write_text(bus_text("motor", waived=True), encoding="utf-8")
    lines = describe_waivers(load_bus(tmp_path / "leg.toml"), None)
    assert lines[0].startswith("the bus file waives the spring watch")
    assert "'motor1' has one encoder, at the motor, and sends no torque" in lines[1]
    assert "spring_torque, joint_range" in lines[1]


# --- controllers -----------------------------------------------------------------------------


class Guest:
    """Settings of a guest that says nothing of what it needs."""

    kind: ClassVar[str] = "guest"


class Modest(Guest):
    """Settings of a guest that looks at the links alone."""

    needs: ClassVar[tuple[str, ...]] = ("joint_pos",)


def test_who_can_run_on_what() -> None:
    assert needs_of(JumpConfig()) == needs_of(BangBangConfig()) == {"motor_pos", "spring_torque"}
    assert needs_of(PositionJumpConfig()) == {"motor_pos"}
    assert needs_of(Guest()) == set(MEASURED)
    assert needs_of(Modest()) == {"joint_pos"}
    assert run_on(MEASURED) == ("jump", "bang-bang", "position-jump", "chirp")
    assert run_on(["motor_pos"]) == ("position-jump", "chirp")
    assert run_on(["joint_pos", "spring_torque"]) == ()


@pytest.mark.parametrize("controller", [JumpConfig(), BangBangConfig()])
def test_controllers_that_read_the_springs_are_refused_without(
    tmp_path: Path, controller: ControllerSettings
) -> None:
    words = (
        f"controller {controller.kind} needs spring_torque, which drive 'motor1' does not tell: "
        "its one encoder is at the motor, and no torque_object .*position-jump, chirp can run"
    )
    with pytest.raises(ConfigError, match=words):
        ran(tmp_path, bus_text("motor", waived=True), controller)


@pytest.mark.parametrize("torque", [True, False])
def test_controllers_that_lead_motors_are_refused_where_links_are_led(
    tmp_path: Path, torque: bool
) -> None:
    words = (
        "controller position-jump needs motor_pos, which drive 'motor1' does not tell: its one "
        "encoder is at the link.*of the built-in ones none can run, --read-only looks on"
    )
    with pytest.raises(ConfigError, match=words):
        ran(tmp_path, bus_text("link", torque=torque, waived=True), PositionJumpConfig())


# --- runs ------------------------------------------------------------------------------------


@pytest.mark.long
def test_a_jump_on_motor_encoders_and_torques_is_rated_as_any(tmp_path: Path) -> None:
    (tmp_path / "a").mkdir()
    usual = ran(tmp_path / "a", BUS.read_text(encoding="utf-8"), JumpConfig(), 1.6)
    lean = ran(tmp_path, bus_text("motor", torque=True), JumpConfig(), 1.6)
    both, one = summarise(usual), summarise(lean)
    assert both.jumps == one.jumps > 0
    assert np.mean(one.rating_stance) == pytest.approx(np.mean(both.rating_stance), abs=1e-3)
    waived = next(event for event in lean.events if event["name"] == "waived")
    assert any("spring torque is the drive's own (6077h:00)" in x for x in waived["protections"])


def test_a_run_that_knows_no_links_says_so_and_is_null_there(tmp_path: Path) -> None:
    found = ran(tmp_path, bus_text("motor", waived=True), PositionJumpConfig(), 0.4)
    for name in ("joint_pos", "joint_vel", "spring_torque"):
        assert np.isnan(found[name]).all()
    assert np.isfinite(found["motor_pos"]).all()
    summary = summarise(found)
    assert summary.rating_periods == []
    assert summary.polar_max is None or math.isnan(summary.polar_max)
    (words,) = summary.warnings
    assert words.startswith("joint_pos and spring_torque are not known in any row")
    with pytest.raises(RecordingError, match="knows no link angle in any row"):
        phase_figure(found)


def test_drives_that_lead_links_are_looked_at(tmp_path: Path) -> None:
    text = bus_text("link", torque=True)
    found = ran(tmp_path, text, PositionJumpConfig(), 0.2, read_only=True)
    assert np.isfinite(found["joint_pos"]).all()
    assert np.isfinite(found["spring_torque"]).all()
