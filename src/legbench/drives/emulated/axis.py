"""The CiA 402 half of an emulated drive: controlword, modes, motion, statusword; pure."""

from collections import deque
from collections.abc import Sequence
from typing import final

from legbench.drives.emulated.actual_values import ActualValues
from legbench.drives.emulated.alarms import Alarms
from legbench.drives.emulated.behaviour import Behaviour
from legbench.drives.emulated.dictionary import USUAL_LINKS
from legbench.drives.emulated.homing import Homing
from legbench.drives.emulated.homing_methods import METHODS
from legbench.drives.emulated.motion import Motion
from legbench.drives.emulated.power import HALT, POWERED, PowerStage
from legbench.drives.emulated.sensors import Sensors
from legbench.drives.emulated.switches import Switches
from legbench.drives.protocol.cia402 import DriveState, Mode, StatusBit
from legbench.drives.protocol.emcy import Emergency, emcy_frame
from legbench.drives.protocol.frame import Frame
from legbench.drives.protocol.objects import Key
from legbench.drives.protocol.sdo import Abort
from legbench.drives.setup.config import NodeConfig
from legbench.drives.setup.encoders import Side

MODES = (Mode.NONE, Mode.HOMING, Mode.CYCLIC_SYNCHRONOUS_POSITION)
POLARITY = (0x607E, 0)
FOLLOWING_ERROR, SETPOINTS_MISSING, SYNC_MISSING = 0x8611, 0xFF10, 0xFF11
HOMED = 1 << 15
"""Bit 15 of the statusword, the maker's own: the position refers to a home since power-on."""
# Numbers and members by names of their own: looking one up in its class takes longer than its use.
_ENABLED, _QUICK_STOP = DriveState.OPERATION_ENABLED, DriveState.QUICK_STOP_ACTIVE
_CYCLIC, _HOMING = int(Mode.CYCLIC_SYNCHRONOUS_POSITION), int(Mode.HOMING)
_STATUS, _FOLLOWS = int(StatusBit.REMOTE), int(StatusBit.FOLLOWS_COMMAND)


