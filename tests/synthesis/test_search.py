from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from legbench.design import LegDesign, load_design
from legbench.design.dependent import cost
from legbench.design.requirements import PAPER, VARIABLES, Requirements
from legbench.design.scaling import quadruped
from legbench.errors import ConfigError, DesignError
from legbench.interrupts import StopFlag
from legbench.signals import Floats
from legbench.synthesis.crosscheck import evolve
from legbench.synthesis.search import SearchSettings, identity_of, search
from legbench.synthesis.sensitivity import moved, refine
from legbench.synthesis.solve import Solution, solve
from legbench.synthesis.trace import Trace

TABLE_2 = load_design(Path(__file__).parents[2] / "models" / "table2.toml")
OPTIMUM = 0.2573
ON_BOUNDS = {
    "relaxed_length": "upper",
    "thigh_com": "lower",
    "shank_com": "upper",
    "foot_com": "lower",
    "shank_inertia": "lower",
    "foot_inertia": "upper",
}


@pytest.fixture(scope="module")
def paper() -> Solution:
    return solve(PAPER, SearchSettings())


def rounded(design: LegDesign) -> list[int]:
    """Entries of Table II in the table's units."""
    entries = [1e3 * design.trunk_mass]
    for segment in design.segments:
        entries += [1e3 * segment.mass, 1e3 * segment.length, 1e3 * segment.com]
        entries.append(1e6 * segment.inertia)
    return [round(entry) for entry in entries]


def test_every_entry_of_table_2(paper: Solution) -> None:
    assert rounded(paper.design) == rounded(TABLE_2)
    assert paper.design.stiffness[0] == pytest.approx(TABLE_2.stiffness[0], rel=3e-3)
    assert paper.design.stiffness[0] == paper.design.stiffness[1]
    assert paper.objective == pytest.approx(OPTIMUM, abs=1e-4)


def test_residuals_are_rounding(paper: Solution) -> None:
    assert paper.complete
    for condition in paper.conditions[:4]:
        assert abs(condition.ratio) < 1e-12
    assert paper.conditions[4].residual > 0.0


@pytest.mark.parametrize(
    "seed", [1, *(pytest.param(seed, marks=pytest.mark.long) for seed in (7, 13))]
)
def test_other_seeds_find_the_same_leg(seed: int, paper: Solution) -> None:
    other = solve(PAPER, SearchSettings(seed=seed), cross_check=False)
    np.testing.assert_allclose(other.free, paper.free, atol=1e-6)
    assert other.objective == pytest.approx(paper.objective, abs=1e-11)


def test_differential_evolution_finds_the_same_leg(paper: Solution) -> None:
    other = evolve(PAPER.bounds, lambda free: cost(PAPER, free), seed=5)
    assert other.cost == pytest.approx(paper.objective, abs=1e-4)
    np.testing.assert_allclose(other.free, paper.free, atol=1e-4)


def test_six_bounds_are_active_and_their_prices_are_true(paper: Solution) -> None:
    assert {bound.variable: bound.side for bound in paper.active} == ON_BOUNDS
    for bound in paper.active:
        assert bound.gain > 0.0
        assert bound.gain == pytest.approx(bound.gain_measured, rel=1e-4)
    gains = [bound.gain for bound in paper.active]
    assert gains == sorted(gains, reverse=True)


def test_a_price_foretells_another_search(paper: Solution) -> None:
    dearest = paper.active[0]
    relief = 1e-3
    eased = moved(PAPER, dearest.variable, dearest.side, relief)
    gained = paper.objective - solve(eased, SearchSettings(seed=3), cross_check=False).objective
    assert gained == pytest.approx(dearest.gain * relief, rel=0.02)


def test_a_margin_can_be_what_holds_the_optimum() -> None:
    soft = Requirements(leg_stiffness=50.0)
    found = solve(soft, SearchSettings(), cross_check=False)
    held = {bound.variable: bound for bound in found.active}
    assert "relaxed_length" not in held
    assert held["upright stability, condition (10)"].gain > 0.0
    assert found.conditions[4].residual >= 0.0


def test_refining_leaves_an_optimum_alone(paper: Solution) -> None:
    np.testing.assert_allclose(refine(PAPER, paper.free), paper.free, atol=1e-7)
    shifted = paper.free.copy()
    shifted[VARIABLES.index("thigh_length")] += 0.02
    np.testing.assert_allclose(refine(PAPER, shifted), paper.free, atol=1e-5)


@pytest.mark.parametrize(
    "mass", [20.0, *(pytest.param(mass, marks=pytest.mark.long) for mass in (0.1, 140.0))]
)
def test_quadrupeds_have_legs(mass: float) -> None:
    found = solve(quadruped(mass), SearchSettings(), cross_check=False)
    assert found.design.total_mass == pytest.approx(mass / 4.0)
    assert found.design.leg_mass == pytest.approx(0.363 * mass / 4.0)


