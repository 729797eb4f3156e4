from dataclasses import replace

import numpy as np
import pytest
from metrics_runs import PERIOD, PROTOTYPE, Hop, clock, manifest, recording, remade
from scipy.integrate import solve_ivp

from legbench.metrics.analysis import Analysis
from legbench.metrics.budget import energy_budget
from legbench.metrics.energy import (
    clean_intervals,
    energy_flows,
    energy_residual,
    loop_gap_max,
)
from legbench.recording.reader import Recording

INERTIA = np.array([0.002, 0.003])
HFTS = manifest(setup={"kind": "hfts"})


def motion(motor_pos: np.ndarray, damping: np.ndarray) -> np.ndarray:
    """Two sprung, damped wheels whose motors move at the start of each cycle (n, 4)."""
    stiffness = np.array(PROTOTYPE.stiffness)
    state = np.array([-0.5, 0.6, 0.0, 0.0])
    states = [state]
    for motor in motor_pos[1:]:

        def slope(_: float, now: np.ndarray, motor: np.ndarray = motor) -> np.ndarray:
            torque = stiffness * (motor - now[:2]) - damping * now[2:]
            return np.concatenate([now[2:], torque / INERTIA])

        state = solve_ivp(slope, (0.0, PERIOD), state, method="DOP853", rtol=1e-12, atol=1e-14).y[
            :, -1
        ]
        states.append(state)
    return np.array(states)


def driven(damping_factor: float = 1.0, slewing: bool = False) -> Recording:
    time = clock(400)
    steps = np.where(np.sin(40.0 * time) > 0.0, 0.1, -0.1)
    moved = 0.1 * np.sin(40.0 * time) if slewing else steps
    motor_pos = np.stack([-0.6 - moved, 0.6 + moved], axis=-1)
    states = motion(motor_pos, damping_factor * np.array(PROTOTYPE.damping))
    kinetic = 0.5 * np.square(states[:, 2:]) @ INERTIA
    return recording(
        time,
        HFTS,
        motor_pos=motor_pos,
        joint_pos=states[:, :2],
        joint_vel=states[:, 2:],
        energy=np.stack([np.zeros_like(kinetic), kinetic], axis=-1),
        contact=np.zeros(len(time)),
    )


@pytest.mark.parametrize(("slewing", "bound"), [(False, 2e-5), (True, 2e-4)])
def test_an_exactly_integrated_leg_has_no_residual(slewing: bool, bound: float) -> None:
    run = driven(slewing=slewing)
    assert energy_residual(run, energy_flows(run)) < bound


def test_a_loss_that_the_design_does_not_know_is_the_residual() -> None:
    run = driven(damping_factor=1.5)
    loss = np.square(run["joint_vel"]) @ (0.5 * np.array(PROTOTYPE.damping))
    missing = np.trapezoid(loss, run.time) / run["energy"][:, 1].max()
    assert missing > 0.01
    assert energy_residual(run, energy_flows(run)) == pytest.approx(missing, rel=1e-2)


def test_flows_add_up_to_the_change_of_the_whole_energy() -> None:
    run = driven()
    flows = energy_flows(run)
    whole = run["energy"].sum(axis=-1)
    stretch = run["motor_pos"] - run["joint_pos"]
    whole += 0.5 * np.square(stretch) @ np.asarray(PROTOTYPE.stiffness)
    np.testing.assert_allclose(flows.gain, np.diff(whole), atol=1e-15)
    balance = flows.motor_work - flows.damper_loss + flows.unexplained
    np.testing.assert_allclose(flows.gain, balance, atol=1e-15)
    assert np.all(flows.damper_loss > -1e-9)


def test_the_integral_converges_where_the_motors_stand_still() -> None:
    time = clock(300)
    joint_vel = np.stack([5.0 * np.cos(60.0 * time), np.zeros_like(time)], axis=-1)
    loss = energy_flows(recording(time, HFTS, joint_vel=joint_vel)).damper_loss
    exact = 25.0 * PROTOTYPE.damping[0] * (0.5 * time + np.sin(120.0 * time) / 240.0)
    np.testing.assert_allclose(loss[1:-1], np.diff(exact)[1:-1], atol=5e-10)


