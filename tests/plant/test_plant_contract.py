"""What every plant promises at the seam."""

from collections.abc import Callable

import numpy as np
import pytest
from plants import PLANTS, Case, arrays, copied, same, wobble

from legbench.limits.safety import SafetyLimits
from legbench.plant.abstract import AbstractPlant
from legbench.plant.limited import LimitedPlant
from legbench.plant.start import PERIOD
from legbench.servo import ServoConfig
from legbench.signals import Command, Floats, Observation

IDEAL = ServoConfig()
LIMITED = ServoConfig(slew_rate=6.0, bandwidth=40.0, delay_cycles=2, encoder_counts=4096)
EVERY_PLANT = pytest.mark.parametrize("case", PLANTS.values(), ids=PLANTS.keys())
COMPUTED = {name: case for name, case in PLANTS.items() if case.computed}
EVERY_COMPUTED_PLANT = pytest.mark.parametrize("case", COMPUTED.values(), ids=COMPUTED.keys())
EVERY_SERVO = pytest.mark.parametrize("servo", [IDEAL, LIMITED], ids=["ideal", "limited"])
EVERY_PAIR = pytest.mark.parametrize(
    ("case", "servo"),
    [
        pytest.param(case, servo, id=f"{name}-{word}")
        for name, case in PLANTS.items()
        for word, servo in (("ideal", IDEAL), ("limited", LIMITED))
        if case.computed or servo == IDEAL
    ],
)


@EVERY_PLANT
def test_time_is_the_plants_and_goes_by_periods(case: Case) -> None:
    with case.make(IDEAL) as plant:
        assert plant.period == PERIOD
        first = plant.reset()
        assert first.time == 0.0
        rest = first.motor_pos.copy()
        times = [plant.step(wobble(rest, k)).time for k in range(20)]
        assert times == [(k + 1) * PERIOD for k in range(20)]
        assert not case.computed or plant.reset().time == 0.0


@EVERY_SERVO
@EVERY_COMPUTED_PLANT
def test_a_reset_repeats_everything_bit_by_bit(case: Case, servo: ServoConfig) -> None:
    with case.make(servo) as plant, case.make(servo) as twin:
        runs = []
        for each in (plant, plant, twin):
            first = each.reset()
            rest = first.motor_pos
            runs.append([copied(first), *(copied(each.step(wobble(rest, k))) for k in range(30))])
        for again in runs[1:]:
            assert all(same(one, other) for one, other in zip(runs[0], again, strict=True))


@EVERY_PAIR
def test_a_command_is_first_seen_one_period_later(case: Case, servo: ServoConfig) -> None:
    change = 7
    runs = []
    for kick in (0.0, 0.1):
        with case.make(servo) as plant:
            first = plant.reset()
            rest = first.applied_pos.copy()
            seen = [copied(first)]
            for cycle in range(change + 12):
                offset = kick if cycle >= change else 0.0
                seen.append(copied(plant.step(Command.holding(rest + offset))))
            runs.append(seen)
    still, kicked = runs
    assert all(same(still[k], kicked[k]) for k in range(change + 1))
    applied = kicked[change + 1]["applied_pos"] - still[change + 1]["applied_pos"]
    assert np.allclose(applied, 0.1)
    reaction = change + 1 + case.delay + servo.delay_cycles
    assert np.array_equal(still[reaction - 1]["joint_pos"], kicked[reaction - 1]["joint_pos"])
    assert np.array_equal(still[reaction - 1]["motor_pos"], kicked[reaction - 1]["motor_pos"])
    assert np.all(still[reaction]["motor_pos"] != kicked[reaction]["motor_pos"])
    assert np.all(still[reaction + 6]["joint_vel"] != kicked[reaction + 6]["joint_vel"])


@EVERY_PLANT
def test_an_ideal_motor_is_where_it_was_told_to_be(case: Case) -> None:
    """After the plant's own delay, to a count of its encoders."""
    with case.make(IDEAL) as plant:
        first = plant.reset()
        rest = first.motor_pos.copy()
        assert np.allclose(first.applied_pos, rest, rtol=0.0, atol=case.resolution)
        told = [rest] * case.delay
        for cycle in range(10):
            command = wobble(rest, cycle)
            told.append(command.motor_pos.copy())
            seen = plant.step(command)
            assert np.allclose(seen.motor_pos, told[cycle], rtol=0.0, atol=case.resolution)
            assert np.allclose(seen.applied_pos, told[-1], rtol=0.0, atol=case.resolution)


@EVERY_PAIR
def test_springs_are_stretched_between_motor_and_link(case: Case, servo: ServoConfig) -> None:
    with case.make(servo) as plant:
        first = plant.reset()
        for cycle in range(30):
            seen = plant.step(wobble(first.motor_pos, cycle))
            expected = case.stiffness * (seen.motor_pos - seen.joint_pos)
            assert np.array_equal(seen.spring_torque, expected)


