"""Passive observation of a bus, from the frames that the drives send."""

from collections.abc import Iterator
from typing import final

import can

from legbench.drives.master.axis_link import AxisLink
from legbench.drives.master.session import Session
from legbench.drives.protocol.cia402 import describe_statusword
from legbench.drives.protocol.emcy import decode_emcy
from legbench.drives.protocol.frame import EMCY_BASE, HEARTBEAT_BASE, LAST_NODE
from legbench.drives.protocol.nmt import decode_heartbeat
from legbench.drives.setup.config import NodeConfig


@final
class MonitoredNode:
    """Latest state of one drive, from its frames."""

    def __init__(self, node: NodeConfig) -> None:
        self.node, self.axis = node, AxisLink(node)
        self.nmt = "silent"
        self.emergency = ""
        self.frames = 0

    def take(self, message: can.Message) -> None:
        """Take a frame from any sender."""
        cob_id, data = message.arbitration_id, bytes(message.data)
        if cob_id in self.axis.tpdo_ids:
            if self.axis.fresh:
                self.axis.begin_cycle()
            self.frames += self.axis.feed(cob_id, data)
        elif cob_id & LAST_NODE == self.node.node_id:
            if cob_id & ~LAST_NODE == HEARTBEAT_BASE:
                state = decode_heartbeat(data)
                self.nmt = self.nmt if state is None else state.name.lower().replace("_", " ")
            elif cob_id & ~LAST_NODE == EMCY_BASE:
                emergency = decode_emcy(self.node.node_id, data)
                self.emergency = self.emergency if emergency is None else str(emergency)

    def line(self) -> str:
        """One line of text."""
        head = f"{self.node.name:<8} {self.nmt:<16}"
        if not self.frames:
            return f"{head} no process data {self.emergency}".rstrip()
        axis = self.axis
        second = "" if self.node.link is None else f"link {axis.link_pos:+.4f} rad, "
        return (
            f"{head} {self.node.side} {axis.motor_pos:+.4f} rad, {second}"
            f"{describe_statusword(axis.statusword)} {self.emergency}"
        ).rstrip()


def monitor(session: Session, *, seconds: float, every: float) -> Iterator[tuple[float, list[str]]]:
    """Listen, send nothing; time [s] and a line a drive, every so often [s].

    Raises:
        BusError: the bus does not work.
    """
    watched = [MonitoredNode(node) for node in session.config.nodes]
    port, timebase = session.port(), session.timebase
    began_ns = timebase.now_ns()
    end_ns = began_ns + round(1e9 * seconds)
    due_ns = began_ns
    while due_ns < end_ns:
        due_ns = min(due_ns + round(1e9 * every), end_ns)
        while (message := port.receive(due_ns)) is not None:
            for one in watched:
                one.take(message)
            if timebase.now_ns() >= due_ns:
                break
        lines = [one.line() for one in watched]
        if port.error_frames:
            lines[-1] += f"; {port.error_frames} error frames, {session.config.bitrate_text}"
        yield 1e-9 * (timebase.now_ns() - began_ns), lines
