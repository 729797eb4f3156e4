"""Every command that the documents show exists, is understood, and prints what is shown."""

from pathlib import Path

import pytest
from docs_blocks import (
    ROOT,
    CommandLine,
    NamedFile,
    Program,
    items,
    pages,
    spans,
)
from docs_parse import misunderstood, unknown_flags
from docs_run import lay, play, prepare

PAGES = pages()
SHOWN = [
    page
    for page in PAGES
    if any(isinstance(each, CommandLine) and each.prompted for each in items(page))
]
LONG = ("identify.md",)
"""Documents whose commands take seconds; those of all others are tried by `make test`."""


def named(page: Path) -> str:
    return str(page.relative_to(ROOT))


@pytest.mark.parametrize("page", PAGES, ids=named)
def test_the_parser_of_each_command_understands_it(page: Path, desk: Path) -> None:
    """Commands behind a `$` are not only parsed, but run, by the test below."""
    found = list(items(page))
    for each in found:
        if isinstance(each, NamedFile):
            lay(each, desk)
    wrong = {
        f"{each.place}: {' '.join(each.words)}": message
        for each in found
        if isinstance(each, CommandLine)
        and not each.prompted
        and (message := misunderstood(each.words, desk))
    }
    assert wrong == {}


@pytest.mark.parametrize("page", PAGES, ids=named)
def test_commands_within_sentences_have_the_flags_that_are_named(page: Path, desk: Path) -> None:
    wrong = {
        f"{place}: {' '.join(words)}": flags
        for place, words in spans(page)
        if (flags := unknown_flags(words, desk))
    }
    assert wrong == {}


@pytest.mark.parametrize(
    "page",
    [
        pytest.param(page, marks=[pytest.mark.long] if page.name in LONG else [], id=named(page))
        for page in SHOWN
    ],
)
def test_what_is_shown_is_what_is_printed(page: Path, tmp_path: Path) -> None:
    prepare(tmp_path)
    wrong = {
        f"{each.command.place}: {' '.join(each.command.words)}": each.problems
        for each in play(page, tmp_path, briefly=True)
        if each.problems
    }
    assert wrong == {}


def test_programs_are_python() -> None:
    for page in PAGES:
        for each in items(page):
            if isinstance(each, Program):
                compile(each.text, each.place, "exec")


def test_no_command_stands_outside_of_a_block() -> None:
    lines = [
        f"{named(page)}: {line}"
        for page in PAGES
        for line in page.read_text(encoding="utf-8").splitlines()
        if line.startswith(("    legbench ", "    $ legbench "))
    ]
    assert lines == []
