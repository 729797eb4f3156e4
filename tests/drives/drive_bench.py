"""One emulated drive by itself and a hand that feeds it, frame by frame."""

import math
from typing import Any

from drives_rig import MS, config, node

from legbench.drives.emulated.behaviour import Behaviour
from legbench.drives.emulated.drive import EmulatedDrive
from legbench.drives.protocol.cia402 import DriveState
from legbench.drives.protocol.datatypes import Value, pack, unpack
from legbench.drives.protocol.emcy import decode_emcy
from legbench.drives.protocol.frame import Frame
from legbench.drives.protocol.nmt import NmtCommand, NmtState, heartbeat_frame, nmt_frame
from legbench.drives.protocol.objects import OBJECTS
from legbench.drives.protocol.sdo_client import Download, Progress, Upload
from legbench.drives.setup.configuration import configuration

OE, SOD = DriveState.OPERATION_ENABLED, DriveState.SWITCH_ON_DISABLED
PER_RAD = (1 << 20) / (2.0 * math.pi)
OFFSET = 777


class Bench:
    """One drive and a hand that feeds it: 1 ms a cycle, SYNC at its start."""

    def __init__(self, *, configured: bool = True, **changes: Any) -> None:
        # pyrefly: ignore[bad-argument-type]
        self.behaviour = Behaviour(**{"reply_delay_us": (50, 50), "interpolate": False, **changes})
        self.drive = EmulatedDrive(node(0), self.behaviour)
        self.now_ns = 0
        self.sent: list[tuple[int, Frame]] = []
        self.target: int | None = None
        self.word = 0
        self.beat = True
        while self.drive.state is NmtState.BOOT_UP:
            self.wait(1)
        if configured:
            for parameter in configuration(config(), node(0)):
                self.put(parameter.index, parameter.sub, parameter.value)
            self.wait(3)
            self.target = self.get(0x6064)
            self.give(nmt_frame(NmtCommand.START, 1))

    @property
    def axis(self) -> DriveState:
        return self.drive.axis.power.state

    @property
    def angle(self) -> float:
        return self.drive.axis.motion.angle

    @property
    def status(self) -> int:
        return self.get(0x6041)

    def give(self, frame: Frame) -> None:
        self.drive.receive(frame, self.now_ns)
        self.sent += self.drive.take()

    def wait(self, milliseconds: int) -> None:
        """No frames at all."""
        for _ in range(milliseconds):
            self.now_ns += MS
            angle = self.drive.tick(self.now_ns)
            self.drive.sense(angle, 0.0)
            self.sent += self.drive.take()

    def cycle(self, count: int = 1, *, sync: bool = True, rpdo: bool = True) -> None:
        """Ordinary cycles: SYNC, RPDO, heartbeat, motion."""
        for _ in range(count):
            if sync:
                self.give(Frame(0x80))
            if rpdo and self.target is not None:
                data = self.word.to_bytes(2, "little") + self.target.to_bytes(
                    4, "little", signed=True
                )
                self.give(Frame(0x201, data))
            if self.beat:
                self.give(heartbeat_frame(126, NmtState.OPERATIONAL))
            self.wait(1)

    def enable(self) -> None:
        for word in (0x06, 0x07, 0x0F):
            self.word = word
            self.cycle(3)
        assert self.axis is OE

    def _carry(self, transfer: Upload | Download) -> None:
        progress = Progress.NEXT
        while progress is Progress.NEXT:
            self.drive.receive(Frame(0x601, transfer.request), self.now_ns)
            said = self.drive.take()
            replies = [frame for _, frame in said if frame.cob_id == 0x581]
            self.sent += [entry for entry in said if entry[1].cob_id != 0x581]
            progress = transfer.feed(replies[0].data)

    def read(self, index: int, sub: int = 0) -> Value:
        upload = Upload(index, sub)
        self._carry(upload)
        return unpack(OBJECTS[index, sub].kind, upload.result)

    def get(self, index: int, sub: int = 0) -> int:
        value = self.read(index, sub)
        assert isinstance(value, int)
        return value

    def put(self, index: int, sub: int, value: int) -> None:
        self._carry(Download(index, sub, pack(OBJECTS[index, sub].kind, value)))

    def emergencies(self) -> list[int]:
        found = [decode_emcy(1, frame.data) for _, frame in self.sent if frame.cob_id == 0x81]
        return [emergency.code for emergency in found if emergency is not None]


def counts(angle: float) -> int:
    return OFFSET + round(angle * PER_RAD)
