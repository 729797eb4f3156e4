"""Rating of the first oscillation period, which begins while the motors still stand."""

from dataclasses import replace

import numpy as np
import pytest
from metrics_runs import PROTOTYPE

from legbench.control import PositionJumpConfig
from legbench.design.setup import Setup, SetupKind
from legbench.experiment import Experiment
from legbench.experiment.run import run
from legbench.imperfections import Imperfections
from legbench.kinematics import MODE_RADIAL
from legbench.metrics import Analysis
from legbench.metrics.changes import rows_before_change
from legbench.plants import AnalyticChoice

STEP = Experiment(
    design=PROTOTYPE,
    setup=Setup(kind=SetupKind.HFTS),
    controller=PositionJumpConfig(z2=1.0, dz2=0.3, delay=0.02),
    plant=AnalyticChoice(),
    duration=0.5,
    imperfections=Imperfections(link_zero=(0.03, 0.01)),
)


@pytest.mark.parametrize("delay_cycles", [0, 3])
def test_rows_in_which_the_motors_still_stand_are_not_rated(delay_cycles: int) -> None:
    """Against eq. (14) summed by hand; in hFTS nothing loads the springs."""
    flaws = replace(STEP.imperfections, motor_delay_cycles=(delay_cycles, delay_cycles))
    measured = Analysis(run(replace(STEP, imperfections=flaws)))
    # A command of the row at 0.02 s is first seen in the next, or `delay_cycles` later.
    answer = 21 + delay_cycles
    motors = measured["motor_pos"]
    np.testing.assert_array_equal(motors[:answer], np.tile(motors[0], (answer, 1)))
    assert np.all(motors[answer] != motors[0])
    assert measured.periods.start[0] == pytest.approx(0.02)
    stop = int(measured.periods.stop[0])
    apart = (measured["joint_pos"] - motors)[answer:stop]
    along = np.abs(apart @ MODE_RADIAL) / np.sqrt(2.0) / np.linalg.norm(apart, axis=1)
    assert measured.ratings.motor.periods[0] == pytest.approx(np.mean(along), abs=1e-12)


def test_motors_that_never_move_leave_out_no_row() -> None:
    still = np.tile([0.3, -0.2], (4, 6, 1))
    still[1, 2:] += 0.1
    still[2, 5, 1] -= 1e-9
    still[3, 1:4, 0] = 0.4
    np.testing.assert_array_equal(rows_before_change(still), [0, 2, 5, 1])
