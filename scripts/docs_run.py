"""Running a document's commands in a folder of their own, one after another."""

import io
import os
import runpy
import shutil
import sys
from collections.abc import Iterator, Sequence
from contextlib import chdir, redirect_stderr, redirect_stdout
from dataclasses import dataclass
from datetime import datetime, timedelta
from functools import partial
from pathlib import Path
from unittest.mock import patch

from docs_blocks import ROOT, CommandLine, NamedFile, items
from docs_compare import differences

from legbench.cli import main
from legbench.recording import writer
from legbench.recording.layout import run_name

BENCH = ROOT / "hardware" / "bring-up.md"
"""Document whose commands are those of the bench; they are run on the emulated leg."""
EMULATED = ("--interface", "legbench")
OFFLINE = ("budget", "check", "emulate", "learn")
"""Actions of `legbench drives` that open no bus."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Tried:
    """One command as it was run."""

    command: CommandLine
    status: int
    printed: tuple[str, ...]

    @property
    def problems(self) -> list[str]:
        """Lines that differ from those that its document shows."""
        return differences(self.command.shown, self.printed) if self.command.shown else []


def prepare(folder: Path) -> None:
    """Lay out what a reader has: a checkout's designs and bench files, and the guest's data sheet.

    Args:
        folder: empty folder in which commands are to be run.
    """
    sys.path.append(str(ROOT / "tests" / "drives"))
    from eds_texts import fremd_7  # noqa: PLC0415

    for name in ("models", "hardware"):
        shutil.copytree(ROOT / name, folder / name)
    (folder / "scripts").symlink_to(ROOT / "scripts")
    (folder / "fremd7.eds").write_text(fremd_7().text(), encoding="utf-8")


def play(page: Path, folder: Path, *, briefly: bool = False) -> Iterator[Tried]:
    """Run the commands of a document that stand behind a `$`, and lay its files in place.

    Args:
        page: the document.
        folder: prepared folder.
        briefly: whether runs on the emulated leg end at their last row, which prints the same.
    """
    for number, item in enumerate(items(page)):
        if isinstance(item, NamedFile):
            lay(item, folder)
        elif isinstance(item, CommandLine) and item.prompted:
            words = on_emulated_leg(item.words) if page == BENCH else list(item.words)
            if briefly and EMULATED[0] in words and words[1] == "run":
                words += ["--end", "stop"]
            with patch.object(writer, "run_name", partial(_named_later, timedelta(seconds=number))):
                status, printed = call(words, folder)
            yield Tried(command=item, status=status, printed=tuple(printed))


def _named_later(late: timedelta, start: datetime, hint: str | None = None) -> str:
    """Name of a run as if it had begun later: a reader does not start two within a second."""
    return run_name(start + late, hint)


def lay(file: NamedFile, folder: Path) -> None:
    """Write a file that a document gives."""
    path = folder / file.name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(file.text, encoding="utf-8")


def on_emulated_leg(words: Sequence[str]) -> list[str]:
    """Words of a command for the bench, with the emulated leg in its place."""
    command, action = (*words, "", "")[1:3]
    opens = command == "drives" and action not in OFFLINE
    opens |= command == "run" and "can" in words and "--plant" in words
    return [*words, *(EMULATED if opens and "--interface" not in words else ())]


def call(words: Sequence[str], folder: Path) -> tuple[int, list[str]]:
    """Run one command line in this process: its exit status, and the lines of both its streams.

    Args:
        words: `legbench ...` or `python FILE`; a `*` stands for what the folder holds.
        folder: present folder of the command.

    Raises:
        ValueError: it is another program.
    """
    said = io.StringIO()
    with chdir(folder), redirect_stdout(said), redirect_stderr(said):
        program, *rest = [found for word in words for found in _expanded(word)]
        if program == "legbench":
            status = _status_of(rest)
        elif program == "python" and len(rest) == 1:
            runpy.run_path(rest[0], run_name="__main__")
            status = 0
        else:
            raise ValueError(f"{words[0]}: only legbench and python FILE are run")
    return status, said.getvalue().splitlines()


def _status_of(words: list[str]) -> int:
    try:
        return main(words)
    except SystemExit as end:
        return end.code if isinstance(end.code, int) else 1


def _expanded(word: str) -> list[str]:
    """Files that a word with a `*` stands for, in their order; any other word is itself."""
    if "*" not in word or os.sep not in word:
        return [word]
    found = sorted(str(path) for path in Path().glob(word))
    if not found:
        raise ValueError(f"{word}: there is no such file")
    return found
