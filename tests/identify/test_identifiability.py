"""What runs cannot show is refused, with the direction that they do not show in words."""

import pytest
from twins import PROTOTYPE, task

from legbench.errors import ConfigError
from legbench.identify import UnidentifiableError, identify, parse_free
from legbench.identify.parameters import NINE
from legbench.identify.trial import FitTrial


@pytest.mark.long
def test_nine_parameters_are_seen_by_three_setups_and_a_known_mass(
    steps: tuple[FitTrial, ...],
) -> None:
    outcome = identify(task(steps, PROTOTYPE, free=parse_free(["nine"])))
    assert outcome.gate is not None
    assert outcome.gate.open
    assert not outcome.gate.weak
    assert outcome.gate.condition < 30.0


@pytest.mark.parametrize(
    ("setups", "free", "words"),
    [
        ([0], ["nine"], r"s1, s2 leave no trace .* all nine scale together .*fixed-foot run"),
        ([0, 1], ["nine"], r"all nine scale together, .*add a fixed-foot run \(ffs\) and the mass"),
        ([0, 1, 2], ["nine", "mass"], r"all nine and the mass scale together, .*give --mass"),
        ([2], ["nine"], r"these change together, .*J1 .*add a run with the trunk fixed"),
        ([0], ["J1", "J2", "B", "springs", "dampers"], r"all nine scale together .*J1, J2, B, k1"),
        ([0], ["mass"], r"mass leave no trace in these runs: add a run with gravity"),
    ],
)
def test_what_cannot_be_seen_is_refused_in_words(
    steps: tuple[FitTrial, ...], setups: list[int], free: list[str], words: str
) -> None:
    asked = task([steps[each] for each in setups], PROTOTYPE, free=parse_free(free))
    with pytest.raises(UnidentifiableError, match=words):
        identify(asked)


@pytest.mark.long
def test_zero_errors_on_both_sides_of_the_springs_are_marked_weak(
    steps: tuple[FitTrial, ...],
) -> None:
    free = parse_free(["springs", "dampers", "link_zero", "motor_zero"])
    outcome = identify(task(steps, PROTOTYPE, free=free))
    assert not outcome.trusted
    assert any("link_zero1 and motor_zero1 (correlation -0.99" in each for each in outcome.alike)
    assert any(reason.startswith("weak:") for reason in outcome.reasons)


def test_names_of_single_segments_are_refused_with_what_to_free_instead() -> None:
    with pytest.raises(ConfigError, match=r"m1 cannot be identified.*free J1, J2, B, s1, s2"):
        parse_free(["k1", "m1"])
    with pytest.raises(ConfigError, match=r"no parameter is called 'k3'; there are J1, J2"):
        parse_free(["k3"])
    with pytest.raises(ConfigError, match=r"no parameter is free"):
        parse_free([])


def test_groups_free_their_members_in_one_order() -> None:
    assert parse_free(["dampers", "k1"]).names == ("k1", "d1", "d2")
    assert parse_free(["nine"]).names == tuple(each.name for each in NINE)
