"""One drive in the cycle: process data <-> angles, controlword and target; pure."""

import math
import struct
from collections.abc import Callable, Sequence
from operator import itemgetter
from typing import final

from legbench.drives.protocol.cia402 import PowerMachine, StatusBit, decode_state
from legbench.drives.protocol.pdo import PdoMap
from legbench.drives.setup.config import NodeConfig
from legbench.drives.setup.pdos import CONTROLWORD, STATUSWORD
from legbench.drives.setup.quirks import ModeShown

LINK, SLOTS = 2, 4
"""Slot of the second encoder among what a drive shows, and the number of slots: statusword, motor,
link, torque."""


def _wanted(layout: PdoMap, node: NodeConfig) -> tuple[tuple[int, int], ...]:
    """Pairs of a slot in `_shown` and the place of its object among the values of a TPDO."""
    objects = (STATUSWORD, node.motor_object, node.link_object, node.torque_object)
    wanted = [
        (slot, entry)
        for slot, entry in enumerate(objects)
        if entry is not None and (slot != LINK or node.link is not None)
    ]
    places = [(slot, layout.place(*entry.key)) for slot, entry in wanted]
    return tuple((slot, place) for slot, place in places if place is not None)


def _picker(
    layouts: Sequence[Sequence[tuple[int, int]]],
) -> Callable[[Sequence[int]], Sequence[int]] | None:
    """Function that picks all slots from the values of the only TPDO; none for several TPDOs.

    A slot that the drive does not show gets any value, which nobody looks at.
    """
    if len(layouts) != 1:
        return None
    places = dict(layouts[0])
    return itemgetter(*(places.get(slot, 0) for slot in range(SLOTS)))


