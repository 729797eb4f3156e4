"""Flags made from dataclasses, one way for every command."""

from typing import TypeVar

import tyro

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
        SystemExit: help was asked for (0), or the flags make no sense (2).
    """
    return tyro.cli(
        kind, prog=f"legbench {command}", description=description, args=arguments, config=STYLE
    )
