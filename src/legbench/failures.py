"""Messages about an exception that was raised by the code of a guest."""

import linecache
import traceback
from collections.abc import Callable, Sequence
from pathlib import Path
from types import CodeType

from legbench.errors import PlantFault

FRAMES = 3
"""Number of lines of source that a message shows, the innermost ones."""


HERE = Path(__file__).parent
"""Folder of this package: a guest's own lines lie outside of it."""


def failed(
    who: str, when: str, error: Exception, lines: Sequence[str], *, told: bool = False
) -> PlantFault:
    """Return the fault with which a run ends because its controller or plant has failed.

    Args:
        who: "controller" or "plant"; the cause is "<who> failed".
        when: such as "at t = 0.002 s".
        error: what was raised.
        lines: of source that its author has to look at.
        told: the error is ours and says it all; its type says nothing more.
    """
    what = str(error) if told else "".join(traceback.format_exception_only(error)).strip()
    message = "".join([f"the {who} failed {when}: {what}", *(f"\n  {line}" for line in lines)])
    return PlantFault(f"{who} failed", message)


def own_lines(error: BaseException) -> list[str]:
    """Return `file:line in function: source` of the innermost frames of the code that was called.

    The frames of the caller, and of what this package has between, are cut off, and so is what the
    code called outside of its own folder: the lines that its author can mend are shown, outermost
    first. Code of this package has lines of its own only where nothing else was called.
    """
    called = traceback.extract_tb(error.__traceback__)[1:]
    guests = [place for place, frame in enumerate(called) if not _ours(frame.filename)]
    frames = called[guests[0] :] if guests else called
    if not frames:
        return []
    home = Path(frames[0].filename).parent
    own = [frame for frame in frames if Path(frame.filename).is_relative_to(home)]
    return [_line(frame.filename, frame.lineno or 0, frame.name) for frame in own][-FRAMES:]


def _ours(filename: str) -> bool:
    return Path(filename).is_relative_to(HERE)


def defined_at(function: Callable[..., object]) -> list[str]:
    """Return where a function begins, as `own_lines` does; nothing for one that is not Python's."""
    code = getattr(function, "__code__", None)
    if not isinstance(code, CodeType):
        return []
    return [_line(code.co_filename, code.co_firstlineno, code.co_name)]


def _line(filename: str, number: int, function: str) -> str:
    source = linecache.getline(filename, number).strip()
    return f"{filename}:{number} in {function}" + (f": {source}" if source else "")
