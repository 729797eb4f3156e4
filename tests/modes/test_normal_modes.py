"""Linear modes, strictness, and brake orbits followed in energy."""

from pathlib import Path

import numpy as np
import pytest
from exact_leg import exact_design
from independent import differences, moved

pytest.importorskip("heyoka")

from legbench.design import LegDesign, load_design
from legbench.errors import ConfigError
from legbench.modes.carry import Carrier
from legbench.modes.curve import curve_through
from legbench.modes.family import Family, at_energy, follow
from legbench.modes.linear import linear_modes
from legbench.modes.scene import Holding, Scene, make_scene
from legbench.modes.strict import check, radial_line

MODELS = Path(__file__).parents[2] / "models"
EXACT = exact_design()
PROTOTYPE = load_design(MODELS / "prototype.toml")
HELD = [Holding.HFTS, Holding.VFTS, Holding.FFS, Holding.FLIGHT]


def scene_of(design: LegDesign, kind: Holding = Holding.FFS, z2: float = 0.9) -> Scene:
    return make_scene(design, kind, z2)


def still(posture: np.ndarray) -> np.ndarray:
    return np.concatenate([posture, [0.0, 0.0]])


@pytest.mark.parametrize("kind", HELD)
def test_linear_modes_are_what_small_oscillations_do(kind: Holding) -> None:
    scene = scene_of(PROTOTYPE, kind)
    for mode in linear_modes(scene).values():
        start = still(np.asarray(scene.rest) + 1e-5 * mode.shape)
        end = moved(scene, start, 1.0 / mode.freq)
        assert np.max(np.abs(end[:2] - start[:2])) < 1e-9


@pytest.mark.parametrize("kind", HELD)
def test_modes_of_the_matched_leg_are_the_modal_axes(kind: Holding) -> None:
    for mode in linear_modes(scene_of(EXACT, kind)).values():
        assert abs(mode.alignment - 1.0) < 1e-12


@pytest.mark.parametrize(
    "kind", [*HELD[2:], *(pytest.param(kind, marks=pytest.mark.long) for kind in HELD[:2])]
)
def test_the_flow_and_its_derivative_are_those_of_another_integration(kind: Holding) -> None:
    scene = scene_of(PROTOTYPE, kind)
    carrier = Carrier(scene)
    start = np.array([-0.9, 0.8, 0.3, -0.2])
    done = carrier.carry(start, 0.4)
    assert np.allclose(done.end, moved(scene, start, 0.4), rtol=0.0, atol=1e-10)
    assert np.allclose(done.by_start, differences(scene, start, 0.4), rtol=1e-6, atol=1e-6)
    path = carrier.path(start, np.array([0.0, 0.1, 0.4]))
    assert np.array_equal(path[0], start)
    assert np.allclose(path[1], moved(scene, start, 0.1), rtol=0.0, atol=1e-10)
    assert np.allclose(path[2], done.end, rtol=0.0, atol=1e-12)


