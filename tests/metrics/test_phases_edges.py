"""Events of a hop where the signals that show them do not cross zero."""

import numpy as np
from metrics_runs import PERIOD, Hop

from legbench.metrics.analysis import Analysis


def test_a_force_that_ends_without_falling_ends_half_a_row_after_its_last() -> None:
    hop = Hop()
    contact = hop.signals()["contact"]
    force = np.where(contact[:, None], [0.0, 40.0], 0.0)
    run = hop.recording(contact_force=force)
    gait = Analysis(run).gait
    last_loaded = run.time[gait.flight.first - 1]
    np.testing.assert_allclose(gait.flight.start, last_loaded + 0.5 * PERIOD, atol=1e-12)
    np.testing.assert_allclose(
        gait.stance.end, run.time[gait.stance.stop - 1] + 0.5 * PERIOD, atol=1e-12
    )


def test_a_foot_that_lands_without_sinking_lands_in_the_row_that_shows_it() -> None:
    hop = Hop()
    signals = hop.signals()
    foot, contact = signals["foot_pos"].copy(), signals["contact"]
    landings = np.flatnonzero(~contact[:-1] & contact[1:]) + 1
    for row in landings:
        foot[row - 2 : row, 1] = 1e-4
    run = hop.recording(foot_pos=foot)
    gait = Analysis(run).gait
    assert len(gait.stance) == 4
    np.testing.assert_array_equal(gait.stance.start, run.time[gait.stance.first])
    np.testing.assert_array_equal(gait.flight.end, run.time[gait.flight.stop])
