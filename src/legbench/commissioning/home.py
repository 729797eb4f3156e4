"""Homing of one drive by its own procedure (CiA 402-2, homing mode), over SDO.

The drive is configured as for a run and goes to operational, so that its own watchdog stops it
when this master falls silent; it is always led out by quick stop.
"""

from dataclasses import dataclass
from typing import final

from legbench.commissioning.search_bounds import check_given, check_held
from legbench.drives.errors import DriveError, SdoAbortError
from legbench.drives.master.bring_up import BringUp
from legbench.drives.master.preparation import is_homed, take_power
from legbench.drives.master.sdo_port import SdoPort
from legbench.drives.master.sdo_stop import SdoStop, leave_operational
from legbench.drives.master.session import Session
from legbench.drives.master.stop_report import DriveLeader, StopReport
from legbench.drives.protocol.cia402 import (
    DriveState,
    Goal,
    Mode,
    StatusBit,
    Way,
    decode_state,
    describe_statusword,
    next_controlword,
)
from legbench.drives.protocol.datatypes import DataType
from legbench.drives.protocol.nmt import NmtCommand, NmtState, heartbeat_frame, nmt_frame
from legbench.drives.setup.config import NodeConfig
from legbench.drives.setup.master_watch import check_master_watch
from legbench.drives.setup.quirks import ModeShown
from legbench.drives.setup.taken import check_taken
from legbench.errors import ConfigError
from legbench.interrupts import shielded

