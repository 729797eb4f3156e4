"""A plant a part of which dies, in front of one that obeys exactly; numbers are exact in binary."""

from typing import Any

import numpy as np
import pytest
from guard_rig import pair

from legbench.commissioning.broken_plant import BrokenPlant, Part
from legbench.commissioning.dead_parts import TrialOutcome
from legbench.plant.abstract import AbstractPlant
from legbench.signals import Command, Observation

PERIOD = 0.125
STIFFNESS = np.array([4.0, 5.0])


class Obeying(AbstractPlant):
    """Motors that are where they are told, links that turn by 0.25 and 0.5 rad a period."""

    def __init__(self) -> None:
        self.period = PERIOD
        self.cycle, self.closed = 0, False
        self.commands: list[tuple[float, ...]] = []

    def _seen(self, motor_pos: Any) -> Observation:
        links = np.array([0.25, 0.5]) * self.cycle
        return Observation(
            time=PERIOD * self.cycle,
            motor_pos=np.array(motor_pos),
            joint_pos=links,
            joint_vel=np.zeros(2),
            spring_torque=STIFFNESS * (np.array(motor_pos) - links),
            applied_pos=np.array(motor_pos),
        )

    def reset(self) -> Observation:
        self.cycle = 0
        return self._seen((0.0, 0.0))

    def step(self, command: Command) -> Observation:
        self.cycle += 1
        self.commands.append(tuple(command.motor_pos))
        return self._seen(command.motor_pos)

    def rest(self, motor_pos: Any, interrupted: Any) -> str | None:
        return f"rest at {motor_pos[0]:g}" if interrupted() else None

    def close(self) -> None:
        self.closed = True


def stepped(plant: AbstractPlant, *motor_pos: tuple[float, float]) -> list[Observation]:
    return [plant.step(Command.holding(np.array(wish))) for wish in motor_pos]


SHOWN = {
    # Motor and link one and two periods after the death, motors led to 1 and 2 from 0.5 rad; the
    # links have turned once before.
    Part.JAMMED: ((0.5, 0.5), (0.0, 0.0), (0.5, 1.5)),
    Part.MOTOR_FROZEN: ((0.5, 0.5), (0.0, 0.0), (0.5, 1.5)),
    Part.LINK_FROZEN: ((1.0, 2.0), None, None),
    Part.REPEATING: ((0.5, 0.5), None, None),
    Part.MOTOR_STEP: ((1.1, 2.1), (0.0, 0.0), (0.1, 0.1)),
    Part.LINK_STEP: ((1.0, 2.0), (0.1, 0.1), (0.1, 0.1)),
    Part.MOTOR_DRIFT: ((1.125, 2.25), (0.0, 0.0), (0.125, 0.25)),
    Part.LINK_DRIFT: ((1.0, 2.0), (0.125, 0.25), (0.125, 0.25)),
}
"""Part -> motors shown, what is added to the links, contradiction; none where the link is frozen,
and the contradiction is how far it has turned since."""


@pytest.mark.parametrize("drive", [0, 1])
@pytest.mark.parametrize("part", Part)
def test_a_dead_part_shows_what_it_shows_and_the_other_drive_is_well(
    part: Part, drive: int
) -> None:
    inside = Obeying()
    plant = BrokenPlant(inside, STIFFNESS, part, drive)
    assert plant.period == PERIOD
    plant.reset()
    (before,) = stepped(plant, (0.5, 0.5))
    assert before.motor_pos.tolist() == [0.5, 0.5]
    assert plant.contradiction == 0.0
    plant.break_part()
    motors, links, contradictions = SHOWN[part]
    turn = (0.25, 0.5)[drive]
    for cycle, wish in enumerate((1.0, 2.0)):
        (seen,) = stepped(plant, pair(drive, wish, -wish))
        healthy = turn * (cycle + 2)
        link = turn if links is None else healthy + links[cycle]
        assert seen.motor_pos[drive] == pytest.approx(motors[cycle], rel=1e-15)
        assert seen.joint_pos[drive] == pytest.approx(link, rel=1e-15)
        assert seen.motor_pos[1 - drive] == -wish
        assert seen.joint_pos[1 - drive] == 0.75 - turn + (0.75 - turn) * (cycle + 1)
        assert seen.spring_torque == pytest.approx(STIFFNESS * (seen.motor_pos - seen.joint_pos))
        if contradictions is not None:
            assert plant.contradiction == pytest.approx(contradictions[cycle], rel=1e-12)
        else:
            motor = wish - motors[cycle]
            assert plant.contradiction == max(motor, healthy - turn)
        held = 0.5 if part is Part.JAMMED else wish
        assert inside.commands[-1] == pair(drive, held, -wish)
    # A reset mends it.
    plant.reset()
    assert stepped(plant, (0.25, 0.25))[0].motor_pos.tolist() == [0.25, 0.25]


def test_a_plant_that_was_never_reset_has_nothing_to_break_and_all_else_is_passed_on() -> None:
    inside = Obeying()
    plant = BrokenPlant(inside, STIFFNESS, Part.JAMMED, 0)
    with pytest.raises(RuntimeError, match="never reset"):
        plant.break_part()
    assert plant.rest(np.array([0.5, 0.5]), lambda: True) == "rest at 0.5"
    assert plant.rest(np.array([0.5, 0.5]), lambda: False) is None
    assert not inside.closed
    plant.close()
    assert inside.closed


def test_sizes_and_kinds_of_deaths() -> None:
    # Steps of 0.1 rad, drifts of 1 rad/s; the others have neither.
    sizes = {Part.MOTOR_STEP: 0.1, Part.LINK_STEP: 0.1, Part.MOTOR_DRIFT: 1.0, Part.LINK_DRIFT: 1.0}
    assert {part: part.size for part in Part if part.size} == sizes
    assert {part for part in Part if part.shows_at_once} == set(sizes)
    assert {part for part in Part if part.drifts} == {Part.MOTOR_DRIFT, Part.LINK_DRIFT}


@pytest.mark.parametrize(("part", "bound"), [(Part.JAMMED, 0.05), (Part.LINK_DRIFT, 0.15)])
def test_a_part_is_found_in_time_up_to_its_bound(part: Part, bound: float) -> None:
    for time, excited, within in (
        (bound, True, True),
        (bound + 1e-9, True, False),
        (0.0, False, True),
        (None, False, True),
        (None, True, False),
    ):
        outcome = TrialOutcome(cause=None, time=time, since_death=None, excited=excited)
        assert outcome.within(part) is within