@final
class AxisLink:
    """Compiled process data of one drive.

    Attributes:
        node: its configuration.
        tpdo_ids: COB-IDs to expect after every SYNC.
        rpdo_ids: COB-IDs of the drive's RPDOs, which carry its commands.
        rpdo_sizes: COB-ID of each RPDO -> length of its data [bytes].
        machine: leads it through its states.
        statusword: statusword last received.
        target_counts: target of its next RPDO, not wrapped.
        sent_counts: target of its last RPDO, none before the first.
        fresh: whether all its TPDOs have come in this cycle.
        motor_pos: angle of the encoder of the position loop (6064h) [rad].
        link_pos: angle of the second encoder, at the link; not a number without one [rad].
        follows: bits of the statusword that are set while the drive follows its target.
        in_mode: whether the drive has shown its mode (6061h).
        torque: torque at the joint that the drive tells; not a number if it does not [N m].
    """

    def __init__(self, node: NodeConfig) -> None:
        self.node = node
        self.machine = PowerMachine()
        self.statusword = 0
        self.target_counts = 0
        self.sent_counts: int | None = None
        self.motor_counts = 0
        self.link_counts = 0
        units, link = node.motor, node.link
        self._motor_zero, self._motor_scale = units.offset_counts, units.counts_per_rad
        self._lowest, self._modulus = units.lowest, units.modulus
        self._half = units.modulus // 2
        self._link_modulus = 1 if link is None else link.modulus
        self._link_half = self._link_modulus // 2
        self._link_zero = 0 if link is None else link.offset_counts
        self._link_scale = math.nan if link is None else link.counts_per_rad
        self.motor_pos = units.to_rad(0)
        self.link_pos = math.nan if link is None else link.to_rad(0)
        self._torque_scale = units.sign * node.torque_scale
        self.follows = int(StatusBit.FOLLOWS_COMMAND) if node.quirks.follows_bit else 0
        self.in_mode = node.quirks.mode_shown is ModeShown.CONFIGURED
        self._shows_link = link is not None
        self._tells_torque = node.torque_object is not None
        self.torque = math.nan
        maps = {node.tpdo_id(pdo): PdoMap(pdo.objects) for pdo in node.tpdos}
        self._tpdos = {
            cob_id: (1 << number, layout.values_of, _wanted(layout, node))
            for number, (cob_id, layout) in enumerate(maps.items())
        }
        self.tpdo_ids = tuple(maps)
        self._pick = _picker([wanted for _, _, wanted in self._tpdos.values()])
        self._all = (1 << len(maps)) - 1
        self._missing = self._all
        self.fresh = False
        self._shown = [0, 0, 0, 0]
        """Statusword, motor, link and torque, as received."""
        self._rpdos = tuple((node.rpdo_id(pdo), PdoMap(pdo.objects)) for pdo in node.rpdos)
        self.rpdo_sizes = {cob_id: layout.size for cob_id, layout in self._rpdos}
        self.rpdo_ids = tuple(self.rpdo_sizes)
        self._plain = self._plain_layout()
        self._known = False

    def _plain_layout(self) -> bool:
        """Whether all commands are one usual frame."""
        plain = (CONTROLWORD, self.node.target_object)
        return len(self._rpdos) == 1 and self._rpdos[0][1].entries == plain

    @property
    def known(self) -> bool:
        """Whether the drive has sent its motor position since the start or `forget`."""
        return self._known

    @property
    def missing_ids(self) -> tuple[int, ...]:
        """COB-IDs that have not come in this cycle."""
        return tuple(cob for cob, (bit, _, _) in self._tpdos.items() if bit & self._missing)

    def begin_cycle(self) -> None:
        """Begin a cycle at SYNC, from which all process data is expected again."""
        self._missing = self._all
        self.fresh = False

    def feed(self, cob_id: int, data: bytes | bytearray) -> bool:
        """Take a TPDO; false, and nothing changed, if its length is wrong."""
        bit, values_of, wanted = self._tpdos[cob_id]
        try:
            values = values_of(data)
        except struct.error:
            return False
        pick = self._pick
        if pick is not None:
            self._missing = 0
            self.statusword, motor, link, torque = pick(values)
        else:
            shown = self._shown
            for slot, place in wanted:
                shown[slot] = values[place]
            self._missing &= ~bit
            if self._missing:
                return True
            self.statusword, motor, link, torque = shown
        self.fresh = True
        if not self._known:
            self._find(motor)
        # As `AxisUnits.nearest` and `to_rad`, without their calls, four times a cycle.
        near, half = self.motor_counts, self._half
        self.motor_counts = counts = near + (motor - near + half) % self._modulus - half
        self.motor_pos = (counts - self._motor_zero) / self._motor_scale
        if self._shows_link:
            near, half = self.link_counts, self._link_half
            self.link_counts = counts = near + (link - near + half) % self._link_modulus - half
            self.link_pos = (counts - self._link_zero) / self._link_scale
        if self._tells_torque:
            self.torque = self._torque_scale * torque
        return True

    def _find(self, motor: int) -> None:
        """Unwrap for the first time: the link lies within half a turn of its motor.

        A position with a modulus of its own lies within half of it of angle 0.
        """
        units, link = self.node.motor, self.node.link
        if units.modulus_counts is not None:
            motor = units.nearest(motor, units.offset_counts)
        self.motor_counts = motor
        if link is not None:
            self.link_counts = link.to_counts(units.to_rad(motor))
        self._known = True

    def forget(self) -> None:
        """Unwrap the positions anew, as they may have jumped by homing or a reset."""
        self._known = False

    @property
    def state_text(self) -> str:
        """State of the drive in words."""
        state = decode_state(self.statusword)
        return "unknown state" if state is None else state.value

    @property
    def target_pos(self) -> float:
        """Target of its next RPDO [rad]."""
        return self.node.motor.to_rad(self.target_counts)

    def aim(self, motor_pos: float) -> None:
        """Set the target [rad]."""
        # As `AxisUnits.to_counts`, without its call.
        self.target_counts = self._motor_zero + round(motor_pos * self._motor_scale)

    def aim_at_actual(self) -> None:
        """Set the target to where the motor is."""
        self.target_counts = self.motor_counts

    def hold(self) -> None:
        """Set the target to the last one that was sent: a stop moves no target."""
        if self.sent_counts is not None:
            self.target_counts = self.sent_counts

    def frames(self, controlword: int) -> list[tuple[int, bytes]]:
        """RPDOs of this cycle: COB-ID and data."""
        self.sent_counts = self.target_counts
        # As `AxisUnits.show`, without its calls.
        lowest = self._lowest
        target = lowest + (self.target_counts - lowest) % self._modulus
        if self._plain:
            cob_id, layout = self._rpdos[0]
            return [(cob_id, layout.bytes_of(controlword, target))]
        known = {CONTROLWORD.key: controlword, self.node.target_object.key: target}
        known[0x6060, 0] = 8
        return [
            (cob_id, layout.pack([known.get(entry.key, 0) for entry in layout.entries]))
            for cob_id, layout in self._rpdos
        ]
