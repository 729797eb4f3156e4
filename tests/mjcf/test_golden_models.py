from pathlib import Path

import pytest

from legbench.design import load_design
from legbench.mjcf import BuildOptions, build_spec, to_xml, xml_hash

MODELS = Path(__file__).parents[2] / "models"
DESIGNS = sorted(MODELS.glob("*.toml"))


def test_the_legs_of_the_paper_are_there() -> None:
    assert {path.stem for path in DESIGNS} >= {"optimal", "prototype", "table2"}


@pytest.mark.parametrize("path", DESIGNS, ids=lambda path: path.stem)
def test_the_reviewed_file_is_what_the_generator_writes(path: Path) -> None:
    golden = path.with_suffix(".xml")
    assert golden.is_file(), f"{golden.name} is missing: make models"
    written = to_xml(build_spec(load_design(path), BuildOptions()))
    kept = golden.read_text(encoding="utf-8")
    if written != kept:
        differing = [
            f"{number}: {old!r} -> {new!r}"
            for number, (old, new) in enumerate(
                zip(kept.splitlines(), written.splitlines(), strict=False), start=1
            )
            if old != new
        ]
        pytest.fail(f"{golden.name} is not what the generator writes: make models\n{differing[:5]}")


def test_the_hash_is_of_the_text() -> None:
    assert xml_hash("abc") != xml_hash("abc ")
    assert xml_hash("") == "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855"
