"""What every controller promises at the seam, built in or from a file.

A new controller joins by one entry in `CONTROLLED`.
"""

from collections.abc import Sequence
from dataclasses import FrozenInstanceError, fields, replace
from pathlib import Path

import numpy as np
import pytest

from legbench.control import (
    CONTROLLERS,
    BangBangConfig,
    ChirpConfig,
    ControllerSettings,
    JumpConfig,
    LegTargets,
    PositionJumpConfig,
    SetupKind,
    make_controller,
)
from legbench.control.check import check_command
from legbench.design import LegDesign, load_design
from legbench.design.setup import Setup
from legbench.experiment import Experiment, load_experiment, save_experiment
from legbench.mjcf import BuildOptions, Linkage, LinkageKind
from legbench.phases import Role
from legbench.plant.batch import BatchPlant
from legbench.plant.sim import SimPlant
from legbench.plant.start import Start
from legbench.signals import Command, Floats, Observation

ROOT = Path(__file__).parents[2]
PROTOTYPE = load_design(ROOT / "models" / "prototype.toml")
CONTROLLED: dict[str, ControllerSettings] = {
    "jump": JumpConfig(delay=0.02),
    "bang-bang": BangBangConfig(delay=0.02),
    "bang-bang of three levels": BangBangConfig(delay=0.02, three_levels=True),
    "position-jump": PositionJumpConfig(delay=0.02),
    "chirp": ChirpConfig(delay=0.02, sweep=0.4),
    "guest sine": CONTROLLERS.find(f"{ROOT / 'tests/control/guests/sine.py'}:Sine")(freq=3.0),
    "guest pump": CONTROLLERS.find(f"{ROOT / 'scripts/examples/own_controller.py'}:Pump")(),
}
EVERY_CONTROLLER = pytest.mark.parametrize("settings", CONTROLLED.values(), ids=CONTROLLED.keys())
CYCLES = 450
"""A hop, or more than one oscillation: every controller has acted several times by then."""


def targets_for(
    settings: ControllerSettings, designs: LegDesign | Sequence[LegDesign] = PROTOTYPE
) -> LegTargets:
    return LegTargets(designs=designs, support=Setup(kind=settings.usual_setup).support)


def options_for(settings: ControllerSettings) -> BuildOptions:
    linkage = Linkage(kind=LinkageKind.REDUCED)
    return BuildOptions(setup=Setup(kind=settings.usual_setup), linkage=linkage)


def start_for(targets: LegTargets, motor_pos: Floats) -> Start:
    return Start(joint_pos=targets.link_at_rest(motor_pos), motor_pos=motor_pos)


def plant_for(settings: ControllerSettings) -> SimPlant:
    targets = targets_for(settings)
    start = start_for(targets, make_controller(settings, targets).start_motor_pos)
    return SimPlant(PROTOTYPE, options_for(settings), start)


def driven(
    settings: ControllerSettings, cycles: int = CYCLES
) -> tuple[list[Observation], list[Command]]:
    """What a controller sees and says on a simulated leg where it is at home."""
    controller = make_controller(settings, targets_for(settings))
    seen, said = [], []
    with plant_for(settings) as plant:
        seen.append(plant.reset())
        controller.reset(seen[0])
        for _ in range(cycles):
            said.append(controller.step(seen[-1]))
            seen.append(plant.step(said[-1]))
    return seen[:-1], said


def content(command: Command) -> tuple[bytes, int, bytes | None]:
    signals = None if command.signals is None else command.signals.tobytes()
    return command.motor_pos.tobytes(), int(command.phase), signals


@EVERY_CONTROLLER
def test_settings_are_frozen_and_say_where_the_controller_is_at_home(
    settings: ControllerSettings,
) -> None:
    assert isinstance(settings.kind, str)
    assert settings.usual_setup in set(SetupKind)
    first = fields(settings)[0].name  # pyrefly: ignore[bad-argument-type]
    with pytest.raises(FrozenInstanceError):
        setattr(settings, first, getattr(settings, first))


@EVERY_CONTROLLER
def test_it_begins_at_a_posture_that_its_leg_can_hold(settings: ControllerSettings) -> None:
    targets = targets_for(settings)
    controller = make_controller(settings, targets)
    motor_pos = controller.start_motor_pos
    assert motor_pos.shape == (2,)
    assert motor_pos.dtype == np.float64
    assert np.array_equal(controller.start_motor_pos, motor_pos)
    link = targets.link_at_rest(motor_pos)
    low, high = PROTOTYPE.limits.knee
    assert low <= link[1] - link[0] <= high


@EVERY_CONTROLLER
def test_every_command_is_one_that_a_plant_can_follow_and_a_run_can_record(
    settings: ControllerSettings,
) -> None:
    description = settings.describe()
    codes = {phase.code for phase in description.phases}
    width = sum(max(1, len(signal.components)) for signal in description.signals)
    seen, said = driven(settings)
    for observation, command in zip(seen, said, strict=True):
        check_command(command, observation)
        assert int(command.phase) in codes
        assert (command.signals is None) == (width == 0)
        if command.signals is not None:
            assert command.signals.shape == (width,)
            assert np.all(np.isfinite(command.signals))


