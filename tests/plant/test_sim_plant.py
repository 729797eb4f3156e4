import re
from pathlib import Path

import mujoco
import numpy as np
import pytest
from plants import JUMP, OPTIMAL, PROTOTYPE, built, hopping, standing, wobble

from legbench.control import AbstractController
from legbench.design.setup import Setup, SetupKind
from legbench.design.statics import GRAVITY
from legbench.errors import PlantFault
from legbench.kinematics import leg_points
from legbench.loop import run
from legbench.mjcf import LinkageKind
from legbench.plant.sim import SimPlant
from legbench.plant.start import Start
from legbench.signals import Command, Floats, Observation, Truth

WEIGHT = GRAVITY * 1.0
FREE_FALL = 0.3
STANDING = ["jump", "ffs"]


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """MuJoCo writes its log into the working directory."""
    monkeypatch.chdir(tmp_path)


def truth_of(observation: Observation) -> Truth:
    assert observation.truth is not None
    return observation.truth


def stood(setup: Setup, linkage: LinkageKind, design: object = None) -> tuple[SimPlant, Floats]:
    start = standing(OPTIMAL, setup)
    return SimPlant(OPTIMAL, built(setup, linkage), start), start.motor_pos


@pytest.mark.parametrize("linkage", LinkageKind)
@pytest.mark.parametrize("kind", STANDING)
def test_the_ground_carries_the_leg_upwards(kind: str, linkage: LinkageKind) -> None:
    plant, motor_pos = stood(Setup(kind=SetupKind(kind)), linkage)
    plant.reset()
    for _ in range(400):
        seen = truth_of(plant.step(Command.holding(motor_pos)))
    seen = truth_of(plant.step(Command.holding(motor_pos)))
    assert bool(seen.contact)
    assert seen.contact_force[1] == pytest.approx(WEIGHT, rel=2e-2)
    assert abs(seen.contact_force[0]) < 0.02 * WEIGHT
    assert seen.trunk_pos[1] > seen.foot_pos[1] + 0.1


@pytest.mark.parametrize("kind", list(SetupKind))
def test_a_leg_at_its_equilibrium_stays_there(kind: SetupKind) -> None:
    plant, motor_pos = stood(Setup(kind=kind), LinkageKind.REDUCED)
    first = plant.reset()
    for _ in range(300):
        seen = plant.step(Command.holding(motor_pos))
        assert np.max(np.abs(seen.joint_pos - first.joint_pos)) < 2e-4
        assert np.max(np.abs(seen.joint_vel)) < 2e-2


def test_the_truth_agrees_with_kinematics_while_hopping() -> None:
    controller, start = hopping(PROTOTYPE)
    plant = SimPlant(PROTOTYPE, built(), start)
    seen = plant.reset()
    controller.reset(seen)
    heights, touching, forces = [], [], []
    before = seen
    for _ in range(1500):
        seen = plant.step(controller.step(seen))
        truth = truth_of(seen)
        reach = leg_points(seen.joint_pos, PROTOTYPE.lengths)[3]
        assert np.allclose(truth.foot_pos - truth.trunk_pos, reach, atol=1e-5)
        assert np.allclose(truth.trunk_vel, plant.data.qvel[:2], atol=1e-12)
        travel = truth.trunk_pos - truth_of(before).trunk_pos
        mean = 0.5 * (truth.trunk_vel + truth_of(before).trunk_vel)
        jolt = np.max(np.abs(truth.trunk_vel - truth_of(before).trunk_vel))
        assert np.max(np.abs(travel / 1e-3 - mean)) < 0.01 + 0.6 * jolt
        turned = seen.joint_pos - before.joint_pos
        jerk = np.max(np.abs(seen.joint_vel - before.joint_vel))
        assert np.max(np.abs(turned / 1e-3 - seen.joint_vel)) < 0.05 + 1.1 * jerk
        heights.append(truth.foot_pos[1])
        touching.append(bool(truth.contact))
        forces.append(float(truth.contact_force[1]))
        before = seen
    height, contact, force = np.array(heights), np.array(touching), np.array(forces)
    assert 0 < np.count_nonzero(~contact) < len(contact)
    assert np.all(height[contact] < 1e-3)
    assert np.all(force[height > 1e-3] == 0.0)
    assert np.all(force >= -1e-9)
    assert np.min(height) > -1e-3


@pytest.mark.parametrize("kind", list(SetupKind))
def test_the_energy_is_that_of_the_state_that_is_seen(kind: SetupKind) -> None:
    plant, motor_pos = stood(Setup(kind=kind), LinkageKind.BARS)
    plant.reset()
    model, data = plant.model, plant.data
    matrix = np.zeros((model.nv, model.nv))
    for cycle in range(100):
        seen = truth_of(plant.step(wobble(motor_pos, cycle)))
        mujoco.mj_fullM(model, data, matrix)
        kinetic = 0.5 * data.qvel @ matrix @ data.qvel
        potential = -np.sum(model.body_mass * (data.xipos @ model.opt.gravity))
        assert np.allclose(seen.energy, [potential, kinetic], rtol=1e-10, atol=1e-14)


def test_a_leg_in_the_air_falls_freely() -> None:
    start = standing(OPTIMAL)
    plant = SimPlant(OPTIMAL, built(linkage=LinkageKind.REDUCED), start)
    first = truth_of(plant.reset())
    plant.data.qpos[1] += FREE_FALL
    command = Command.holding(start.joint_pos)
    for cycle in range(1, 200):
        seen = truth_of(plant.step(command))
        assert not bool(seen.contact)
        assert np.array_equal(seen.contact_force, [0.0, 0.0])
        fallen = first.trunk_pos[1] + FREE_FALL - seen.trunk_pos[1]
        assert fallen == pytest.approx(0.5 * GRAVITY * (cycle * 1e-3) ** 2, abs=1e-9)


