"""The equations against energies, against each other and against their own structure."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from exact_leg import exact_design

from legbench.analytic import Bars, LegModel, PairTerms, floating_terms, stance_terms
from legbench.analytic import equations as eq
from legbench.analytic import matrices as mx
from legbench.design import LegDesign, load_design
from legbench.design.statics import GRAVITY, Support, gravity_load
from legbench.errors import ConfigError
from legbench.kinematics import direction, joint_to_polar, joint_to_polar_rate
from legbench.signals import Floats

MODELS = Path(__file__).parents[2] / "models"
DESIGNS = [exact_design(damping=0.004), load_design(MODELS / "prototype.toml")]
each_design = pytest.mark.parametrize("design", DESIGNS, ids=lambda design: design.name)


def random_states(count: int = 200) -> tuple[Floats, Floats]:
    random = np.random.default_rng(7)
    q1 = random.uniform(-2.0, 0.5, count)
    pos = np.stack(
        [*random.uniform(-1.0, 1.0, (2, count)), q1, q1 + random.uniform(0.2, 2.9, count)], axis=-1
    )
    vel = random.uniform(-1.0, 1.0, (count, 4)) * np.array([2.0, 2.0, 20.0, 20.0])
    return pos, vel


def centres(design: LegDesign, pos: Floats) -> Floats:
    """Trunk, thigh, shank, foot centres of mass in the world (..., 4, 2), from the drawing."""
    hip, q1, q2 = pos[..., :2], pos[..., 2], pos[..., 3]
    knee = hip + design.thigh.length * direction(q1)
    ankle = knee + design.shank.length * direction(q2)
    return np.stack(
        [
            hip,
            hip + design.thigh.com * direction(q1),
            knee + design.shank.com * direction(q2),
            ankle + design.foot.com * direction(q1),
        ],
        axis=-2,
    )


def masses(design: LegDesign) -> Floats:
    return np.array([design.trunk_mass, *(segment.mass for segment in design.segments)])


def kinetic(design: LegDesign, pos: Floats, vel: Floats, step: float = 1e-6) -> Floats:
    """From the bodies' positions, differenced along the velocity."""
    moved = centres(design, pos + step * vel) - centres(design, pos - step * vel)
    speed = np.linalg.norm(moved / (2.0 * step), axis=-1)
    turning = np.stack([vel[..., 2], vel[..., 3], vel[..., 2]], axis=-1)
    inertia = np.array([segment.inertia for segment in design.segments])
    return 0.5 * (speed**2 @ masses(design)) + 0.5 * (turning**2 @ inertia)


def potential(design: LegDesign, pos: Floats) -> Floats:
    return GRAVITY * centres(design, pos)[..., 1] @ masses(design)


def gradient(function: Any, at: Floats, step: float = 1e-20) -> Floats:
    """By a complex step: exact to rounding."""
    columns = []
    for index in range(at.shape[-1]):
        moved = at.astype(np.complex128)
        moved[..., index] += 1j * step
        columns.append(np.imag(function(moved)) / step)
    return np.stack(columns, axis=-1)


@each_design
def test_mass_matrix_is_the_hessian_of_kinetic_energy(design: LegDesign) -> None:
    pos, _ = random_states()
    basis = np.eye(4)
    from_energy = np.empty((len(pos), 4, 4))
    for i in range(4):
        for j in range(4):
            both = kinetic(design, pos, np.broadcast_to(basis[i] + basis[j], pos.shape))
            one = kinetic(design, pos, np.broadcast_to(basis[i], pos.shape))
            other = kinetic(design, pos, np.broadcast_to(basis[j], pos.shape))
            from_energy[:, i, j] = both - one - other
    mass = mx.floating_mass(floating_terms(design), pos)
    assert np.max(np.abs(mass - from_energy)) < 1e-7


@each_design
def test_gravity_is_the_gradient_of_the_potential(design: LegDesign) -> None:
    pos, _ = random_states()
    wanted = gradient(lambda at: potential(design, at), pos)
    assert np.max(np.abs(mx.floating_gravity(floating_terms(design), pos) - wanted)) < 1e-9
    for terms in (stance_terms(design), floating_terms(design).hanging()):

        def height(q: Floats, terms: PairTerms = terms) -> Floats:
            return eq.pair_potential(eq.ARRAY, terms, (q[..., 0], q[..., 1]))

        pair = gradient(height, pos[:, 2:])
        assert np.max(np.abs(mx.pair_gravity(terms, pos[:, 2:]) - pair)) < 1e-9


