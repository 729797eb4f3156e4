"""Bad input over all commands: one clear line each, the right status, and nothing written."""

from pathlib import Path

import pytest
from bad_inputs import VALUES
from commands import MODELS, called

from legbench.cli import COMMANDS, main

FILES = """
run X
run jump --design X
run jump --limits X
run jump --plant can --interface legbench --bus X
run --again X
replay X
replay RUN --against X
replay RUN --resimulate commands --design X
replay LOG --bus X
recover X
render X
model --design X
design --requirements X
design --tolerances X
design --measured X
check X
check optimal --no-model --target X
check optimal --no-model --tolerances X
modes X
hop X
explain --against X
explain --design X
report X
campaign X
campaign GOOD --plant can --bus X
compare RUN X
export X --csv
identify X
identify RUN --design X
drives budget --bus X
drives budget --limits X
drives scan --interface legbench --bus X
drives status --interface legbench --bus X
drives configure --interface legbench --bus X
drives zero --interface legbench --posture 0 0 --bus X
drives home --interface legbench --node motor1 --method 37 --bus X
drives jog --interface legbench --node motor1 --bus X
drives jog --interface legbench --node motor1 --limits X
drives reset --interface legbench --bus X
drives store --interface legbench --bus X
drives node-id --interface legbench --to 3 --bus X
drives jitter --interface legbench --bus X
drives monitor --interface legbench --bus X
drives emulate --channel x.sock --bus X
drives emulate --channel x.sock --eds X
drives learn --out new.toml X
drives check --bus X
drives check --eds X
"""
"""A line a file that a command reads, X; RUN, LOG and GOOD are a run, a bus log and a campaign."""
GOOD = f"""
format = 1
name = "good"
base.design = "{MODELS / "prototype.toml"}"

[[cells]]
name = "step, fixed trunk"
set."controller.kind" = "position-jump"
set.duration = 0.5
"""
KINDS = {
    "missing": None,
    "folder": None,
    "empty": b"",
    "torn": b"[thigh\n",
    "image": b"\x89PNG\r\n\x1a\n\x00\xff\xfe",
    "other": b'[project]\nname = "x"\n',
}
"""Kinds of a wrong file, and what they hold."""
LINES: list[str] = [line for line in FILES.splitlines() if line]
ROWS = [line.rsplit(" | ", 2) for line in VALUES.splitlines() if line]


@pytest.fixture(scope="module")
def places(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """A short run and its log, a campaign, and one wrong file of each kind."""
    folder = tmp_path_factory.mktemp("places")
    for name, content in KINDS.items():
        if content is not None:
            (folder / f"{name}.toml").write_bytes(content)
    (folder / "folder.toml").mkdir()
    (folder / "bus.log").write_text("(0.000000) leg 080#\n", encoding="utf-8")
    assert main(["run", "jump", "--duration", "0.05", "--out", str(folder / "runs")]) == 0
    (run,) = (folder / "runs").iterdir()
    good = folder / "good.toml"
    good.write_text(GOOD, encoding="utf-8")
    return {"RUN": run, "RUNS": run.parent, "LOG": folder / "bus.log", "GOOD": good, "X": folder}


def refused(
    words: list[str], capfd: pytest.CaptureFixture[str], folder: Path, status: int | None = None
) -> str:
    """The one line that a command says; it leaves nothing where it was called."""
    done = called(capfd, *words)
    assert done.status in (1, 2) if status is None else done.status == status, done.err
    assert done.out == ""
    assert done.err.startswith("legbench: "), done.err
    assert done.err.count("\n") == 1, done.err
    assert list(folder.iterdir()) == []
    return done.err


@pytest.fixture(autouse=True)
def empty_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Folder in which commands are called."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("turn", [0, pytest.param(1, marks=pytest.mark.long)])
@pytest.mark.parametrize("line", LINES)
def test_a_wrong_file_is_named(
    line: str,
    turn: int,
    places: dict[str, Path],
    empty_folder: Path,
    capfd: pytest.CaptureFixture[str],
) -> None:
    """Every other kind, beginning with another one from line to line; the rest takes its turn."""
    for kind in list(KINDS)[(LINES.index(line) + turn) % 2 :: 2]:
        path = places["X"] / f"{kind}.toml"
        words = [str(path if word == "X" else places.get(word, word)) for word in line.split()]
        assert path.name in refused(words, capfd, empty_folder), kind


@pytest.mark.parametrize(("line", "status", "told"), ROWS, ids=[row[0] for row in ROWS])
def test_a_wrong_value_is_told_with_its_limit(
    line: str,
    status: str,
    told: str,
    places: dict[str, Path],
    empty_folder: Path,
    capfd: pytest.CaptureFixture[str],
) -> None:
    words = [str(places.get(word, word)) for word in line.split()]
    assert told in refused(words, capfd, empty_folder, int(status))


def test_the_table_holds_every_command() -> None:
    # The folder of `runs` may hold anything, or nothing.
    assert {line.split()[0] for line in LINES} | {"runs"} == set(COMMANDS)
    assert {line.split()[0] for line, _, _ in ROWS} == set(COMMANDS)
    assert len(KINDS) * len(LINES) + len(ROWS) >= 400
