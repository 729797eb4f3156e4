from pathlib import Path

import pytest

from legbench.design import load_design
from legbench.errors import ConfigError
from legbench.paper import COLUMNS, Relation, published

MODELS = Path(__file__).parents[1] / "models"
ROW = "rating,0.9,1,>,ffs,bang-bang,1.0,0.1,a rating,VI,Fig. 5,more than 0.9"


def test_the_prototype_is_the_leg_of_table_3() -> None:
    numbers, leg = published(), load_design(MODELS / "prototype.toml")
    for name in ("thigh", "shank", "foot"):
        segment = getattr(leg, name)
        assert segment.mass == pytest.approx(numbers[f"{name}_mass"].value, rel=1e-12)
        assert segment.inertia == pytest.approx(numbers[f"{name}_inertia"].value, rel=1e-12)
    for name in ("stiffness", "damping"):
        pair = [numbers[f"{name}_{joint}"].value for joint in (1, 2)]
        assert getattr(leg, name) == pytest.approx(pair, rel=1e-12)
    assert leg.total_mass == pytest.approx(numbers["system_mass"].value, rel=1e-12)


def test_numbers_that_say_the_same_twice_agree() -> None:
    numbers = published()
    start, end = numbers["step_from"], numbers["step_to"]
    assert end.value == end.z2
    assert start.z2 is not None
    assert start.dz2 is not None
    assert start.value == pytest.approx(start.z2 + start.dz2)
    assert numbers["bang_bang_middle"].value == numbers["bang_bang_rating"].z2
    assert numbers["bang_bang_amplitude"].value == numbers["bang_bang_rating"].dz2


def test_every_number_says_where_it_stands() -> None:
    numbers = published()
    assert {number.section for number in numbers.values()} == {"V", "VI-B", "VI-C"}
    assert numbers["step_rating_6"].place == "section VI-B, Fig. 4"
    assert numbers["control_rate"].place == "section V"
    assert numbers["jump_rating_flight"].comparison is Relation.MORE


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        ([ROW, ROW], "line 3: rating is there twice"),
        ([ROW.replace("0.9,1", "nine,1")], "line 2: could not convert string to float: 'nine'"),
        ([ROW.replace("0.9,1", "nan,1")], "line 2: rating is nan; a published number is finite"),
        ([ROW.replace(">", "~")], "line 2: comparison is '~'; choose from =, >, <, about"),
        ([ROW.replace("ffs", "fts")], "line 2: setup is 'fts'; choose from hfts, vfts, ffs, jump"),
        ([ROW + ",more"], "line 2: 13 cells; there are 12 columns"),
        ([ROW.replace("a rating", "")], "line 2: rating needs a key, what it is"),
    ],
)
def test_a_wrong_line_is_told(tmp_path: Path, rows: list[str], message: str) -> None:
    file = tmp_path / "numbers.csv"
    file.write_text("\n".join([",".join(COLUMNS), *rows]))
    with pytest.raises(ConfigError, match=message) as caught:
        published(file)
    assert str(caught.value).startswith(f"{file}, ")


def test_files_that_hold_no_numbers_are_refused(tmp_path: Path) -> None:
    file = tmp_path / "numbers.csv"
    with pytest.raises(ConfigError, match="no such file of published numbers"):
        published(file)
    with pytest.raises(ConfigError, match="no published numbers can be read"):
        published(tmp_path)
    file.write_text("key,value\n")
    with pytest.raises(ConfigError, match="line 1: the columns must be key,value,unit"):
        published(file)