@each_design
def test_mdot_minus_two_c_is_skew(design: LegDesign) -> None:
    pos, vel = random_states()
    floating, stance = floating_terms(design), stance_terms(design)
    step = 1e-20j
    moved: Any = pos + step * vel
    rate4 = np.imag(mx.floating_mass(floating, moved)) / 1e-20
    skew4 = rate4 - 2.0 * mx.floating_coriolis(floating, pos, vel)
    q, v = pos[:, 2:], vel[:, 2:]
    rate2 = np.imag(mx.pair_mass(stance, moved[:, 2:])) / 1e-20
    skew2 = rate2 - 2.0 * mx.pair_coriolis(stance, q, v)
    for skew in (skew4, skew2):
        assert np.max(np.abs(skew + np.swapaxes(skew, -1, -2))) < 1e-9


@each_design
def test_appendix_1_is_the_floating_leg_with_the_foot_held(design: LegDesign) -> None:
    appendix, summed = stance_terms(design), floating_terms(design).pinned()
    for name in ("inertia", "coupling", "moment"):
        assert np.allclose(getattr(appendix, name), getattr(summed, name), rtol=0.0, atol=1e-12)
    # And by Lagrange's multipliers, which know nothing of moving the reference point.
    pos, vel = random_states()
    terms = floating_terms(design)
    torque = np.random.default_rng(3).uniform(-5.0, 5.0, (len(pos), 2))
    jacobian = mx.contact_jacobian(terms, pos)
    q, v = pos[:, 2:], vel[:, 2:]
    vel = np.concatenate([-np.einsum("nij,nj->ni", jacobian[..., 2:], v), v], axis=-1)
    turning = np.stack([-np.sin(q), np.cos(q)], axis=-2) * terms.reach
    drift = np.einsum("nij,nj->ni", turning, v**2)
    bias = np.einsum("nij,nj->ni", mx.floating_coriolis(terms, pos, vel), vel)
    bias += mx.floating_gravity(terms, pos)
    system = np.zeros((len(pos), 6, 6))
    system[:, :4, :4] = mx.floating_mass(terms, pos)
    system[:, :4, 4:], system[:, 4:, :4] = -np.swapaxes(jacobian, 1, 2), jacobian
    right = np.concatenate([-bias, -drift], axis=-1)
    right[:, 2:4] += torque
    solved = np.linalg.solve(system, right[..., np.newaxis])[..., 0]
    pairs = (tuple(q.T), tuple(v.T), tuple(torque.T))
    a = eq.pair_acceleration(eq.ARRAY, appendix, *pairs)
    force = eq.contact_force(eq.ARRAY, terms, pairs[0], pairs[1], a)
    wanted = np.stack([*a, *force], axis=-1)
    assert np.max(np.abs(solved[:, 2:] - wanted) / (1.0 + np.abs(wanted))) < 1e-12


@each_design
def test_flight_eliminates_the_trunk_exactly(design: LegDesign) -> None:
    pos, vel = random_states()
    terms = floating_terms(design)
    torque = np.random.default_rng(4).uniform(-5.0, 5.0, (len(pos), 2))
    right = -np.einsum("nij,nj->ni", mx.floating_coriolis(terms, pos, vel), vel)
    right -= mx.floating_gravity(terms, pos)
    right[:, 2:] += torque
    dense = np.linalg.solve(mx.floating_mass(terms, pos), right[..., np.newaxis])[..., 0]
    q, v = tuple(pos[:, 2:].T), tuple(vel[:, 2:].T)
    a = eq.pair_acceleration(eq.ARRAY, terms.falling(), q, v, tuple(torque.T))
    trunk = eq.trunk_acceleration(eq.ARRAY, terms, q, v, a)
    closed = np.stack([*trunk, *a], axis=-1)
    assert np.max(np.abs(closed - dense) / (1.0 + np.abs(dense))) < 1e-11


@each_design
def test_batch_and_loop_agree(design: LegDesign) -> None:
    pos, vel = random_states(50)
    model = LegModel.of(design, stops=False)
    q, v = pos[:, 2:], vel[:, 2:]
    torque = model.torque((-0.5, 0.6), tuple(q.T), tuple(v.T))
    batch = np.stack(eq.pair_acceleration(eq.ARRAY, model.stance, tuple(q.T), tuple(v.T), torque))
    loop = [
        model.stance_acceleration((-0.5, 0.6), tuple(a), tuple(b))
        for a, b in zip(q.tolist(), v.tolist(), strict=True)
    ]
    assert np.allclose(batch.T, loop, rtol=1e-12, atol=1e-12)
    stacked = mx.floating_mass(model.floating, pos.reshape(5, 10, 4))
    assert np.array_equal(stacked.reshape(50, 4, 4), mx.floating_mass(model.floating, pos))


