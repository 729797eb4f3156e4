"""What is read of a bus without leading it: monitor, status, scan, troubles, commands in a log."""

import math
from dataclasses import replace
from pathlib import Path

import can
import pytest
from drives_rig import config, node
from service_rig import BENCH, FAULT, HOMED, MS, alone, opened, serial, written

from legbench.commissioning.command_excess import excess_of
from legbench.commissioning.idle import drive_troubles
from legbench.commissioning.monitor import MonitoredNode, monitor
from legbench.commissioning.scan import scan
from legbench.commissioning.status import status
from legbench.drives.emulated.drive import UNDER_VOLTAGE
from legbench.drives.errors import BusError
from legbench.drives.protocol.cia402 import DriveState
from legbench.drives.setup.pdos import STATUSWORD, PdoConfig, packed
from legbench.limits.safety import SafetyLimits


def frame(cob_id: int, data: str) -> can.Message:
    return can.Message(arbitration_id=cob_id, data=bytes.fromhex(data), is_extended_id=False)


# --- monitor ---------------------------------------------------------------------------------

QUARTER = (777 + (1 << 18)).to_bytes(4, "little").hex() + (-55 + (1 << 14)).to_bytes(
    2, "little"
).hex()
"""Both encoders of the hip at a quarter of a turn."""


def test_a_node_is_silent_until_it_is_heard_and_tells_what_it_said_last() -> None:
    hip = MonitoredNode(node(0))
    assert hip.line() == "hip      silent           no process data"
    hip.take(frame(0x701, "7F"))
    assert hip.line() == "hip      pre operational  no process data"
    hip.take(frame(0x701, "11"))  # No state that there is.
    hip.take(frame(0x081, "2032"))  # No emergency: too short.
    assert hip.line() == "hip      pre operational  no process data"
    hip.take(frame(0x701, "05"))
    hip.take(frame(0x081, "2032040000000000"))
    assert hip.line().startswith("hip      operational      no process data ")
    assert "3220h" in hip.line()
    for _ in range(2):
        hip.take(frame(0x181, "3712" + QUARTER))
    assert hip.frames == 2
    assert hip.line().startswith(
        "hip      operational      motor +1.5708 rad, link +1.5708 rad, 1237h: operation enabled"
    )
    assert "3220h" in hip.line()


@pytest.mark.parametrize("cob_id", [0x182, 0x201, 0x281, 0x702, 0x601, 0x082, 0x000])
def test_frames_of_others_and_of_other_kinds_say_nothing_of_a_node(cob_id: int) -> None:
    hip = MonitoredNode(node(0))
    for data in ("05", "2032040000000000", "3712" + QUARTER):
        hip.take(frame(cob_id, data))
    assert (hip.line(), hip.frames) == ("hip      silent           no process data", 0)


def test_a_drive_with_one_encoder_shows_one() -> None:
    plain = packed((STATUSWORD, node(0).motor_object))
    hip = MonitoredNode(replace(node(0), link=None, tpdos=plain))
    hip.take(frame(0x181, "3712" + QUARTER[:8]))
    assert hip.line().startswith("hip      silent           motor +1.5708 rad, 1237h: operation")


def test_a_node_with_two_frames_of_process_data_is_shown_once_both_are_there() -> None:
    entries = (STATUSWORD, node(0).motor_object, node(0).link_object)
    two = (PdoConfig(number=1, objects=entries[:2]), PdoConfig(number=2, objects=entries[2:]))
    hip = MonitoredNode(replace(node(0), tpdos=two))
    hip.take(frame(0x181, "3712" + QUARTER[:8]))
    hip.take(frame(0x281, QUARTER[8:]))
    assert "motor +1.5708 rad, link +1.5708 rad, 1237h" in hip.line()


def test_a_monitor_hears_drives_and_counts_error_frames_in_its_last_line() -> None:
    session, _ = opened()
    with session:
        for one in BENCH.nodes:
            session.bring_up().configure(one)  # From now on they send heartbeats.
        port = session.port()
        session.port = lambda: port
        port.error_frames = 3
        ((_, lines),) = monitor(session, seconds=0.05, every=0.05)
    assert [line[:24] for line in lines] == ["motor1   pre operational", "motor2   pre operational"]
    assert ["3 error frames" in line for line in lines] == [False, True]


def test_a_monitor_tells_in_equal_times_until_its_end_and_sends_nothing() -> None:
    session, network = opened()
    began = network.now_ns
    with session:
        told = list(monitor(session, seconds=0.05, every=0.02))
    assert [at for at, _ in told] == pytest.approx([0.02, 0.04, 0.05])
    assert [[line[:8] for line in lines] for _, lines in told] == [["motor1  ", "motor2  "]] * 3
    assert network.now_ns - began == 50 * MS
    assert written(network) == []


