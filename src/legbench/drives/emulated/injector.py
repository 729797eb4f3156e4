"""Injector of faults into an emulated bus: which fault acts on what, and when; pure."""

from collections.abc import Iterator, Sequence
from typing import final

from legbench.drives.emulated.drive import OVER_TEMPERATURE, UNDER_VOLTAGE, EmulatedDrive
from legbench.drives.emulated.faults import (
    Babble,
    Fault,
    FrameFault,
    FrameFaultKind,
    NodeFault,
    NodeFaultKind,
)
from legbench.drives.emulated.sensors import SensorFault
from legbench.drives.protocol.frame import Frame

_TRIPS = {
    NodeFaultKind.UNDER_VOLTAGE: UNDER_VOLTAGE,
    NodeFaultKind.OVER_TEMPERATURE: OVER_TEMPERATURE,
}
_ENCODERS = {
    NodeFaultKind.MOTOR_FROZEN: ("motor", SensorFault.FROZEN),
    NodeFaultKind.MOTOR_STEP: ("motor", SensorFault.STEP),
    NodeFaultKind.MOTOR_DRIFT: ("motor", SensorFault.DRIFT),
    NodeFaultKind.LINK_FROZEN: ("link", SensorFault.FROZEN),
    NodeFaultKind.LINK_STEP: ("link", SensorFault.STEP),
    NodeFaultKind.LINK_DRIFT: ("link", SensorFault.DRIFT),
}
Fate = tuple[tuple[int, Frame], ...]
"""Delay [ns] and content of each copy of a frame that arrives."""


def _strike_parts(drive: EmulatedDrive, fault: NodeFault, *, begins: bool) -> None:
    """Begin or end a fault of a drive's motor, encoders or process data."""
    axis = drive.axis
    if fault.kind is NodeFaultKind.WARNING:
        axis.warning = begins
    elif fault.kind is NodeFaultKind.JAMMED:
        axis.motion.jammed = begins
    elif fault.kind is NodeFaultKind.REPEATING:
        drive.repeat_process_data(begins)
    elif fault.kind in _ENCODERS:
        which, ailment = _ENCODERS[fault.kind]
        encoder = axis.sensors.motor if which == "motor" else axis.sensors.link
        encoder.fail(ailment if begins else None, fault.size)


@final
class Injector:
    """Faults of one bus; it also counts as the sender of the frames of babbling nodes.

    Attributes:
        unplugged: ids of the nodes whose connector is unplugged.
        frames: faults of frames.
    """

    def __init__(self, faults: Sequence[Fault]) -> None:
        self.frames: list[FrameFault] = []
        self._nodes: list[NodeFault] = []
        self._babbles: list[Babble] = []
        self._begun: list[NodeFault] = []
        self.unplugged: frozenset[int] = frozenset()
        for fault in faults:
            self.add(fault)

    def add(self, fault: Fault) -> None:
        """Add a fault, which acts in its window of time."""
        if isinstance(fault, FrameFault):
            self.frames.append(fault)
        elif isinstance(fault, NodeFault):
            self._nodes.append(fault)
        else:
            self._babbles.append(fault)

    def receive(self, frame: Frame, now_ns: int) -> None:
        """Ignore the frames of other nodes."""

    def take(self) -> list[tuple[int, Frame]]:
        """Return no frames: the injector sends nothing of its own."""
        return []

    def tick(self, now_ns: int) -> float:
        """Do nothing; returns 0, as an injector has no motor."""
        return 0.0

    def breaks(self, frame: Frame, now_ns: int) -> bool:
        """Whether a frame is destroyed on the wire."""
        for fault in self.frames:
            if fault.kind is FrameFaultKind.BAD_BITS and fault.hits(frame, now_ns):
                return True
        return False

    def fate(self, frame: Frame, now_ns: int) -> Fate:
        """Delay [ns] and content of each copy that arrives of a frame that was not destroyed."""
        arrivals: Fate = ((0, frame),)
        for fault in self.frames:
            if not fault.hits(frame, now_ns):
                continue
            if fault.kind is FrameFaultKind.DROP:
                return ()
            if fault.kind is FrameFaultKind.WRONG_LENGTH:
                cut = frame.data[: fault.length].ljust(fault.length, b"\0")
                arrivals = ((0, frame._replace(data=cut)),)
            elif fault.kind is FrameFaultKind.DELAY:
                arrivals = ((max(1, fault.delay_ns), frame),)
            elif fault.kind is FrameFaultKind.DUPLICATE:
                arrivals = (*arrivals, (max(1, fault.delay_ns), frame))
        return arrivals

    def babble(self, now_ns: int, span_ns: int) -> Iterator[Frame]:
        """Yield the frames that babbling nodes send in the coming span."""
        for babble in self._babbles:
            if babble.start_ns <= now_ns < babble.end_ns:
                for _ in range(max(1, span_ns // babble.every_ns)):
                    yield Frame(babble.cob_id, babble.data)

    def node_events(self, now_ns: int) -> Iterator[tuple[NodeFault, bool]]:
        """Yield the faults of nodes that begin (true) or end (false) by now."""
        for fault in tuple(self._nodes):
            if now_ns >= fault.start_ns:
                self._nodes.remove(fault)
                self._begun.append(fault)
                self._note_unplugged()
                yield fault, True
        for fault in tuple(self._begun):
            if now_ns >= fault.end_ns:
                self._begun.remove(fault)
                self._note_unplugged()
                yield fault, False

    def _note_unplugged(self) -> None:
        self.unplugged = frozenset(
            fault.node_id for fault in self._begun if fault.kind is NodeFaultKind.SILENT
        )

    @staticmethod
    def cuts_off(fault: NodeFault) -> bool:
        """Whether a fault takes its node off the bus, knowingly."""
        return fault.kind is NodeFaultKind.BUS_OFF

    @staticmethod
    def strike(drive: EmulatedDrive, fault: NodeFault, now_ns: int, *, begins: bool) -> None:
        """Apply the beginning or the end of a fault to a drive."""
        code = _TRIPS.get(fault.kind)
        if code is not None:
            if begins:
                drive.trip(code, now_ns)
            else:
                drive.clear_trip(code)
        elif fault.kind is NodeFaultKind.HEARTBEAT_LOSS:
            drive.mute_heartbeat(begins)
        elif fault.kind is NodeFaultKind.RESET and begins:
            drive.reset(now_ns)
        elif fault.kind is NodeFaultKind.BUS_OFF and begins:
            drive.bus_off(now_ns)
        else:
            _strike_parts(drive, fault, begins=begins)
