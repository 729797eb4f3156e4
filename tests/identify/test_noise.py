"""Precision of encoders, measured from what they show."""

import numpy as np
import pytest

from legbench.identify.noise import FLOOR, count_of, precision_of
from legbench.identify.trial import quietened

TIME = np.arange(0.0, 2.0, 1e-3)
SWING = 0.3 * np.exp(-TIME) * np.sin(2.0 * np.pi * 5.0 * TIME)


@pytest.mark.parametrize("sigma", [1e-4, 1.7e-3, 1e-2])
def test_noise_is_told_from_a_swing(sigma: float) -> None:
    random = np.random.default_rng(0)
    found = precision_of(SWING + sigma * random.standard_normal(len(SWING)))
    assert found.sigma == pytest.approx(sigma, rel=0.06)
    assert found.count == 0.0


def test_a_step_of_the_posture_does_not_count_as_noise() -> None:
    random = np.random.default_rng(1)
    stepped = SWING + 0.5 * (TIME > 1.0) + 1e-3 * random.standard_normal(len(SWING))
    assert precision_of(stepped).sigma == pytest.approx(1e-3, rel=0.06)


@pytest.mark.parametrize("counts", [4096, 16384, 65536])
def test_the_count_of_an_encoder_is_found(counts: int) -> None:
    count = 2.0 * np.pi / counts
    shown = np.round(SWING / count) * count
    found = precision_of(shown)
    assert found.count == pytest.approx(count, rel=1e-9)
    assert found.sigma >= count / np.sqrt(12.0)
    assert precision_of(shown, noise=1e-3).sigma == pytest.approx(
        np.hypot(1e-3, count / np.sqrt(12.0))
    )


def test_an_exact_encoder_has_no_count_and_the_precision_of_the_equations() -> None:
    assert count_of(SWING) == 0.0
    assert precision_of(SWING).sigma == FLOOR
    assert count_of(np.array([0.0, 1.0, 1.0])) == 0.0


def test_motors_that_stand_still_are_averaged_and_those_that_move_are_not() -> None:
    random = np.random.default_rng(2)
    command = np.where(TIME < 1.0, 0.2, 0.5)
    place = np.where(TIME < 1.0, 0.2, 0.5 - 0.3 * np.exp(-np.maximum(TIME - 1.0, 0.0) / 0.02))
    measured = place + 1e-3 * random.standard_normal(len(TIME))
    both = np.stack([measured, measured], axis=1)
    found = quietened(both, np.stack([command, command], axis=1), np.full(2, 1e-3))
    assert np.abs(found - place[:, np.newaxis])[:1000].max() < 2e-4
    assert np.abs(found - place[:, np.newaxis])[1300:].max() < 2e-4
    assert np.array_equal(found[1000:1020], both[1000:1020])