def test_a_fixed_trunk_stays_and_has_no_ground() -> None:
    for kind in (SetupKind.HFTS, SetupKind.VFTS):
        setup = Setup(kind=kind)
        plant, motor_pos = stood(setup, LinkageKind.BARS)
        first = truth_of(plant.reset())
        for cycle in range(50):
            seen = truth_of(plant.step(wobble(motor_pos, cycle)))
            assert np.array_equal(seen.trunk_pos, first.trunk_pos)
            assert not bool(seen.contact)
            assert np.array_equal(seen.contact_force, [0.0, 0.0])


def test_the_text_that_is_saved_is_the_model_that_runs() -> None:
    plant = SimPlant(OPTIMAL, built(), standing(OPTIMAL))
    assert plant.xml.startswith("<mujoco")
    assert plant.model.nu == 2
    assert plant.model.opt.timestep * 4 == pytest.approx(plant.period)


class Commanding(AbstractController):
    """Commands one thing after another; keeps to the last."""

    def __init__(self, *motor_pos: Floats) -> None:
        self._queue = list(motor_pos)

    @property
    def start_motor_pos(self) -> Floats:
        return self._queue[0]

    def reset(self, observation: Observation) -> None:
        """Nothing to forget."""

    def step(self, observation: Observation) -> Command:
        if len(self._queue) > 1:
            return Command.holding(self._queue.pop(0))
        return Command.holding(self._queue[0])


@pytest.mark.parametrize(
    ("motor_pos", "cause"),
    [
        (np.array([3.0, -3.0]), "leg straightened through"),
        (np.array([-6.0, 6.0]), "leg folded through"),
    ],
)
@pytest.mark.parametrize("kind", [SetupKind.HFTS, SetupKind.JUMP])
def test_a_leg_driven_through_its_stops_ends_the_run(
    kind: SetupKind, motor_pos: Floats, cause: str
) -> None:
    setup = Setup(kind=kind)
    start = standing(PROTOTYPE, setup)
    plant = SimPlant(PROTOTYPE, built(setup, LinkageKind.REDUCED), start)
    outcome = run(plant, Commanding(start.motor_pos, motor_pos), 3000)
    assert (outcome.status, outcome.cause) == ("fault", cause)
    assert 1 < outcome.cycles < 3000
    assert outcome.message is not None
    assert re.search(rf"{cause} at t = 0\.\d+ s: .*--dz2.*--slew-rate", outcome.message)


@pytest.mark.parametrize(
    ("joint", "cause"),
    [("ankle", "foot loop crossed"), ("crank", "thigh loop crossed")],
)
def test_a_crossed_loop_is_named(joint: str, cause: str) -> None:
    """The other assembly of a parallelogram: its loop is closed, so no gap shows it."""
    start = standing(PROTOTYPE)
    plant = SimPlant(PROTOTYPE, built(), start)
    plant.reset()
    data, arm = plant.data, 0.02
    knee = float(data.joint("knee").qpos[0])
    fold = np.pi - knee
    side = PROTOTYPE.shank.length if joint == "ankle" else PROTOTYPE.thigh.length
    lean = 2.0 * np.arctan2(arm * np.sin(fold), side - arm * np.cos(fold))
    if joint == "ankle":
        data.joint("bar_shank").qpos[0] -= lean
        data.joint("ankle").qpos[0] += 2.0 * knee - lean
    else:
        data.joint("crank").qpos[0] -= 2.0 * knee - lean
        data.joint("bar_thigh").qpos[0] += 2.0 * knee
    with pytest.raises(PlantFault, match=cause) as caught:
        plant.step(Command.holding(start.motor_pos))
    assert caught.value.cause == cause


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_a_command_that_is_no_number_ends_the_run(value: float) -> None:
    start = standing(PROTOTYPE)
    plant = SimPlant(PROTOTYPE, built(), start)
    bad = np.array([start.motor_pos[0], value])
    outcome = run(plant, Commanding(start.motor_pos, start.motor_pos, bad), 10)
    assert (outcome.status, outcome.cause) == ("fault", "controller failed")
    assert outcome.message is not None
    assert "at t = 0.002 s" in outcome.message
    with pytest.raises(PlantFault, match="must give finite numbers") as caught:
        plant.step(Command.holding(bad))
    assert caught.value.cause == "command not finite"


@pytest.mark.parametrize("speed", [1e7, np.nan])
def test_a_diverged_simulation_is_called_by_its_name(
    speed: float, capfd: pytest.CaptureFixture[str]
) -> None:
    start = standing(PROTOTYPE)
    plant = SimPlant(PROTOTYPE, built(JUMP, LinkageKind.REDUCED), start)
    plant.reset()
    plant.data.qvel[:] = speed
    with pytest.raises(PlantFault, match="simulation diverged at t = 0"):
        plant.step(Command.holding(start.motor_pos))


def test_a_start_is_not_changed_by_running(tmp_path: Path) -> None:
    start = standing(PROTOTYPE)
    kept = Start(joint_pos=start.joint_pos.copy(), motor_pos=start.motor_pos.copy())
    plant = SimPlant(PROTOTYPE, built(), start)
    rest = plant.reset().motor_pos
    for cycle in range(5):
        plant.step(wobble(rest, cycle))
    assert np.array_equal(kept.joint_pos, start.joint_pos)
    assert np.array_equal(kept.motor_pos, start.motor_pos)
