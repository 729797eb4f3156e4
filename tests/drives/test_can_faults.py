"""Every fault in mid-jump on the emulated leg: found, stopped, within the limits, recorded."""

from pathlib import Path

import pytest
from can_rig import BUS, ROOT

from legbench.commissioning.fault_trial import TRIALS, Trial, try_fault
from legbench.design import load_design

WITHIN = 85
"""Cycles from any fault to the reaction; a lost heartbeat takes three times 20 ms and a little."""


@pytest.mark.parametrize("trial", TRIALS, ids=lambda trial: trial.name.replace(" ", "-"))
def test_no_fault_survives(trial: Trial, tmp_path: Path) -> None:
    design = load_design(ROOT / "models" / "optimal.toml")
    result = try_fault(trial, BUS, design, tmp_path)
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
        assert (result.status, result.cause) == ("fault", trial.cause)
        assert result.cycles is not None
        assert 0 < result.cycles <= WITHIN