@EVERY_PLANT
def test_shapes_have_the_components_last(case: Case) -> None:
    legs = case.stiffness.shape[:-1]
    with case.make(IDEAL) as plant:
        first = plant.reset()
        for seen in (first, plant.step(wobble(first.motor_pos, 0))):
            assert (seen.truth is not None) == case.computed
            for name, leaf in arrays(seen).items():
                if name == "time" or leaf is None:
                    continue
                expected = legs if name == "truth.contact" else (*legs, 2)
                assert np.shape(leaf) == expected, name


@EVERY_PAIR
def test_what_was_seen_stays_as_it_was(case: Case, servo: ServoConfig) -> None:
    """Observations do not alias the simulation: neither the next step nor a reset changes them."""
    with case.make(servo) as plant:
        first = plant.reset()
        rest = first.motor_pos.copy()
        seen = [first, *(plant.step(wobble(rest, k)) for k in range(3))]
        kept = [copied(each) for each in seen]
        for cycle in range(3, 12):
            plant.step(wobble(rest, cycle))
        if case.computed:
            plant.reset()
        assert all(same(before, copied(each)) for before, each in zip(kept, seen, strict=True))


@EVERY_PAIR
def test_what_is_done_to_an_observation_or_a_command_stays_outside(
    case: Case, servo: ServoConfig
) -> None:
    with case.make(servo) as plant, case.make(servo) as untouched:
        first = untouched.reset()
        rest = first.motor_pos.copy()
        for turn in range(2 if case.computed else 1):
            mine, theirs = plant.reset(), untouched.reset() if turn else first
            for cycle in range(8):
                assert same(copied(mine), copied(theirs)), (turn, cycle)
                for leaf in arrays(mine).values():
                    if isinstance(leaf, np.ndarray):
                        leaf[...] = 9
                command = wobble(rest, cycle)
                mine, theirs = plant.step(command), untouched.step(wobble(rest, cycle))
                applied = mine.applied_pos.copy()
                command.motor_pos[...] = 9.0
                assert np.array_equal(mine.applied_pos, applied)


@EVERY_PLANT
def test_closing_twice_is_closing_once(case: Case) -> None:
    plant = case.make(IDEAL)
    plant.close()
    plant.close()
    with case.make(IDEAL) as other:
        other.reset()
    other.close()


@EVERY_COMPUTED_PLANT
def test_encoders_round_to_whole_counts(case: Case) -> None:
    count = 2.0 * np.pi / 512
    with case.make(ServoConfig(encoder_counts=512)) as plant, case.make(IDEAL) as exact:
        rest = exact.reset().motor_pos
        plant.reset()
        for cycle in range(15):
            seen = plant.step(wobble(rest, cycle))
            true = exact.step(wobble(rest, cycle))
            for coarse, fine in (
                (seen.joint_pos, true.joint_pos),
                (seen.motor_pos, true.motor_pos),
            ):
                assert np.allclose(coarse / count, np.round(coarse / count), atol=1e-9)
                assert np.max(np.abs(coarse - fine)) <= 0.5 * count * (1.0 + 1e-9)


@EVERY_COMPUTED_PLANT
@pytest.mark.parametrize("limited", [False, True], ids=["bare", "limited"])
def test_a_computed_leg_is_left_as_it_is_at_the_end(case: Case, limited: bool) -> None:
    """`rest` asks nobody, says nothing, and the next step goes on as if it had not been called."""

    def asked() -> bool:
        raise AssertionError("nothing happens that could be interrupted")

    with case.make(IDEAL) as plain, case.make(IDEAL) as other:
        if limited and case.stiffness.ndim > 1:
            pytest.skip("limits are of one leg")
        ended = LimitedPlant(other, SafetyLimits()) if limited else other
        rest = plain.reset().motor_pos
        ended.reset()
        for cycle in range(20):
            expected, seen = (each.step(wobble(rest, cycle)) for each in (plain, ended))
            assert same(copied(expected), copied(seen))
            assert ended.rest(rest, asked) is None


def test_a_plant_with_limits_passes_rest_on() -> None:
    given: list[object] = []

    class Resting(AbstractPlant):
        period = PERIOD

        def reset(self) -> Observation:
            raise AssertionError("not asked")

        def step(self, command: Command) -> Observation:
            raise AssertionError("not asked")

        def rest(self, motor_pos: Floats, interrupted: Callable[[], bool]) -> str:
            given.extend((motor_pos, interrupted))
            return "it swung"

        def close(self) -> None:
            """Nothing to release."""

    posture = np.array([0.1, -0.2])

    def interrupted() -> bool:
        return False

    assert LimitedPlant(Resting(), SafetyLimits()).rest(posture, interrupted) == "it swung"
    assert given[0] is posture
    assert given[1] is interrupted
