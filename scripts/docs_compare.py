"""Comparing what a document shows with what a command prints.

- Numbers agree if they differ by one unit of the last digit shown at most, and a zero has no sign.
- `...` stands for any text within a line; a line that is `...` alone stands for any lines.
- `TIME` stands for the moment at which a run began, in the name of its folder.
- Lines that tell wall time (`speed ... x real time`) are left out on both sides.
"""

import re
from collections.abc import Sequence
from decimal import Decimal

NUMBER = r"[+-]?(?:\d[\d_]*\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
NUMBERS = re.compile(rf"(?<![\w.]){NUMBER}(?!\w)")
"""Numbers that stand alone; those within a word (201h, motor1) are text."""
MOMENT = re.compile(r"\b\d{8}-\d{6}(?:-\d+)?(?=_)")
WALL_TIME = re.compile(r"^speed\s+\S+ x real time$")
ANY = "..."


def differences(shown: Sequence[str], printed: Sequence[str]) -> list[str]:
    """Lines that differ, none if the command prints what is shown.

    Args:
        shown: lines of the document.
        printed: lines of the command.
    """
    left, right = _plain(shown), _plain(printed)
    place = 0
    for number, line in enumerate(left):
        if line == ANY:
            following = left[number + 1 :]
            if not following:
                return []
            while place < len(right) and not same(following[0], right[place]):
                place += 1
            continue
        if place >= len(right):
            return [f"shown:   {line}", "printed: nothing more"]
        if not same(line, right[place]):
            return [f"shown:   {line}", f"printed: {right[place]}"]
        place += 1
    return [f"printed, and not shown: {line}" for line in right[place:]]


def printed_as_shown(printed: Sequence[str]) -> list[str]:
    """Lines of a command as a document shows them, none left out but those of wall time."""
    return [MOMENT.sub("TIME", line.rstrip()) for line in printed if not WALL_TIME.match(line)]


def _plain(lines: Sequence[str]) -> list[str]:
    """Lines without ends of spaces, moments and wall times."""
    kept = [MOMENT.sub("TIME", line.rstrip()) for line in lines]
    return [line for line in kept if line and not WALL_TIME.match(line)]


def same(shown: str, printed: str) -> bool:
    """Whether a line of a document is a line that was printed."""
    wanted = [part for part in re.split(f"({re.escape(ANY)})", " ".join(shown.split())) if part]
    pattern, numbers = "", []
    for part in wanted:
        if part == ANY:
            pattern += ".*"
            continue
        before = 0
        for found in NUMBERS.finditer(part):
            pattern += re.escape(part[before : found.start()]) + f"({NUMBER})"
            numbers.append(found[0])
            before = found.end()
        pattern += re.escape(part[before:])
    match = re.fullmatch(pattern, " ".join(printed.split()))
    return match is not None and all(map(_close, numbers, match.groups()))


def _close(shown: str, printed: str) -> bool:
    """Whether a number agrees with one that is shown, to the digits shown."""
    wanted, got = Decimal(shown.replace("_", "")), Decimal(printed.replace("_", ""))
    exponent = wanted.as_tuple().exponent
    unit = Decimal(1).scaleb(exponent if isinstance(exponent, int) else 0)
    if "." not in shown and "e" not in shown.lower():
        return wanted == got  # a count
    return abs(wanted - got) <= unit
