"""Entries of a manifest: each has its type, stands for nothing, or is named and refused."""

from collections.abc import Callable
from enum import StrEnum
from typing import Any

import pytest

from legbench.errors import FormatError
from legbench.recording.controller_table import parse_controller
from legbench.recording.tables import ManifestTable


class Colour(StrEnum):
    RED = "red"
    BLUE = "blue"


def table(**entries: Any) -> ManifestTable:
    return ManifestTable(entries=entries, path="leg")


@pytest.mark.parametrize(
    ("read", "absent"),
    [
        (lambda t: t.table("x"), ManifestTable(entries={}, path="leg.x")),
        (lambda t: t.tables("x"), ()),
        (lambda t: t.text("x"), None),
        (lambda t: t.texts("x"), ()),
        (lambda t: t.number("x"), None),
        (lambda t: t.whole("x"), None),
        (lambda t: t.pair("x"), None),
    ],
)
def test_what_is_not_there_and_what_is_none_stand_for_nothing(
    read: Callable[[ManifestTable], Any], absent: Any
) -> None:
    assert read(table()) == read(table(x=None)) == absent


@pytest.mark.parametrize(
    ("read", "given", "found"),
    [
        (lambda t: t.text("x"), "", ""),
        (lambda t: t.text("x"), "nan", "nan"),
        (lambda t: t.texts("x"), ["a", "b"], ("a", "b")),
        (lambda t: t.texts("x"), ("a",), ("a",)),
        (lambda t: t.texts("x"), [], ()),
        (lambda t: t.number("x"), 3, 3.0),
        (lambda t: t.number("x"), -0.5, -0.5),
        (lambda t: t.number("x"), 0, 0.0),
        (lambda t: t.number("x"), "inf", float("inf")),
        (lambda t: t.number("x"), "-inf", -float("inf")),
        (lambda t: t.whole("x"), 4.0, 4),
        (lambda t: t.whole("x"), 0, 0),
        (lambda t: t.pair("x"), [1, 2.5], (1.0, 2.5)),
        (lambda t: t.pair("x"), (0, 0), (0.0, 0.0)),
        (lambda t: t.choice("x", Colour), "blue", Colour.BLUE),
        (lambda t: t.choice("y", Colour, Colour.RED), "blue", Colour.RED),
        (lambda t: t.choice("x", Colour, Colour.RED), "blue", Colour.BLUE),
    ],
)
def test_an_entry_of_its_type_comes_back(
    read: Callable[[ManifestTable], Any], given: Any, found: Any
) -> None:
    seen = read(table(x=given))
    assert seen == found
    assert type(seen) is type(found)


def test_not_a_number_is_a_number() -> None:
    number = table(x="nan").number("x")
    assert number is not None
    assert number != number


@pytest.mark.parametrize(
    ("read", "given", "message"),
    [
        (lambda t: t.table("x"), 1, "leg.x is 1; it must be a table"),
        (lambda t: t.table("x"), [], r"leg.x is \[\]; it must be a table"),
        (lambda t: t.tables("x"), "ab", "leg.x is 'ab'; it must be a list of tables"),
        (lambda t: t.tables("x"), [{}, {}, 3], r"leg.x\[2\] is 3; it must be a table"),
        (lambda t: t.tables("x")[1].number("y"), [{}, {"y": "z"}], r"leg.x\[1\].y is 'z'; .* num"),
        (lambda t: t.table("x").text("y"), {"y": 2}, "leg.x.y is 2; it must be a text"),
        (lambda t: t.text("x"), False, "leg.x is False; it must be a text"),
        (lambda t: t.texts("x"), "ab", "leg.x is 'ab'; it must be a list of texts"),
        (lambda t: t.texts("x"), ["a", 1], r"leg.x is \['a', 1\]; it must be a list of texts"),
        (lambda t: t.number("x"), True, "leg.x is True; it must be a number"),
        (lambda t: t.number("x"), "1.5", "leg.x is '1.5'; it must be a number"),
        (lambda t: t.number("x"), 10**400, "leg.x is 'a whole number of too many digits'"),
        (lambda t: t.whole("x"), 0.5, "leg.x is 0.5; it must be a whole number"),
        (lambda t: t.whole("x"), "inf", "leg.x is inf; it must be a whole number"),
        (lambda t: t.whole("x"), "nan", "leg.x is nan; it must be a whole number"),
        (lambda t: t.pair("x"), [1, 2, 3], r"leg.x is \[1, 2, 3\]; it must be two numbers"),
        (lambda t: t.pair("x"), [1], r"leg.x is \[1\]; it must be two numbers"),
        (lambda t: t.pair("x"), "12", "leg.x is '12'; it must be two numbers"),
        (lambda t: t.pair("x"), {"0": 1}, "leg.x is {'0': 1}; it must be two numbers"),
        (lambda t: t.pair("x"), [None, 1], r"leg.x is \[None, 1\]; it must be two numbers"),
        (lambda t: t.pair("x"), [1, None], r"leg.x is \[1, None\]; it must be two numbers"),
        (lambda t: t.pair("x"), ["a", 1], "leg.x.0 is 'a'; it must be a number"),
        (lambda t: t.pair("x"), [1, "b"], "leg.x.1 is 'b'; it must be a number"),
        (lambda t: t.choice("x", Colour), "tan", "leg.x is 'tan'; known are red, blue"),
        (lambda t: t.choice("y", Colour), "tan", "leg.y is None; known are red, blue"),
    ],
)
def test_an_entry_of_another_type_is_named(
    read: Callable[[ManifestTable], Any], given: Any, message: str
) -> None:
    with pytest.raises(FormatError, match=f"^manifest {message}"):
        read(table(x=given))


def test_a_name_at_the_top_has_no_dot() -> None:
    assert ManifestTable(entries={}).name("x") == "x"
    assert ManifestTable(entries={}).table("x").table("y").path == "x.y"


def test_a_controller_may_leave_out_what_has_a_usual_value() -> None:
    found = parse_controller(
        ManifestTable(
            entries={
                "phases": [{"code": 3, "name": "hold", "role": "rest"}],
                "signals": [{"name": "gain"}],
            }
        )
    )
    (phase,), (signal,) = found.phases, found.signals
    assert (phase.late, phase.doc) == (0.0, "")
    assert (signal.components, signal.unit, signal.doc) == ((), "-", "")
    assert (found.counting.most, found.counting.smallest) == (None, 0.0)
    assert parse_controller(ManifestTable(entries={})).phases == ()


@pytest.mark.parametrize(
    ("entries", "message"),
    [
        ({"phases": [{"name": "hold", "role": "rest"}]}, r"phases\[0\].code is None; .* whole"),
        ({"phases": [{"code": 1, "role": "rest"}]}, r"phases\[0\].name is None; .* a text"),
        ({"signals": [{"name": ""}]}, r"signals\[0\].name is ''; it must be a text"),
    ],
)
def test_a_controller_must_name_what_it_declares(entries: dict[str, Any], message: str) -> None:
    with pytest.raises(FormatError, match=message):
        parse_controller(ManifestTable(entries=entries, path="controller"))
