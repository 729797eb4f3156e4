"""The analytic leg behind the plant seam."""

from pathlib import Path

import numpy as np
import pytest

from legbench.control import BangBangConfig, JumpConfig, PositionJumpConfig
from legbench.design import LegDesign, load_design
from legbench.design.setup import Setup, SetupKind
from legbench.errors import PlantFault
from legbench.experiment import ControllerSettings, Experiment, make_controller, targets_of
from legbench.loop import Outcome, run
from legbench.mjcf import BuildOptions, Linkage, LinkageKind
from legbench.plant.abstract import AbstractPlant
from legbench.plant.analytic import AnalyticPlant
from legbench.plant.sim import SimPlant
from legbench.plant.start import Start
from legbench.servo import ServoConfig
from legbench.signals import Command, Floats, Observation, Truth

MODELS = Path(__file__).parents[2] / "models"
PROTOTYPE = load_design(MODELS / "prototype.toml")
OPTIMAL = load_design(MODELS / "optimal.toml")
REDUCED = Linkage(kind=LinkageKind.REDUCED)


class Seen:
    """A sink that keeps what it is given."""

    def __init__(self) -> None:
        self.observations: list[Observation] = []

    def append(
        self, command: Command, observation: Observation, cycle_us: float, late_us: float
    ) -> None:
        self.observations.append(observation)

    def truth(self, name: str) -> Floats:
        values: list[Floats] = []
        for observation in self.observations:
            assert isinstance(observation.truth, Truth)
            values.append(getattr(observation.truth, name))
        return np.array(values)


def start_of(experiment: Experiment) -> Start:
    targets = targets_of(experiment)
    motor = make_controller(experiment.controller, targets).start_motor_pos
    return Start(joint_pos=targets.link_at_rest(motor), motor_pos=motor)


def controlled(plant: AbstractPlant, experiment: Experiment, cycles: int) -> tuple[Seen, Outcome]:
    seen = Seen()
    controller = make_controller(experiment.controller, targets_of(experiment))
    return seen, run(plant, controller, cycles, sink=seen)


def replayed(plant: AbstractPlant, seen: Seen) -> Seen:
    """Another plant under the commands of a run."""
    again = Seen()
    again.observations.append(plant.reset())
    for row in seen.observations[1:]:
        again.observations.append(plant.step(Command.holding(row.applied_pos)))
    return again


def replay(plant: AbstractPlant, command: Command, cycles: int) -> None:
    for _ in range(cycles):
        plant.step(command)


def jump(design: LegDesign = PROTOTYPE, z2: float = 0.6, dz2: float = 0.2) -> Experiment:
    return Experiment(design=design, controller=JumpConfig(z2=z2, dz2=dz2), linkage=REDUCED)


@pytest.mark.parametrize("kind", list(SetupKind))
def test_reset_shows_what_the_simulation_shows(kind: SetupKind) -> None:
    experiment = Experiment(
        design=PROTOTYPE, controller=PositionJumpConfig(), setup=Setup(kind=kind)
    )
    start = start_of(experiment)
    first = AnalyticPlant(PROTOTYPE, experiment.setup, start).reset()
    second = SimPlant(PROTOTYPE, BuildOptions(setup=experiment.setup), start).reset()
    for name in ("motor_pos", "joint_pos", "joint_vel", "spring_torque", "applied_pos"):
        assert np.allclose(getattr(first, name), getattr(second, name), atol=1e-12), name
    assert first.truth is not None
    assert second.truth is not None
    for name in ("trunk_pos", "trunk_vel", "foot_pos", "loop_gap"):
        value, other = getattr(first.truth, name), getattr(second.truth, name)
        assert value.shape == other.shape
        assert np.allclose(value, other, atol=1e-9), name
    assert bool(first.truth.contact) == bool(second.truth.contact)
    weight = 9.81 * PROTOTYPE.total_mass if bool(first.truth.contact) else 0.0
    assert np.allclose(first.truth.contact_force, [0.0, weight], atol=1e-9)


def test_two_runs_are_the_same_to_the_bit_and_one_command_acts_one_row_later() -> None:
    experiment = jump()
    plant = AnalyticPlant(PROTOTYPE, experiment.setup, start_of(experiment))
    first, _ = controlled(plant, experiment, 300)
    second, _ = controlled(plant, experiment, 300)
    for one, other in zip(first.observations, second.observations, strict=True):
        assert np.array_equal(one.joint_pos, other.joint_pos)
    observation = plant.reset()
    moved = observation.motor_pos + 0.1
    after = plant.step(Command.holding(moved))
    assert after.time == plant.period
    assert np.array_equal(after.motor_pos, moved)
    assert np.array_equal(observation.motor_pos, start_of(experiment).motor_pos)


def test_the_servo_is_the_one_of_the_simulation() -> None:
    experiment = jump()
    servo = ServoConfig(slew_rate=4.0, delay_cycles=2, encoder_counts=4096)
    start = start_of(experiment)
    plants = (
        AnalyticPlant(PROTOTYPE, experiment.setup, start, servo),
        SimPlant(PROTOTYPE, experiment.options, start, servo),
    )
    rows = []
    for plant in plants:
        plant.reset()
        rows.append(
            [plant.step(Command.holding(start.motor_pos + 0.05)).motor_pos for _ in range(30)]
        )
    assert np.array_equal(*rows)


