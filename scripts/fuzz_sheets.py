"""Mutate data sheets and read them: a proposal, or one line of refusal, in bounded time and memory.

python scripts/fuzz_sheets.py --mutations 2000

The sheets begin as that of the emulated drive, and as any others that are named. A mutation flips,
cuts, doubles, swaps or inserts bytes, lines and numbers. Nothing may be raised but what the command
line turns into one line, and no line may have a line break.
"""

import argparse
import random
import resource
import sys
import time
from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path

from legbench.drives.setup.bus_file import bus_from_mapping
from legbench.drives.setup.eds import eds_text
from legbench.drives.sheet.assess import assess
from legbench.drives.sheet.bus_text import bus_text
from legbench.drives.sheet.load import sheet_of
from legbench.drives.sheet.propose import propose
from legbench.errors import ConfigError, LegbenchError
from legbench.reading import UnreadableError, parse_toml

NUMBERS = (
    b"0",
    b"-1",
    b"0xFFFFFFFFFFFFFFFFFFFF",
    b"$NODEID",
    b"1e309",
    b"0x",
    b"",
    b"255",
    b"9" * 60,
)
WORDS = (b"[", b"]", b"=", b";", b"\0", b"\xff\xfe", b"\r", b"\n", b"%(x)s", b"CompactSubObj=254\n")
WORDS += (b"[1018]\n", b"[A0]\nDataType=0xA0\n", b"SubNumber=99999999\n", b"AccessType=\n")
Mutation = Callable[[bytes, random.Random], bytes]


def _flip(text: bytes, chance: random.Random) -> bytes:
    changed = bytearray(text)
    for _ in range(chance.choice((1, 3, 30))):
        changed[chance.randrange(len(changed))] = chance.randrange(256)
    return bytes(changed)


def _cut(text: bytes, chance: random.Random) -> bytes:
    first, last = sorted(chance.randrange(len(text)) for _ in range(2))
    return text[:first] + text[last:] if chance.random() < 0.5 else text[:last]


def _insert(text: bytes, chance: random.Random) -> bytes:
    at = chance.randrange(len(text))
    return text[:at] + chance.choice(WORDS) * chance.choice((1, 1, 7)) + text[at:]


def _lines(text: bytes, chance: random.Random) -> bytes:
    lines = text.split(b"\n")
    for _ in range(chance.choice((1, 5, 50))):
        first, second = chance.randrange(len(lines)), chance.randrange(len(lines))
        act = chance.randrange(3)
        if act == 0:
            lines[first], lines[second] = lines[second], lines[first]
        elif act == 1:
            lines.insert(first, lines[second])
        elif len(lines) > 1:
            del lines[first]
    return b"\n".join(lines)


def _number(text: bytes, chance: random.Random) -> bytes:
    lines = text.split(b"\n")
    for _ in range(chance.choice((1, 4, 20))):
        place = chance.randrange(len(lines))
        key, mark, _ = lines[place].partition(b"=")
        if mark:
            lines[place] = key + mark + chance.choice(NUMBERS)
    return b"\n".join(lines)


MUTATIONS: tuple[Mutation, ...] = (_flip, _cut, _insert, _lines, _number)


def mutated(text: bytes, chance: random.Random) -> bytes:
    """A data sheet with one to three mutations."""
    for _ in range(chance.randint(1, 3)):
        text = chance.choice(MUTATIONS)(text, chance) or b"["
    return text


def learned(text: bytes) -> str:
    """How a data sheet is learned: `proposed`, `cannot be used`, or the refusal."""
    try:
        sheet = sheet_of(text, "sheet.eds")
        proposed = bus_text(propose(sheet, "sheet.eds"), (1, 2))
        config = bus_from_mapping(parse_toml(proposed.encode()))
        found = [assess(sheet, config, node).problems for node in config.nodes]
    except (UnreadableError, ConfigError) as error:
        if "\n" in str(error) or len(str(error)) > 500:
            raise AssertionError(f"no short line: {error!r}") from error
        return "refused"
    return "cannot be used" if any(found) else "proposed"


def main(arguments: Sequence[str] | None = None) -> int:
    """Mutate and count; 1 if something else than a refusal was raised."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--mutations", type=int, default=2000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("sheets", type=Path, nargs="*", help="other data sheets to begin with")
    chosen = parser.parse_args(arguments)
    texts = [eds_text().encode(), *(path.read_bytes() for path in chosen.sheets)]
    chance, counts, slowest = random.Random(chosen.seed), Counter[str](), 0.0
    for number in range(chosen.mutations):
        text = mutated(chance.choice(texts), chance)
        began = time.process_time()
        try:
            counts[learned(text)] += 1
        except Exception as error:
            known = isinstance(error, LegbenchError)
            print(f"mutation {number}: {type(error).__name__}: {error}; known: {known}")
            return 1
        slowest = max(slowest, time.process_time() - began)
    memory_mib = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    told = ", ".join(f"{word} {count}" for word, count in sorted(counts.items()))
    print(f"{chosen.mutations} mutations: {told}; at most {slowest:.2f} s and {memory_mib:.0f} MiB")
    return 0


if __name__ == "__main__":
    sys.exit(main())
