"""What to tell the user about an exception that was raised by somebody else's code."""

import linecache
import traceback
from collections.abc import Callable, Sequence
from pathlib import Path
from types import CodeType

from legbench.errors import PlantFault

FRAMES = 3
"""Lines of source that a message shows, the innermost ones."""


def failed(who: str, when: str, error: Exception, lines: Sequence[str]) -> PlantFault:
    """Return the fault with which a run ends because its controller or plant has failed.

    Args:
        who: "controller" or "plant"; the cause is "<who> failed".
        when: such as "at t = 0.002 s".
        error: what was raised.
        lines: of source that its author has to look at.
    """
    what = "".join(traceback.format_exception_only(error)).strip()
    message = "".join([f"the {who} failed {when}: {what}", *(f"\n  {line}" for line in lines)])
    return PlantFault(f"{who} failed", message)


def own_lines(error: BaseException) -> list[str]:
    """Return `file:line in function: source` of the innermost frames of the code that was called.

    The frame of the caller is cut off, and so is what the code called outside of its own folder:
    the lines that its author can mend are shown, outermost first.
    """
    frames = traceback.extract_tb(error.__traceback__)[1:]
    if not frames:
        return []
    home = Path(frames[0].filename).parent
    own = [frame for frame in frames if Path(frame.filename).is_relative_to(home)]
    return [_line(frame.filename, frame.lineno or 0, frame.name) for frame in own][-FRAMES:]


def defined_at(function: Callable[..., object]) -> list[str]:
    """Return where a function begins, as `own_lines` does; nothing for one that is not Python's."""
    code = getattr(function, "__code__", None)
    if not isinstance(code, CodeType):
        return []
    return [_line(code.co_filename, code.co_firstlineno, code.co_name)]


def _line(filename: str, number: int, function: str) -> str:
    source = linecache.getline(filename, number).strip()
    return f"{filename}:{number} in {function}" + (f": {source}" if source else "")
