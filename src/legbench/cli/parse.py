"""Flags made from dataclasses, one way for every command."""

import os
from typing import TypeVar

import tyro

from legbench.errors import ConfigError

Arguments = TypeVar("Arguments")
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
        ConfigError: a word is empty, or no text.
        SystemExit: help was asked for (0), or the flags make no sense (2).
    """
    for before, word in zip(["", *arguments], arguments, strict=False):
        if not word or word.endswith("="):
            name = word.removesuffix("=") or before or "a word of the command line"
            raise ConfigError(f"{name} is empty; give it a value, or leave it out")
        if not word.isprintable() and any(0xDC80 <= ord(letter) <= 0xDCFF for letter in word):
            raise ConfigError(
                f"{os.fsencode(word)!r} is no UTF-8 text; rename the file or folder, since run "
                "folders and their descriptions are in UTF-8"
            )
    return tyro.cli(
        kind, prog=f"legbench {command}", description=description, args=arguments, config=STYLE
    )
