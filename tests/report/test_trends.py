from pathlib import Path

import numpy as np
import pytest
from campaign_tables import BANG_BANG, SETUPS, STEP, Runs, as_the_paper_says, jumps, periods

from legbench.campaign import read_table
from legbench.campaign.curves import rating_curves
from legbench.metrics import Reference
from legbench.paper import published
from legbench.report import Trend, judge_trends
from legbench.report.judging import level_of, settling

EQUILIBRIUM, MOTOR = Reference.EQUILIBRIUM, Reference.MOTOR
NUMBERS = published()


def judged(runs: Runs, reference: Reference = EQUILIBRIUM) -> dict[str, Trend]:
    return {trend.key: trend for trend in judge_trends(runs.table(), NUMBERS, reference)}


def test_a_table_that_is_as_the_paper_says_holds_every_statement() -> None:
    for reference in Reference:
        found = judged(as_the_paper_says(), reference)
        assert len(found) == 15
        assert {key for key, trend in found.items() if not trend.held} == set()


def test_an_empty_table_shows_nothing() -> None:
    runs = Runs()
    runs.add("ffs", STEP, 1.0, 0.3, [])
    assert {trend.held for trend in judged(runs).values()} == {None}
    assert judged(runs)["vertical_better"].verdict == "not shown"


@pytest.mark.parametrize(
    ("ratings", "held"),
    [
        ([0.99, 0.95, 0.90], True),
        ([0.99, 0.95, 0.954, 0.90], True),  # a rise that two decimals do not show
        ([0.99, 0.95, 0.956, 0.90], False),
        ([0.99, 0.989, 0.988, 0.987], False),  # falls by less than two decimals show
        ([0.90, 0.95], False),
        ([0.99], None),
    ],
)
def test_a_decrease_is_seen_where_two_decimals_show_it(
    ratings: list[float], held: bool | None
) -> None:
    runs = Runs()
    runs.add("vfts", STEP, 1.0, 0.3, periods(ratings))
    assert judged(runs)["step_decreases_vfts"].held is held
    assert judged(runs)["step_decreases_hfts"].held is None


def test_one_cell_that_rises_breaks_the_decrease_and_is_named() -> None:
    runs = Runs()
    runs.add("ffs", STEP, 1.0, 0.3, periods([0.99, 0.95, 0.90]))
    runs.add("ffs", STEP, 1.4, 0.1, periods([0.99, 0.90, 0.94]))
    trend = judged(runs)["step_decreases_ffs"]
    assert trend.held is False
    assert trend.evidence == (
        "falls in 1 of 2 cells; on average from 0.990 to 0.920; largest rise 0.040, to period 3 at "
        "z2 = 1.4, dz2 = 0.1"
    )


def test_trials_are_judged_by_their_mean() -> None:
    runs = Runs()
    for trial, ratings in enumerate(([0.99, 0.94, 0.95], [0.98, 0.96, 0.91])):
        runs.add("ffs", STEP, 1.0, 0.3, periods(ratings), trial=trial)
    assert judged(runs)["step_decreases_ffs"].held is True
    (curve,) = rating_curves(runs.table(), EQUILIBRIUM)
    assert curve.mean == pytest.approx([0.985, 0.95, 0.93])
    assert curve.spread == pytest.approx([0.005, 0.01, 0.02])
    assert curve.trials.tolist() == [2, 2, 2]


@pytest.mark.parametrize(
    "said", [{"status": "fault", "cause": "straightened"}, {"numerics": "unsound"}]
)
def test_invalid_runs_do_not_count(said: dict[str, str]) -> None:
    runs = Runs()
    runs.add("ffs", STEP, 1.0, 0.3, periods([0.99, 0.95]))
    runs.add("ffs", STEP, 1.0, 0.3, periods([0.90, 0.99]), trial=1, **said)
    assert judged(runs)["step_decreases_ffs"].held is True
    assert judged(runs)["step_decreases_ffs"].evidence.endswith("from 0.990 to 0.950")


@pytest.mark.parametrize(("vertical", "held"), [(0.886, True), (0.884, False), (0.80, False)])
def test_the_vertical_setup_is_better_in_the_sixth_period(vertical: float, held: bool) -> None:
    runs = Runs()
    runs.add("hfts", STEP, 1.0, 0.3, periods([0.9] * 5 + [0.88, 0.1]))
    runs.add("vfts", STEP, 1.0, 0.3, periods([0.1] * 5 + [vertical]))
    assert judged(runs)["vertical_better"].held is held


def test_setups_are_compared_over_the_cells_and_periods_that_both_have() -> None:
    runs = Runs()
    runs.add("hfts", STEP, 1.0, 0.3, periods([0.95, 0.90, 0.1]))
    runs.add("vfts", STEP, 1.0, 0.3, periods([0.95, 0.90]))
    runs.add("ffs", STEP, 1.0, 0.3, periods([0.90, 0.85]))
    runs.add("ffs", STEP, 1.8, 0.3, periods([1.0, 1.0]))
    trend = judged(runs)["fixed_foot_lower"]
    assert trend.held is True
    assert trend.evidence == "FFS 0.875, hFTS 0.925 (1 cell); FFS 0.875, vFTS 0.925 (1 cell)"
    assert judged(runs)["vertical_better"].held is None


def test_the_fixed_foot_must_lie_below_both_others() -> None:
    runs = Runs()
    for setup, rating in (("hfts", 0.95), ("vfts", 0.85), ("ffs", 0.90)):
        runs.add(setup, STEP, 1.0, 0.3, periods([rating] * 3))
    assert judged(runs)["fixed_foot_lower"].held is False


