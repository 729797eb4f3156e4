"""The start of a run on drives, found from its links, for a plant whose errors grow by a law."""

from collections.abc import Sequence
from dataclasses import replace
from typing import final

import numpy as np
import pytest

from legbench.errors import PlantFault
from legbench.plant.abstract import AbstractPlant
from legbench.recording.reader import Recording
from legbench.replay.moved import MotionSource, Moved
from legbench.replay.start_estimate import LOST, PULSE, StartEstimate, StartTrials
from legbench.replay.start_search import find_start
from legbench.signals import Command, Floats, Observation

COUNT = 1e-4
PERIOD = 1e-3
STAND, ROWS = 80, 700
OMEGA, DAMPING, GROWTH = np.array([25.0, 40.0]), 4.0, np.array([6.0, 9.0])
HOLD, AWAY = np.array([-0.2, 0.3]), np.array([0.8, 1.3])


@final
class Toppling(AbstractPlant):
    """Two links that swing about their motors, and fall away from them once these have moved.

    An error at the start is forty times (joint 1) and two hundred times (joint 2) as large at the
    end.
    """

    def __init__(self, off: float = 1e-4, falls_at: float = np.inf) -> None:
        self.period, self._off, self._falls_at = PERIOD, off, falls_at
        self.pos, self.vel = np.zeros(2), np.zeros(2)

    def put(self, pos: Floats, vel: Floats) -> None:
        self.pos, self.vel = pos.copy(), vel.copy()

    def reset(self) -> Observation:
        self.put(HOLD + self._off, np.zeros(2))
        return self._look(HOLD)

    def step(self, command: Command) -> Observation:
        motor = command.motor_pos
        moved = np.abs(motor - HOLD) > 0.5
        pull = np.where(moved, GROWTH**2 * (self.pos - HOLD), OMEGA**2 * (motor - self.pos))
        self.vel = self.vel + PERIOD * (pull - np.where(moved, 0.0, DAMPING) * self.vel)
        self.pos = self.pos + PERIOD * self.vel
        if np.abs(self.pos - HOLD).max() > self._falls_at:
            raise PlantFault("fell", "it fell")
        return self._look(motor)

    def _look(self, motor: Floats) -> Observation:
        return Observation(
            time=0.0,
            motor_pos=motor,
            joint_pos=self.pos.copy(),
            joint_vel=self.vel.copy(),
            spring_torque=motor - self.pos,
            applied_pos=motor,
        )

    def close(self) -> None:
        """Nothing to release."""


def motors() -> Floats:
    return np.where(np.arange(ROWS)[:, np.newaxis] < STAND, HOLD, AWAY)


def moved_from(
    recording: Recording, links: Floats, source: MotionSource, silent: Sequence[int] = ()
) -> Moved:
    """Rows of a run on drives whose links and motors are these; in some no drive answers."""
    columns = {name: values[:ROWS] for name, values in recording.columns.items()}
    for axis in range(2):
        columns[f"motor_pos_{axis + 1}"] = motors()[:, axis]
        columns[f"joint_pos_{axis + 1}"] = links[:, axis]
        columns[f"joint_vel_{axis + 1}"] = 1.0 + np.arange(ROWS)  # each row has its answer
        for row in silent:
            for name in ("motor_pos", "joint_pos", "joint_vel"):
                column = columns[f"{name}_{axis + 1}"] = columns[f"{name}_{axis + 1}"].copy()
                column[row] = column[row - 1]
    return Moved(replace(recording, time=recording.time[:ROWS], columns=columns), source)


def fallen(start: StartEstimate | None = None) -> Floats:
    """Links (n, 2) from a swing of one and a half counts, or from a start that was found."""
    plant = Toppling()
    plant.reset()
    if start is None:
        plant.put(HOLD + np.array([1.5e-4, -0.6e-4]), np.array([-1e-3, 2.5e-3]))
    for motor_pos in () if start is None else start.motor_pos():
        plant.step(Command.holding(motor_pos))
    links = [plant.pos, *(plant.step(Command.holding(each)).joint_pos for each in motors()[1:])]
    return np.array(links)


def rounded(links: Floats) -> Floats:
    return np.round(links / COUNT) * COUNT


STEPS: Sequence[int] = [1] * (ROWS - 1)


