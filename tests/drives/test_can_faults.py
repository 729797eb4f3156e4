"""Every fault in mid-jump on the emulated leg: found, stopped, within the limits, recorded."""

import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from can_rig import BUS, ROOT

from legbench.commissioning.fault_table import TRIALS, FaultTrial
from legbench.commissioning.fault_trial import try_fault
from legbench.design import load_design
from legbench.plants import BUS_LOG
from legbench.recording.reader import load
from legbench.viz.live.launch import LiveView, start_live

WITHIN = 85
"""Cycles from any fault to the reaction; a lost heartbeat takes three times 20 ms and a little."""


def wait_for(happened: Callable[[], bool]) -> None:
    """Wait for another process; the run's own time stands meanwhile."""
    end = time.monotonic() + 30.0
    while not happened():
        assert time.monotonic() < end
        time.sleep(0.02)


def view(run: Path) -> LiveView:
    """A view that has begun: what freezes it later freezes no interpreter that is starting."""
    started = start_live(run, save=run / "live.rrd")
    wait_for((run / "live.rrd").exists)
    return started


EXACT = {
    # Three cycles without process data end a run, as do an emergency in the cycle that shows it,
    # and an interruption before the next one.
    "cable pulled": 3,
    "drive unplugged": 3,
    "under-voltage": 1,
    "^C": 0,
}
"""Cycles from a fault to the reaction, where the limits leave no choice."""
LOST = {"answers dropped for 2 cycles": 2, "drive warns": 0}
"""Cycles without process data in a run that goes on."""
BETWEEN = ("answers 0.7 ms late", "answers 1 ms late")
"""Trials whose delay lies between those of two others with the same end."""
LIKE_OTHERS = (
    "over-temperature",
    *("frozen motor encoder", "motor encoder steps 0.1 rad", "motor encoder drifts 1 rad/s"),
    *("frozen link encoder", "link encoder steps 0.1 rad", "link encoder drifts 1 rad/s"),
)
"""Trials of an emergency like under-voltage, and of parts that `test_can_dead_parts` lets die in
the same jump on the same drives."""


@pytest.mark.parametrize(
    "trial",
    [
        pytest.param(
            trial,
            id=trial.name.replace(" ", "-"),
            marks=[pytest.mark.long] if trial.name in BETWEEN + LIKE_OTHERS else [],
        )
        for trial in TRIALS
        if not trial.viewer  # whose view hangs has its own test below
    ],
)
def test_no_fault_survives(trial: FaultTrial, tmp_path: Path) -> None:
    design = load_design(ROOT / "models" / "optimal.toml")
    result = try_fault(trial, BUS, design, tmp_path)
    assert result.safe, result
    assert result.cycles == EXACT.get(trial.name, result.cycles)
    assert result.lost_cycles == LOST.get(trial.name, result.lost_cycles)
    if trial.gone:
        assert result.cycles is not None
        assert result.cycles < WITHIN
    elif trial.interrupted:
        assert result.status == "interrupted"
    elif trial.cause is None:
        assert result.status == "complete"
        assert result.cycles is None
    else:
        assert result.status == "fault"
        assert result.cause in {trial.cause, trial.or_cause} - {None}
        assert result.cycles is not None
        assert 0 < result.cycles <= WITHIN


def test_a_viewer_that_hangs_changes_neither_the_loop_nor_the_recording(tmp_path: Path) -> None:
    design = load_design(ROOT / "models" / "optimal.toml")
    stopped, views = [], []

    class Watched:
        """A view that tells in which state it was when the run had ended."""

        def __init__(self, run: Path) -> None:
            self.view = view(run)
            self.pid = self.view.pid
            views.append(self.view)

        def state(self) -> str:
            return Path(f"/proc/{self.pid}/stat").read_text().rsplit(")", 1)[1].split()[0]

        def stop(self) -> None:
            # A process that waits for a processor takes its signal when it gets one.
            until = time.monotonic() + 20.0
            while (state := self.state()) != "T" and time.monotonic() < until:
                time.sleep(0.01)
            stopped.append(state)
            self.view.stop()

    results = [
        try_fault(FaultTrial(name=name, viewer=hangs), BUS, design, tmp_path / name, Watched)
        for name, hangs in (("alone", False), ("hanging", True))
    ]
    for result in results:
        assert result.safe, result
        assert (result.status, result.cycles) == ("complete", None)
    runs = [result.run for result in results]
    assert stopped == ["T"]
    alone, hanging = map(load, runs)
    assert alone.torn is None
    assert hanging.torn is None
    for name in alone.signals:
        if name not in ("cycle_us", "late_us"):  # of the wall clock
            np.testing.assert_array_equal(alone[name], hanging[name])
    assert (runs[0] / BUS_LOG).read_bytes() == (runs[1] / BUS_LOG).read_bytes()
    # Set going again, it shows the run to its end and has nothing to complain of.
    wait_for(lambda: not views[0].alive)
    assert not (runs[1] / "live.log").exists()
    assert (runs[1] / "live.rrd").stat().st_size > 100_000
