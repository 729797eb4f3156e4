"""Wrong usage: one line in one form, status 2, whatever the command."""

import pytest

from legbench.cli import main


@pytest.mark.parametrize(
    ("words", "told"),
    [
        ("run jump --nonsense 3", "Unrecognized options: --nonsense, 3; see legbench run jump"),
        ("replay", "Missing from legbench replay: PATH Run folder"),
        ("check a b", "Unrecognized options: b; see legbench check --help"),
        ("design --evaluations abc", "Error parsing --evaluations"),
        ("drives frob", "Unrecognized options: frob; see legbench drives --help"),
        ("run jump --setup nowhere", "invalid choice 'nowhere' for argument '--setup'"),
        ("frob", "no command 'frob'; there are run, "),
        ("run nobody", "no controller 'nobody'; there are jump, "),
    ],
)
def test_wrong_usage_is_a_line(words: str, told: str, capsys: pytest.CaptureFixture[str]) -> None:
    try:
        status = main(words.split())
    except SystemExit as end:
        status = end.code
    printed = capsys.readouterr()
    assert (status, printed.out) == (2, "")
    assert printed.err.startswith("legbench: ")
    assert printed.err.count("\n") == 1
    assert told in printed.err