@pytest.mark.parametrize(
    ("ratings", "held"),
    [
        ([0.5] * 8 + [0.94] * 8, True),
        ([0.5] * 9 + [0.94] * 11, False),  # settled from period 10 on
        ([0.89] * 16, False),  # not high
        ([0.94, 0.90] * 8, False),  # never settles
        ([0.94] * 9, None),
    ],
)
def test_saturation_is_high_and_soon(ratings: list[float], held: bool | None) -> None:
    runs = Runs()
    runs.add("hfts", BANG_BANG, 1.0, 0.08, periods(ratings))
    assert judged(runs)["bang_bang_saturates_hfts"].held is held


def test_a_curve_settles_at_the_mean_of_its_second_half() -> None:
    ratings = np.array([0.5, 0.9, 0.93, 0.94, 0.95, 0.94])
    assert level_of(ratings) == pytest.approx(0.9433, abs=1e-4)
    assert settling(ratings) == 3
    assert settling(np.full(4, 0.9)) == 1


@pytest.mark.parametrize(("folded", "held"), [(0.90, True), (0.939, False), (0.99, False)])
def test_the_folded_leg_rates_lower_with_a_fixed_trunk(folded: float, held: bool) -> None:
    runs = Runs()
    for setup in ("hfts", "vfts"):
        runs.add(setup, BANG_BANG, 1.0, 0.08, periods([0.94] * 12))
        runs.add(setup, BANG_BANG, 1.8, 0.08, periods([folded] * 12))
    assert judged(runs)["folded_lower"].held is held


def test_jumps_are_judged_by_the_last_three_and_bounds_by_their_sign() -> None:
    runs = as_the_paper_says()
    held = judged(runs, MOTOR)
    assert held["jump_rating_flight"].evidence == "0.975"
    assert held["foot_clearance"].evidence == "45.0 mm"
    for row in runs.rows:
        if row["row"] == "flight" and row["index"] == 4:
            row["rating_motor"] = 0.97  # more is asked for
        if row["row"] == "jump":
            row["trunk_excursion"] = 0.0936  # a tenth more is allowed
    broken = judged(runs, MOTOR)
    assert broken["jump_rating_flight"].held is False
    assert broken["trunk_excursion"].held is False
    assert broken["jump_rating_stance"].held is True


@pytest.fixture(scope="session")
def ideal(small: Path) -> dict[Reference, dict[str, Trend]]:
    table = read_table(small)
    return {
        each: {trend.key: trend for trend in judge_trends(table, NUMBERS, each)}
        for each in Reference
    }


@pytest.mark.parametrize("key", [f"bang_bang_saturates_{setup}" for setup in SETUPS])
def test_the_ideal_leg_saturates_under_bang_bang(
    ideal: dict[Reference, dict[str, Trend]], key: str
) -> None:
    assert ideal[EQUILIBRIUM][key].held is True


def test_the_ideal_leg_rates_higher_with_a_fixed_foot_than_the_paper_says(
    ideal: dict[Reference, dict[str, Trend]],
) -> None:
    assert ideal[EQUILIBRIUM]["fixed_foot_lower"].held is False
    assert ideal[EQUILIBRIUM]["step_decreases_ffs"].held is False


def test_the_ideal_leg_does_not_rate_lower_when_it_is_folded(
    ideal: dict[Reference, dict[str, Trend]],
) -> None:
    assert ideal[EQUILIBRIUM]["folded_lower"].held is False


def test_gravity_helps_the_ideal_leg_about_the_motor_alone(
    ideal: dict[Reference, dict[str, Trend]],
) -> None:
    assert ideal[MOTOR]["vertical_better"].held is True
    assert ideal[EQUILIBRIUM]["vertical_better"].held is False


def test_the_ideal_leg_jumps_along_its_mode_but_not_as_far_as_the_paper(
    ideal: dict[Reference, dict[str, Trend]],
) -> None:
    found = ideal[MOTOR]
    assert found["jump_rating_stance"].held is True
    assert found["jump_rating_flight"].held is True
    assert not any(found[key].held for key in ("foot_clearance", "trunk_excursion", "foot_travel"))


def test_a_lower_bound_is_kept_by_every_run_not_by_their_mean() -> None:
    runs = as_the_paper_says()
    lengths = {name: [0.04] * 3 for name in ("foot_clearance", "trunk_excursion", "foot_travel")}
    worse = jumps([0.995] * 3, [0.98, 0.969, 0.98], lengths)
    runs.add("jump", "jump", 0.8, 0.28, worse, trial=1)
    trend = judged(runs, MOTOR)["jump_rating_flight"]
    assert trend.held is False
    assert trend.evidence == "0.969 ± 0.003 over 2 runs"


def test_runs_of_a_controller_without_set_points_are_one_cell() -> None:
    runs = Runs()
    for trial in (0, 1):
        runs.add("ffs", "sine", None, None, periods([0.9, 0.8]), trial=trial)
    (curve,) = rating_curves(runs.table(), EQUILIBRIUM)
    assert curve.trials.tolist() == [2, 2]
    assert curve.cell.place == ""


def test_settings_that_vary_within_a_setup_tell_cells_apart() -> None:
    runs = Runs()
    for number, (name, z2) in enumerate((("optimal", 1.0), ("prototype", 1.0), ("optimal", 1.4))):
        runs.add("ffs", STEP, z2, 0.3, periods([0.9, 0.8]))
        runs.settings[f"{number:02d}".ljust(64, "0")]["design.name"] = name
    places = [curve.cell.place for curve in rating_curves(runs.table(), EQUILIBRIUM)]
    assert places == [
        "z2 = 1, dz2 = 0.3, design.name = optimal",
        "z2 = 1, dz2 = 0.3, design.name = prototype",
        "z2 = 1.4, dz2 = 0.3, design.name = optimal",
    ]