def test_the_derivative_by_dampers_and_motors_is_that_of_differences() -> None:
    scene = scene_of(PROTOTYPE)
    start, motor = np.array([-0.9, 0.8, 0.3, -0.2]), np.array([-0.8, 0.9])
    done = Carrier(scene, (0.01, 0.02)).carry(start, 0.4, extra=0.003, motor=motor)
    for place, at, step in ((7, 0, 1e-5), (8, 1, 1e-5), (9, 0, 1e-5), (10, 1, 1e-5)):
        ends = []
        for sign in (1.0, -1.0):
            aside = sign * step * np.eye(2)[at]
            dampers = np.array([0.013, 0.023]) + (aside if place < 9 else 0.0)
            held = motor + (aside if place >= 9 else 0.0)
            damping = (float(dampers[0]), float(dampers[1]))
            ends.append(moved(scene, start, 0.4, damping=damping, motor=held))
        slope = (ends[0] - ends[1]) / (2.0 * step)
        assert np.allclose(done.by_parameters[:, place], slope, rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize("speed", [1e9, 1e15], ids=["too many steps", "no step"])
def test_a_leg_that_runs_away_is_named(speed: float, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("legbench.modes.carry.MAX_STEPS", 500)
    scene = scene_of(EXACT)
    with pytest.raises(ConfigError, match="cannot be followed for 1 s: it runs away"):
        Carrier(scene).carry(np.array([0.0, 0.0, speed, -speed]), 1.0)


@pytest.mark.parametrize("kind", HELD)
def test_the_matched_leg_is_strict_and_the_prototype_is_not(kind: Holding) -> None:
    found = [
        check(scene, radial_line(scene, 0.3), 1.0)
        for scene in (scene_of(EXACT, kind), scene_of(PROTOTYPE, kind))
    ]
    for name in ("geodesic", "force", "invariance"):
        assert getattr(found[0], name) < 1e-9, name
    # Without gravity only inertia and springs are left, and the prototype's springs are equal.
    for name in ("geodesic", "invariance"):
        assert getattr(found[1], name) > 1e-4, name


def test_a_crooked_curve_is_not_strict() -> None:
    scene = scene_of(EXACT)
    line = radial_line(scene, 0.3).points
    bump = 0.05 * np.sin(np.linspace(0.0, np.pi, len(line)))[:, np.newaxis]
    found = check(scene, curve_through(line + bump), 0.5)
    assert found.geodesic > 0.1
    assert found.force > 0.01
    assert found.invariance > 0.01


@pytest.mark.parametrize("kind", HELD)
def test_radial_mode_of_the_matched_leg_is_straight_at_every_energy(kind: Holding) -> None:
    family = follow(scene_of(EXACT, kind), "radial", 0.2)
    assert family.largest >= 0.2
    for found in family.orbits:
        assert found.bend < 1e-8
        assert abs(found.start.sum()) < 1e-8


@pytest.mark.parametrize("name", ["radial", "polar"])
@pytest.mark.parametrize("kind", [Holding.FFS, Holding.FLIGHT])
def test_brake_orbits_close_and_keep_their_energy(kind: Holding, name: str) -> None:
    scene = scene_of(PROTOTYPE, kind)
    family = follow(scene, name, 0.15)
    energies = [found.energy for found in family.orbits]
    assert np.all(np.diff(energies) > 0.0)
    linear = 1.0 / family.mode.freq
    assert abs(family.orbits[0].period / linear - 1.0) < 1e-3
    for found in family.orbits[::4]:
        half = moved(scene, still(found.start), 0.5 * found.period)
        assert np.max(np.abs(half - still(found.end))) < 1e-7
        whole = moved(scene, still(found.start), found.period)
        assert np.max(np.abs(whole - still(found.start))) < 1e-7
        assert abs(float(scene.potential(found.end)) - found.energy) < 1e-9


def test_polar_mode_bends_and_radial_mode_of_the_prototype_hardly() -> None:
    scene = scene_of(PROTOTYPE)
    bends = {name: follow(scene, name, 0.15).orbits[-1].bend for name in ("radial", "polar")}
    assert 1e-4 < bends["radial"] < 5e-3
    assert bends["polar"] > 0.05


@pytest.mark.parametrize(
    "design", [pytest.param(EXACT, marks=pytest.mark.long), PROTOTYPE], ids=["exact", "prototype"]
)
@pytest.mark.parametrize("z2", [0.9, 2.04])
@pytest.mark.parametrize("name", ["radial", "polar"])
def test_multipliers_are_those_of_a_conservative_flow(
    design: LegDesign, z2: float, name: str
) -> None:
    scene = scene_of(design, Holding.FFS, z2)
    found = follow(scene, name, 0.05).orbits[-1]
    matrix = found.monodromy
    assert abs(matrix.determinant - 1.0) < 1e-8
    assert abs(matrix.pair[0] * matrix.pair[1] - 1.0) < 1e-8
    other = differences(scene, still(found.start), found.period)
    assert np.allclose(other, matrix.matrix, rtol=0.0, atol=2e-5)
    # The double eigenvalue one splits by the root of the differences' error.
    values = np.linalg.eigvals(other)
    rest = values[np.argsort(np.abs(values - 1.0))[2:]]
    assert np.allclose(rest.sum().real, matrix.trace, rtol=0.0, atol=1e-3)


def test_an_orbit_of_a_given_energy_is_found_or_refused_by_name() -> None:
    scene = scene_of(EXACT)
    family = follow(scene, "polar", 0.1)
    found = at_energy(family, 0.0625)
    assert abs(found.energy - 0.0625) < 1e-10
    with pytest.raises(ConfigError, match=r"polar mode does not exist at 50 J: it was followed"):
        at_energy(family, 50.0)


@pytest.mark.parametrize("share", [0.5, 1e-3])
def test_an_orbit_below_the_first_one_is_solved_for(share: float) -> None:
    scene = scene_of(PROTOTYPE)
    family = follow(scene, "polar", 0.01)
    energy = share * family.orbits[0].energy
    found = at_energy(family, energy)
    assert found.energy == pytest.approx(energy, rel=1e-9)
    end = moved(scene, still(found.start), found.period)
    assert np.max(np.abs(end - still(found.start))) < 1e-9
    assert found.period == pytest.approx(1.0 / family.mode.freq, rel=1e-3)


def test_an_orbit_that_is_the_linear_mode_to_all_digits_is_told() -> None:
    family = follow(scene_of(PROTOTYPE), "polar", 0.01)
    with pytest.raises(ConfigError, match=r"amplitude below 1e-05 rad, where the polar mode is"):
        at_energy(family, 1e-14)


def test_a_family_ends_at_the_joint_limits_and_says_so() -> None:
    scene = scene_of(PROTOTYPE)
    family = follow(scene, "radial", 5.0)
    assert family.ended == f"the knee reaches its limit of 0.3 rad beyond {family.largest:.4g} J"
    knees = [np.array([found.start, found.end]) @ [-1.0, 1.0] for found in family.orbits]
    assert 0.3 <= np.min(knees) < 0.302


def test_a_mode_whose_first_orbit_meets_a_stop_is_refused() -> None:
    with pytest.raises(ConfigError, match=r"at its smallest, .* J, the knee reaches its limit"):
        follow(scene_of(EXACT, Holding.HFTS, 0.3001 / np.sqrt(2.0)), "radial", 0.1)


def resonant(design: LegDesign, name: str, z2: float = 1.11072) -> Family:
    return follow(scene_of(design, Holding.FFS, z2), name, 0.1)


@pytest.mark.parametrize("z2", [1.09, 1.11072, np.pi / np.sqrt(8.0), 1.13])
def test_modes_are_told_apart_in_the_one_to_one_resonance(z2: float) -> None:
    optimal = load_design(MODELS / "optimal.toml")
    radial, polar = (resonant(optimal, name, z2) for name in ("radial", "polar"))
    assert all(found.bend < 1e-4 for found in radial.orbits)
    assert all(abs(found.start.sum()) < 1e-4 for found in radial.orbits)
    for found in polar.orbits:
        aside = found.start - np.asarray(polar.shooting.scene.rest)
        assert abs(aside.sum()) > 3.0 * abs(aside[1] - aside[0])
    for family in (radial, polar):
        assert family.warnings[0].startswith("1:1 resonance: the linear frequencies")
    again = moved(radial.shooting.scene, still(radial.orbits[-1].start), radial.orbits[-1].period)
    assert np.max(np.abs(again - still(radial.orbits[-1].start))) < 1e-7


def test_a_leg_far_from_resonance_is_not_warned_of() -> None:
    assert follow(scene_of(EXACT), "radial", 0.05).warnings == ()


@pytest.mark.parametrize("z2", [2.6, 0.1])
def test_a_set_point_past_the_limits_is_named(z2: float) -> None:
    with pytest.raises(ConfigError, match=r"design 'prototype' allows .* and \(0.3, 2.9\)"):
        make_scene(PROTOTYPE, Holding.VFTS, z2)


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
        make_scene(soft, Holding.FFS, 0.9)


def test_bad_questions_are_named() -> None:
    scene = scene_of(EXACT)
    with pytest.raises(ConfigError, match="mode 'sideways' is unknown; there are radial, polar"):
        follow(scene, "sideways", 0.1)
    with pytest.raises(ConfigError, match="energy is -1 J; it must be positive"):
        follow(scene, "radial", -1.0)