def test_contact_and_stops_are_left_out_with_a_row_around() -> None:
    time = clock(60)
    joint = np.tile([-0.5, 0.5], (60, 1))
    joint[40] = [-0.16, 0.15]
    contact = np.isin(np.arange(60), [10, 11])
    run = recording(time, manifest(), joint_pos=joint, contact=contact)
    left_out = np.flatnonzero(~clean_intervals(run))
    np.testing.assert_array_equal(left_out, [8, 9, 10, 11, 12, 38, 39, 40, 41])
    pinned = recording(time, manifest(setup={"kind": "ffs"}), joint_pos=joint, contact=contact)
    np.testing.assert_array_equal(np.flatnonzero(~clean_intervals(pinned)), [38, 39, 40, 41])


def test_an_impact_counts_as_loss_and_not_as_residual() -> None:
    hop = Hop()
    signals = hop.signals()
    posture = np.tile([-0.6, 0.6], (len(signals["time"]), 1))
    landed = np.cumsum(np.diff(signals["contact"].astype(int), prepend=1) == 1)
    potential = 5.0 - 0.1 * landed
    energy = np.stack([potential, np.ones_like(potential)], axis=-1)
    run = hop.recording(energy=energy, joint_pos=posture, motor_pos=posture)
    flows = energy_flows(run)
    budget = energy_budget(run, Analysis(run).gait, flows)
    np.testing.assert_allclose(budget.impact_loss, [0.1, 0.1, 0.1], atol=1e-12)
    np.testing.assert_allclose(budget.gain, [-0.1, -0.1, -0.1], atol=1e-12)
    for name in ("stop_loss", "contact_loss", "other_loss", "motor_work", "damper_loss"):
        np.testing.assert_allclose(getattr(budget, name), 0.0, atol=1e-12)
    assert energy_residual(run, flows) < 1e-12


def test_a_joint_at_its_stop_in_flight_has_its_own_loss() -> None:
    hop = Hop()
    signals = hop.signals()
    time, count = signals["time"], len(signals["time"])
    flown = np.mod(time - hop.liftoff(0), hop.cycle)
    at_stop = (flown > 0.02) & (flown < 0.03) & ~signals["contact"]
    energy = np.ones((count, 2))
    energy[:, 0] = 5.0 - 0.01 * np.cumsum(at_stop)
    posture = np.where(at_stop[:, None], [-0.15, 0.15], [-0.6, 0.6])
    run = hop.recording(energy=energy, joint_pos=posture, motor_pos=posture)
    free = replace(PROTOTYPE, stiffness=(1e-12, 1e-12))
    run = remade(run, manifest(free))
    budget = energy_budget(run, Analysis(run).gait, energy_flows(run))
    np.testing.assert_allclose(budget.stop_loss, 0.1, atol=1e-9)
    np.testing.assert_allclose(budget.impact_loss + budget.other_loss, 0.0, atol=1e-9)


def test_a_budget_adds_up() -> None:
    hop = Hop()
    count = len(hop.signals()["time"])
    noise = np.random.default_rng(1).normal(size=(3, count, 2))
    run = hop.recording(energy=noise[0], joint_vel=noise[1], motor_pos=noise[2])
    budget = energy_budget(run, Analysis(run).gait, energy_flows(run))
    losses = budget.damper_loss + budget.impact_loss + budget.stop_loss
    losses += budget.contact_loss + budget.other_loss
    np.testing.assert_allclose(budget.gain, budget.motor_work - losses, atol=1e-9)


def test_without_truth_motion_or_rows_there_is_no_residual() -> None:
    real = Hop().real()
    assert np.isnan(energy_residual(real, energy_flows(real)))
    assert np.isnan(loop_gap_max(real))
    empty = recording(np.zeros(0), HFTS)
    assert np.isnan(energy_residual(empty, energy_flows(empty)))
    still = recording(clock(9), HFTS, energy=np.zeros((9, 2)), contact=np.zeros(9))
    assert np.isnan(energy_residual(still, energy_flows(still)))


def test_loop_gap_is_the_widest_of_either_sign_that_is_known() -> None:
    gap = np.array([[1e-7, np.nan], [-3e-6, 2e-6]])
    assert loop_gap_max(recording(clock(2), HFTS, loop_gap=gap)) == 3e-6


def test_a_design_with_other_damping_is_not_the_same_leg() -> None:
    run = driven()
    stiffer = replace(PROTOTYPE, damping=(0.02, 0.02))
    other = remade(run, manifest(stiffer, setup={"kind": "hfts"}))
    assert energy_residual(other, energy_flows(other)) > 0.01