@final
class Axis:
    """Emulated motor with its two encoders, as the object dictionary shows them.

    Attributes:
        node_id: node id under which it reports its errors.
        power: power state machine.
        motion: motion of the motor.
        alarms: errors of the drive.
        sensors: encoders of motor and link.
        warning: whether bit 7 of the statusword is set.
        emergencies: messages that `take` returns.
    """

    def __init__(
        self,
        node: NodeConfig,
        behaviour: Behaviour,
        values: dict[Key, int],
        links: Sequence[Key] = USUAL_LINKS,
    ) -> None:
        """Turn the numbers of an object dictionary; `links` show the position of the link."""
        self._node, self._behaviour, self._values = node, behaviour, values
        self.node_id = node.node_id
        self.power = PowerStage(values)
        self.motion = Motion(node.motor, behaviour, values)
        self.alarms = Alarms(self.node_id, values)
        self.sensors = Sensors(node)
        self.warning = False
        self._switches = Switches(node.motor, behaviour)
        self._homing = Homing(values, self._switches)
        self._link_counts = 0 if node.link is None else node.link.to_counts(behaviour.start_pos)
        self._torque = 0.0
        self._shown = ActualValues(node, behaviour.rated_torque, values, links)
        self._target = node.target_object.key
        self._mode_due_ns: int | None = None
        self._waiting_word: int | None = None
        self._now_ns = 0
        self._late_words: deque[tuple[int, int]] = deque()
        self.emergencies: list[Frame] = []
        self.publish()

    def address(self, node_id: int) -> None:
        """Report under another node id from now on."""
        self.node_id = self.alarms.node_id = node_id

    def boot(self, now_ns: int) -> None:
        """Leave the self-test; a mode of operation that was stored is entered (6060h)."""
        self.power.boot()
        if self._values[0x6060, 0]:
            self.written((0x6060, 0), now_ns)

    def restart(self) -> None:
        """Reset the electronics to their power-on state; the motor stays where it is."""
        self.power.state = DriveState.NOT_READY_TO_SWITCH_ON
        self.power.stopping = None
        self.alarms = Alarms(self.node_id, self._values)
        self._homing = Homing(self._values, self._switches)
        self._waiting_word = self._mode_due_ns = None
        self._late_words.clear()
        self.motion.hold(0)

    def take(self) -> list[Frame]:
        """Return the emergency messages since the last call."""
        out, self.emergencies = self.emergencies, []
        return out

    def check(self, key: Key, value: int) -> Abort | None:
        """Abort code that refuses a value for an object of the profile; none if it is accepted."""
        if key == (0x6060, 0):
            if value not in MODES:
                return Abort.INVALID_VALUE
            halted = self._values[0x6040, 0] & HALT
            changes = value != self._values[0x6060, 0]
            if halted and changes and self._behaviour.halt_blocks_mode:
                return Abort.DEVICE_STATE
        if key == (0x6098, 0) and value not in METHODS:
            return Abort.INVALID_VALUE
        if key == POLARITY and value != self._values[key] and self.power.state in POWERED:
            # The target would be another one, all at once.
            return Abort.DEVICE_STATE
        return None

    def written(self, key: Key, now_ns: int) -> None:
        """Act on a new value of an object of the profile."""
        if key == (0x6040, 0):
            if self._behaviour.slow_loop:
                self._waiting_word = self._values[key]
            else:
                self._command(self._values[key], now_ns)
        elif key == (0x6060, 0):
            self._mode_due_ns = now_ns + 1000 * self._behaviour.mode_lag_us

    def _command(self, controlword: int, now_ns: int) -> None:
        was_enabled = self.power.state is _ENABLED
        obeyed = controlword not in self._behaviour.ignores
        if obeyed and self.power.command(controlword, cause_gone=not self.alarms.standing):
            self._say(self.alarms.reset())
        if self.power.state is _ENABLED and not was_enabled:
            self.motion.hold(now_ns)
            self._warn()
        if obeyed and self.power.state is _ENABLED and self._values[0x6061, 0] == _HOMING:
            self._homing.command(controlword)
        self._status()

    def _warn(self) -> None:
        """Send the emergency messages of a drive that warns of nothing."""
        for code in self._behaviour.warnings:
            self._say(emcy_frame(Emergency(node_id=self._node.node_id, code=code, register=0)))

    def fault(self, code: int) -> None:
        """Raise an error and start the fault reaction."""
        self._say(self.alarms.raise_(code))
        self.power.fault()

    def sync(self, fresh: bool, now_ns: int) -> None:
        """Latch the target as the new set point at SYNC, if one has come."""
        values = self._values
        if self.power.state is not _ENABLED or values[0x6061, 0] != _CYCLIC:
            return
        if self.power.stopping is not None or values[0x6040, 0] & HALT:
            return
        asked, units = values[self._target], self._node.motor
        # A position beyond what the drive shows is none: it is as if no target had come.
        target = asked + values[0x60B0, 0] if fresh and units.show(asked) == asked else None
        if target is not None:
            # The object wraps; the motor takes the short way round.
            near = round(self.motion.demand)
            target = units.nearest(self.motion.sign * target, near)
        self.motion.latch(target, now_ns)
        if self.motion.missing > self._behaviour.missing_limit:
            self.fault(SETPOINTS_MISSING)

    def tick(self, now_ns: int, step_ns: int) -> float:
        """Move for `step_ns` until now; returns the true motor position [rad]."""
        self._now_ns = now_ns
        if self._waiting_word is not None:
            word, self._waiting_word = self._waiting_word, None
            self._command(word, now_ns)
        self._show_mode(now_ns)
        self.sensors.tick(step_ns)
        before = self.motion.actual
        self._move(now_ns, step_ns)
        turned = -1 if self._values[POLARITY] & 0x40 else 1
        self._values[0x606C, 0] = turned * round((self.motion.actual - before) * 1e9 / step_ns)
        return self.motion.angle

    def _show_mode(self, now_ns: int) -> None:
        """Let the mode display 6061h follow 6060h, late; some drives show none without power."""
        values, due_ns = self._values, self._mode_due_ns
        if self._behaviour.mode_needs_power and self.power.state is not _ENABLED:
            values[0x6061, 0] = Mode.NONE
            self._mode_due_ns = now_ns + 1000 * self._behaviour.mode_lag_us
            return
        if due_ns is not None and now_ns >= due_ns:
            values[0x6061, 0], self._mode_due_ns = values[0x6060, 0], None
            self.motion.hold(now_ns)

    def _move(self, now_ns: int, step_ns: int) -> None:
        motion, power, values = self.motion, self.power, self._values
        if power.stopping is not None:
            if motion.ramp(self._deceleration(power.stopping), step_ns):
                power.stopped()
        elif power.state is _QUICK_STOP:
            motion.ramp(0.0, step_ns)
        elif power.state is not _ENABLED:
            motion.hold(now_ns)
            return
        elif values[0x6040, 0] & HALT:
            motion.ramp(self._deceleration(values[0x605D, 0]), step_ns)
        elif values[0x6061, 0] == _CYCLIC:
            motion.follow(now_ns, step_ns)
        elif values[0x6061, 0] == _HOMING:
            self._homing.step(motion, step_ns)
        motion.drive(step_ns)
        if motion.overdue(step_ns):
            self.fault(FOLLOWING_ERROR)

    def _deceleration(self, option: int) -> float:
        """Deceleration of a stop option [counts/s2]; 0 stops at once, at the current limit."""
        if option == 1:
            return float(self._values[0x6084, 0])
        return float(self._values[0x6085, 0]) if option == 2 else 0.0

    def sense(self, link_pos: float, spring_torque: float) -> None:
        """Take over the state of the body: link angle [rad] and spring torque [N m]."""
        if self._behaviour.motor_noise is not None:
            self.sensors.motor.disturb(self._behaviour.motor_noise())
        node = self._node
        self._torque = node.motor.sign * spring_torque
        if node.link is not None:
            self._link_counts = node.link.to_counts(link_pos)
        elif node.side is Side.LINK:
            self.motion.beside = node.motor.counts_per_rad * (link_pos - self.motion.angle)

    def publish(self) -> None:
        """Update the actual values in the object dictionary."""
        self._shown.update(self.motion, self.sensors, self._link_counts, self._torque)
        if self._switches.present:
            motion = self.motion
            self._values[0x60FD, 0] = self._switches.inputs(motion.travel, motion.sign)
        self._status()

    def _status(self) -> None:
        power, motion, values = self.power, self.motion, self._values
        word = power.low_byte | _STATUS
        if self.warning:
            word |= StatusBit.WARNING
        if self._homing.done:
            word |= HOMED
        mode, halted = values[0x6061, 0], bool(values[0x6040, 0] & HALT)
        if mode == _CYCLIC:
            if power.state is _ENABLED and power.stopping is None:
                if motion.limited:
                    word |= StatusBit.INTERNAL_LIMIT
                elif self._behaviour.follows_bit and not halted:
                    word |= _FOLLOWS
            if values[0x603F, 0] == FOLLOWING_ERROR:
                word |= StatusBit.FOLLOWING_ERROR
        elif mode == _HOMING:
            word |= self._homing.status(halted=halted, standing=motion.speed == 0.0)
        if self._behaviour.status_lag_us:
            self._show_late(word)
        else:
            values[0x6041, 0] = word

    def _show_late(self, word: int) -> None:
        """Publish the statusword in the object dictionary, late by the status lag."""
        late, lag_ns = self._late_words, 1000 * self._behaviour.status_lag_us
        late.append((self._now_ns + lag_ns, word))
        while late and late[0][0] <= self._now_ns:
            self._values[0x6041, 0] = late.popleft()[1]

    def _say(self, frame: Frame | None) -> None:
        if frame is not None:
            self.emergencies.append(frame)
