import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from legbench.control import Chirp, ChirpConfig, LegTargets, SetupKind
from legbench.control.chirp import ChirpCoordinate, ChirpPhase, ChirpWave
from legbench.design import LegDesign
from legbench.design.setup import Setup
from legbench.errors import ConfigError
from legbench.kinematics import ModalConvention, joint_to_modal
from legbench.signals import Floats, Observation


def targets_for(designs: LegDesign | list[LegDesign]) -> LegTargets:
    return LegTargets(designs=designs, support=Setup(kind=SetupKind.FFS).support)


def observation(time: float, shape: tuple[int, ...] = ()) -> Observation:
    zero = np.zeros((*shape, 2))
    return Observation(
        time=time,
        motor_pos=zero,
        joint_pos=zero,
        joint_vel=zero,
        spring_torque=zero,
        applied_pos=zero,
    )


def deflections(config: ChirpConfig, design: LegDesign, times: Floats) -> Floats:
    chirp = Chirp(config, targets_for(design))
    chirp.reset(observation(0.0))
    said = [chirp.step(observation(float(time))).motor_pos for time in times]
    return np.array(said) - chirp.start_motor_pos


def test_its_phase_is_the_integral_of_a_frequency_that_rises_steadily(
    prototype: LegDesign,
) -> None:
    """Frequency as the rate of the wave's phase, integrated by the trapezoidal rule."""
    config = ChirpConfig(f0=1.0, f1=9.0, sweep=2.0, delay=0.1, amplitude=0.05)
    times = np.arange(0.1, 2.0999, 1e-3)
    frequency = np.interp(times, [0.1, 2.1], [1.0, 9.0])
    turns = np.concatenate([[0.0], np.cumsum(0.5e-3 * (frequency[1:] + frequency[:-1]))])
    found = deflections(config, prototype, times)
    assert found[:, 0] == pytest.approx(0.05 * np.sin(2.0 * math.pi * turns), abs=1e-9)
    assert not found[:, 1].any()


@pytest.mark.parametrize("coordinate", list(ChirpCoordinate))
def test_it_moves_its_coordinate_alone(prototype: LegDesign, coordinate: ChirpCoordinate) -> None:
    config = ChirpConfig(coordinate=coordinate, f0=2.5, f1=2.5, sweep=1.0, delay=0.0)
    found = deflections(config, prototype, np.array([0.1]))[0]
    values: dict[str, float] = dict(zip(("q1", "q2"), found, strict=True))
    values |= dict(
        zip(("z1", "z2"), joint_to_modal(found, ModalConvention.ORTHONORMAL), strict=True)
    )
    assert values[coordinate] == pytest.approx(config.amplitude)
    partners: dict[str, str] = {"q1": "q2", "q2": "q1", "z1": "z2", "z2": "z1"}
    assert values[partners[coordinate]] == pytest.approx(0.0, abs=1e-15)


def test_a_square_wave_steps_between_its_ends(prototype: LegDesign) -> None:
    config = ChirpConfig(wave=ChirpWave.SQUARE, f0=1.0, f1=1.0, sweep=2.0, delay=0.0)
    found = deflections(config, prototype, np.arange(0.0, 2.0, 1e-2))[:, 0]
    assert set(np.round(found, 12)) == {-0.1, 0.1}
    assert np.count_nonzero(np.diff(found)) == 3


def test_it_rests_before_and_settles_after(prototype: LegDesign) -> None:
    chirp = Chirp(ChirpConfig(delay=0.1, sweep=0.5), targets_for(prototype))
    phases = [int(chirp.step(observation(time)).phase) for time in (0.0, 0.09, 0.1, 0.59, 0.6)]
    rest, sweep, settle = ChirpPhase.REST, ChirpPhase.SWEEP, ChirpPhase.SETTLE
    assert phases == [rest, rest, sweep, sweep, settle]
    last = chirp.step(observation(0.7))
    assert np.array_equal(last.motor_pos, chirp.start_motor_pos)


def test_legs_of_a_batch_have_chirps_of_their_own(prototype: LegDesign) -> None:
    first = ChirpConfig(delay=0.0, sweep=0.3)
    second = ChirpConfig(
        delay=0.1, sweep=0.4, coordinate=ChirpCoordinate.Z1, wave=ChirpWave.SQUARE, f0=3.0
    )
    both = ChirpConfig.build_each([first, second], targets_for([prototype, prototype]))
    alone = [Chirp(each, targets_for(prototype)) for each in (first, second)]
    for time in np.arange(0.0, 0.6, 0.01):
        together = both.step(observation(float(time), (2,)))
        for row, one in enumerate(alone):
            mine = one.step(observation(float(time)))
            assert np.array_equal(mine.motor_pos, together.motor_pos[row])
            assert mine.phase == together.phase[row]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"amplitude": 0.0}, r"amplitude is 0 rad"),
        ({"amplitude": 1.2}, r"amplitude"),
        ({"f0": 0.0}, r"f0 is 0 Hz"),
        ({"f1": 400.0}, r"f1 is 400 Hz; it must be positive and at most 250 Hz"),
        ({"sweep": math.inf}, r"sweep is inf s"),
        ({"delay": -1.0}, r"delay is -1 s"),
        ({"z2": 2.2}, r"set point z2"),
    ],
)
def test_it_refuses_what_the_leg_cannot_do(
    prototype: LegDesign, change: dict[str, Any], words: str
) -> None:
    with pytest.raises(ConfigError, match=words):
        Chirp(replace(ChirpConfig(), **change), targets_for(prototype))
