"""Moments at which a command is interrupted, and what interrupts it there."""

import signal
import sys
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import CodeType, FrameType
from typing import Any, final

ROOT = Path(__file__).parents[1]
SOURCE = ROOT / "src" / "legbench"
HOME = str(ROOT)
TRACED = ("drives", "plant", "commissioning", "loop.py", "plants.py", "experiment", "limits")
HARDWARE = ("emulated", "bus.py", "wire.py", "timebase.py", "pacer.py")
"""What stands for the drives and their wire: no signal reaches into a real drive."""
STOPPING = ("close", "stop", "end", "unpower", "__exit__", "_write_controlword")
RUNNING = ("_cycle", "_to_rest", "move_to", "await_end", "_script")


@dataclass(frozen=True, slots=True, kw_only=True)
class Point:
    """One moment at which a command is interrupted."""

    command: str
    kind: str
    """`call` of the bus or its clock, source `line`, or a `driver` that raises by itself."""
    number: int
    """Which call, or which pass of the line."""
    code: CodeType | None = None
    line: int = 0
    sent: signal.Signals = signal.SIGINT
    second: int = 0
    """Calls until the second signal; 0 for none."""


@final
class Injector:
    """Counts calls and lines, and interrupts at a point.

    Attributes:
        calls: made so far.
        struck: whether the first interruption has come.
        phase: of the command when it came.
        phases: of every call, without a point.
        lines: passes of every line, without a point.
        began: whether a run has come to its first row.
    """

    def __init__(self, point: Point | None, on_strike: Callable[[], None]) -> None:
        self.point, self._on_strike = point, on_strike
        self.calls = 0
        self.phases: list[str] = []
        self.struck = self.began = False
        self.phase = "not reached"
        self._left = 0
        self.lines: Counter[tuple[CodeType, int]] = Counter()

    def call(self) -> None:
        """A call of the bus or its clock is about to be made."""
        self.calls += 1
        point = self.point
        if point is None:
            self.phases.append(self._phase(sys._getframe(2)))
        elif self.struck:
            self._left -= 1
            if self._left == 0:
                self._raise(point)
        elif point.kind != "line" and self.calls == point.number:
            self._strike(point, sys._getframe(2))

    def trace(self, frame: FrameType, _event: str, _argument: Any) -> Any:
        """Trace function for `sys.settrace`."""
        code, point = frame.f_code, self.point
        if point is None:
            return self._count if _is_ours(code.co_filename) else None
        return self._pass if code is point.code and not self.struck else None

    def _count(self, frame: FrameType, event: str, _argument: Any) -> Any:
        if event == "line":
            self.lines[frame.f_code, frame.f_lineno] += 1
        return self._count

    def _pass(self, frame: FrameType, event: str, _argument: Any) -> Any:
        point = self.point
        if point is None or self.struck:
            return None
        if event == "line" and frame.f_lineno == point.line:
            self.lines[frame.f_code, frame.f_lineno] += 1
            if self.lines[frame.f_code, frame.f_lineno] == point.number:
                sys.settrace(None)
                self._strike(point, frame)
        return self._pass

    def _strike(self, point: Point, frame: FrameType | None) -> None:
        self.struck, self._left, self.phase = True, point.second, self._phase(frame)
        self._on_strike()
        self._raise(point)

    def _raise(self, point: Point) -> None:
        if point.kind == "driver":
            raise KeyboardInterrupt
        signal.raise_signal(point.sent)

    def _phase(self, frame: FrameType | None) -> str:
        names = set()
        while frame is not None:
            if frame.f_code.co_filename.startswith(HOME):
                names.add(frame.f_code.co_name)
            frame = frame.f_back
        if not names.isdisjoint(STOPPING):
            return "stop"
        if "start" in names:
            return "start-up"
        return "run" if self.began or not names.isdisjoint(RUNNING) else "start-up"


@cache
def _is_ours(name: str) -> bool:
    path = Path(name)
    if not path.is_relative_to(SOURCE):
        return False
    parts = path.relative_to(SOURCE).parts
    return parts[0] in TRACED and not set(parts) & set(HARDWARE)
