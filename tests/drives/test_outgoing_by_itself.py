"""What a master sends after SYNC, before its grid is laid and on a bus that refuses it."""

from typing import Any, cast

from cycle_wire import Wire
from drives_rig import config

from legbench.drives.errors import BusError
from legbench.drives.master.axis_link import AxisLink
from legbench.drives.master.outgoing import Outgoing
from legbench.drives.protocol.frame import HEARTBEAT_BASE


def outgoing(wire: Wire, failed: list[BusError]) -> Outgoing:
    bus = config()
    axes = tuple(AxisLink(node) for node in bus.nodes)
    return Outgoing(cast(Any, wire), bus, axes, failed.append)


def test_a_heartbeat_is_due_at_once_where_a_stop_comes_before_the_grid_is_laid() -> None:
    wire, failed = Wire(), list[BusError]()
    assert outgoing(wire, failed).heartbeat(0)
    assert [cob_id for _, cob_id, _ in wire.sent] == [HEARTBEAT_BASE + config().master_id]
    assert failed == []


def test_a_heartbeat_that_is_refused_is_told_and_raises_nothing() -> None:
    wire, failed = Wire(), list[BusError]()
    wire.refuses = {HEARTBEAT_BASE + config().master_id}
    assert not outgoing(wire, failed).heartbeat(0)
    assert [str(error) for error in failed] == [
        f"{HEARTBEAT_BASE + config().master_id:03X}h refused"
    ]


def test_a_command_frame_says_its_true_length() -> None:
    wire, lengths = Wire(), list[tuple[int, int]]()
    put = wire.put

    def kept(message: Any) -> None:
        lengths.append((message.dlc, len(message.data)))
        put(message)

    wire.put = kept
    assert outgoing(wire, []).commands([0x000F, None])
    assert lengths
    assert all(stated == real > 0 for stated, real in lengths)
