import pytest

from legbench.metrics.rating_text import rating_decimals, rating_text, shown


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.7812345, "0.7812"),
        (0.94, "0.9400"),
        (0.99944, "0.99944"),
        (0.9999876543, "0.999988"),
        (0.99999996, "0.999999960"),
        (1.0 - 1e-8, "0.999999990"),
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
