"""One drive as the cycle sees it: process data <-> angles, controlword and target; pure."""

from typing import final

from legbench.drives.errors import CodecError
from legbench.drives.protocol.cia402 import PowerMachine, decode_state
from legbench.drives.protocol.pdo import PdoMap
from legbench.drives.setup.config import (
    CONTROLWORD,
    POSITION_ACTUAL,
    STATUSWORD,
    TARGET_POSITION,
    NodeConfig,
)
from legbench.drives.setup.units import Unwrapper, wrap


def _wanted(layout: PdoMap, node: NodeConfig) -> tuple[tuple[int, int], ...]:
    """Slot among what an axis is after, and place among the values of a TPDO."""
    objects = (STATUSWORD, POSITION_ACTUAL, node.link_object)
    places = [(slot, layout.place(*entry.key)) for slot, entry in enumerate(objects)]
    return tuple((slot, place) for slot, place in places if place is not None)


@final
class AxisLink:
    """Compiled process data of one drive.

    Attributes:
        node: its configuration.
        machine: leads it through its states.
        statusword: statusword last received.
        target_counts: what its next RPDO says, not wrapped.
        sent_counts: what its last RPDO said, none before the first.
        fresh: whether all its TPDOs have come in this cycle.
        motor_pos, link_pos: measured angles of motor and link [rad].
    """

    def __init__(self, node: NodeConfig) -> None:
        self.node = node
        self.machine = PowerMachine()
        self.statusword = 0
        self.target_counts = 0
        self.sent_counts: int | None = None
        self.motor_counts = 0
        self.link_counts = 0
        self._motor_rad, self._link_rad = node.motor.to_rad, node.link.to_rad
        self.motor_pos, self.link_pos = self._motor_rad(0), self._link_rad(0)
        maps = {node.tpdo_id(pdo): PdoMap(pdo.objects) for pdo in node.tpdos}
        self._tpdos = {
            cob_id: (1 << number, layout, _wanted(layout, node))
            for number, (cob_id, layout) in enumerate(maps.items())
        }
        self._tpdo_ids = tuple(maps)
        self._all = (1 << len(maps)) - 1
        self._missing = self._all
        self.fresh = False
        self._shown = [0, 0, 0]
        """Statusword, motor and link, as received."""
        self._rpdos = tuple((node.rpdo_id(pdo), PdoMap(pdo.objects)) for pdo in node.rpdos)
        self._plain = self._plain_layout()
        self._motor = Unwrapper(node.motor.bits, 0)
        self._link = Unwrapper(node.link.bits, 0)
        self._known = False

    def _plain_layout(self) -> bool:
        """Whether all process data is one usual frame each way."""
        return len(self._rpdos) == 1 and self._rpdos[0][1].entries == (CONTROLWORD, TARGET_POSITION)

    @property
    def tpdo_ids(self) -> tuple[int, ...]:
        """COB-IDs to expect after every SYNC."""
        return self._tpdo_ids

    @property
    def rpdo_ids(self) -> tuple[int, ...]:
        """COB-IDs of its commands."""
        return tuple(cob_id for cob_id, _ in self._rpdos)

    @property
    def known(self) -> bool:
        """Whether it has ever said where its motor is."""
        return self._known

    @property
    def missing_ids(self) -> tuple[int, ...]:
        """COB-IDs that have not come in this cycle."""
        return tuple(cob for cob, (bit, _, _) in self._tpdos.items() if bit & self._missing)

    def received(self, cob_id: int) -> bool:
        """Whether one of its TPDOs has come in this cycle."""
        return not self._tpdos[cob_id][0] & self._missing

    def begin_cycle(self) -> None:
        """SYNC goes out: everything is expected again."""
        self._missing = self._all
        self.fresh = False

    def feed(self, cob_id: int, data: bytes | bytearray) -> bool:
        """Take a TPDO; false, and nothing changed, if its length is wrong."""
        bit, layout, wanted = self._tpdos[cob_id]
        try:
            values = layout.unpack(data)
        except CodecError:
            return False
        shown = self._shown
        for slot, place in wanted:
            shown[slot] = values[place]
        self._missing &= ~bit
        if not self._missing:
            self.fresh = True
            self._digest()
        return True

    def _digest(self) -> None:
        self.statusword, motor, link = self._shown
        if not self._known:
            self._find(motor)
        self.motor_counts = counts = self._motor.feed(motor)
        self.motor_pos = self._motor_rad(counts)
        self.link_counts = counts = self._link.feed(link)
        self.link_pos = self._link_rad(counts)

    def _find(self, motor: int) -> None:
        """Unwrap for the first time: the link lies within half a turn of its motor."""
        self._motor.counts = motor
        self._link.counts = self.node.link.to_counts(self.node.motor.to_rad(motor))
        self._known = True

    def forget(self) -> None:
        """Positions may have jumped (homing, reset): unwrap anew."""
        self._known = False

    @property
    def state_text(self) -> str:
        """State in words."""
        state = decode_state(self.statusword)
        return "unknown state" if state is None else state.value

    @property
    def target_pos(self) -> float:
        """What its next RPDO says [rad]."""
        return self.node.motor.to_rad(self.target_counts)

    def aim(self, motor_pos: float) -> None:
        """Set the target [rad]."""
        self.target_counts = self.node.motor.to_counts(motor_pos)

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
        target = wrap(self.target_counts)
        if self._plain:
            cob_id, layout = self._rpdos[0]
            return [(cob_id, layout.pack((controlword, target)))]
        known = {CONTROLWORD.key: controlword, TARGET_POSITION.key: target, (0x6060, 0): 8}
        return [
            (cob_id, layout.pack([known.get(entry.key, 0) for entry in layout.entries]))
            for cob_id, layout in self._rpdos
        ]
