"""The flow of a conservative leg keeps volumes and the symplectic form; its error is controlled."""

from pathlib import Path

import numpy as np
import pytest

from legbench.analytic.matrices import pair_coriolis, pair_mass
from legbench.design import load_design
from legbench.errors import ConfigError

pytest.importorskip("heyoka")

from legbench.modes.carry import Carrier
from legbench.modes.scene import Holding, Scene, make_scene
from legbench.signals import Floats

MODELS = Path(__file__).parents[2] / "models"


def scene_of(name: str, kind: Holding, z2: float) -> Scene:
    return make_scene(load_design(MODELS / f"{name}.toml"), kind, z2)


def momenta(scene: Scene, state: Floats) -> Floats:
    """Derivative of (q, M v) by (q, v) (4, 4)."""
    q, v = state[:2], state[2:]
    mass = pair_mass(scene.terms, q)
    swirl = scene.terms.coupling * np.sin(q[0] - q[1])
    by_q = np.array([[-swirl * v[1], swirl * v[1]], [-swirl * v[0], swirl * v[0]]])
    assert pair_coriolis(scene.terms, q, v).shape == mass.shape
    return np.block([[np.eye(2), np.zeros((2, 2))], [by_q, mass]])


@pytest.mark.parametrize("kind", [Holding.HFTS, Holding.VFTS, Holding.FFS, Holding.FLIGHT])
@pytest.mark.parametrize(("name", "z2"), [("optimal", 0.9), ("optimal", 2.04), ("prototype", 1.5)])
def test_derivatives_of_the_flow_are_symplectic_off_the_modes(
    name: str, kind: Holding, z2: float
) -> None:
    scene = scene_of(name, kind, z2)
    form = np.block([[np.zeros((2, 2)), np.eye(2)], [-np.eye(2), np.zeros((2, 2))]])
    random = np.random.default_rng(8)
    for _ in range(5):
        start = np.concatenate([scene.rest + random.uniform(-0.15, 0.15, 2), [0.0, 0.0]])
        done = Carrier(scene).carry(start, 1.0)
        end, slope = done.end, done.by_start
        canonical = momenta(scene, end) @ slope @ np.linalg.inv(momenta(scene, start))
        wrong = canonical.T @ form @ canonical - form
        assert np.max(np.abs(wrong)) < 1e-8 * max(1.0, np.max(np.abs(canonical)) ** 2)
        assert abs(np.linalg.det(canonical) - 1.0) < 1e-8


def test_a_leg_that_cannot_be_followed_is_named() -> None:
    scene = scene_of("prototype", Holding.FFS, 0.9)
    with pytest.raises(ConfigError, match="cannot be followed for 1 s: it runs away"):
        Carrier(scene).carry(np.array([-0.9, 0.8, 1e200, -1e200]), 1.0)
