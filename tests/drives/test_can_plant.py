"""The bench's plant on the emulated leg, in virtual time."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from can_rig import BUS, LIMITS, MS, Stage, experiment, stage

from legbench.control import BangBangConfig, JumpConfig, PositionJumpConfig
from legbench.drives.emulated.behaviour import Behaviour
from legbench.drives.emulated.faults import NodeFault, NodeFaultKind
from legbench.drives.master.link import LinkState
from legbench.drives.protocol.cia402 import DriveState
from legbench.drives.setup.bus_file import load_bus, load_limits
from legbench.drives.setup.quirks import Quirks
from legbench.errors import ConfigError, PlantFault
from legbench.experiment import record, start_of
from legbench.loop import run
from legbench.mjcf import Linkage, LinkageKind
from legbench.plant.can_events import bus_events
from legbench.plant.landing import End
from legbench.plant.limited import LimitedPlant
from legbench.plant.sim import SimPlant
from legbench.plants import CanChoice, SimChoice, joint_ranges, limits_for
from legbench.recording.reader import load
from legbench.signals import Command, Observation

EMULATED = CanChoice(bus=BUS, interface="legbench", end=End.STOP)
"""What follows the last row is told in test_can_landing."""


def test_a_jump_over_frames_leaves_a_whole_recording(tmp_path: Path) -> None:
    chosen = replace(experiment(JumpConfig(), 1.0), plant=EMULATED)
    finished = record(chosen, tmp_path)
    run_folder = load(finished.path)
    assert run_folder.complete
    assert len(run_folder.time) == 1000
    assert run_folder.description.plant == "can"
    said = run_folder.manifest["plant"]
    assert said["bus"]["interface"] == "legbench"
    assert said["limits"]["spring_torque"] == load_limits(LIMITS).spring_torque
    assert {event["name"] for event in run_folder.events} == {"bus", "end", "limited"}
    log = (finished.path / "bus.log").read_text(encoding="ascii").splitlines()
    assert sum(line.endswith("080#") for line in log) > 1000


def test_the_leg_does_not_move_until_it_is_told_to() -> None:
    chosen = replace(experiment(JumpConfig()), linkage=Linkage(kind=LinkageKind.BARS))
    with stage(chosen) as it:
        seen = it.plant.reset()
        np.testing.assert_allclose(seen.motor_pos, it.start.motor_pos, atol=2e-5)
        assert np.max(np.abs(seen.joint_vel)) < 0.05
        assert seen.truth is None
        assert seen.time == 0.0


def test_warnings_of_the_bus_file_are_told_beside_all_emergencies() -> None:
    chosen, bench = experiment(PositionJumpConfig()), load_bus(BUS)
    first, second = bench.nodes
    bus = replace(bench, nodes=(replace(first, quirks=Quirks(warnings=(0xFF01,))), second))
    start = start_of(chosen).motor_pos
    behaviours = [
        Behaviour(start_pos=float(pos), warnings=codes)
        for pos, codes in zip(start, ((0xFF01,), ()), strict=True)
    ]
    with stage(chosen, config=bus, behaviours=behaviours, lands=False) as it:
        it.plant.reset()
        told = bus_events(it.plant)["bus"]
    assert told["emergencies"] == told["warnings"] == ["EMCY FF01h vendor error of node 1"]


@pytest.mark.long
def test_drives_that_stand_elsewhere_go_to_the_start_slowly() -> None:
    chosen = experiment(PositionJumpConfig())
    away = [float(value) + 0.1 for value in start_of(chosen).motor_pos]
    with stage(chosen, behaviours=[Behaviour(start_pos=pos) for pos in away]) as it:
        seen = it.plant.reset()
        moves = [
            int.from_bytes(frame.data[2:6], "little", signed=True)
            for _, frame in it.network.log or []
            if frame.cob_id == 0x201
        ]
        config = load_bus(BUS)
        fastest = np.max(np.abs(np.diff(moves))) * config.nodes[0].motor.resolution / 1e-3
        assert fastest <= config.start_speed * 1.05
        np.testing.assert_allclose(seen.motor_pos, it.start.motor_pos, atol=2e-5)


def test_velocity_is_the_encoders_difference_behind_a_low_pass() -> None:
    with stage(experiment(BangBangConfig(), 0.6)) as it:
        seen = it.plant.reset()
        it.controller.reset(seen)
        places, rates = [], []
        for _ in range(600):
            seen = it.plant.step(it.controller.step(seen))
            places.append(seen.joint_pos)
            rates.append(seen.joint_vel)
    central = (np.array(places)[20:] - np.array(places)[:-20]) / 20e-3
    assert np.max(np.abs(central - np.array(rates)[10:-10])) < 0.25
    assert np.max(np.abs(central)) > 1.0


def test_closing_stops_both_drives_in_the_same_cycle_and_twice_is_once() -> None:
    with stage(experiment(JumpConfig())) as it:
        it.plant.reset()
        it.plant.close()
        it.plant.close()
        log = it.network.log or []
        stops = {
            frame.cob_id: at_ns
            for at_ns, frame in reversed(log)
            if frame.cob_id in (0x201, 0x202) and frame.data[:2] == b"\x02\x00"
        }
        assert len(stops) == 2
        assert abs(stops[0x201] - stops[0x202]) < MS
        states = [drive.axis.power.state for drive in it.network.drives]
        assert states == [DriveState.SWITCH_ON_DISABLED] * 2
        assert it.plant.link.state is LinkState.STOPPED


@pytest.mark.parametrize("answer", [LookupError("no such phase"), None])
def test_a_controller_that_fails_stops_both_drives_in_that_cycle(
    answer: Exception | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    with stage(experiment(JumpConfig())) as it:
        usual, failed_ns = it.controller.step, []

        def fail(observation: Observation) -> object:
            if observation.time < 0.1:
                return usual(observation)
            failed_ns.append(it.network.now_ns)
            if answer is not None:
                raise answer
            return answer

        monkeypatch.setattr(it.controller, "step", fail)
        outcome = run(it.plant, it.controller, 1000)
        assert (outcome.status, outcome.cause) == ("fault", "controller failed")
        assert (outcome.cycles, len(failed_ns)) == (100, 1)
        stops = {
            frame.cob_id: at_ns
            for at_ns, frame in reversed(it.network.log or [])
            if frame.cob_id in (0x201, 0x202) and frame.data[:2] == b"\x02\x00"
        }
        assert set(stops) == {0x201, 0x202}
        assert all(0 <= at_ns - failed_ns[0] < MS for at_ns in stops.values())
        states = [drive.axis.power.state for drive in it.network.drives]
        assert states == [DriveState.SWITCH_ON_DISABLED] * 2


def stand(it: Stage, cycles: int) -> None:
    for _ in range(cycles):
        it.plant.step(Command.holding(it.start.motor_pos))


def test_closing_a_plant_whose_bus_has_died_does_not_raise() -> None:
    with stage(experiment(JumpConfig())) as it:
        it.plant.reset()
        for node_id in (1, 2):
            it.network.inject(
                NodeFault(kind=NodeFaultKind.SILENT, node_id=node_id, start_ns=it.network.now_ns)
            )
        with pytest.raises(PlantFault, match="no process data"):
            stand(it, 10)
        it.plant.close()


def test_read_only_commands_nothing(tmp_path: Path) -> None:
    chosen = replace(experiment(JumpConfig(), 0.3), plant=replace(EMULATED, read_only=True))
    finished = record(chosen, tmp_path)
    assert finished.outcome.status == "complete"
    log = (finished.path / "bus.log").read_text(encoding="ascii")
    assert " 201#" not in log
    assert " 202#" not in log
    seen = load(finished.path)
    np.testing.assert_array_equal(seen["applied_pos"], seen["motor_pos"])
    assert json.loads((finished.path / "run.json").read_text())["plant"]["bus"]["read_only"]


# --- the same limits on every plant ----------------------------------------------------------


def test_limits_slew_a_simulation_as_they_slew_the_drives(tmp_path: Path) -> None:
    slow = tmp_path / "limits.toml"
    slow.write_text("command_speed = 5.0\n")
    seen = []
    chosen_limits = load_limits(slow)
    for plant in (SimChoice(limits=chosen_limits), replace(EMULATED, limits=chosen_limits)):
        chosen = replace(experiment(BangBangConfig(), 0.4), plant=plant)
        found = load(record(chosen, tmp_path / plant.kind).path)
        assert found.manifest["plant"]["limits"]["command_speed"] == 5.0
        assert np.max(np.abs(np.diff(found["applied_pos"], axis=0))) < 5.1e-3
        assert np.max(np.abs(np.diff(found["command_pos"], axis=0))) > 0.05
        seen.append(found["applied_pos"])
    np.testing.assert_allclose(seen[0][:150], seen[1][:150], atol=1e-4)


@pytest.mark.parametrize(
    ("text", "cause"),
    [
        ("command_step = 0.01", "command step"),
        ("spring_torque = 0.6", "spring torque"),
        ("joint_range = [[-0.5, 0.5], [-0.55, 0.55]]", "joint range"),
    ],
)
def test_a_limit_ends_the_run_with_its_name_on_every_plant(
    text: str, cause: str, tmp_path: Path
) -> None:
    limits = tmp_path / "limits.toml"
    limits.write_text(text)
    chosen_limits = load_limits(limits)
    for plant in (SimChoice(limits=chosen_limits), replace(EMULATED, limits=chosen_limits)):
        finished = record(
            replace(experiment(JumpConfig(), 1.0), plant=plant), tmp_path / plant.kind
        )
        assert (finished.outcome.status, finished.outcome.cause) == ("fault", cause)
        kept = load(finished.path)
        assert kept.torn is None
        assert kept.description.cause == cause
        assert len(kept.time) == finished.outcome.cycles


def test_a_limited_plant_with_delay_expects_its_motors_late() -> None:
    chosen = experiment(JumpConfig(), 0.5)
    for delay, status in ((0, "complete"), (3, "complete")):
        servo = replace(chosen.servo, delay_cycles=delay)
        limits = replace(load_limits(LIMITS), following_error=1e-6, following_cycles=1)
        inner = SimPlant(chosen.design, chosen.options, start_of(chosen), servo)
        with stage(chosen) as it, LimitedPlant(inner, limits, delay_cycles=delay) as plant:
            assert run(plant, it.controller, 500).status == status


def test_limits_looser_than_the_design_are_refused(tmp_path: Path) -> None:
    design = experiment(JumpConfig()).design
    (low, high), _ = joint_ranges(design)
    loose = tmp_path / "limits.toml"
    loose.write_text(f"joint_range = [[{low - 0.1}, {high}], [-0.5, 0.5]]\n")
    with pytest.raises(ConfigError, match=r"looser than the design's \[-2\.2, 0\.9\] rad"):
        limits_for(loose, design)
