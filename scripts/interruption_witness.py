"""What was seen on an emulated bus and in its drives since an interruption."""

from collections import Counter
from dataclasses import dataclass, field

import can

from legbench.drives.emulated.network import Network
from legbench.drives.emulated.power import POWERED

MS = 1_000_000
WITHIN_NS = 50 * MS
"""From an interruption to no power in any drive."""
HANDED_NS = MS
"""A frame that the controller had before the interruption may act so long after it."""
RUN_ON = 0.1
"""Longest way of a motor after an interruption [rad]."""


@dataclass
class Witness:
    """What was seen on the bus and in the drives since an interruption."""

    network: Network | None = None
    at_ns: int | None = None
    angles: tuple[float, ...] = ()
    powered: tuple[bool, ...] = ()
    targets: dict[int, bytes] = field(default_factory=dict)
    moved: Counter[int] = field(default_factory=Counter)
    faults: list[str] = field(default_factory=list)
    led: bool = False
    over: bool = False
    """The drives had their power before the interruption, and none any more."""

    def strike(self) -> None:
        """The interruption comes now."""
        if self.network is not None:
            self.at_ns = self.network.now_ns
            self.over = self.led and not any(self.powered)
            self.angles = tuple(drive.axis.motion.angle for drive in self.network.drives)

    def sent(self, message: can.Message) -> None:
        """Look at a frame of the master: after an interruption nothing leads a drive on."""
        cob_id, data = message.arbitration_id, bytes(message.data)
        if 0x200 < cob_id < 0x280 and data[0] & 0x0F == 0x0F:
            if self.at_ns is not None and data[2:] != self.targets.get(cob_id):
                self.moved[cob_id] += 1
            self.targets[cob_id] = data[2:]
        elif self.at_ns is not None and 0x600 < cob_id < 0x680:
            key, word = data[1:3], data[4]
            if data[0] == 0x23 and key == b"\x7a\x60":
                self.faults.append("a target was written")
            if data[0] == 0x2B and key == b"\x40\x60" and word & 0x04:
                self.faults.append(f"controlword {word:02X}h was written")

    def look(self) -> None:
        """One millisecond has passed."""
        network = self.network
        if network is None:
            return
        powered = tuple(drive.axis.power.state in POWERED for drive in network.drives)
        if self.at_ns is not None:
            since_ns = network.now_ns - self.at_ns
            for before, now in zip(self.powered or powered, powered, strict=True):
                if now and not before and since_ns > HANDED_NS:
                    self.faults.append(f"enabled {since_ns / MS:.1f} ms later")
            if any(powered) and since_ns > WITHIN_NS:
                self.faults.append("power after 50 ms")
        self.powered = powered
        self.led = self.led or any(powered)

    def conclude(self, *, row: bool) -> None:
        """The command has ended; `row` tells that a row may have been finished first."""
        network = self.network
        if network is None or self.at_ns is None:
            return
        if any(drive.axis.power.state in POWERED for drive in network.drives):
            self.faults.append("power at the end of the command")
        network.advance(max(network.now_ns, self.at_ns + WITHIN_NS) + 2 * MS)
        if max(self.moved.values(), default=0) > int(row):
            self.faults.append(f"{max(self.moved.values())} targets after the interruption")
        for drive, before in zip(network.drives, self.angles, strict=True):
            if abs(drive.axis.motion.angle - before) > RUN_ON:
                self.faults.append("a motor ran on")
