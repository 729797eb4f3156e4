"""The stop over SDO, for drives that are led without process data or do not obey it."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import final

from legbench.drives.errors import BusError
from legbench.drives.master.port import Port
from legbench.drives.master.sdo_port import SdoPort
from legbench.drives.master.stop_report import StopReport
from legbench.drives.protocol.cia402 import POWERED, Controlword, decode_state, describe_statusword
from legbench.drives.protocol.datatypes import DataType, pack
from legbench.drives.protocol.frame import SDO_REQUEST_BASE, Frame
from legbench.drives.protocol.sdo_client import Download
from legbench.drives.setup.config import NodeConfig

RAMP_NS = 35_000_000
"""Longest that a quick-stop ramp is waited for, so that with the time of the questions every
drive is without power after 50 ms [ns]."""
LAST_NS = 250_000_000
"""Longest that a drive is asked whether its power is gone [ns]."""
REST_NS = 5_000_000
"""Pause between two rounds of reading all statuswords [ns]."""
ANSWER_MS = 20
"""Longest wait for a statusword, so that the other drives are read in time, too [ms]."""
FAILED_LOOKS = 3
"""Number of rounds in a row without a frame sent after which the stop gives up."""
STATUSWORD, CONTROLWORD = 0x6041, 0x6040


@final
class SdoStop:
    """Stop of some drives over SDO; raises nothing.

    The controlword goes to all drives at once, before anybody waits for an answer. Whatever a
    step raises, a KeyboardInterrupt out of a driver included, the next step is taken.
    """

    def __init__(
        self,
        port: Port,
        nodes: Sequence[NodeConfig],
        hold: Callable[[BaseException], None],
        *,
        beat: Frame | None = None,
        rest_ns: int = REST_NS,
    ) -> None:
        """Prepare to stop drives.

        Args:
            port: to the bus.
            nodes: the drives.
            hold: called with what was raised, such as `Shield.hold`.
            beat: this master's heartbeat, if drives watch for it.
            rest_ns: pause between two rounds of reading all statuswords [ns].
        """
        self._port, self._hold = port, hold
        self._nodes = tuple(nodes)
        self._sdo = {
            node.node_id: SdoPort(port, node.node_id, timeout_ms=ANSWER_MS, retries=1)
            for node in nodes
        }
        self._beat, self._rest_ns = beat, rest_ns
        self._errors: dict[str, None] = {}
        self._refused = 0

    def run(self) -> StopReport:
        """Quick stop at once, no voltage where the ramp takes too long, look until it is gone."""
        now_ns = self._port.timebase.now_ns
        began_ns = now_ns()
        left, shown = list(self._nodes), dict.fromkeys(self._nodes, -1)
        cut_off: tuple[NodeConfig, ...] = ()
        self._write_controlword(left, Controlword.QUICK_STOP)
        for _ in range(LAST_NS // self._rest_ns):
            self._try(self._rest)
            for node in left:
                shown[node] = self._look(node)
            left = [node for node in left if _may_have_power(shown[node])]
            elapsed_ns = now_ns() - began_ns
            if not left or elapsed_ns > LAST_NS or self._refused >= FAILED_LOOKS:
                break
            if elapsed_ns < RAMP_NS:
                self._write_controlword(left, Controlword.QUICK_STOP)
                continue
            cut_off = cut_off or tuple(left)
            self._write_controlword(left, Controlword.DISABLE_VOLTAGE)
        self._write_controlword(self._nodes, Controlword.DISABLE_VOLTAGE)
        powered = [node for node in left if shown[node] >= 0]
        return StopReport(
            powered=tuple(node.name for node in powered),
            states=tuple(describe_statusword(shown[node]) for node in powered),
            silent=tuple(node.name for node in left if shown[node] < 0),
            cut_off=tuple(node.name for node in cut_off if shown[node] >= 0),
            errors=tuple(self._errors),
        )

    def _write_controlword(self, nodes: Sequence[NodeConfig], controlword: int) -> None:
        """Write 6040h in all drives, back to back; twice where something was raised."""
        written = False
        for node in nodes:
            request = Download(CONTROLWORD, 0, pack(DataType.UNSIGNED16, controlword)).request
            for _ in range(2):
                if self._try(partial(self._port.send, SDO_REQUEST_BASE + node.node_id, request)):
                    written = True
                    break
        self._refused = 0 if written else self._refused + 1

    def _look(self, node: NodeConfig) -> int:
        """Read the statusword of a drive; -1 if it does not answer."""
        try:
            return self._sdo[node.node_id].get_int(STATUSWORD, 0, DataType.UNSIGNED16)
        except BaseException as error:  # The stop goes on, whatever a driver raises.
            self._note(error)
            return -1

    def _rest(self) -> None:
        if self._beat is not None:
            self._port.send_frame(self._beat)
        timebase = self._port.timebase
        timebase.wait_until(timebase.now_ns() + self._rest_ns)

    def _try(self, step: Callable[[], None]) -> bool:
        try:
            step()
        except BaseException as error:  # The stop goes on, whatever a driver raises.
            self._note(error)
            return False
        return True

    def _note(self, error: BaseException) -> None:
        self._hold(error)
        self._errors[f"{type(error).__name__}: {error}".rstrip(": ")] = None


def _may_have_power(statusword: int) -> bool:
    return statusword < 0 or decode_state(statusword) in POWERED


def leave_operational(
    order: Callable[[], None],
    port: Port,
    nodes: Sequence[NodeConfig],
    stopped: StopReport | None,
    hold: Callable[[BaseException], None],
) -> StopReport | None:
    """Order drives out of operational, and repeat a stop that is not verified; raises nothing.

    A drive that leaves operational stops by itself (6007h). SDO works where process data is lost,
    so those that have not been seen without power are told and looked at once more.

    Args:
        order: sends the order to all drives, such as `BringUp.pre_operational`.
        port: to the bus.
        nodes: all drives.
        stopped: report of their stop, none if none was needed.
        hold: called with what was raised, such as `Shield.hold`.

    Returns:
        How the stop has ended now; none if it was not repeated.
    """
    for _ in range(2):
        try:
            order()
            break
        except BusError:  # Every drive has been told, or the bus takes nothing.
            break
        except BaseException as error:  # The stop goes on, whatever a driver raises.
            hold(error)
    if stopped is None or stopped.verified:
        return None
    left = [node for node in nodes if node.name in stopped.powered + stopped.silent]
    return SdoStop(port, left, hold).run().after(stopped)
