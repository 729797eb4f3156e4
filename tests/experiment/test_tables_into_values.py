"""Tables into dataclasses and single entries replaced: what is built, and what is told when not."""

from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from types import MappingProxyType
from typing import Any, ClassVar, Literal

import pytest

from legbench.errors import ConfigError
from legbench.experiment.overrides import overlaid, parse_setting
from legbench.experiment.reading import Reader, Special, placed, tagged


class Colour(StrEnum):
    RED = "red"
    GREEN = "green"


@dataclass(frozen=True, kw_only=True)
class Inner:
    size: float = 1.0
    count: int = 2

    def __post_init__(self) -> None:
        if self.size <= 0.0:
            raise ConfigError(f"size is {self.size:g}; it must be positive")


@dataclass(frozen=True, kw_only=True)
class Drop:
    kind: ClassVar[str] = "drop"
    share: float = 0.5


@dataclass(frozen=True, kw_only=True)
class Delay:
    kind: ClassVar[str] = "delay"
    cycles: int = 1


@dataclass(frozen=True, kw_only=True)
class Outer:
    inner: Inner = Inner()
    colour: Colour = Colour.RED
    word: Literal["one", "two"] = "one"
    pair: tuple[float, float] = (0.0, 1.0)
    many: tuple[int, ...] = ()
    data: bytes = b""
    place: Path = Path("here")
    on: bool = False
    fault: Drop | Delay | None = None
    wanted: float


FOLDER = Path("/folder")


def built(tables: dict[str, Any], *, json: bool = False) -> Any:
    reader = Reader(folder=FOLDER, specials=MappingProxyType({}), json=json)
    return reader.read(Outer, tables)


def test_every_kind_of_field_is_built() -> None:
    tables = {
        "inner": {"size": 3, "count": 4},
        "colour": "green",
        "word": "two",
        "pair": [1, 2.5],
        "many": [3, 1, 2],
        "data": "00ff",
        "place": "a/b",
        "on": True,
        "fault": {"kind": "delay", "cycles": 7},
        "wanted": -1,
    }
    assert built(tables) == Outer(
        inner=Inner(size=3.0, count=4),
        colour=Colour.GREEN,
        word="two",
        pair=(1.0, 2.5),
        many=(3, 1, 2),
        data=b"\x00\xff",
        place=FOLDER / "a/b",
        on=True,
        fault=Delay(cycles=7),
        wanted=-1.0,
    )
    assert type(built(tables).inner.size) is float


REFUSALS: list[tuple[dict[str, Any], str]] = [
    ({}, "wanted: is missing"),
    ({"wanted": True}, "wanted: is True; it must be a number"),
    ({"wanted": "0.3"}, "wanted: is '0.3'; it must be a number"),
    ({"wanted": 10**400}, "wanted: is too large for a number"),
    ({"wanted": 0.0, "inner": 3}, "inner: is 3; it must be a table"),
    ({"wanted": 0.0, "inner": {"size": -1.0}}, "inner: size is -1; it must be positive"),
    ({"wanted": 0.0, "inner": {"count": 1.0}}, "inner.count: is 1.0; it must be a whole number"),
    ({"wanted": 0.0, "inner": {"count": True}}, "inner.count: is True; it must be a whole number"),
    ({"wanted": 0.0, "colour": "blue"}, "colour: is 'blue'; known are red, green"),
    ({"wanted": 0.0, "word": 1}, "word: is 1; known are one, two"),
    ({"wanted": 0.0, "pair": [1.0]}, "pair: has 1 entries; it must have 2"),
    ({"wanted": 0.0, "pair": 1.0}, "pair: is 1.0; it must be a list"),
    ({"wanted": 0.0, "many": [1, "2"]}, "many.1: is '2'; it must be a whole number"),
    ({"wanted": 0.0, "data": "0g"}, "data: is '0g'; it must be bytes in hexadecimal"),
    ({"wanted": 0.0, "place": 3}, "place: is 3; it must be a text"),
    ({"wanted": 0.0, "on": 1}, "on: is 1; true or false?"),
    ({"wanted": 0.0, "fault": 3}, "fault.kind: is 3; known are drop, delay"),
    ({"wanted": 0.0, "fault": {"cycles": 1}}, "fault.kind: is None; known are drop, delay"),
    (
        {"wanted": 0.0, "fault": {"kind": "drop", "cycles": 1}},
        "fault.cycles: unknown key; known are share",
    ),
    (
        {"wanted": 0.0, "inner": {"sise": 1.0}},
        "inner.sise: unknown key; did you mean 'size'? known are size, count",
    ),
]


@pytest.mark.parametrize(("tables", "told"), REFUSALS)
def test_what_is_wrong_is_told_with_its_key(tables: dict[str, Any], told: str) -> None:
    with pytest.raises(ConfigError) as caught:
        built(tables)
    assert str(caught.value) == told


def test_all_mistakes_are_told_at_once() -> None:
    with pytest.raises(ConfigError) as caught:
        built({"colour": 1, "inner": {"size": "x", "y": 0}})
    parts = str(caught.value).split("; ")
    assert [part.split(":")[0] for part in parts if ": " in part] == [
        "inner.y",
        "inner.size",
        "colour",
        "wanted",
    ]


