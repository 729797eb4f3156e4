"""Parsing the documents' commands by the commands' own parsers, without running them."""

import io
import re
import shutil
from collections.abc import Callable, Iterator, Sequence
from contextlib import chdir, contextmanager, redirect_stderr, redirect_stdout, suppress
from pathlib import Path
from typing import Any
from unittest.mock import patch

import tyro
from docs_blocks import ROOT

from legbench import Experiment, JumpConfig, load_design, run
from legbench.cli import COMMANDS, main
from legbench.cli.hop_arguments import HopArguments
from legbench.cli.hop_checks import check as check_hop

TARGET = re.compile(r"^([a-z][a-z-]*):", re.MULTILINE)
FLAG = re.compile(r"(?<![\w-])--[a-z][\w.-]*")
CHECKS: dict[type[Any], Callable[[Any], object]] = {HopArguments: check_hop}
"""Checks of a command's arguments beyond their types, which it makes before anything else."""


class UnderstoodError(Exception):
    """Stands for the end of a command whose words make sense."""


def lay_out(folder: Path) -> None:
    """Put the files that documents speak of into a folder in which commands are parsed.

    Args:
        folder: prepared folder, see `docs_run.prepare`.
    """
    guests = ROOT / "tests"
    for source, place in (
        (guests / "control" / "guests" / "sine.py", "mine.py"),
        (guests / "control" / "guests" / "sine.py", "path/to/sine.py"),
        (guests / "plant" / "guests" / "still.py", "path/to/still.py"),
        (ROOT / "models" / "prototype.toml", "FILE"),
    ):
        (folder / place).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(source, folder / place)
    table = (ROOT / "docs" / "experiments.md").read_text(encoding="utf-8")
    found = re.search(r"^```toml\n(.*?)^```", table, re.MULTILINE | re.DOTALL)
    assert found is not None
    for name in ("swing.toml", "next.toml"):
        (folder / name).write_text(found[1].replace('"../', '"'), encoding="utf-8")
    leg = load_design(ROOT / "models" / "prototype.toml")
    short = Experiment(design=leg, controller=JumpConfig(), duration=1.7)
    recorded = run(short, folder / "recorded").path
    for name in ("RUN", "OTHER"):
        shutil.copytree(recorded, folder / name)


@contextmanager
def _parsing_alone() -> Iterator[None]:
    """Within it, a command ends as soon as its words are understood."""
    parse = tyro.cli

    def understand(kind: Any, **settings: Any) -> Any:
        arguments = parse(kind, **settings)
        CHECKS.get(type(arguments), lambda _: None)(arguments)
        raise UnderstoodError

    with patch.object(tyro, "cli", understand):
        yield


def misunderstood(words: Sequence[str], folder: Path) -> str | None:
    """Message of a command line that its parser refuses, None if it is understood.

    Args:
        words: the command line.
        folder: present folder, with the files that it names.
    """
    program, *rest = words
    if program == "make":
        targets = TARGET.findall((ROOT / "Makefile").read_text(encoding="utf-8"))
        unknown = [word for word in rest if "=" not in word and word not in targets]
        return f"make has no {unknown}" if unknown else None
    if program == "python":
        return None if (ROOT / rest[0]).is_file() or "*" in rest[0] else f"there is no {rest[0]}"
    said = io.StringIO()
    with chdir(folder), redirect_stdout(said), redirect_stderr(said), _parsing_alone():
        try:
            status = main(rest)
        except UnderstoodError:
            return None
        except SystemExit as end:
            status = end.code
    return said.getvalue() if status or "--help" not in rest else None


def unknown_flags(words: Sequence[str], folder: Path) -> list[str]:
    """Flags in a command named within a sentence that the command does not have, or its name.

    Args:
        words: `legbench ...`, which may be incomplete.
        folder: present folder.
    """
    _, command, *rest = (*words, "")
    if command.startswith("-") or not command or command == "COMMAND":
        return []
    if command not in COMMANDS:
        return [command]
    action = [word for word in rest[:1] if command == "drives" and word.islower()]
    subject = ["jump"] if command == "run" else []
    plant = ["--plant", "can"] if command == "run" else []
    said = io.StringIO()
    with chdir(folder), redirect_stdout(said), redirect_stderr(said), suppress(SystemExit):
        main([command, *subject, *action, *plant, "--help"])
    if action and f"{command} {action[0]} " not in said.getvalue().splitlines()[0]:
        return action
    known = set(FLAG.findall(said.getvalue()))
    return [flag for word in rest for flag in FLAG.findall(word) if flag not in known]
