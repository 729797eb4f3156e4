"""Watch of a drive besides its process data: heartbeat, emergencies, losses; pure."""

import math
from typing import final

from legbench.drives.protocol.emcy import MEANINGS, Emergency, decode_emcy
from legbench.drives.protocol.nmt import HeartbeatWatch, NmtState, decode_heartbeat
from legbench.drives.setup.config import BusConfig, NodeConfig

NOT_OPERATIONAL = (NmtState.PRE_OPERATIONAL, NmtState.STOPPED)
"""NMT states in which a drive sends no process data."""
HEARTBEATS = 3
"""Number of heartbeat periods without a heartbeat after which a drive is lost."""


@final
class NodeWatch:
    """Watches one drive.

    Attributes:
        state: its NMT state, as last heard.
        emergency: the first one since `arm` that is no warning.
        history: every emergency ever heard, the all-clear included.
        missed: cycles without process data since two in a row had theirs: every second answer is
            no answer, and may be an old one.
        lost_total: all cycles without process data.
        bad_total: process data of a wrong length.
        well_until_ns: time until which `trouble` finds nothing, unless something comes, or fails to
            come; in the past if it may find something at once [ns].
    """

    def __init__(self, bus: BusConfig, node: NodeConfig, now_ns: int) -> None:
        self._node, self._who = node, f"drive '{node.name}' (node {node.node_id})"
        self._beat = HeartbeatWatch(1_000_000 * HEARTBEATS * bus.heartbeat_ms, now_ns)
        self.state: NmtState | None = None
        self.emergency: Emergency | None = None
        self.history: list[Emergency] = []
        self.missed = 0
        self.lost_total = 0
        self.bad_total = 0
        self._expects_heartbeat = True
        self._rebooted = False
        self._well = True
        self._judge()

    def arm(self, now_ns: int) -> None:
        """Start watching from now: the counts, emergency and state of before are cleared."""
        self._beat.feed(now_ns)
        self.emergency, self.missed, self._rebooted = None, 0, False
        self.lost_total = self.bad_total = 0
        self.state = None
        self._judge()

    @property
    def expects_heartbeat(self) -> bool:
        """Whether the drive produces a heartbeat (1017h), which then must come."""
        return self._expects_heartbeat

    @expects_heartbeat.setter
    def expects_heartbeat(self, expects: bool) -> None:
        self._expects_heartbeat = expects
        self._judge()

    def take_heartbeat(self, data: bytes, now_ns: int) -> None:
        """Take a heartbeat or boot-up message."""
        state = decode_heartbeat(data)
        if state is None:
            return
        self._beat.feed(now_ns)
        self.state = state
        if state is NmtState.BOOT_UP:
            self._rebooted = True
        self._judge()

    def take_emergency(self, data: bytes) -> None:
        """Take an emergency message."""
        emergency = decode_emcy(self._node.node_id, data)
        if emergency is None:
            return
        self.history.append(emergency)
        warns = emergency.code in self._node.quirks.warnings
        if emergency.code != 0 and not warns and self.emergency is None:
            self.emergency = emergency
            self._judge()

    def _judge(self) -> None:
        """Judge what has come from the drive, once a message instead of once a cycle."""
        stands = self.state in NOT_OPERATIONAL
        if stands or self._rebooted or self.emergency is not None or self.missed > 0:
            self.well_until_ns: float = -1
        else:
            beat = self._beat
            late_ns = beat.last_ns + beat.timeout_ns
            self.well_until_ns = late_ns if self._expects_heartbeat else math.inf

    def cycle(self, *, complete: bool) -> None:
        """Count a cycle that has ended with or without its process data."""
        if complete:
            if self._well and self.missed:
                self.missed = 0
                self._judge()
            self._well = True
        else:
            self._well = False
            self.missed += 1
            self.lost_total += 1
            self._judge()

    @property
    def gaps(self) -> bool:
        """Whether it has missed a cycle since two in a row had its process data."""
        return not self._well or self.missed > 0

    def _way(self) -> str:
        """How to go on after an emergency that only the maker of the drive can explain."""
        if self.emergency is None or self.emergency.code in MEANINGS:
            return ""
        code = f"0x{self.emergency.code:04X}"
        return f"; if its manual calls it a warning, give warnings = [{code}] in [node.quirks]"

    def trouble(self, now_ns: int, lost_frames: int) -> tuple[str, str] | None:
        """Cause and message of what is wrong with the drive; none if nothing is."""
        late = self._expects_heartbeat and self._beat.lost(now_ns)
        if self.emergency is not None:
            return "drive emergency", f"{self._who}: {self.emergency}{self._way()}"
        if self._rebooted:
            return "drive reset", f"{self._who} has started again; its configuration is gone"
        if self.missed >= lost_frames:
            return (
                "process data lost",
                f"{self._who} sent no process data for {self.missed} cycles, the limit is "
                f"{lost_frames}",
            )
        if late:
            late_ms = (now_ns - self._beat.last_ns) / 1e6
            return "heartbeat lost", f"{self._who}: no heartbeat for {late_ms:.0f} ms"
        state = self.state
        if state is not None and state in NOT_OPERATIONAL:
            return "drive left operational", f"{self._who} is {state.name.lower()}"
        return None
