"""Every fault in mid-jump on the emulated leg: found, stopped, within the limits, recorded."""

import time
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


def view(run: Path) -> LiveView:
    return start_live(run, save=run / "live.rrd")


@pytest.mark.parametrize("trial", TRIALS, ids=lambda trial: trial.name.replace(" ", "-"))
def test_no_fault_survives(trial: FaultTrial, tmp_path: Path) -> None:
    design = load_design(ROOT / "models" / "optimal.toml")
    result = try_fault(trial, BUS, design, tmp_path, view)
    assert result.safe, result
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


@pytest.mark.long  # Its viewer is a real process, which may end early on a busy machine.
def test_a_viewer_that_hangs_changes_neither_the_loop_nor_the_recording(tmp_path: Path) -> None:
    design = load_design(ROOT / "models" / "optimal.toml")
    stopped, views = [], []

    class Watched:
        """A view that tells in which state it was when the run had ended."""

        def __init__(self, run: Path) -> None:
            self.view = start_live(run, save=run / "live.rrd")
            self.pid = self.view.pid
            views.append(self.view)

        def stop(self) -> None:
            state = Path(f"/proc/{self.pid}/stat").read_text().rsplit(")", 1)[1].split()[0]
            stopped.append(state)
            self.view.stop()

    runs = [
        try_fault(FaultTrial(name=name, viewer=hangs), BUS, design, tmp_path / name, Watched).run
        for name, hangs in (("alone", False), ("hanging", True))
    ]
    assert stopped == ["T"]
    alone, hanging = map(load, runs)
    assert alone.torn is None
    assert hanging.torn is None
    for name in alone.signals:
        if name not in ("cycle_us", "late_us"):  # of the wall clock
            np.testing.assert_array_equal(alone[name], hanging[name])
    assert (runs[0] / BUS_LOG).read_bytes() == (runs[1] / BUS_LOG).read_bytes()
    end = time.monotonic() + 30.0
    while views[0].alive and time.monotonic() < end:
        time.sleep(0.02)
    assert not views[0].alive
