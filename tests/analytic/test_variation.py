"""Derivatives on the fast path against complex steps, differences and closed forms."""

import math
from pathlib import Path

import numpy as np
import pytest
from exact_leg import exact_design
from scipy.integrate import solve_ivp

from legbench.analytic import LegModel, LegState, Regime, equations, flying, standing
from legbench.analytic.dual import DUAL, Dual, gradient, seeds
from legbench.design import load_design
from legbench.signals import Floats

pytest.importorskip("heyoka")

from legbench.analytic.taylor import SILENT, Levels, TaylorLeg, Watched

EXACT = LegModel.of(exact_design(damping=0.01), stops=False)
PROTOTYPE = LegModel.of(load_design(Path(__file__).parents[2] / "models" / "prototype.toml"))
PROBE = (-math.sqrt(0.5), math.sqrt(0.5))
MOTOR = (-0.45, 0.4)
TINY = 1e-40


@pytest.fixture(scope="module")
def fast() -> TaylorLeg:
    return TaylorLeg(EXACT, probe=PROBE)


@pytest.fixture(scope="module")
def stopped() -> TaylorLeg:
    return TaylorLeg(PROTOTYPE)


def numbers(state: LegState) -> list[float]:
    return [state.time, *state.q, *state.v, *state.trunk_pos, *state.trunk_vel]


def moved(state: LegState, values: list[float]) -> LegState:
    """The state with other angles, rates, trunk positions and velocities, in this order."""
    q1, q2, v1, v2, x, z, vx, vz = values
    return state._replace(q=(q1, q2), v=(v1, v2), trunk_pos=(x, z), trunk_vel=(vx, vz))


def formula(x: complex, y: complex, ops: equations.Ops) -> complex:
    root = ops.sqrt(2.0 + x * y) - (1.0 - ops.sin(x)) / (y + 3.0)
    return 2.0 / (root * ops.cos(y - x) - x) + (-y) * (x - 1.0) + 0.5


def test_dual_numbers_are_complex_steps() -> None:
    x, y = seeds(np.array([0.7, -0.3]))
    got = formula(x, y, DUAL)  # type: ignore[arg-type]
    assert isinstance(got, Dual)
    wanted = [
        formula(0.7 + dx * 1j * TINY, -0.3 + dy * 1j * TINY, equations.COMPLEX).imag / TINY
        for dx, dy in ((1.0, 0.0), (0.0, 1.0))
    ]
    assert np.allclose(gradient(got), wanted, rtol=1e-14, atol=0.0)
    assert float(got) == pytest.approx(formula(0.7, -0.3, equations.SCALAR), rel=1e-15)  # type: ignore[arg-type]
    assert max(x, y, 0.1) is x
    assert (2.0 - x < y + 1.7) is True


@pytest.mark.parametrize("regime", [Regime.PINNED, Regime.HANGING])
def test_variational_equations_are_complex_steps_through_the_flow(
    fast: TaylorLeg, regime: Regime
) -> None:
    terms = EXACT.stance if regime is Regime.PINNED else EXACT.hanging
    start = np.array([-0.9, 0.8, 0.3, -0.2])

    def rates(_time: float, y: Floats) -> list[complex]:
        q1, q2, v1, v2 = y.tolist()
        torque = EXACT.torque(MOTOR, (q1, q2), (v1, v2))
        a = equations.pair_acceleration(equations.COMPLEX, terms, (q1, q2), (v1, v2), torque)
        return [v1, v2, *a]

    wanted = []
    for column in np.eye(4):
        path = solve_ivp(
            rates,
            (0.0, 0.4),
            start + TINY * 1j * column,
            method="DOP853",
            rtol=1e-12,
            atol=1e-14,
        )
        wanted.append(path.y[:, -1].imag / TINY)
    q1, q2, v1, v2 = seeds(start)
    state = standing(EXACT, (-0.9, 0.8), (0.3, -0.2), pinned=True)
    state = state._replace(regime=regime, q=(q1, q2), v=(v1, v2))
    end, what = fast.varied.watch(state, 0.4, MOTOR, SILENT)
    assert what is None
    got = [gradient(value) for value in (*end.q, *end.v)]
    assert np.allclose(got, np.transpose(wanted), rtol=1e-10, atol=1e-10)


