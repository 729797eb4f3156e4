"""Reference pages of what the program itself says: commands, columns, phases, docstrings."""

import io
import os
from collections.abc import Callable, Iterable, Sequence
from contextlib import redirect_stdout
from typing import Any, Protocol

from docutils import nodes
from docutils.parsers.rst import Directive
from sphinx.ext.napoleon import Config, GoogleDocstring

from legbench.cli import COMMANDS, main
from legbench.control import CONTROLLERS
from legbench.recording.columns import Layout

WIDTH = "80"
"""Columns of the terminal that the texts of help are laid out for."""
RUNS = (("jump",), ("position-jump",), ("bang-bang",), ("jump", "--plant", "can"))
"""What `legbench run` is followed by, whose flags differ."""


class Application(Protocol):
    """The part of Sphinx that an extension is given."""

    config: Any

    def add_directive(self, name: str, directive: type[Directive]) -> None:
        """Make a directive known."""

    def connect(self, event: str, callback: Callable[..., None]) -> int:
        """Have a function called at an event."""


def help_of(words: Sequence[str]) -> str:
    """Text of `legbench ... --help`."""
    said = io.StringIO()
    os.environ["COLUMNS"] = WIDTH
    with redirect_stdout(said):
        try:
            main([*words, "--help"])
        except SystemExit as end:
            if end.code:
                raise
    return said.getvalue()


def actions() -> list[str]:
    """Actions of `legbench drives`, in the order of its help."""
    choices = help_of(["drives"]).partition("{")[2].partition("}")[0]
    return [each.strip() for each in choices.split(",")]


def section(title: str, *children: nodes.Node) -> nodes.section:
    """Return a section that can be linked to by its title."""
    made = nodes.section("", nodes.title("", title), *children, ids=[nodes.make_id(title)])
    made["names"] = [title]
    return made


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> nodes.table:
    """Return a table of plain text."""
    group = nodes.tgroup("", cols=len(head))
    group += [nodes.colspec("", colwidth=1) for _ in head]
    made = [nodes.row("", *(_cell(text) for text in row)) for row in (head, *rows)]
    group += nodes.thead("", made[0])
    group += nodes.tbody("", *made[1:])
    return nodes.table("", group)


def _cell(text: str) -> nodes.entry:
    return nodes.entry("", nodes.paragraph("", text))


class Commands(Directive):
    """Help of every command, each in a section of its own."""

    def run(self) -> list[Any]:
        """Sections of all commands."""
        return [self._command(name, text) for name, text in COMMANDS.items()]

    @staticmethod
    def _command(name: str, text: str) -> nodes.section:
        more: list[tuple[str, ...]] = []
        if name == "run":
            more = [(name, *words) for words in RUNS]
        elif name == "drives":
            more = [(name, action) for action in actions()]
        parts = [
            section(f"legbench {' '.join(words)}", nodes.literal_block("", help_of(words)))
            for words in more
        ]
        first = nodes.paragraph("", f"{text[0].upper()}{text[1:]}.")
        help_text = nodes.literal_block("", help_of([name]))
        return section(f"legbench {name}", first, help_text, *parts)


class Columns(Directive):
    """Table of the columns that every run has."""

    def run(self) -> list[Any]:
        """One table."""
        rows = [("t_ns", "ns", "plant time since the reset, rounded to the nanosecond")]
        rows += [
            (column.name, column.signal.unit, column.signal.doc) for column in Layout().columns
        ]
        return [table(("column", "unit", "what"), rows)]


class Phases(Directive):
    """Phases and own signals of the controllers that are built in."""

    def run(self) -> list[Any]:
        """One section a controller."""
        return [self._controller(name) for name in CONTROLLERS.builtin]

    @staticmethod
    def _controller(name: str) -> nodes.section:
        told = CONTROLLERS.find(name)().describe()
        phases = [
            (str(phase.code), phase.name, phase.role.value, f"{phase.late:g}", phase.doc)
            for phase in told.phases
        ]
        parts: list[nodes.Node] = [table(("code", "phase", "role", "late [s]", "what"), phases)]
        if told.signals:
            own = [(each.name, each.unit, each.doc) for each in told.signals]
            parts.append(table(("own signal", "unit", "what"), own))
        return section(name, *parts)


def read_docstring(
    app: Any, what: Any, name: str, thing: object, options: object, lines: list[str]
) -> None:
    """Turn a docstring of Google's style into what Sphinx reads.

    Sphinx's own reader takes a colon in the sentence under a field for the end of the field's type,
    so these sentences pass it by.
    """
    text = [line.replace("|", r"\|") for line in lines]
    if what != "attribute":
        text = GoogleDocstring(text, Config(), app, what, name, thing, options).lines()
    lines[:] = text


def setup(app: Application) -> dict[str, bool]:
    """Make the directives known to Sphinx."""
    app.add_directive("legbench-commands", Commands)
    app.add_directive("legbench-columns", Columns)
    app.add_directive("legbench-phases", Phases)
    app.connect("autodoc-process-docstring", read_docstring)
    return {"parallel_read_safe": True}