# --- status and troubles ---------------------------------------------------------------------


@pytest.mark.parametrize("place", [0, 1])
def test_a_status_tells_state_mode_error_places_and_heat_of_each_drive(place: int) -> None:
    session, network = opened()
    network.drives[place].trip(UNDER_VOLTAGE, network.now_ns)
    with session:
        shown = status(session)
    assert [one.name for one in shown] == ["motor1", "motor2"]
    assert [one.node_id for one in shown] == [1, 2]
    assert shown[place].statusword.startswith("0208h: fault")
    assert shown[1 - place].statusword.startswith("0240h: switch on disabled")
    assert (shown[place].error, shown[1 - place].error) == ("3220h under-voltage", "none")
    for one, bench in zip(shown, BENCH.nodes, strict=True):
        assert one.side == "motor"
        assert one.motor_pos == pytest.approx(0.0, abs=1e-4)
        assert one.link_pos == pytest.approx(0.0, abs=1e-3)
        assert one.motor_counts == bench.motor.to_counts(one.motor_pos)
        assert one.temperature == 25.0
        assert one.homed is None


@pytest.mark.parametrize("place", [0, 1])
@pytest.mark.parametrize(
    ("state", "words"),
    [
        (DriveState.SWITCH_ON_DISABLED, None),
        (DriveState.READY_TO_SWITCH_ON, None),
        (DriveState.OPERATION_ENABLED, "has power (0"),
        (DriveState.QUICK_STOP_ACTIVE, "has power (0"),
    ],
)
def test_a_drive_with_power_is_a_trouble_and_nothing_is_written(
    place: int, state: DriveState, words: str | None
) -> None:
    session, network = opened()
    network.drives[place].axis.power.state = state
    network.advance(network.now_ns + 2 * MS)
    with session:
        found = drive_troubles(session)
    assert len(found) == (words is not None)
    if words is not None:
        assert found[0].startswith(f"motor{place + 1} {words}")
    assert written(network) == []


@pytest.mark.parametrize("place", [0, 1])
def test_a_drive_in_fault_is_a_trouble_with_its_error(place: int) -> None:
    session, network = opened()
    network.drives[place].trip(UNDER_VOLTAGE, network.now_ns)
    network.advance(network.now_ns + 2 * MS)
    assert network.drives[place].axis.power.state is FAULT
    with session:
        (found,) = drive_troubles(session)
    assert found.startswith(f"motor{place + 1} is in fault, 3220h under-voltage (0208h: fault")


def test_a_mode_is_told_in_words() -> None:
    session, _ = opened()
    with session:
        session.bring_up().configure(BENCH.nodes[1])
        assert [one.mode for one in status(session)] == ["none", "cyclic synchronous position"]


def test_a_drive_that_must_be_homed_and_is_not_is_a_trouble() -> None:
    nodes = (BENCH.nodes[0], replace(BENCH.nodes[1], homed=HOMED))
    session, _ = opened(replace(BENCH, nodes=nodes))
    with session:
        assert drive_troubles(session) == ["motor2 is not homed"]


# --- scan ------------------------------------------------------------------------------------


def test_a_scan_says_how_each_drive_fits_the_bus_file() -> None:
    known, other = BENCH.nodes
    for nodes, verdicts in (
        ((known, other), ["'motor1' of the bus file", "'motor2' of the bus file"]),
        (
            (serial(known, 77), replace(known, node_id=5), serial(other, 78, node_id=6)),
            [
                "in the place of 'motor1', but another drive",
                "'motor1' of the bus file, which expects it at node 1",
                "not in the bus file",
            ],
        ),
    ):
        session, network = alone(*nodes)
        with session:
            found = list(scan(session, 6))
        assert [one.node_id for one in found] == [one.node_id for one in nodes]
        assert [one.verdict for one in found] == verdicts
        assert [one.answers for one in found] == [1] * len(nodes)
        assert [one.serial for one in found] == [one.identity.serial for one in nodes]
        assert {(one.vendor, one.product, one.revision) for one in found} == {(0x123, 0x402, 0)}
        # The profile of CiA 402 is in the lower word of 1000h.
        assert {one.device_type & 0xFFFF for one in found} == {0x0192}
        assert written(network) == []


