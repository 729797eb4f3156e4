"""Conditions on runs, against Python's own reading of the same words."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from legbench.errors import ConfigError
from legbench.runs.columns import column_named, titled
from legbench.runs.select import select
from legbench.runs.where import parse_where

ROWS = [
    {
        "run": "a",
        "version": "1",
        "controller": "jump",
        "rating": 0.98,
        "controller.settings.z2": 1.0,
        "ok": True,
    },
    {"run": "b", "controller": "jump", "rating": 0.5, "controller.settings.z2": 1.7, "ok": False},
    {"run": "c", "controller": "bang-bang", "rating": None, "setup.z2": 1.0, "cause": "it's off"},
]
NAMES = [
    "run",
    "controller",
    "rating",
    "controller.settings.z2",
    "setup.z2",
    "ok",
    "cause",
    "version",
]


def chosen(where: str) -> str:
    condition = parse_where(where, NAMES)
    return "".join(str(row["run"]) for row in ROWS if condition(row))


@pytest.mark.parametrize(
    ("where", "runs"),
    [
        ("controller=jump", "ab"),
        ("controller == jump and rating>0.97", "a"),
        ("rating<=.5 or controller = bang-bang", "bc"),
        ("not controller=jump", "c"),
        ("not (controller=jump and rating>0.9)", "bc"),
        ("controller=jump and rating>0.9 or run=c", "ac"),
        ("run=c or controller=jump and rating>0.9", "ac"),
        ("run=c or not rating>0.9 and controller=jump", "bc"),
        ("rating=none", "c"),
        ("rating != none", "ab"),
        ("rating != 0.5", "a"),
        ("settings.z2 >= 1.7e0", "b"),
        ("ok=true", "a"),
        ("ok=false", "b"),
        ('cause = "it\'s off"', "c"),
        ("run > a", "bc"),
        ("controller = 3", ""),
        ("version = 1", "a"),
        ("version = 1.0", ""),
        ("((run=a))", "a"),
    ],
)
def test_conditions_choose(where: str, runs: str) -> None:
    assert chosen(where) == runs


@pytest.mark.parametrize(
    ("where", "message"),
    [
        ("", "it ends where a figure or setting should come"),
        ("rating", "it ends where an operator after 'rating' should come"),
        ("rating >", "it ends where a value after 'rating >' should come"),
        ("rating > > 3", "'>' comes where a value should"),
        ("rating is 3", "'is' is no operator; there are =, ==, !=, <, <=, >, >="),
        ("(rating > 3", "a bracket is not closed"),
        ("rating > 3 rating < 4", "'rating' comes where `and`, `or` or the end should"),
        ("rating > 3 and", "it ends where a figure or setting should come"),
        ("and rating > 3", "'and' comes where a figure or setting should"),
        ("rating > 3)", r"'\)' comes where `and`, `or` or the end should"),
        ("rating ! 3", "'! 3' is no part of a condition"),
        ('run = "a', "is no part of a condition"),
        ("z2 > 1", r"'z2' may mean controller.settings.z2, setup.z2; write out one of them"),
        ("ratng > 1", "no run has a figure or setting 'ratng'; near are rating"),
        ("qqqq > 1", "no run has a figure or setting 'qqqq'; there are run, controller"),
    ],
)
def test_bad_conditions_say_what_is_wrong(where: str, message: str) -> None:
    with pytest.raises(ConfigError, match=message):
        parse_where(where, NAMES)


ATOMS = st.sampled_from(["rating > 0.6", "controller = jump", "run = c", "ok = true"])


def joined(parts: st.SearchStrategy[str]) -> st.SearchStrategy[str]:
    return st.one_of(
        st.tuples(parts, st.sampled_from([" and ", " or "]), parts).map("".join),
        parts.map(lambda part: f"not ({part})"),
        parts.map(lambda part: f"({part})"),
    )


@given(st.recursive(ATOMS, joined, max_leaves=6))
def test_brackets_and_precedence_are_those_of_python(where: str) -> None:
    python = where.replace("= jump", "== 'jump'").replace("= c", "== 'c'").replace("= true", "== 1")
    for row in ROWS:
        known = {name: row.get(name) for name in ("controller", "run", "ok")}
        rating = row["rating"]
        known["rating"] = -1.0 if rating is None else rating
        assert parse_where(where, NAMES)(row) == bool(eval(python, {}, known)), where


def test_rows_are_sorted_and_those_without_the_column_come_last() -> None:
    for descending, order in ((False, "bac"), (True, "abc")):
        rows = select(ROWS, sort="rating", descending=descending)
        assert "".join(str(row["run"]) for row in rows) == order
    assert [row["run"] for row in select(ROWS, descending=True)] == ["c", "b", "a"]
    assert select([], where="nonsense of any kind", sort="anything") == []


def test_columns_are_named_by_their_ends_and_titled_with_units() -> None:
    assert column_named("settings.z2", NAMES) == "controller.settings.z2"
    assert titled("controller.settings.z2") == "z2 [rad]"
    assert titled("setup.z2") == "setup.z2"
