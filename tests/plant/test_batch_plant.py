from pathlib import Path

import numpy as np
import pytest
from plants import JUMP, PROTOTYPE, built, copied, family, hopping, standing

from legbench.control.jump_rules import JumpPhase
from legbench.errors import ConfigError
from legbench.mjcf import LinkageKind
from legbench.plant.batch import BatchPlant
from legbench.plant.sim import SimPlant
from legbench.plant.start import Start
from legbench.servo import ServoConfig
from legbench.signals import Command

LIMITED = ServoConfig(slew_rate=8.0, bandwidth=60.0, delay_cycles=1, encoder_counts=8192)


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """MuJoCo writes its log into the working directory."""
    monkeypatch.chdir(tmp_path)


@pytest.mark.parametrize(
    ("linkage", "servo"),
    [(LinkageKind.BARS, ServoConfig()), (LinkageKind.REDUCED, LIMITED)],
    ids=["bars, ideal", "reduced, limited"],
)
def test_each_row_is_bit_identical_to_a_single_run(
    linkage: LinkageKind, servo: ServoConfig
) -> None:
    """Plant and controller, legs that all differ and legs that are all the same."""
    designs = [*family(6), *[PROTOTYPE] * 2]
    options, cycles = built(JUMP, linkage), 250
    controller, start = hopping(designs)
    plant = BatchPlant(designs, options, start, servo, threads=2)
    seen = plant.reset()
    controller.reset(seen)
    rows = [copied(seen)]
    phases = []
    for _ in range(cycles):
        command = controller.step(seen)
        phases.append(command.phase.copy())
        seen = plant.step(command)
        rows.append(copied(seen))
    assert len({int(phase) for phase in np.ravel(phases)}) >= 4
    assert not plant.faulted.any()
    for leg, design in enumerate(designs):
        alone, begin = hopping(design)
        single = SimPlant(design, options, begin, servo)
        one = single.reset()
        alone.reset(one)
        for cycle in range(cycles + 1):
            for name, leaf in copied(one).items():
                theirs = rows[cycle][name] if name == "time" else rows[cycle][name][leg]
                assert np.array_equal(leaf, theirs), (leg, cycle, name)
            if cycle < cycles:
                command = alone.step(one)
                assert command.phase == phases[cycle][leg]
                one = single.step(command)
    for name, leaf in rows[-1].items():
        if name != "time":
            assert np.array_equal(leaf[-2:], np.broadcast_to(leaf[-1], leaf[-2:].shape)), name


def test_the_number_of_threads_changes_nothing() -> None:
    designs = family(5)
    runs = []
    for threads in (1, 2, 3):
        controller, start = hopping(designs)
        plant = BatchPlant(designs, built(), start, threads=threads)
        seen = plant.reset()
        controller.reset(seen)
        for _ in range(60):
            seen = plant.step(controller.step(seen))
        runs.append(seen.joint_pos)
    assert np.array_equal(runs[0], runs[1])
    assert np.array_equal(runs[0], runs[2])


def test_a_leg_that_faults_is_marked_and_leaves_the_others_alone() -> None:
    designs = family(3)
    start = standing(designs)
    options = built(JUMP, LinkageKind.REDUCED)
    plant = BatchPlant(designs, options, start)
    alone = BatchPlant(designs, options, start)
    plant.reset()
    alone.reset()
    push = start.motor_pos.copy()
    push[1] = [3.0, -3.0]
    for _ in range(300):
        seen = plant.step(Command.holding(push))
        calm = alone.step(Command.holding(start.motor_pos))
        for leg in (0, 2):
            assert np.array_equal(seen.joint_pos[leg], calm.joint_pos[leg])
    assert plant.faulted.tolist() == [False, True, False]
    assert not alone.faulted.any()
    again = plant.reset()
    assert not plant.faulted.any()
    assert np.array_equal(again.joint_pos, start.joint_pos)


def test_a_command_that_is_no_number_marks_its_leg(capfd: pytest.CaptureFixture[str]) -> None:
    designs = family(2)
    start = standing(designs)
    plant = BatchPlant(designs, built(), start)
    plant.reset()
    bad = start.motor_pos.copy()
    bad[0, 1] = np.nan
    plant.step(Command.holding(bad))
    assert plant.faulted.tolist() == [True, False]


def test_rows_and_designs_must_match() -> None:
    start = standing(PROTOTYPE)
    with pytest.raises(ConfigError, match="at least one design"):
        BatchPlant([], built(), start)
    with pytest.raises(
        ConfigError, match=r"start posture has shape \(2,\); 1 designs need \(1, 2\)"
    ):
        BatchPlant([PROTOTYPE], built(), start)
    rows = standing([PROTOTYPE])
    with pytest.raises(ConfigError, match=r"start motors has shape \(2,\)"):
        BatchPlant([PROTOTYPE], built(), Start(joint_pos=rows.joint_pos, motor_pos=start.motor_pos))


def test_the_controllers_phases_are_a_row_each() -> None:
    controller, start = hopping(family(3))
    assert start.motor_pos.shape == (3, 2)
    plant = BatchPlant(family(3), built(), start)
    seen = plant.reset()
    controller.reset(seen)
    assert controller.step(seen).phase.tolist() == [JumpPhase.REST] * 3