START_HOMING = 0x1F
"""Controlword that enables operation, with bit 4, which starts the homing."""
IN_PLACE = (35, 37)
"""Methods that do not move."""
INDEX_ONLY = (33, 34)
"""Methods that search the index pulse alone, at the slower speed."""
STANDARD, MAKERS = range(1, 38), range(-128, 0)
"""Homing methods of CiA 402-2, and of the makers of drives."""
FASTEST = 1.0
"""Highest speed of a search for a hard stop (6099h:01) [rad/s]."""
LONGEST = 600.0
"""A search at the lowest sensible speed, 0.01 rad/s, has made a turn by then [s]."""
PATIENCE = 200
"""Largest number of times that a drive is asked whether it has made a step [-]."""
LOOK_NS = 5_000_000
"""Longest time between two looks, so that each can bring a heartbeat in time [ns]."""
U16, U32, I8, I32 = (
    DataType.UNSIGNED16,
    DataType.UNSIGNED32,
    DataType.INTEGER8,
    DataType.INTEGER32,
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Homed:
    """Result of a homing."""

    node: str
    method: int
    before_counts: int
    after_counts: int


def home(session: Session, node: NodeConfig, method: int, *, timeout: float = 20.0) -> Homed:
    """Configure one drive, home it and leave it without power, by quick stop in any case.

    Args:
        session: the channel is taken.
        node: drive of the bus file.
        method: 6098h; 37 calls the present position zero, all others but 35 search.
        timeout: longest duration of the homing [s].

    Raises:
        ConfigError: no time at all or more than 10 minutes, the bus file does not bound a search,
            it is too fast, or a drive would go on without its master.
        BusError: the channel has a master.
        PlantFault: somebody else leads these drives; before the homing has begun, nothing has been
            sent since it was heard.
        DriveError: another drive, a refused step, a search that the drive does not bound, homing
            failed, or is not shown afterwards.
        StopError: the drive keeps its power, or does not answer.
    """
    _check_asked(node, method, timeout)
    # Led by SDO a drive gets no RPDO, whose deadline therefore never begins.
    check_master_watch(session.config, speed=FASTEST, commands=False)
    session.hold()
    up = session.bring_up()
    take_power(up)
    up.pre_operational()
    outcomes = up.configure(node)
    check_taken(session.config, {node.name: outcomes}, speed=FASTEST, commands=False)
    sdo = up.sdo(node)
    if method not in IN_PLACE:
        check_held(node, outcomes)
        _check_speed(sdo, node, method)
    before = up.preload(node)
    _choose(sdo, node, method)
    master = _Master(session, up, node)
    session.register(master)
    up.poll_frames()
    with master:
        master.start()
        master.choose_homing()
        master.enable()
        master.await_homing()
        master.command(START_HOMING)
        master.await_end(timeout)
    up.detector.disarm()
    sdo.put(0x6060, 0, I8, Mode.CYCLIC_SYNCHRONOUS_POSITION)
    after = up.position(node)
    _check_shown(up, node)
    return Homed(node=node.name, method=method, before_counts=before, after_counts=after)


def _check_shown(up: BringUp, node: NodeConfig) -> None:
    """Check that a drive shows its homing as the bus file says; raises DriveError."""
    if is_homed(up, node) is False:
        raise DriveError(
            f"drive '{node.name}' has homed, and does not show it ({node.homed}): correct its "
            "'homed' in the bus file, by which nothing begins otherwise"
        )


def _check_asked(node: NodeConfig, method: int, timeout: float) -> None:
    """Refuse what no drive has or no search should be made with; raises ConfigError."""
    if not 0.0 < timeout <= LONGEST:
        raise ConfigError(f"timeout is {timeout:g} s; it must be positive, {LONGEST:g} s at most")
    if method not in STANDARD and method not in MAKERS:
        raise ConfigError(
            f"homing method is {method}; the standard has 1 to {STANDARD[-1]}, makers of drives "
            f"{MAKERS[0]} to -1"
        )
    if method not in IN_PLACE:
        check_given(node)


def _check_speed(sdo: SdoPort, node: NodeConfig, method: int) -> None:
    """Refuse a search that is too fast, or that would never come anywhere (6099h)."""
    subs = {1: "a switch or stop", 2: "zero"}
    for sub, what in subs.items():
        try:
            speed = sdo.get_int(0x6099, sub, U32) / abs(node.motor.counts_per_rad)
        except SdoAbortError as error:
            raise DriveError(
                f"drive '{node.name}' does not tell how fast it searches {what}: {error}; home it "
                "with its maker's tool"
            ) from error
        # The maker's own methods need not use the second speed, an index pulse not the first.
        needed = sub == 1 if method in MAKERS else sub == 2 or method not in INDEX_ONLY
        way = f'give "6099:{sub:02X} u32" [counts/s] in its parameters'
        if speed > FASTEST:
            raise ConfigError(
                f"'{node.name}' would search {what} at {speed:.3g} rad/s, the limit is "
                f"{FASTEST:g} rad/s; {way}"
            )
        if needed and not speed:
            raise ConfigError(f"'{node.name}' has no speed to search {what} with; {way}")


def _choose(sdo: SdoPort, node: NodeConfig, method: int) -> None:
    try:
        sdo.put(0x6098, 0, I8, method)
    except SdoAbortError as error:
        raise DriveError(
            f"drive '{node.name}' does not take homing method {method}: {error}; its manual lists "
            "those that it has"
        ) from error
    there = sdo.get_int(0x6098, 0, I8)
    if there != method:
        raise DriveError(f"drive '{node.name}' does not take homing method {method}: {there}")


@final
class _Master(DriveLeader):
    """Leads one drive by SDO, with a heartbeat in every wait."""

    def __init__(self, session: Session, up: BringUp, node: NodeConfig) -> None:
        self._port, self._up, self._node = session.port(), up, node
        self._sdo = up.sdo(node)
        self._begun = self._closed = False
        self._stopped: StopReport | None = None
        self._timebase = session.timebase
        self._beat = heartbeat_frame(session.config.master_id, NmtState.OPERATIONAL)
        self._rest_ns = min(LOOK_NS, 1_000_000 * session.config.master_heartbeat_ms // 2)

    @property
    def stopped(self) -> StopReport | None:
        """Report of the stop of the drive; none if it was never started."""
        return self._stopped

    def start(self) -> None:
        """Start the node; from this first heartbeat on the drive's watchdog runs (1016h)."""
        self._begun = True
        self._port.send_frame(self._beat)
        self._port.send_frame(nmt_frame(NmtCommand.START, self._node.node_id))

    def choose_homing(self) -> None:
        """Write the mode (6060h), and wait for it where it is shown without power."""
        self._sdo.put(0x6060, 0, I8, Mode.HOMING)
        if self._node.quirks.mode_shown is ModeShown.CONFIGURED:
            self.await_homing()

    def await_homing(self) -> None:
        """Wait until 6061h shows the mode, which lags behind 6060h.

        Raises:
            DriveError: it is not shown within the time that the bus file gives the drive.
        """
        patience_ms = self._node.quirks.mode_patience_ms
        until_ns = self._timebase.now_ns() + 1_000_000 * patience_ms
        while self._sdo.get_int(0x6061, 0, I8) != Mode.HOMING:
            if self._timebase.now_ns() >= until_ns:
                raise DriveError(
                    f"drive '{self._node.name}' does not enter homing mode (6061h) within "
                    f"{patience_ms} ms; if it is slow, raise mode_patience_ms in [node.quirks]; if "
                    "it shows its mode only once it is enabled, give mode_shown = "
                    f'"{ModeShown.ENABLED}"'
                )
            self._wait()

    def enable(self) -> None:
        """Advance the power state by one transition per observed statusword."""
        word = 0
        for _ in range(PATIENCE):
            word = self._look()
            state = decode_state(word)
            if state is None:
                continue
            controlword, way = next_controlword(state, Goal.ENABLED)
            if way is Way.REACHED:
                return
            if way is Way.REFUSED:
                break
            self.command(controlword)
        way = f"; remove the cause, then run `legbench drives reset --node {self._node.name}`"
        raise DriveError(
            f"drive '{self._node.name}' does not become enabled: {describe_statusword(word)}"
            f"{way if decode_state(word) is DriveState.FAULT else ''}"
        )

    def await_end(self, timeout: float) -> None:
        """Wait until the drive says attained; raises DriveError if it fails or takes too long."""
        name, until_ns = self._node.name, self._timebase.now_ns() + round(1e9 * timeout)
        while self._timebase.now_ns() < until_ns:
            word = self._look()
            enabled = decode_state(word) is DriveState.OPERATION_ENABLED
            if not enabled or word & StatusBit.FOLLOWING_ERROR:
                raise DriveError(f"homing of '{name}' failed with statusword {word:04X}h")
            if word & StatusBit.FOLLOWS_COMMAND and word & StatusBit.TARGET_REACHED:
                return
        raise DriveError(
            f"homing of '{name}' has not ended within {timeout:g} s; raise --timeout, or the "
            "speeds of a search (6099h) in its parameters"
        )

    def close(self) -> None:
        """Quick stop, no voltage for a drive that takes too long, pre-operational; once.

        A drive that leaves operational stops by itself, whatever failed until then (6007h).
        """
        if self._closed or not self._begun:
            return
        with shielded() as shield:
            port, nodes, hold = self._port, (self._node,), shield.hold
            stop = SdoStop(port, nodes, hold, beat=self._beat, rest_ns=self._rest_ns)
            self._stopped = stop.run()
            order = self._up.pre_operational
            again = leave_operational(order, port, nodes, self._stopped, hold)
            self._stopped = again or self._stopped
            self._closed = True

    def command(self, controlword: int) -> None:
        """Write the controlword (6040h)."""
        self._sdo.put(0x6040, 0, U16, controlword)

    def _look(self) -> int:
        """The statusword, after a wait."""
        self._wait()
        return self._sdo.get_int(0x6041, 0, U16)

    def _wait(self) -> None:
        self._port.send_frame(self._beat)
        self._timebase.wait_until(self._timebase.now_ns() + self._rest_ns)