def test_a_scan_ends_with_its_last_node_and_one_that_answers_is_enough() -> None:
    session, _ = alone(*BENCH.nodes)
    port = session.port()
    session.port = lambda: port
    port.error_frames = 3
    with session:
        assert [one.node_id for one in scan(session, 1)] == [1]


def test_a_node_that_is_not_there_is_asked_twice_for_15_ms() -> None:
    session, network = alone(BENCH.nodes[0])
    with session:
        assert [one.node_id for one in scan(session, 2)] == [1]
    asked = [(at_ns, one.data.hex()) for at_ns, one in network.log or [] if one.cob_id == 0x602]
    # A question that was not answered in time is given up by its abort (05040000h).
    question, given_up = "4000100000000000", "8000100000000405"
    assert [data for _, data in asked] == [question, given_up, question]
    assert asked[2][0] - asked[0][0] == pytest.approx(15 * MS, rel=0.01)


def test_drives_are_told_apart_by_the_answers_to_their_serial_number() -> None:
    session, network = alone(BENCH.nodes[0])
    with session:
        list(scan(session, 1))
    asked = [one.data.hex() for _, one in network.log or [] if one.cob_id == 0x601]
    # Device type and identity (1018h:01 to :04) once, then three times what differs.
    identity = [f"401810{sub:02x}00000000" for sub in (1, 2, 3, 4)]
    assert asked == ["4000100000000000", *identity, *[identity[3]] * 3]


def test_two_drives_with_one_node_id_are_counted() -> None:
    session, _ = alone(BENCH.nodes[0], serial(BENCH.nodes[0], 9))
    with session:
        (found,) = scan(session, 2)
    assert (found.answers, found.verdict) == (2, "2 drives answer with this node id")


def test_another_vendor_or_product_is_another_drive() -> None:
    for changes in ({"vendor": 0x999}, {"product": 0x999}):
        stranger = replace(BENCH.nodes[0], identity=replace(BENCH.nodes[0].identity, **changes))
        session, _ = alone(stranger)
        with session:
            (found,) = scan(session, 2)
        assert found.verdict == "in the place of 'motor1', but another drive"


def test_a_scan_without_any_answer_is_an_error_where_the_bus_carries_error_frames() -> None:
    session, network = alone(BENCH.nodes[0])
    network.drives[0].receive = lambda frame, now_ns: None
    port = session.port()
    session.port = lambda: port
    with session:
        assert list(scan(session, 2)) == []
        port.error_frames = 3
        with pytest.raises(BusError, match=r"^no node up to 2 answers; .*: 3 error frames and no"):
            list(scan(session, 2))


# --- commands in a log -----------------------------------------------------------------------


def _command(place: int, angle: float, word: str = "0F00") -> str:
    counts = node(place).motor.to_counts(angle)
    return f"20{place + 1}#{word}{counts.to_bytes(4, 'little', signed=True).hex().upper()}"


@pytest.mark.parametrize("place", [0, 1])
@pytest.mark.parametrize(
    ("angles", "excess"),
    [
        ((0.0, 0.02, 0.04), 0.0),
        ((0.0, 0.02, 0.07), 0.03),
        ((0.0, 0.02, -0.03), 0.03),
        ((0.5, 0.5), 0.0),
        ((0.51, 0.52), 0.02),
        ((-0.3, -0.31), 0.06),
    ],
)
def test_the_excess_of_commands_is_the_largest_of_range_and_step(
    place: int, angles: tuple[float, ...], excess: float, tmp_path: Path
) -> None:
    limits = SafetyLimits(motor_range=((-0.25, 0.5), (-0.25, 0.5)), command_speed=20.0)
    log = tmp_path / "bus.log"
    # A command may carry more behind its target.
    lines = [_command(place, angle) + "0102" for angle in angles]
    # Those to a drive that is not enabled do not count, nor do frames of another kind.
    lines.insert(1, _command(place, 3.0, "0600"))
    lines.insert(1, f"18{place + 1}#0F00FFFFFF7F0000")
    log.write_text("".join(f"(0.{i:06d}) can0 {line}\n" for i, line in enumerate(lines)))
    resolution = 2.0 * math.pi / (1 << 20)
    found = excess_of(log, config(), limits)
    assert found == pytest.approx(excess - resolution, abs=2.0 * resolution)


def test_a_log_without_commands_has_no_excess(tmp_path: Path) -> None:
    log = tmp_path / "bus.log"
    log.write_text("(0.0) can0 080#\n")
    assert excess_of(log, config(), SafetyLimits()) == -1.0
    with pytest.raises(ValueError, match="zip"):
        excess_of(log, config(nodes=(node(0),)), SafetyLimits())
