import numpy as np
import pytest
from metrics_runs import PROTOTYPE, clock, manifest, recording

from legbench.errors import FormatError
from legbench.metrics.modal import Trajectory, trajectory


def moved(convention: str) -> Trajectory:
    time = clock(2000)
    joint_pos = np.stack([-0.7 + 0.2 * np.sin(9.0 * time), 0.8 + 0.3 * np.cos(7.0 * time)], -1)
    joint_vel = np.stack([1.8 * np.cos(9.0 * time), -2.1 * np.sin(7.0 * time)], -1)
    entries = manifest(conventions={"modal": convention})
    return trajectory(recording(time, entries, joint_pos=joint_pos, joint_vel=joint_vel))


@pytest.mark.parametrize("convention", ["orthonormal", "literal"])
def test_rates_are_the_derivatives(convention: str) -> None:
    seen = moved(convention)
    for value, rate in ((seen.polar, seen.polar_rate), (seen.modal, seen.modal_rate)):
        slope = np.gradient(value, seen.time, axis=0, edge_order=2)
        np.testing.assert_allclose(slope, rate, atol=2e-4)


def test_conventions_differ_by_the_root_of_two() -> None:
    orthonormal, literal = moved("orthonormal"), moved("literal")
    np.testing.assert_allclose(orthonormal.modal, np.sqrt(2.0) * literal.modal, rtol=1e-14)
    np.testing.assert_array_equal(orthonormal.polar, literal.polar)


def test_literal_modes_are_the_polar_angle_and_the_half_angle() -> None:
    seen = moved("literal")
    np.testing.assert_allclose(seen.modal[:, 0], seen.polar[:, 0], rtol=1e-14)
    length = 2.0 * PROTOTYPE.shank.length * np.cos(seen.modal[:, 1])
    np.testing.assert_allclose(seen.polar[:, 1], length, rtol=1e-14)


@pytest.mark.parametrize(
    ("entries", "message"),
    [
        ({"conventions": {"modal": "unit"}}, "conventions.modal is 'unit'; known are orthonormal"),
        ({"setup": {"kind": "swim"}}, "setup.kind is 'swim'; known are hfts, vfts, ffs, jump"),
        ({"setup": {}}, "setup.kind is None"),
        ({"design": {}}, r"manifest design: \[trunk\] is missing"),
        (
            {"conventions": {"rating_reference": "sky"}},
            "rating_reference is 'sky'; known are setup, motor, equilibrium",
        ),
    ],
)
def test_unknown_terms_are_refused_with_the_known_ones(entries: dict, message: str) -> None:
    run = recording(np.zeros(0), manifest() | entries)
    with pytest.raises(FormatError, match=message):
        trajectory(run)