@EVERY_CONTROLLER
def test_it_does_something_and_its_phases_say_so(settings: ControllerSettings) -> None:
    _, said = driven(settings)
    postures = np.array([command.motor_pos for command in said])
    moved = np.any(np.abs(postures - postures[0]) > 1e-3, axis=-1)
    assert moved.any()
    roles = {phase.code: phase.role for phase in settings.describe().phases}
    assert all(
        roles[int(command.phase)] is not Role.REST
        for command, away in zip(said, moved, strict=True)
        if away
    )


@EVERY_CONTROLLER
def test_a_reset_forgets_everything(settings: ControllerSettings) -> None:
    """Whatever came before, the same observations are answered by the same commands."""
    seen, said = driven(settings)
    controller = make_controller(settings, targets_for(settings))
    for cycles in (CYCLES, 137, CYCLES):
        controller.reset(seen[0])
        again = [content(controller.step(each)) for each in seen[:cycles]]
        assert again == [content(command) for command in said[:cycles]]


@EVERY_CONTROLLER
def test_what_it_said_stays_as_it_was(settings: ControllerSettings) -> None:
    """Later steps and a reset alter no command that was given before."""
    seen, _ = driven(settings)
    controller = make_controller(settings, targets_for(settings))
    controller.reset(seen[0])
    said = [controller.step(each) for each in seen[:-1]]
    kept = [content(command) for command in said]
    controller.step(seen[-1])
    controller.reset(seen[0])
    controller.step(seen[0])
    assert [content(command) for command in said] == kept


@EVERY_CONTROLLER
def test_it_neither_alters_nor_keeps_what_it_sees(settings: ControllerSettings) -> None:
    seen, said = driven(settings)
    controller = make_controller(settings, targets_for(settings))
    controller.reset(seen[0])
    for observation, command in zip(seen, said, strict=True):
        shown = replace(
            observation,
            motor_pos=observation.motor_pos.copy(),
            joint_pos=observation.joint_pos.copy(),
            joint_vel=observation.joint_vel.copy(),
            spring_torque=observation.spring_torque.copy(),
            applied_pos=observation.applied_pos.copy(),
        )
        assert content(controller.step(shown)) == content(command)
        for name in ("motor_pos", "joint_pos", "joint_vel", "spring_torque", "applied_pos"):
            array = getattr(shown, name)
            assert np.array_equal(array, getattr(observation, name)), name
            array.setflags(write=True)
            array[...] = 9.0


@EVERY_CONTROLLER
def test_it_needs_nothing_that_only_a_simulation_knows(settings: ControllerSettings) -> None:
    seen, said = driven(settings)
    controller = make_controller(settings, targets_for(settings))
    controller.reset(replace(seen[0], truth=None))
    blind = [content(controller.step(replace(each, truth=None))) for each in seen]
    assert blind == [content(command) for command in said]


@EVERY_CONTROLLER
def test_a_batch_is_each_leg_alone_bit_by_bit(settings: ControllerSettings) -> None:
    stiff = replace(PROTOTYPE, stiffness=(2.5, 2.4))
    heavy = replace(PROTOTYPE, trunk_mass=1.05 * PROTOTYPE.trunk_mass)
    targets = targets_for(settings, [PROTOTYPE, stiff, heavy])
    together = make_controller(settings, targets)
    alone = [make_controller(settings, one) for one in targets.each()]
    start = start_for(targets, together.start_motor_pos)
    for row, single in enumerate(alone):
        assert np.array_equal(single.start_motor_pos, together.start_motor_pos[row])
    with BatchPlant([PROTOTYPE, stiff, heavy], options_for(settings), start, threads=1) as plant:
        seen = plant.reset()
        together.reset(seen)
        for row, single in enumerate(alone):
            single.reset(of_leg(seen, row))
        for _ in range(CYCLES):
            command = together.step(seen)
            for row, single in enumerate(alone):
                mine = single.step(of_leg(seen, row))
                assert np.array_equal(mine.motor_pos, command.motor_pos[row])
                assert mine.phase == command.phase[row]
                if mine.signals is not None:
                    assert command.signals is not None
                    assert np.array_equal(mine.signals, command.signals[row])
            seen = plant.step(command)


def of_leg(seen: Observation, row: int) -> Observation:
    return Observation(
        time=seen.time,
        motor_pos=seen.motor_pos[row].copy(),
        joint_pos=seen.joint_pos[row].copy(),
        joint_vel=seen.joint_vel[row].copy(),
        spring_torque=seen.spring_torque[row].copy(),
        applied_pos=seen.applied_pos[row].copy(),
    )


@EVERY_CONTROLLER
def test_its_settings_go_to_a_file_and_back(settings: ControllerSettings, tmp_path: Path) -> None:
    chosen = Experiment(
        design=PROTOTYPE, controller=settings, setup=Setup(kind=settings.usual_setup)
    )
    save_experiment(chosen, tmp_path / "own.toml")
    assert load_experiment(tmp_path / "own.toml") == chosen
