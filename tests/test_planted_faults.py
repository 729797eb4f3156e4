"""The list of planted faults without effect speaks of the code as it is."""

import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[1]
LIST = ROOT / "scripts" / "mutants" / "equivalent.toml"


def test_every_fault_without_effect_names_a_line_of_its_file() -> None:
    entries = tomllib.loads(LIST.read_text(encoding="utf-8"))["equivalent"]
    lines: dict[str, set[str]] = {}
    gone: list[str] = []
    for entry in entries:
        file = entry["file"]
        if file not in lines:
            text = (ROOT / "src" / "legbench" / file).read_text(encoding="utf-8")
            lines[file] = {" ".join(line.split()) for line in text.splitlines()}
        if entry["before"] not in lines[file]:
            gone.append(f"{file}: {entry['before']}")
    assert entries
    assert gone == []