@pytest.mark.parametrize(
    ("requirements", "lacking"),
    [
        (Requirements(leg_com=0.4), "a positive thigh mass"),
        (Requirements(leg_com=0.005), "a positive shank mass"),
        (Requirements(leg_stiffness=5.0), r"upright stability, condition \(10\)"),
    ],
)
def test_contradictory_requirements_name_the_condition(
    requirements: Requirements, lacking: str
) -> None:
    with pytest.raises(DesignError, match=f"no leg within the bounds .* lacks {lacking}"):
        solve(requirements, SearchSettings())


class Counted:
    """The cost, and how often it was asked for; asks for a stop after some generations."""

    def __init__(self, stop_after: int | None = None) -> None:
        self.calls = 0
        self.stop = StopFlag()
        self._stop_after = stop_after

    def __call__(self, free: Floats) -> Floats:
        self.calls += 1
        if self.calls == self._stop_after:
            self.stop.set()
        return cost(PAPER, free)


def test_an_interrupted_search_goes_on_where_it_was(tmp_path: Path) -> None:
    settings, path = SearchSettings(seed=4), tmp_path / "trace.jsonl"
    identity = identity_of({"name": "paper"}, settings)
    straight = Trace(identity)
    whole = search(PAPER.bounds, Counted(), settings, straight)

    first = Counted(stop_after=30)
    trace = Trace(identity, path)
    part = search(PAPER.bounds, first, settings, trace, stop=first.stop)
    trace.close()
    assert not part.complete
    assert part.evaluations == 600
    assert part.cost == straight.costs[:600].min()

    with path.open("a") as file:
        file.write('{"points": [[0.1, 0.2')  # what a crash leaves
    second, resumed = Counted(), Trace(identity, path)
    rest = search(PAPER.bounds, second, settings, resumed)
    resumed.close()
    np.testing.assert_array_equal(resumed.points, straight.points)
    np.testing.assert_array_equal(resumed.costs, straight.costs)
    np.testing.assert_array_equal(rest.free, whole.free)
    assert (rest.cost, rest.evaluations, rest.complete) == (whole.cost, whole.evaluations, True)
    assert second.calls == len(straight) // settings.population - 30


def test_scatter_is_paid_by_candidates_that_exist() -> None:
    seen: list[LegDesign] = []

    def heavier_thighs_scatter_more(designs: Sequence[LegDesign]) -> Floats:
        seen.extend(designs)
        return np.array([3.0 * design.thigh.mass for design in designs])

    plain, robust = (
        solve(PAPER, SearchSettings(), cross_check=False, scatter_cost=scatter)
        for scatter in (None, heavier_thighs_scatter_more)
    )
    assert robust.complete
    assert robust.cost == pytest.approx(robust.objective + 3.0 * robust.design.thigh.mass)
    assert robust.design.thigh.mass < plain.design.thigh.mass - 1e-3
    assert robust.objective > plain.objective
    assert robust.active == ()
    assert robust.check is None
    assert len(seen) < robust.evaluations


def test_a_trace_of_another_search_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "trace.jsonl"
    Trace(identity_of({}, SearchSettings(seed=1)), path).close()
    with pytest.raises(ConfigError, match="was written for other requirements or settings"):
        Trace(identity_of({}, SearchSettings(seed=2)), path)
    path.write_text("not a trace\n")
    with pytest.raises(ConfigError, match="is not a search trace"):
        Trace({}, path)
    Trace({}, tmp_path / "other.jsonl").close()
    with (tmp_path / "other.jsonl").open("a") as file:
        file.write('{"points": []}\n')
    with pytest.raises(ConfigError, match="is not a search trace"):
        Trace({}, tmp_path / "other.jsonl")
    with pytest.raises(ConfigError, match="cannot keep the search there"):
        Trace({}, tmp_path)


def test_a_search_that_may_not_begin_says_so() -> None:
    stop = StopFlag()
    stop.set()
    with pytest.raises(ConfigError, match="stopped before it had tried anything"):
        search(PAPER.bounds, Counted(), SearchSettings(), Trace({}), stop=stop)
    with pytest.raises(ConfigError, match="population is 2; it must be 4 or more"):
        SearchSettings(population=2)


def test_restarts_double_the_population_and_draw_anew() -> None:
    trace = Trace({})
    search(PAPER.bounds, Counted(), SearchSettings(restarts=1), trace)
    sizes = np.bincount(trace.generation)
    assert set(sizes.tolist()) == {20, 40}
    assert np.all(np.diff(sizes) >= 0)


def test_global_random_state_is_not_touched() -> None:
    np.random.seed(11)  # noqa: NPY002
    expected = np.random.random()  # noqa: NPY002
    np.random.seed(11)  # noqa: NPY002
    search(PAPER.bounds, Counted(), SearchSettings(evaluations=200), Trace({}))
    assert np.random.random() == expected  # noqa: NPY002
