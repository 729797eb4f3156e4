"""Measured in windows, a run gives what it gives as a whole."""

import numpy as np
import pytest
from metrics_runs import Hop

from legbench.design.statics import Support
from legbench.metrics import Analysis, energy_flows, find_gait, rating, summarise
from legbench.metrics import analysis as analysis_module
from legbench.metrics.energy import Flows
from legbench.metrics.rating import rate_phases
from legbench.metrics.source import Reference
from legbench.metrics.window import RowWindow, spans

RUN = Analysis(Hop().recording())
COUNT = len(RUN.time)


@pytest.mark.parametrize("rows", [1, 2, 7, COUNT - 2, COUNT - 1, COUNT])
def test_energy_flows_do_not_show_the_windows(rows: int) -> None:
    whole, parts = energy_flows(RUN, 10 * COUNT), energy_flows(RUN, rows)
    for name in Flows.__dataclass_fields__:
        found, wanted = getattr(parts, name), getattr(whole, name)
        assert found.shape == wanted.shape == (COUNT - 1,)
        np.testing.assert_allclose(found, wanted, rtol=0.0, atol=1e-15)


def test_runs_too_short_for_an_interval_have_no_flows() -> None:
    for count in (0, 1, 2, 3):
        flows = energy_flows(RowWindow(RUN, 0, count))
        assert len(flows.gain) == max(count - 1, 0)


@pytest.mark.parametrize("reference", list(Reference))
def test_ratings_do_not_show_the_windows(
    reference: Reference, monkeypatch: pytest.MonkeyPatch
) -> None:
    flight = find_gait(RUN, RUN.states).stance
    given = (RUN, Support.FOOT, reference, flight.first, flight.stop)
    whole = rate_phases(*given)
    for rows in (1, 200, 400):
        monkeypatch.setattr(rating, "WINDOW_ROWS", rows)
        np.testing.assert_allclose(rate_phases(*given), whole, rtol=1e-14)


def test_signals_that_are_forgotten_are_read_again(monkeypatch: pytest.MonkeyPatch) -> None:
    whole = summarise(Hop().recording())
    monkeypatch.setattr(analysis_module, "KEPT_BYTES", 3 * 16 * COUNT)
    run = Analysis(Hop().recording())
    assert summarise(run) == whole or "nan" in str(whole)
    assert str(summarise(run)) == str(whole)
    assert sum(each.nbytes for each in run._signals.values()) <= 3 * 16 * COUNT


def test_as_many_signals_are_kept_as_fit_and_the_one_asked_for_longest_ago_goes(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    # Usually 268 MB: 27 numbers a row, with what is computed of them, over 20 minutes at 1 kHz.
    assert analysis_module.KEPT_BYTES == 268_435_456
    monkeypatch.setattr(analysis_module, "KEPT_BYTES", 2 * 16 * COUNT)
    run = Analysis(Hop().recording())
    for name in ("joint_pos", "motor_pos", "joint_pos"):
        assert run[name].nbytes == 16 * COUNT
    assert list(run._signals) == ["motor_pos", "joint_pos"]
    assert run["joint_vel"].nbytes == 16 * COUNT
    assert list(run._signals) == ["joint_pos", "joint_vel"]


def test_windows_are_four_minutes_long_and_one_is_there_without_rows() -> None:
    assert list(spans(300_000)) == [(0, 262_144), (262_144, 300_000)]
    assert list(spans(0, 1)) == [(0, 0)]
    assert list(spans(1, 1)) == [(0, 1)]


def test_windows_cover_the_rows_once() -> None:
    for count in (0, 1, 5, 6):
        rows = [row for first, stop in spans(count, 3) for row in range(first, stop)]
        assert rows == list(range(count))
        assert list(spans(count, 3))
    np.testing.assert_array_equal(RowWindow(RUN, 3, 9)["joint_pos"], RUN["joint_pos"][3:9])
