from itertools import pairwise

import numpy as np
import pytest
from viz_runs import FLIGHT_TIME, STANCE_TIME, part

from legbench.metrics.analysis import Analysis
from legbench.metrics.roles import STANCE
from legbench.recording.reader import Recording
from legbench.viz.facts import facts_of
from legbench.viz.trace import Thinner, Tracer

CUTS = (
    [0, 2500],
    [0, 1, 2, 3, 2500],
    [*range(0, 2500, 50), 2500],
    [0, 0, 700, 700, 701, 1999, 2500],
)


@pytest.mark.parametrize("cuts", CUTS)
@pytest.mark.parametrize("name", ["hop", "swing", "real_hop"])
def test_slices_give_what_the_whole_run_gives(
    name: str, cuts: list[int], request: pytest.FixtureRequest
) -> None:
    run: Recording = request.getfixturevalue(name)
    facts = facts_of(run.description)
    whole = Tracer(facts).extend(run)
    tracer = Tracer(facts)
    traces = [tracer.extend(part(run, low, high)) for low, high in pairwise(cuts)]
    for field in ("time", "joint", "polar", "modal", "period", "stance"):
        together = np.concatenate([getattr(trace, field) for trace in traces])
        np.testing.assert_array_equal(together, getattr(whole, field))


@pytest.mark.parametrize("cuts", CUTS[1:])
@pytest.mark.parametrize("freq", [1000.0, 200.0, 150.0, 100.0])
def test_thinning_in_slices_keeps_the_rows_of_the_whole(freq: float, cuts: list[int]) -> None:
    time = np.arange(2500, dtype=np.float64) * 1e-3
    thinner = Thinner(freq)
    whole = Thinner(freq).pick(time)
    kept = [low + thinner.pick(time[low:high]) for low, high in pairwise(cuts)]
    np.testing.assert_array_equal(np.concatenate(kept), whole)
    assert np.diff(whole).max() <= 1000.0 / freq


def test_jumps_are_counted_at_touchdown(hop: Recording) -> None:
    trace = Tracer(facts_of(hop.description)).extend(hop)
    jumps = int((hop.time[-1] + 0.4 * STANCE_TIME) / (STANCE_TIME + FLIGHT_TIME))
    assert trace.period[-1] == jumps
    gait = Analysis(hop).gait
    np.testing.assert_array_equal(
        np.flatnonzero(np.diff(trace.period)) + 1,
        [*gait.stance.first, *gait.flight.stop[-1:]][:jumps],
    )
    np.testing.assert_array_equal(trace.stance, Analysis(hop).states == STANCE)


def test_chattering_contact_is_one_touchdown(hop: Recording) -> None:
    contact = hop.columns["contact"].copy()
    touchdowns = np.flatnonzero(np.diff(contact) > 0.0) + 1
    for row in touchdowns:
        contact[row + 2 : row + 5] = 0.0
    chattering = Recording(
        path=hop.path,
        manifest={},
        described=hop.described,
        time=hop.time,
        columns={**hop.columns, "contact": contact},
        events=(),
    )
    trace = Tracer(facts_of(hop.description)).extend(chattering)
    np.testing.assert_array_equal(np.flatnonzero(np.diff(trace.period)) + 1, touchdowns)


def test_a_period_lasts_as_long_as_the_oscillation(swing: Recording) -> None:
    trace = Tracer(facts_of(swing.description)).extend(swing)
    starts = swing.time[np.flatnonzero(np.diff(trace.period)) + 1]
    np.testing.assert_allclose(np.diff(starts)[2:], 1.0 / 3.1, rtol=0.02)


def test_a_real_leg_stands_when_its_controller_says_so(hop: Recording, real_hop: Recording) -> None:
    expected = Tracer(facts_of(hop.description)).extend(hop)
    trace = Tracer(facts_of(real_hop.description)).extend(real_hop)
    np.testing.assert_array_equal(trace.stance, expected.stance)