def test_floats_that_json_spells_out_are_read_from_json_alone() -> None:
    assert built({"wanted": "inf"}, json=True).wanted == float("inf")
    with pytest.raises(ConfigError, match="wanted: is 'inf'; it must be a number"):
        built({"wanted": "inf"})


def test_a_value_may_be_a_file_or_have_words_of_its_own() -> None:
    special = Special(
        load=lambda path: Inner(size=float(len(path.name))),
        decode=lambda raw: Inner(size=raw["wide"], count=int(raw["deep"]["many"])),
        structure={"wide": 1.0, "deep": {"many": 2}},
    )
    specials = MappingProxyType({Inner: special})

    def read(raw: object) -> Any:
        reader = Reader(folder=FOLDER, specials=specials)
        return reader.read(Outer, {"wanted": 0.0, "inner": raw}).inner

    assert read("abc.toml") == Inner(size=8.0)
    assert read({"wide": 2.0, "deep": {"many": 3}}) == Inner(size=2.0, count=3)
    for raw, told in (
        ({"wyde": 2.0}, r"inner\.wyde: unknown key; did you mean 'wide'"),
        ({"deep": {"mny": 3}}, r"inner\.deep\.mny: unknown key; did you mean 'many'"),
        (3, "inner: is 3; it must be a table or the path of a file"),
        ({"wide": -2.0, "deep": {"many": 3}}, "inner: size is -2; it must be positive"),
    ):
        with pytest.raises(ConfigError, match=told):
            read(raw)


def test_a_union_needs_something_that_tells_its_members_apart() -> None:
    assert tagged((Drop, Delay)) == ("kind", {"drop": Drop, "delay": Delay})
    with pytest.raises(TypeError, match="nothing tells"):
        tagged((Inner, Outer))


@pytest.mark.parametrize(
    ("name", "found"),
    [
        ("jump", "jump"),
        ("pkg.module:Class", "pkg.module:Class"),
        ("mine.py:Sine", "/folder/mine.py:Sine"),
        ("deep/mine.py", "/folder/deep/mine.py"),
    ],
)
def test_a_guest_in_a_file_is_found_beside_the_file_that_names_it(name: str, found: str) -> None:
    assert placed(name, FOLDER) == found


SETTINGS: list[tuple[str, tuple[str, Any]]] = [
    ("a.b=1", ("a.b", 1)),
    ("a = 1.5e-3", ("a", 1.5e-3)),
    ("a=true", ("a", True)),
    ("a=[1, 2.5]", ("a", [1, 2.5])),
    ('a="x=y"', ("a", "x=y")),
    ("a={b = 1}", ("a", {"b": 1})),
    ("kind=mine.py:Sine", ("kind", "mine.py:Sine")),
]


@pytest.mark.parametrize(("text", "found"), SETTINGS)
def test_a_setting_is_a_key_and_a_toml_value_or_a_word(text: str, found: tuple[str, Any]) -> None:
    assert parse_setting(text) == found


@pytest.mark.parametrize("text", ["", "a", "=1", "a=", "a=[1", "a=1 2", "a=two words", 'a="x'])
def test_anything_else_is_no_setting(text: str) -> None:
    with pytest.raises(ConfigError, match=r"^--set "):
        parse_setting(text)


def test_one_entry_is_replaced_and_the_tables_given_stay(tmp_path: Path) -> None:
    tables: dict[str, Any] = {"a": {"b": {"c": 1, "d": 2}}, "e": 3}
    assert overlaid(tables, "a.b.c", 9, tmp_path) == {"a": {"b": {"c": 9, "d": 2}}, "e": 3}
    assert overlaid(tables, "x.y", 9, tmp_path) == {**tables, "x": {"y": 9}}
    assert overlaid(tables, "a.b.d", None, tmp_path) == {"a": {"b": {"c": 1}}, "e": 3}
    assert tables == {"a": {"b": {"c": 1, "d": 2}}, "e": 3}
    with pytest.raises(ConfigError, match=r"'e' is 3, no table; 'e\.f' leads nowhere"):
        overlaid(tables, "e.f", 1, tmp_path)


def test_a_new_kind_replaces_its_table_and_the_same_kind_does_not() -> None:
    tables = {"controller": {"kind": "jump", "settings": {"z2": 1.0}}}
    same = overlaid(tables, "controller.kind", "jump", FOLDER)
    other = overlaid(tables, "controller.kind", "bang-bang", FOLDER)
    assert same == tables
    assert other == {"controller": {"kind": "bang-bang"}}


def test_an_entry_of_a_file_that_stands_for_a_table_is_replaced(tmp_path: Path) -> None:
    (tmp_path / "leg.toml").write_text("name = 'leg'\n[springs]\nstiffness = [1.0, 2.0]\n")
    found = overlaid({"design": "leg.toml"}, "design.springs.stiffness", [3.0, 4.0], tmp_path)
    assert found == {"design": {"name": "leg", "springs": {"stiffness": [3.0, 4.0]}}}
    with pytest.raises(ConfigError):
        overlaid({"design": "none.toml"}, "design.name", "x", tmp_path)
