"""Flags made from dataclasses, one way for every command."""

import io
import os
import re
from contextlib import redirect_stderr
from typing import TypeVar, Union

import tyro

from legbench.cli.output import WRONG_USAGE, report_error
from legbench.errors import ConfigError

Arguments = TypeVar("Arguments")
T = TypeVar("T")
OrNone = Union[None, T]  # noqa: UP007 tyro loads a library of 60 ms to check a default of `T | None`
"""Type of a flag that may be left out, for commands that have to start fast."""
FRAME, RULE = " \u2502\u256d\u256e\u2570\u256f|+", "\u2500-"
"""Characters of the boxes in which tyro puts its errors, and of the rules within them."""
STYLE = (
    tyro.conf.OmitArgPrefixes,
    tyro.conf.OmitSubcommandPrefixes,
    tyro.conf.CascadeSubcommandArgs,
    tyro.conf.FlagCreatePairsOff,
    tyro.conf.EnumChoicesFromValues,
)


def parse(
    kind: type[Arguments], command: str, arguments: list[str], description: str | None = None
) -> Arguments:
    """Read a command's flags into its dataclass; `--help` comes from the docstrings.

    Raises:
        ConfigError: a word is empty, no text, or `-` where a file is to be named.
        SystemExit: help was asked for (0), or the flags make no sense (2).
    """
    for before, word in zip(["", *arguments], arguments, strict=False):
        if not word or word.endswith("="):
            name = word.removesuffix("=") or before or "a word of the command line"
            raise ConfigError(f"{name} is empty; give it a value, or leave it out")
        if word == "-":
            raise ConfigError(
                "- is no file, and stands for neither standard input nor output; name a file "
                "(./- for one that is called so)"
            )
        if not word.isprintable() and any(0xDC80 <= ord(letter) <= 0xDCFF for letter in word):
            raise ConfigError(
                f"{os.fsencode(word)!r} is no UTF-8 text; rename the file or folder, since run "
                "folders and their descriptions are in UTF-8"
            )
    told = io.StringIO()
    try:
        with redirect_stderr(told):
            return tyro.cli(
                kind,
                prog=f"legbench {command}",
                description=description,
                args=arguments,
                config=STYLE,
            )
    except SystemExit as end:
        if end.code == WRONG_USAGE:
            said = _in_a_line(told.getvalue())
            deeper = re.search(rf"legbench ({re.escape(command)} [\w-]+)", said)
            wrong_usage(deeper[1] if deeper else command, said)
        raise


def wrong_usage(command: str, message: str) -> int:
    """Say what makes no sense of a command's flags together; returns the exit status for it."""
    report_error(f"{message}; see legbench {command} --help")
    return WRONG_USAGE


def _in_a_line(box: str) -> str:
    """What a box of words says before its first rule, in one line.

    The box is drawn by lines, by plain ASCII, or by rules alone.
    """
    said: list[str] = []
    for framed in box.splitlines()[1:]:  # the first line is the title
        line = framed.strip(FRAME)
        if not line.strip(RULE) or line.startswith("Got errors"):
            if said:
                break
            continue
        said.append(line)
    return " ".join(" ".join(said).split()).rstrip(".:")
