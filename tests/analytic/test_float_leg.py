"""Readings on plain floats against the general equations that they write out."""

from pathlib import Path

import numpy as np
import pytest

from legbench.analytic import LegModel
from legbench.analytic.equations import (
    SCALAR,
    contact_force,
    free_foot_acceleration,
    pair_acceleration,
)
from legbench.analytic.float_leg import FloatLeg
from legbench.design import load_design
from legbench.design.statics import GRAVITY

pytest.importorskip("heyoka")

from legbench.analytic.compiled import foot_from_centre

MODELS = Path(__file__).parents[2] / "models"


@pytest.mark.parametrize("name", ["prototype", "optimal", "table2"])
def test_readings_on_floats_are_those_of_the_equations(name: str) -> None:
    model, random = LegModel.of(load_design(MODELS / f"{name}.toml")), np.random.default_rng(7)
    leg, weight = FloatLeg(model, foot_from_centre(model)), model.floating.mass * GRAVITY
    for _ in range(200):
        q, motor = (tuple(random.uniform(-1.5, 1.5, 2).tolist()) for _ in range(2))
        v = tuple(random.normal(0.0, 8.0, 2).tolist())
        torque = model.torque(motor, q, v)
        assert leg.torque(motor, q, v) == torque
        for terms in (model.stance, model.falling, model.hanging):
            wanted = pair_acceleration(SCALAR, terms, q, v, torque)
            assert np.allclose(leg.accelerations(terms, motor, q, v), wanted, rtol=1e-12, atol=1e-9)
        standing = pair_acceleration(SCALAR, model.stance, q, v, torque)
        force = contact_force(SCALAR, model.floating, q, v, standing)[1] / weight
        assert abs(leg.force(motor, q, v) - force) < 1e-11 * (1.0 + abs(force))
        falling = pair_acceleration(SCALAR, model.falling, q, v, torque)
        rise = free_foot_acceleration(SCALAR, model.floating, q, v, falling)[1] / GRAVITY
        assert abs(leg.released(motor, q, v) - rise) < 1e-11 * (1.0 + abs(rise))
