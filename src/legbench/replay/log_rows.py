"""Rows out of the frames of a bus: one for each SYNC, as the master would have recorded it."""

import math
from typing import Final, final

import can
import numpy as np

from legbench.drives.errors import CodecError
from legbench.drives.master.axis_link import AxisLink
from legbench.drives.master.joint import joint_of
from legbench.drives.protocol.emcy import decode_emcy
from legbench.drives.protocol.frame import EMCY_BASE, SYNC_ID
from legbench.drives.protocol.pdo import PdoMap
from legbench.drives.setup.config import BusConfig, NodeConfig
from legbench.drives.setup.pdos import CONTROLWORD
from legbench.plant.can import VELOCITY_BANDWIDTH
from legbench.plant.velocity import VelocityEstimate
from legbench.recording.memory import MemoryRun
from legbench.signals import REST, Command, Observation, Signal

STATUSWORD: Final = Signal("statusword", ("1", "2"), "-", "statusword of each drive (6041h)")
CONTROL: Final = Signal("controlword", ("1", "2"), "-", "controlword sent to each drive (6040h)")
TORQUE: Final = Signal(
    "drive_torque", ("1", "2"), "N m", "torque at the joint, as a drive tells it"
)


def signals_of(config: BusConfig) -> tuple[Signal, ...]:
    """Signals that a log of a bus has beside those of every run."""
    told = any(node.torque_object is not None for node in config.nodes)
    return (STATUSWORD, CONTROL, *([TORQUE] if told else []))


@final
class Orders:
    """What the master commanded of one drive.

    Attributes:
        controlword: last controlword; not a number before the first.
        target_pos: last target of the motor; not a number before the first [rad].
    """

    def __init__(self, node: NodeConfig) -> None:
        self._units, self._maps = node.motor, {}
        for pdo in node.rpdos:
            layout = PdoMap(pdo.objects)
            places = layout.place(*CONTROLWORD.key), layout.place(*node.target_object.key)
            self._maps[node.rpdo_id(pdo)] = (layout, *places)
        self.controlword = self.target_pos = math.nan

    def take(self, cob_id: int, data: bytes, near: int) -> None:
        """Take an RPDO, whose target lies within half a lap of the motor at `near` counts."""
        entry = self._maps.get(cob_id)
        if entry is None:
            return
        layout, word, target = entry
        try:
            values = layout.unpack(data)
        except CodecError:
            return  # The drive takes no frame of another length either.
        if word is not None:
            self.controlword = float(values[word])
        if target is not None:
            self.target_pos = self._units.to_rad(self._units.nearest(values[target], near))


@final
class RowMaker:
    """Makes a row of each SYNC once the next one has come; before that, answers may still come.

    Attributes:
        axes: the drives.
        rows: number of rows so far.
        backwards: SYNCs that were left out because their time is not later than the last one's.
        bad: frames of the drives' process data that have another length than is mapped.
    """

    def __init__(self, config: BusConfig, stiffness: tuple[float, float], run: MemoryRun) -> None:
        self.axes = tuple(AxisLink(node) for node in config.nodes)
        self.rows = self.backwards = self.bad = 0
        self._orders = tuple(Orders(node) for node in config.nodes)
        self._config, self._stiffness, self._run = config, stiffness, run
        self._answers = {cob: axis for axis in self.axes for cob in axis.tpdo_ids}
        self._commands = {
            cob: (axis, orders)
            for axis, orders in zip(self.axes, self._orders, strict=True)
            for cob in axis.rpdo_ids
        }
        self._emergencies = {EMCY_BASE + axis.node.node_id: axis.node for axis in self.axes}
        self._velocity = VelocityEstimate(VELOCITY_BANDWIDTH, config.period)
        self._began: float | None = None
        """Time of the SYNC of the first row, as the log has it [s]."""
        self._sync_us: int | None = None
        """Time of the present SYNC since the first row; none before the first SYNC."""
        self._last_us = 0
        self._heard = -math.inf
        """Time of the last SYNC, as the log has it [s]."""
        self._applied = [math.nan, math.nan]
        self._torque = any(node.torque_object is not None for node in config.nodes)

    def take(self, message: can.Message) -> None:
        """Take a frame of the bus."""
        cob_id, data = message.arbitration_id, bytes(message.data)
        if cob_id == SYNC_ID:
            self._sync(message.timestamp)
        elif (axis := self._answers.get(cob_id)) is not None:
            if self._sync_us is not None and not axis.feed(cob_id, data):
                self.bad += 1
        elif (both := self._commands.get(cob_id)) is not None:
            axis, orders = both
            orders.take(cob_id, data, axis.motor_counts)
        elif (node := self._emergencies.get(cob_id)) is not None:
            told = decode_emcy(node.node_id, data)
            if told is not None and self._began is not None:
                at = round(message.timestamp - self._began, 6)
                self._run.event(at, "emergency", drive=node.name, message=str(told))

    def finish(self) -> None:
        """Make the row of the last SYNC, where both drives have answered it."""
        if all(axis.fresh for axis in self.axes):
            self._row()

    def _sync(self, timestamp: float) -> None:
        since, self._heard = timestamp - self._heard, timestamp
        if 0.0 <= since < 0.5 * self._config.period:
            return  # Each channel of a bus has its own SYNC, and some logs have each frame twice.
        if self._sync_us is not None:
            self._row()
        origin = timestamp if self._began is None else self._began
        at_us = round(1e6 * (timestamp - origin))
        if self.rows and at_us <= self._last_us:
            self.backwards += 1
            self._sync_us = None
            return
        self._sync_us = at_us
        if self.rows == 0:
            self._began, self._sync_us = timestamp, 0
        for axis in self.axes:
            axis.begin_cycle()

    def _row(self) -> None:
        """Record the cycle of the present SYNC, once both drives have told where they are."""
        if self._sync_us is None or not all(axis.known for axis in self.axes):
            return
        at_us, axes = self._sync_us, self.axes
        joints = [joint_of(axis, k) for axis, k in zip(axes, self._stiffness, strict=True)]
        motor, link, torque = (list(each) for each in zip(*joints, strict=True))
        if self.rows == 0:
            self._velocity.reset(0, link)
        applied = [m if math.isnan(a) else a for a, m in zip(self._applied, motor, strict=True)]
        self._applied = [orders.target_pos for orders in self._orders]
        command = [m if math.isnan(c) else c for c, m in zip(self._applied, motor, strict=True)]
        own = [float(axis.statusword) for axis in axes]
        own += [orders.controlword for orders in self._orders]
        own += [axis.torque for axis in axes] if self._torque else []
        seen = Observation(
            time=at_us / 1e6,
            motor_pos=np.array(motor),
            joint_pos=np.array(link),
            joint_vel=self._velocity.update(1000 * at_us, link, [axis.fresh for axis in axes]),
            spring_torque=np.array(torque),
            applied_pos=np.array(applied),
        )
        rest = np.asarray(REST, dtype=np.int64)
        asked = Command(motor_pos=np.array(command), phase=rest, signals=np.array(own))
        self._run.append(asked, seen, float(at_us - self._last_us), math.nan)
        self.rows += 1
        self._last_us = at_us
