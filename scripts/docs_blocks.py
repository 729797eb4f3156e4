"""Reading the documents: their command lines, what these print, their files and programs.

One parser serves the tests and `docs_commands.py`. In a fenced block

- a line that begins with `$ ` is a command, and the lines below it, up to the next command, are
  what it prints;
- in a block without such a line, a line that begins with `legbench `, `make ` or `python ` is a
  command whose output is not shown;
- a line `name="words"` lets `$name` stand for these words in the lines below it;
- a block whose first line is a comment with nothing but a file's name (`# sine.py`) is that file;
- a block of Python without a name is a program.

A `#` between spaces begins a comment behind a command.
"""

import re
import shlex
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[1]
FENCE = re.compile(r"^(```+)\s*([\w{}-]*)")
FILE_NAME = re.compile(r"^# ([\w./-]+\.(?:py|toml))$")
FENCED = re.compile(r"^```.*?^```", re.MULTILINE | re.DOTALL)
VARIABLE = re.compile(r'^(\w+)="(.*)"$')
SPAN = re.compile(r"`(legbench [^`]+)`")
PROGRAMS = ("legbench", "make", "python")
"""First words of the command lines that are checked; others are the system's."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Block:
    """One fenced block of a document."""

    page: Path
    line: int
    """Number of its first line of text."""
    language: str
    lines: tuple[str, ...]

    @property
    def place(self) -> str:
        """Page and line, for messages."""
        return f"{self.page.relative_to(ROOT)}:{self.line}"


@dataclass(frozen=True, slots=True, kw_only=True)
class CommandLine:
    """One command line of a document."""

    place: str
    words: tuple[str, ...]
    prompted: bool
    """Whether it stands behind a `$`, so that it is run when its page is tried."""
    shown: tuple[str, ...] = ()
    """Lines that it prints, as the document shows them; none if it shows none."""


@dataclass(frozen=True, slots=True, kw_only=True)
class NamedFile:
    """File whose content a document gives."""

    place: str
    name: str
    text: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Program:
    """Lines of Python that stand for themselves."""

    place: str
    text: str


Item = CommandLine | NamedFile | Program


def pages() -> list[Path]:
    """Documents of the project that show commands."""
    found = [*ROOT.glob("hardware/*.md"), *ROOT.glob("docs/*.md"), *ROOT.glob("docs/*/*.md")]
    kept = [page for page in found if not page.relative_to(ROOT).parts[1].startswith("_")]
    return [ROOT / "README.md", *sorted(kept)]


def blocks(page: Path) -> Iterator[Block]:
    """Fenced blocks of a document, in their order."""
    fence, language, start = "", "", 0
    inside: list[str] = []
    for number, line in enumerate(page.read_text(encoding="utf-8").splitlines(), 1):
        opening = FENCE.match(line)
        if not fence and opening:
            fence, language, start, inside = opening[1], opening[2], number + 1, []
        elif fence and line.rstrip() == fence:
            yield Block(page=page, line=start, language=language, lines=tuple(inside))
            fence = ""
        elif fence:
            inside.append(line)
    if fence:
        raise ValueError(f"{page}: the block at line {start} has no end")


def items(page: Path) -> Iterator[Item]:
    """Commands, files and programs of a document, in their order."""
    for block in blocks(page):
        named = FILE_NAME.match(block.lines[0]) if block.lines else None
        if named:
            text = "\n".join(block.lines) + "\n"
            yield NamedFile(place=block.place, name=named[1], text=text)
        elif block.language == "python":
            yield Program(place=block.place, text="\n".join(block.lines) + "\n")
        elif any(line.startswith("$ ") for line in block.lines):
            yield from _prompted(block)
        elif not block.language.startswith("{"):
            yield from _listed(block)


def _prompted(block: Block) -> Iterator[CommandLine]:
    """Commands behind a `$`, each with what it prints."""
    starts = [place for place, line in enumerate(block.lines) if line.startswith("$ ")]
    for start, end in zip(starts, [*starts[1:], len(block.lines)], strict=True):
        shown = block.lines[start + 1 : end]
        while shown and not shown[-1].strip():
            shown = shown[:-1]
        yield CommandLine(
            place=f"{block.page.relative_to(ROOT)}:{block.line + start}",
            words=_words(block.lines[start][2:]),
            prompted=True,
            shown=shown,
        )


def _listed(block: Block) -> Iterator[CommandLine]:
    """Commands without a `$`."""
    variables: dict[str, str] = {}
    for number, line in enumerate(block.lines, block.line):
        line = re.sub(r"\$(\w+)", lambda name: variables.get(name[1], name[0]), line)
        if assigned := VARIABLE.match(line):
            variables[assigned[1]] = assigned[2]
        if line.split(" ")[0] in PROGRAMS:
            place = f"{block.page.relative_to(ROOT)}:{number}"
            yield CommandLine(place=place, words=_words(line), prompted=False)


def _words(line: str) -> tuple[str, ...]:
    command = re.split(r"\s+#\s", line)[0]
    return tuple(shlex.split(command))


def spans(page: Path) -> Iterator[tuple[str, Sequence[str]]]:
    """Commands named within a sentence, each with its place."""
    text = page.read_text(encoding="utf-8")
    prose = re.sub(
        r"^```.*?^```", lambda block: "\n" * block[0].count("\n"), text, flags=re.M | re.S
    )
    for found in SPAN.finditer(prose):
        line = prose.count("\n", 0, found.start()) + 1
        words = " ".join(found[1].split())
        yield f"{page.relative_to(ROOT)}:{line}", shlex.split(words)
