"""In which part of a jump each interval's unexplained energy is counted."""

import numpy as np
import pytest
from metrics_runs import PROTOTYPE, Hop

from legbench.metrics.analysis import Analysis
from legbench.metrics.budget import EnergyBudget, energy_budget
from legbench.metrics.energy import energy_flows

PARTS = ("impact_loss", "stop_loss", "contact_loss", "other_loss")
HOP = Hop()
CONTACT = HOP.signals()["contact"]
TOUCHDOWN = int(np.flatnonzero(~CONTACT[:-1] & CONTACT[1:])[1]) + 1
"""Row in which the second jump lands."""
LIFTOFF = int(np.flatnonzero(CONTACT[:-1] & ~CONTACT[1:])[2]) + 1
"""First row of the flight after it."""
LOSS = 0.25


def budget_with(row: int, *, at_stop: bool = False) -> EnergyBudget:
    """Budget of a hop that loses energy between `row - 1` and `row` alone."""
    count = len(CONTACT)
    posture = np.tile([-0.6, 0.6], (count, 1))
    if at_stop:
        posture[:] = [-0.1, 0.1]
    energy = np.ones((count, 2))
    energy[row:, 0] -= LOSS
    run = HOP.recording(energy=energy, joint_pos=posture, motor_pos=posture)
    return energy_budget(run, Analysis(run).gait, energy_flows(run))


@pytest.mark.parametrize(
    ("row", "part"),
    [
        (TOUCHDOWN - 1, "other_loss"),
        (TOUCHDOWN, "impact_loss"),
        (TOUCHDOWN + 1, "impact_loss"),
        (TOUCHDOWN + 15, "impact_loss"),
        (TOUCHDOWN + 16, "contact_loss"),
        (TOUCHDOWN + 29, "contact_loss"),
        (LIFTOFF, "contact_loss"),
        (LIFTOFF + 1, "other_loss"),
    ],
)
def test_an_interval_is_counted_once_in_its_part(row: int, part: str) -> None:
    found = budget_with(row)
    for name in PARTS:
        total = getattr(found, name).sum()
        assert total == pytest.approx(LOSS if name == part else 0.0, abs=1e-12), name
    assert found.gain.sum() == pytest.approx(-LOSS, abs=1e-12)


@pytest.mark.parametrize(
    ("row", "part"),
    [
        (TOUCHDOWN + 5, "impact_loss"),
        (TOUCHDOWN + 29, "stop_loss"),
        (TOUCHDOWN - 20, "stop_loss"),
    ],
)
def test_a_joint_at_its_stop_takes_what_no_impact_does(row: int, part: str) -> None:
    found = budget_with(row, at_stop=True)
    for name in PARTS:
        total = getattr(found, name).sum()
        assert total == pytest.approx(LOSS if name == part else 0.0, abs=1e-12), name


def test_a_jump_has_what_lies_between_its_lower_apexes() -> None:
    run = HOP.recording()
    jumps = Analysis(run).gait.jumps
    low = np.searchsorted(run.time, jumps.start)
    for index in range(len(jumps)):
        # The first interval that begins in a jump, and the last that does.
        for row in (low[index] + 1, np.searchsorted(run.time, jumps.end[index])):
            gain = budget_with(int(row)).gain
            expected = np.where(np.arange(len(jumps)) == index, -LOSS, 0.0)
            np.testing.assert_allclose(gain, expected, atol=1e-12)


@pytest.mark.parametrize(("hops", "jumps"), [(0.0, 0), (2.1, 0), (3.1, 1), (4.1, 2)])
def test_a_budget_has_one_figure_a_jump(hops: float, jumps: int) -> None:
    hop = Hop(hops=hops)
    count = len(hop.signals()["time"])
    energy = np.stack([np.linspace(9.0, 8.0, count), np.ones(count)], axis=-1)
    run = hop.recording(energy=energy)
    found = energy_budget(run, Analysis(run).gait, energy_flows(run))
    for name in EnergyBudget.__dataclass_fields__:
        assert getattr(found, name).shape == (jumps,), name
    rows = np.searchsorted(run.time, Analysis(run).gait.jumps.start)
    ends = np.searchsorted(run.time, Analysis(run).gait.jumps.end)
    lost = energy[rows].sum(axis=-1) - energy[ends].sum(axis=-1)
    springs = found.gain + lost
    stretch = run["motor_pos"] - run["joint_pos"]
    held = 0.5 * np.square(stretch) @ np.asarray(PROTOTYPE.stiffness)
    np.testing.assert_allclose(springs, held[ends] - held[rows], atol=1e-12)