@pytest.mark.parametrize(
    ("controller", "kind"),
    [
        (PositionJumpConfig(), SetupKind.VFTS),
        (BangBangConfig(z2=1.0), SetupKind.HFTS),
        (BangBangConfig(), SetupKind.FFS),
        (JumpConfig(), SetupKind.JUMP),
    ],
)
def test_every_controller_runs_on_it(controller: ControllerSettings, kind: SetupKind) -> None:
    experiment = Experiment(design=PROTOTYPE, controller=controller, setup=Setup(kind=kind))
    plant = AnalyticPlant(PROTOTYPE, experiment.setup, start_of(experiment))
    seen, outcome = controlled(plant, experiment, 1000)
    assert outcome.status == "complete"
    z2 = np.array([row.joint_pos[1] - row.joint_pos[0] for row in seen.observations])
    assert np.ptp(z2) > 0.1
    assert np.ptp(z2[:90]) < 1e-9


def test_energy_of_the_truth_is_lost_to_damping_alone() -> None:
    experiment = Experiment(
        design=PROTOTYPE, controller=PositionJumpConfig(), setup=Setup(kind=SetupKind.FFS)
    )
    plant = AnalyticPlant(PROTOTYPE, experiment.setup, start_of(experiment))
    seen, _ = controlled(plant, experiment, 600)
    rows = seen.observations[102:]
    torque = np.array([row.spring_torque for row in rows])
    stored = 0.5 * np.sum(torque**2 / np.asarray(PROTOTYPE.stiffness), axis=-1)
    total = np.sum(seen.truth("energy")[102:], axis=-1) + stored
    speed = np.array([row.joint_vel for row in rows])
    power = speed**2 @ np.asarray(PROTOTYPE.damping)
    lost = 0.001 * np.concatenate([[0.0], np.cumsum(0.5 * (power[1:] + power[:-1]))])
    assert np.max(np.abs(total[0] - total - lost)) < 2e-5
    assert lost[-1] > 0.01


@pytest.mark.parametrize(
    ("design", "z2", "dz2"),
    [
        (PROTOTYPE, 0.45, 0.15),
        (OPTIMAL, 0.45, 0.15),
        (PROTOTYPE, 0.6, 0.2),
        (PROTOTYPE, 0.7, 0.25),
        (OPTIMAL, 0.7, 0.25),
    ],
    ids=["prototype", "optimal", "prototype-0.6", "prototype-0.7", "optimal-0.7"],
)
def test_first_flight_of_a_jump_is_that_of_the_simulation(
    design: LegDesign, z2: float, dz2: float
) -> None:
    """The same commands on both, so that the flight begins at the same push to the millisecond.

    The default settings drive the knee into its stop in the first flight, the others do not.
    """
    experiment = jump(design, z2, dz2)
    start = start_of(experiment)
    plant = AnalyticPlant(design, experiment.setup, start)
    analytic, _ = controlled(plant, experiment, 420)
    simulated = replayed(SimPlant(design, experiment.options, start), analytic)
    liftoff, touchdown = (transition.time for transition in plant.transitions[:2])
    rows = slice(round(1e3 * liftoff), round(1e3 * touchdown))
    knee = np.array([row.joint_pos[1] - row.joint_pos[0] for row in analytic.observations])
    assert bool(np.min(knee[rows]) < design.limits.knee[0]) is (z2 == JumpConfig().z2)
    heights = [seen.truth("trunk_pos")[:, 1] for seen in (analytic, simulated)]
    rise = [float(np.max(height[rows]) - np.min(height[: rows.stop])) for height in heights]
    assert abs(rise[1] / rise[0] - 1.0) < 0.03
    foot = simulated.truth("foot_pos")[:, 1]
    middle = (rows.start + rows.stop) // 2
    assert foot[middle] > 1e-3
    row = middle + int(np.flatnonzero(foot[middle:] <= 0.0)[0])
    # Continue the last three heights in the air: the row after is already braked by the ground.
    curve = np.polynomial.Polynomial.fit([-2.0, -1.0, 0.0], foot[row - 3 : row], 2)
    crossings = [float(root.real) for root in curve.roots() if abs(root.imag) < 1e-9]
    met = 1e-3 * (row - 1 + min(root for root in crossings if root > 0.0))
    assert abs(met - touchdown) < 3e-4


def test_a_leg_driven_through_its_stop_is_a_named_fault() -> None:
    setup = Setup(kind=SetupKind.HFTS)
    start = Start(joint_pos=np.array([-0.6, 0.6]), motor_pos=np.array([-0.6, 0.6]))
    plant = AnalyticPlant(PROTOTYPE, setup, start)
    plant.reset()
    push = Command.holding(np.array([60.0, -60.0]))
    with pytest.raises(PlantFault, match="leg straightened through at t = ") as caught:
        replay(plant, push, 300)
    assert caught.value.cause == "leg straightened through"
