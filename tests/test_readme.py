"""The README's promises that a machine can check."""

import re
from pathlib import Path

import pytest

from legbench.cli import COMMANDS

ROOT = Path(__file__).parent.parent
README = (ROOT / "README.md").read_text(encoding="utf-8")


def test_the_example_runs_as_it_stands(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (code,) = re.findall(r"```python\n(.*?)```", README, flags=re.DOTALL)
    (tmp_path / "models").symlink_to(ROOT / "models")
    monkeypatch.chdir(tmp_path)
    exec(code, {"__name__": "__main__"})
    ratings = [float(value) for value in capsys.readouterr().out.strip(" []\n").split(",")]
    assert ratings
    assert all(0.9 < value <= 1.0 for value in ratings)


def test_every_command_is_told() -> None:
    told = set(re.findall(r"^legbench ([a-z]+)", README, flags=re.MULTILINE))
    assert told == set(COMMANDS)


def test_every_linked_file_is_there() -> None:
    links = re.findall(r"\]\((?!http)([^)#]+)\)", README)
    missing = [link for link in links if not (ROOT / link).exists()]
    assert not missing


def test_every_room_is_in_the_picture() -> None:
    source = ROOT / "src" / "legbench"
    rooms = {path.name + "/" for path in source.iterdir() if (path / "__init__.py").exists()}
    rooms |= {path.name for path in source.glob("*.py")} - {"__init__.py", "__main__.py"}
    missing = [room for room in rooms if f"`{room}`" not in README]
    assert not missing