def differences(
    leg: TaylorLeg, start: LegState, until: float, motor: tuple[float, float], size: float
) -> Floats:
    values, columns = numbers(start)[1:], []
    for index in range(8):
        ends = []
        for sign in (1.0, -1.0):
            shifted = list(values)
            shifted[index] += sign * size
            end, _ = leg.advance(moved(start, shifted), until, motor)
            ends.append(numbers(end))
        above, below = ends
        columns.append(np.subtract(above, below) / (2.0 * size))
    return np.stack(columns, axis=-1)


def exact(leg: TaylorLeg, start: LegState, until: float, motor: tuple[float, float]) -> Floats:
    values = seeds(np.array(numbers(start)[1:]))
    end, _ = leg.varied.advance(moved(start, list(values)), until, motor)
    return np.stack([gradient(value) * np.ones(8) for value in numbers(end)])


def test_a_hop_through_impact_and_liftoff_is_its_differences(fast: TaylorLeg) -> None:
    q = (-0.7, 0.6)
    start = flying(EXACT, q, (0.4, -0.3), (0.0, 0.04 - EXACT.foot_from_hip(q)[1]), (0.1, 0.0))
    _, happened = fast.advance(start, 0.55, MOTOR)
    assert [event.touchdown for event in happened][:1] == [True]
    assert len(happened) >= 2
    got = exact(fast, start, 0.55, MOTOR)
    assert np.allclose(got, differences(fast, start, 0.55, MOTOR, 1e-6), rtol=1e-6, atol=1e-6)


def test_a_joint_stop_on_the_way_is_its_differences(stopped: TaylorLeg) -> None:
    start = flying(PROTOTYPE, (-0.4, 0.4), (20.0, -18.0), (0.0, 2.0), (0.0, 0.0))
    motor, knee = (-0.4, 0.4), []
    for tick in range(1, 61):
        q1, q2 = stopped.advance(start, 0.001 * tick, motor)[0].q
        knee.append(q2 - q1)
    assert min(knee) < 0.30 < knee[-1]
    got = exact(stopped, start, 0.06, motor)
    wanted = differences(stopped, start, 0.06, motor, 1e-6)
    assert np.allclose(got, wanted, rtol=1e-5, atol=1e-5)


def test_touchdown_of_a_stone_moves_as_its_formula_says(fast: TaylorLeg) -> None:
    q = (-0.6, 0.7)
    drop, speed = 0.08, -0.5
    z, vz = seeds(np.array([drop - EXACT.foot_from_hip(q)[1], speed]))
    start = flying(EXACT, q, (0.0, 0.0), (0.0, float(z)), (0.2, speed))
    start = start._replace(trunk_pos=(0.0, z), trunk_vel=(0.2, vz))
    end, what = fast.varied.watch(start, 1.0, q, SILENT)
    assert what is Watched.CONTACT
    g = EXACT.floating.gravity
    root = math.sqrt(speed**2 + 2.0 * g * drop)
    assert math.isclose(end.time, (speed + root) / g, rel_tol=1e-12)
    assert np.allclose(gradient(end.time), [1.0 / root, (1.0 + speed / root) / g], rtol=1e-10)


def test_levels_and_times_that_move_move_the_end(fast: TaylorLeg) -> None:
    start = standing(EXACT, (-0.9, 0.9), pinned=True)
    (level,) = seeds(np.array([1.15]))
    end, what = fast.varied.watch(start, 1.0, MOTOR, Levels(lower=level))
    assert what is Watched.FALL
    probe = PROBE[0] * end.q[0] + PROBE[1] * end.q[1]
    assert np.allclose(gradient(probe), 1.0, rtol=1e-12)
    (time,) = seeds(np.array([0.05]))
    end, _ = fast.varied.watch(start, time, MOTOR, SILENT)
    assert np.allclose(gradient(end.time), 1.0)
    assert np.allclose(gradient(end.q[0]), end.v[0], rtol=1e-12)