@each_design
def test_polar_dynamics_move_the_foot_as_the_joints_do(design: LegDesign) -> None:
    pos, vel = random_states()
    terms, reach = stance_terms(design), design.shank.length
    q, v = pos[:, 2:], vel[:, 2:]
    torque = np.random.default_rng(5).uniform(-2.0, 2.0, q.shape)
    pairs = (tuple(q.T), tuple(v.T), tuple(torque.T))
    a = np.stack(eq.pair_acceleration(eq.ARRAY, terms, *pairs), axis=-1)
    jacobian = mx.polar_jacobian(reach, q)
    rate = joint_to_polar_rate(q, v, reach)
    assert np.allclose(np.einsum("nij,nj->ni", jacobian, v), rate, atol=1e-12)
    acceleration = np.einsum("nij,nj->ni", jacobian, a)
    acceleration += np.einsum("nij,nj->ni", mx.polar_jacobian_rate(reach, q, v), v)
    mass, coriolis, gravity = mx.polar_dynamics(terms, reach, q, v)
    left = np.einsum("nij,nj->ni", mass, acceleration)
    left += np.einsum("nij,nj->ni", coriolis, rate) + gravity
    right = np.linalg.solve(np.swapaxes(jacobian, 1, 2), torque[..., np.newaxis])[..., 0]
    assert np.max(np.abs(left - right) / (1.0 + np.abs(right))) < 1e-9


def test_polar_dynamics_of_the_matched_leg_decouple_on_the_axis() -> None:
    half = np.linspace(0.2, 1.4, 50)
    q, v = np.stack([-half, half], axis=-1), np.full((50, 2), 3.0) * [-1.0, 1.0]
    leg = exact_design()
    mass, coriolis, gravity = mx.polar_dynamics(stance_terms(leg), leg.shank.length, q, v)
    assert np.max(np.abs(mass[:, 0, 1])) < 1e-12
    assert np.max(np.abs(coriolis[:, 0, 1])) < 1e-12
    assert np.max(np.abs(gravity[:, 0])) < 1e-12
    assert np.allclose(joint_to_polar(q, leg.shank.length)[:, 0], 0.0)


def test_polar_dynamics_refuse_the_straight_leg() -> None:
    leg = exact_design()
    with pytest.raises(ConfigError, match="straight or folded"):
        mx.polar_dynamics(stance_terms(leg), leg.shank.length, np.zeros(2), np.zeros(2))


@each_design
def test_statics_of_the_design_room_are_the_same_gravity(design: LegDesign) -> None:
    pairs = {Support.FOOT: stance_terms(design), Support.TRUNK: floating_terms(design).hanging()}
    for support, terms in pairs.items():
        assert np.allclose(gravity_load(design, support).moment, terms.moment, atol=1e-13)


@each_design
def test_impact_is_a_projector_that_stops_the_foot(design: LegDesign) -> None:
    pos, vel = random_states()
    terms = floating_terms(design)
    impact = mx.impact_map(terms, pos)
    assert np.max(np.abs(impact @ impact - impact)) < 1e-11
    after = np.einsum("nij,nj->ni", impact, vel)
    foot = np.einsum("nij,nj->ni", mx.contact_jacobian(terms, pos), after)
    assert np.max(np.abs(foot)) < 1e-11
    mass = mx.floating_mass(terms, pos)
    lost = 0.5 * np.einsum("ni,nij,nj->n", vel, mass, vel)
    lost -= 0.5 * np.einsum("ni,nij,nj->n", after, mass, after)
    assert np.all(lost >= 0.0)
    standing = np.einsum("nij,nj->ni", impact, after)
    assert np.max(np.abs(standing - after)) < 1e-11


@each_design
def test_closed_form_of_touchdown_is_the_projector(design: LegDesign) -> None:
    pos, vel = random_states()
    terms = floating_terms(design)
    wanted = np.einsum("nij,nj->ni", mx.impact_map(terms, pos), vel)[:, 2:]
    foot = np.einsum("nij,nj->ni", mx.contact_jacobian(terms, pos), vel)
    closed, lost = eq.touchdown(
        eq.ARRAY,
        stance_terms(design),
        terms,
        tuple(pos[:, 2:].T),
        tuple(vel[:, 2:].T),
        tuple(foot.T),
    )
    assert np.max(np.abs(np.stack(closed, axis=-1) - wanted) / (1.0 + np.abs(wanted))) < 1e-12
    inertia = mx.floating_mass(terms, pos)
    after = np.einsum("nij,nj->ni", mx.impact_map(terms, pos), vel)
    before, left = (0.5 * np.einsum("ni,nij,nj->n", x, inertia, x) for x in (vel, after))
    assert np.max(np.abs(lost - (before - left)) / before) < 1e-12


def test_bars_weigh_what_the_trunk_loses() -> None:
    leg = exact_design()
    bars = Bars(density=0.007, crank_length=0.02)
    heavy, light = floating_terms(leg, bars=bars), floating_terms(leg)
    assert heavy.mass == light.mass
    rods = bars.density * np.array([0.02, leg.thigh.length, leg.shank.length])
    assert math.isclose(
        heavy.first[0] - light.first[0],
        rods[1] * leg.thigh.length / 2 + rods[2] * (leg.thigh.length + 0.02),
    )
    none = floating_terms(leg, bars=Bars(density=0.0))
    assert none == light
