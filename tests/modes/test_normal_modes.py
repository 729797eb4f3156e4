"""Linear modes, strictness, and brake orbits followed in energy."""

from pathlib import Path

import numpy as np
import pytest
from exact_leg import exact_design  # pyright: ignore[reportMissingImports]

from legbench.design import LegDesign, load_design
from legbench.design.setup import SetupKind
from legbench.errors import ConfigError
from legbench.modes.brake import at_energy, floquet, follow
from legbench.modes.curve import curve_through
from legbench.modes.flow import flow, orbit
from legbench.modes.linear import linear_modes
from legbench.modes.scene import Scene, make_scene
from legbench.modes.strict import check, radial_line

MODELS = Path(__file__).parents[2] / "models"
EXACT = exact_design()
PROTOTYPE = load_design(MODELS / "prototype.toml")
FIXED = [SetupKind.HFTS, SetupKind.VFTS, SetupKind.FFS]


def scene_of(design: LegDesign, kind: SetupKind = SetupKind.FFS, z2: float = 0.9) -> Scene:
    return make_scene(design, kind, z2)


@pytest.mark.parametrize("kind", FIXED)
def test_linear_modes_are_what_small_oscillations_do(kind: SetupKind) -> None:
    scene = scene_of(PROTOTYPE, kind)
    for mode in linear_modes(scene).values():
        start = np.concatenate([np.asarray(scene.rest) + 1e-5 * mode.shape, [0.0, 0.0]])
        end, _ = flow(scene, start, 1.0 / mode.freq, np.eye(4)[:, :1])
        assert np.max(np.abs(end[:2] - start[:2])) < 1e-9


@pytest.mark.parametrize("kind", FIXED)
def test_modes_of_the_matched_leg_are_the_modal_axes(kind: SetupKind) -> None:
    for mode in linear_modes(scene_of(EXACT, kind)).values():
        assert abs(mode.alignment - 1.0) < 1e-12


def test_complex_steps_are_the_derivative_of_the_flow() -> None:
    scene = scene_of(PROTOTYPE)
    start = np.array([-0.9, 0.8, 0.3, -0.2])
    _, slope = flow(scene, start, 0.4, np.eye(4))
    for index in range(4):
        ends = []
        for sign in (1.0, -1.0):
            moved = start.copy()
            moved[index] += sign * 1e-5
            ends.append(flow(scene, moved, 0.4, np.eye(4)[:, :1])[0])
        assert np.allclose((ends[0] - ends[1]) / 2e-5, slope[:, index], rtol=1e-5, atol=1e-5)


@pytest.mark.parametrize("kind", FIXED)
def test_the_matched_leg_is_strict_and_the_prototype_is_not(kind: SetupKind) -> None:
    found = [
        check(scene, radial_line(scene, 0.3), 1.0)
        for scene in (scene_of(EXACT, kind), scene_of(PROTOTYPE, kind))
    ]
    for name in ("geodesic", "force", "invariance"):
        assert getattr(found[0], name) < 1e-9, name
        assert getattr(found[1], name) > 1e-4, name


def test_a_crooked_curve_is_not_strict() -> None:
    scene = scene_of(EXACT)
    line = radial_line(scene, 0.3).points
    bump = 0.05 * np.sin(np.linspace(0.0, np.pi, len(line)))[:, np.newaxis]
    found = check(scene, curve_through(line + bump), 0.5)
    assert found.geodesic > 0.1
    assert found.force > 0.01
    assert found.invariance > 0.01


@pytest.mark.parametrize("kind", FIXED)
def test_radial_mode_of_the_matched_leg_is_straight_at_every_energy(kind: SetupKind) -> None:
    family = follow(scene_of(EXACT, kind), "radial", 0.2)
    assert family.largest >= 0.2
    for found in family.orbits:
        assert found.bend < 1e-9
        assert abs(found.start.sum()) < 1e-9


@pytest.mark.parametrize("name", ["radial", "polar"])
def test_brake_orbits_close_and_keep_their_energy(name: str) -> None:
    scene = scene_of(PROTOTYPE)
    family = follow(scene, name, 0.15)
    energies = [found.energy for found in family.orbits]
    assert np.all(np.diff(energies) > 0.0)
    linear = 1.0 / family.mode.freq
    assert abs(family.orbits[0].period / linear - 1.0) < 1e-3
    assert abs(family.orbits[-1].period / linear - 1.0) > 1e-2
    for found in family.orbits[::4]:
        path = orbit(scene, found.start, found.period, 3)
        assert np.max(np.abs(path[1] - found.end)) < 1e-7
        assert np.max(np.abs(path[2] - found.start)) < 1e-7
        assert abs(float(scene.potential(found.end)) - found.energy) < 1e-9


def test_polar_mode_bends_and_radial_mode_of_the_prototype_hardly() -> None:
    scene = scene_of(PROTOTYPE)
    bends = {name: follow(scene, name, 0.15).orbits[-1].bend for name in ("radial", "polar")}
    assert 1e-4 < bends["radial"] < 5e-3
    assert bends["polar"] > 0.05


@pytest.mark.parametrize("name", ["radial", "polar"])
def test_floquet_multipliers_are_those_of_a_hamiltonian_flow(name: str) -> None:
    scene = scene_of(EXACT)
    found = follow(scene, name, 0.1).orbits[-1]
    values = np.array(floquet(scene, found))
    assert abs(np.prod(values) - 1.0) < 1e-7
    assert np.sum(np.abs(values - 1.0) < 1e-3) >= 2
    for value in values:
        assert np.min(np.abs(values - 1.0 / value)) < 1e-4


def test_an_orbit_of_a_given_energy_is_found_or_refused_by_name() -> None:
    scene = scene_of(EXACT)
    family = follow(scene, "polar", 0.1)
    found = at_energy(scene, family, 0.0625)
    assert abs(found.energy - 0.0625) < 1e-10
    with pytest.raises(ConfigError, match=r"polar mode does not exist at 50 J: it was followed"):
        at_energy(scene, family, 50.0)


def test_a_family_ends_at_the_joint_limits_and_says_so() -> None:
    family = follow(scene_of(PROTOTYPE), "radial", 5.0)
    assert family.ended == "a joint reaches its limit"
    assert family.largest < 5.0


@pytest.mark.parametrize("z2", [2.6, 0.1])
def test_a_set_point_past_the_limits_is_named(z2: float) -> None:
    with pytest.raises(ConfigError, match=r"design 'prototype' allows .* and \(0.3, 2.9\)"):
        make_scene(PROTOTYPE, SetupKind.VFTS, z2)


def test_a_leg_too_soft_to_stand_is_named() -> None:
    soft = LegDesign(
        name="soft",
        trunk_mass=3.0,
        thigh=EXACT.thigh,
        shank=EXACT.shank,
        foot=EXACT.foot,
        stiffness=(0.8, 0.8),
        damping=(0.0, 0.0),
    )
    with pytest.raises(ConfigError, match="no stable equilibrium"):
        make_scene(soft, SetupKind.FFS, 0.9)


def test_bad_questions_are_named() -> None:
    scene = scene_of(EXACT)
    with pytest.raises(ConfigError, match="mode 'sideways' is unknown; there are radial, polar"):
        follow(scene, "sideways", 0.1)
    with pytest.raises(ConfigError, match="energy is -1 J; it must be positive"):
        follow(scene, "radial", -1.0)