def test_ways_of_the_motors_are_the_last_of_the_rest() -> None:
    beside = np.array([[1e-4, 0.0], [0.0, -2e-4]])
    start = StartEstimate(hold=HOLD, periods=2 * PULSE + 3, beside=beside)
    found = np.array(list(start.motor_pos())) - HOLD
    np.testing.assert_allclose(found, np.repeat([[0.0, 0.0], *beside], [3, PULSE, PULSE], axis=0))
    still = replace(start, periods=2, beside=np.zeros((2, 2)))
    np.testing.assert_array_equal(list(still.motor_pos()), [HOLD, HOLD])


def test_a_swing_is_found_to_a_part_of_a_count(can_swing: Recording) -> None:
    """Rows at rest alone leave tens of counts at the end, the rows after them less than two.

    Starts from which the leg comes to its fall do no harm."""
    truth = fallen()
    moved = moved_from(can_swing, rounded(truth), MotionSource.MOTORS)
    assert moved.count == pytest.approx(COUNT)
    told: list[tuple[int, int]] = []
    found = find_start(
        Toppling(falls_at=0.06), moved, STEPS, lambda done, total: told.append((done, total))
    )
    assert found.rows is not None
    assert told == sorted(set(told))
    assert told[-1][0] <= told[-1][1] == told[0][1]
    plain = find_start(
        Toppling(), moved_from(can_swing, rounded(truth), MotionSource.COMMANDS), STEPS
    )
    assert plain.rows is None
    assert np.abs(fallen(plain) - truth).max() > 10.0 * COUNT
    assert np.abs(fallen(found) - truth).max() < 2.0 * COUNT


def test_rows_without_an_answer_tell_nothing_of_the_start(can_swing: Recording) -> None:
    """A repeated answer of a moving leg lies far beside it, and is no reason to lose it."""
    stood = StartEstimate(hold=HOLD, periods=30, beside=np.zeros((2, 2)))
    links, silent = rounded(fallen(stood)), [STAND + 20, *range(ROWS - 60, ROWS - 30)]
    moved = moved_from(can_swing, links, MotionSource.MOTORS, silent)
    assert np.flatnonzero(moved.stale.all(axis=1)).tolist() == silent
    assert np.abs(moved.joint_pos - links).max() > LOST * COUNT
    trials = StartTrials(Toppling(), moved, STEPS, COUNT)
    followed = trials.follow(stood)
    assert (len(followed.links), followed.beside) == (ROWS, ROWS)
    assert np.abs(trials.missing(followed.links)).max() < COUNT
    assert not trials.missing(followed.links).reshape(ROWS, 2)[silent].any()
    assert find_start(Toppling(), moved, STEPS).rows is None


def test_a_leg_that_falls_beside_every_start_is_left_as_it_stands(can_swing: Recording) -> None:
    moved = moved_from(can_swing, rounded(fallen()), MotionSource.MOTORS)
    trials = StartTrials(Toppling(falls_at=1e-6), moved, STEPS, COUNT)
    start = StartEstimate(hold=HOLD, periods=2 * PULSE, beside=np.zeros((2, 2)))
    assert trials.follow(start).beside == 0
    assert trials.better(start, 10, (1.0,)) is None


def test_a_leg_that_stands_elsewhere_is_not_swung(can_swing: Recording) -> None:
    """The swing of another leg would only hide that it is another one."""
    links = rounded(fallen() + 4.0 * COUNT)
    found = find_start(Toppling(), moved_from(can_swing, links, MotionSource.MOTORS), STEPS)
    assert found.rows is None
    assert not found.beside.any()


def test_a_leg_that_stays_beside_is_left_as_it_stands(can_swing: Recording) -> None:
    stood = StartEstimate(hold=HOLD, periods=30, beside=np.zeros((2, 2)))
    moved = moved_from(can_swing, rounded(fallen(stood)), MotionSource.MOTORS)
    found = find_start(Toppling(), moved, STEPS)
    assert found.periods == 30
    assert found.rows is None


def test_a_link_that_never_moves_has_no_count(can_swing: Recording) -> None:
    links = np.tile(HOLD, (ROWS, 1))
    moved = moved_from(can_swing, links, MotionSource.MOTORS)
    assert moved.count is None
    assert find_start(Toppling(), moved, STEPS).rows is None
