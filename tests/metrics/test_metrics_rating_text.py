from types import SimpleNamespace
from typing import Any

import pytest

from legbench.metrics.rating_text import rated_lines, rating_decimals, rating_text, shown


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.7812345, "0.7812"),
        (0.94, "0.9400"),
        (0.99944, "0.99944"),
        (0.9999876543, "0.999988"),
        (0.99999996, "0.999999960"),
        (1.0 - 1e-8, "0.999999990"),
        (1.0 - 1e-9, "0.999999999"),
        (1.0 - 0.6e-9, "0.999999999"),
        (1.0 - 1e-10, "1.0000"),
        (1.0 - 1e-14, "1.0000"),
        (1.0, "1.0000"),
        (0.0, "0.0000"),
    ],
)
def test_a_rating_shows_what_it_lacks_of_one(value: float, text: str) -> None:
    assert shown(value) == text


def test_two_ratings_that_differ_are_shown_to_differ() -> None:
    for lost in (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7):
        assert shown(1.0 - lost) != shown(1.0 - 1.5 * lost)


def test_the_lowest_and_the_last_are_told() -> None:
    assert rating_text([0.9999, 0.87, 0.999991]) == "0.8700 lowest, 0.9999910 last of 3"
    assert rating_text([float("nan"), 0.5]) == "0.5000 lowest, 0.5000 last of 2"
    assert rating_text([float("nan")]) == "unknown, all 1"
    assert rating_decimals([]) == 4
    # The one that lacks the least decides for all.
    assert rating_decimals([0.87, 0.999991]) == rating_decimals([0.999991, 0.87]) == 7


@pytest.mark.parametrize("first", ["motor", "equilibrium"])
def test_what_was_rated_is_listed_about_the_chosen_reference_first(first: str) -> None:
    figures = {
        f"rating_{kind}_{reference}": values
        for kind, values in (("stance", [0.9]), ("flight", []), ("periods", [0.5, 0.75]))
        for reference in ("motor", "equilibrium")
    }
    summary: Any = SimpleNamespace(rating_reference=first, **figures)
    other = "equilibrium" if first == "motor" else "motor"
    assert [(line.kind, line.reference, line.values) for line in rated_lines(summary)] == [
        ("stance", first, [0.9]),
        ("stance", other, [0.9]),
        ("periods", first, [0.5, 0.75]),
        ("periods", other, [0.5, 0.75]),
    ]
    assert rated_lines(summary)[0].text == f"0.9000 lowest, 0.9000 last of 1, about the {first}"
