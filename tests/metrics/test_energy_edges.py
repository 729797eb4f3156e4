"""Which law integrates each interval, and from where a joint stop counts."""

from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest
from metrics_runs import PERIOD, PROTOTYPE, clock, manifest, recording

from legbench.metrics.energy import (
    clean_intervals,
    energy_flows,
    energy_residual,
    stop_intervals,
)
from legbench.signals import Floats

HFTS = manifest(setup={"kind": "hfts"})
CUBIC = np.polynomial.Polynomial([2.0, 30.0, -400.0, 5000.0])
"""Dissipated power over time [W], positive in all rows here."""
SLOT = 0.02
"""Distance to a stop from which a row is left out [rad]."""


def losses(time: Floats, motor_pos: Floats | None = None) -> Floats:
    """Loss of each interval of a leg whose hip alone turns, as fast as `CUBIC` asks for."""
    speed = np.sqrt(CUBIC(time) / PROTOTYPE.damping[0])
    joint_vel = np.stack([speed, np.zeros_like(speed)], axis=-1)
    motors = np.zeros((len(time), 2)) if motor_pos is None else motor_pos
    run = recording(time, HFTS, joint_vel=joint_vel, motor_pos=motors)
    return energy_flows(run).damper_loss


def straight(time: Floats) -> list[int]:
    """Intervals of a leg with still motors that the trapezoid integrates."""
    return straight_of(time, losses(time))


def straight_of(time: Floats, seen: Floats) -> list[int]:
    """Intervals whose losses are the trapezoid's; all others must be exact."""
    whole = CUBIC.integ()
    exact = np.diff(whole(time))
    trapezoid = [np.trapezoid(CUBIC(pair), pair) for pair in pairwise(time)]
    by_trapezoid = np.isclose(seen, trapezoid, rtol=0.0, atol=1e-12)
    exactly = np.isclose(seen, exact, rtol=0.0, atol=1e-12)
    assert np.all(by_trapezoid != exactly)
    return np.flatnonzero(by_trapezoid).tolist()


@pytest.mark.parametrize("rows", [4, 5, 9])
def test_a_cubic_is_integrated_exactly_but_at_the_ends(rows: int) -> None:
    assert straight(clock(rows)) == [0, rows - 2]


@pytest.mark.parametrize("rows", [2, 3])
def test_fewer_than_four_rows_are_integrated_by_the_trapezoid(rows: int) -> None:
    assert straight(clock(rows)) == list(range(rows - 1))


@pytest.mark.parametrize("motor", [0, 1])
def test_a_motor_that_moves_bends_the_two_intervals_around_its_row(motor: int) -> None:
    time = clock(12)
    motor_pos = np.zeros((12, 2))
    # The motor moves in the first instant of interval 5, at row 5: four rows around interval 4
    # or 5 have that bend inside.
    motor_pos[6:, motor] = 0.1
    assert straight_of(time, losses(time, motor_pos)) == [0, 4, 5, 10]


def test_a_late_row_bends_the_intervals_whose_neighbours_are_of_another_length() -> None:
    time = clock(12)
    time[6:] += 3.0 * PERIOD
    assert straight(time) == [0, 4, 5, 6, 10]


@pytest.mark.parametrize(("share", "bent"), [(0.9e-6, False), (1.1e-6, True)])
def test_rows_that_differ_by_rounding_are_even(share: float, bent: bool) -> None:
    time = clock(12)
    time[6:] += share * PERIOD
    assert straight(time) == ([0, 4, 5, 6, 10] if bent else [0, 10])


HIP, KNEE = PROTOTYPE.limits.hip, PROTOTYPE.limits.knee
FREE = (0.5 * sum(HIP), 0.5 * sum(KNEE))


def posture(hip: float, knee: float) -> Floats:
    """Joint angles q1, q2 of a hip and a knee angle."""
    return np.array([hip, hip + knee])


@pytest.mark.parametrize(
    "at",
    [
        lambda inside: posture(HIP[0] + inside, FREE[1]),
        lambda inside: posture(HIP[1] - inside, FREE[1]),
        lambda inside: posture(FREE[0], KNEE[0] + inside),
        lambda inside: posture(FREE[0], KNEE[1] - inside),
    ],
    ids=["hip low", "hip high", "knee low", "knee high"],
)
def test_each_stop_acts_from_its_margin_on(at: Callable[[float], Floats]) -> None:
    joint_pos = np.tile(posture(*FREE), (9, 1))

    def left_out(inside: float) -> list[int]:
        joint_pos[4] = at(inside)
        run = recording(clock(9), HFTS, joint_pos=joint_pos)
        return np.flatnonzero(stop_intervals(run)).tolist()

    assert left_out(SLOT + 1e-9) == []
    assert left_out(SLOT - 1e-9) == [2, 3, 4, 5]
    assert left_out(-0.1) == [2, 3, 4, 5]


@pytest.mark.parametrize("height", [0.0, -1e-9])
def test_a_foot_on_the_ground_is_down_with_or_without_a_contact(height: float) -> None:
    joint_pos, foot_pos = np.tile(posture(*FREE), (9, 1)), np.full((9, 2), 0.25)
    for contact, row in ((np.arange(9) == 4, 0.25), (np.zeros(9), height), (np.zeros(9), 1e-9)):
        foot_pos[4, 1] = row
        run = recording(clock(9), joint_pos=joint_pos, foot_pos=foot_pos, contact=contact)
        down = [] if row == 1e-9 else [2, 3, 4, 5]
        assert np.flatnonzero(~clean_intervals(run)).tolist() == down


def test_the_residual_is_the_worst_drift_within_one_clean_stretch() -> None:
    """Losses at a stop count for nothing, and what is lost before it is no part of what follows."""
    joint_pos = np.tile(posture(*FREE), (20, 1))
    joint_pos[9] = posture(HIP[1], FREE[1])
    energy = np.ones((20, 2))
    lost = np.zeros(20)
    lost[3], lost[5], lost[9], lost[14] = 0.1, 0.2, 5.0, 0.25
    energy[:, 0] = 8.0 - np.cumsum(lost)
    energy[17, 1] = 2.0
    energy[17, 0] -= 1.0
    run = recording(clock(20), HFTS, joint_pos=joint_pos, motor_pos=joint_pos, energy=energy)
    flows = energy_flows(run)
    assert np.flatnonzero(~clean_intervals(run)).tolist() == [7, 8, 9, 10]
    # 0.3 J before the stop and 0.25 J after it, over 2 J of kinetic energy.
    assert energy_residual(run, flows) == pytest.approx(0.3 / 2.0, abs=1e-12)


@pytest.mark.parametrize(("share", "moves"), [(0.9e-6, False), (1.1e-6, True)])
def test_a_leg_moves_from_a_millionth_of_its_weight_times_its_length_on(
    share: float, moves: bool
) -> None:
    free = np.tile(posture(*FREE), (9, 1))
    energy = np.ones((9, 2))
    energy[:, 1] = 0.0
    energy[4, 1] = share * 9.81 * PROTOTYPE.total_mass * PROTOTYPE.shank.length
    run = recording(clock(9), HFTS, joint_pos=free, motor_pos=free, energy=energy)
    assert np.isfinite(energy_residual(run, energy_flows(run))) == moves
