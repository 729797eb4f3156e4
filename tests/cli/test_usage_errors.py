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
        ("drives jitter --speed 1", "; see legbench drives jitter --help"),
        ("drives zero", "Missing from legbench drives zero: --posture FLOAT FLOAT Angles"),
        ("drives zero", "(required); see legbench drives zero --help"),
        ("run jump --setup nowhere", "invalid choice 'nowhere' for argument '--setup'"),
        ("frob", "no command 'frob'; there are run, "),
        ("run nobody", "no controller 'nobody'; there are jump, "),
        ("run", "run what? jump, "),
        ("run jump --duration nan", "duration is nan s"),
        ("run jump --out=", "--out is empty"),
        ("run jump --set nonsense", "--set nonsense: write dotted.key=value"),
        ("run jump --limits nowhere.toml", "nowhere.toml"),
        ("check nowhere.toml", "nowhere.toml: no such design file"),
        ("export RUN --csv --out -", "- is no file"),
        ("model --out -", "- is no file"),
        ("render RUN --out -", "- is no file"),
        ("drives learn sheet.eds --out -", "- is no file"),
        ("replay -", "- is no file"),
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
