"""The drives change nothing but one cycle of delay and the encoders' resolution."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import final

import numpy as np
import pytest
from can_rig import BUS, experiment, fine_bus, stage, staged

from legbench.control import BangBangConfig, JumpConfig
from legbench.drives.setup.bus_file import load_bus
from legbench.experiment import ControllerSettings, Experiment, record
from legbench.limits.safety import SafetyLimits
from legbench.loop import run
from legbench.metrics import summarise
from legbench.mjcf import Linkage, LinkageKind
from legbench.plant.abstract import AbstractPlant
from legbench.plant.emulated_leg import EmulatedLeg
from legbench.plant.landing import End
from legbench.plant.sim import SimPlant
from legbench.plants import CanChoice
from legbench.recording.manifest import OWN_KEYS
from legbench.recording.reader import Recording, load
from legbench.recording.writer import RunWriter
from legbench.servo import ServoConfig
from legbench.signals import Command, Floats, Observation

SIGNALS = ("command_pos", "applied_pos", "motor_pos", "joint_pos", "spring_torque")
RESOLUTION = load_bus(BUS).nodes[0].link_units.resolution
"""Of the bench's link encoders [rad]."""


@final
@dataclass
class FirstRow:
    """A recording that also remembers how long the leg had stood before its first row."""

    writer: RunWriter
    body: EmulatedLeg
    periods: int = 0

    def append(
        self, command: Command, observation: Observation, cycle_us: float, late_us: float
    ) -> None:
        self.periods = self.periods or self.body.periods
        self.writer.append(command, observation, cycle_us, late_us)


@final
class Settled(AbstractPlant):
    """A simulation that has stood in its start posture for a while, as a leg on a bench has."""

    def __init__(self, chosen: Experiment, periods: int) -> None:
        _, start = staged(chosen)
        servo = ServoConfig(delay_cycles=1)
        self._plant = SimPlant(chosen.design, chosen.options, start, servo)
        self._hold = Command.holding(start.motor_pos)
        self._periods, self.period = periods, self._plant.period
        self._cycle = 0

    def reset(self) -> Observation:
        seen = self._plant.reset()
        for _ in range(self._periods):
            seen = self._plant.step(self._hold)
        self._cycle = 0
        return self._shifted(seen)

    def step(self, command: Command) -> Observation:
        self._cycle += 1
        return self._shifted(self._plant.step(command))

    def rest(self, motor_pos: Floats, interrupted: Callable[[], bool]) -> None:
        self._plant.rest(motor_pos, interrupted)

    def close(self) -> None:
        self._plant.close()

    def _shifted(self, seen: Observation) -> Observation:
        return Observation(
            time=self._cycle * self.period,
            motor_pos=seen.motor_pos,
            joint_pos=seen.joint_pos,
            joint_vel=seen.joint_vel,
            spring_torque=seen.spring_torque,
            applied_pos=seen.applied_pos,
            truth=None,
        )


def both(chosen: Experiment, folder: Path) -> tuple[Recording, Recording]:
    """The same run over CAN frames and in a simulation with one cycle of delay."""
    brief = replace(
        chosen, duration=0.01, plant=CanChoice(bus=BUS, interface="legbench", end=End.STOP)
    )
    manifest = load(record(brief, folder / "manifest").path).manifest
    manifest = {key: value for key, value in manifest.items() if key not in OWN_KEYS}
    cycles = round(chosen.duration / 1e-3)
    with (
        stage(chosen, config=fine_bus(), limits=SafetyLimits(), ideal=True, lands=False) as it,
        RunWriter.create(folder / "can", manifest) as can,
    ):
        rows = FirstRow(can, it.body)
        assert run(it.plant, it.controller, cycles, sink=rows).status == "complete"
    controller, _ = staged(chosen)
    with RunWriter.create(folder / "sim", manifest) as sim:
        settled = Settled(chosen, rows.periods)
        assert run(settled, controller, cycles, sink=sim).status == "complete"
    return load(can.path), load(sim.path)


@pytest.mark.parametrize(
    ("config", "duration"),
    [pytest.param(BangBangConfig(), 1.5, marks=pytest.mark.long), (JumpConfig(), 1.0)],
    ids=["bang-bang", "jump"],
)
def test_drives_are_a_simulation_with_one_cycle_of_delay(
    config: ControllerSettings, duration: float, tmp_path: Path
) -> None:
    with_bars = replace(experiment(config, duration), linkage=Linkage(kind=LinkageKind.BARS))
    can, sim = both(with_bars, tmp_path)
    assert len(can.time) == round(duration / 1e-3)
    np.testing.assert_array_equal(can["phase"], sim["phase"])
    for name in SIGNALS:
        worst = float(np.max(np.abs(can[name] - sim[name])))
        assert worst < RESOLUTION
    mine, theirs = summarise(can), summarise(sim)
    for name in ("rating_stance", "rating_flight", "rating_periods", "polar_max"):
        np.testing.assert_allclose(getattr(mine, name), getattr(theirs, name), atol=1e-4)


def test_a_run_over_frames_repeats_to_the_byte(tmp_path: Path) -> None:
    seen = []
    for attempt in ("first", "second"):
        plant = CanChoice(bus=BUS, interface="legbench", end=End.STOP)
        chosen = replace(experiment(JumpConfig(), 0.5), plant=plant)
        run_folder = record(chosen, tmp_path / attempt).path
        recording = load(run_folder)
        rows = np.column_stack([recording[name] for name in SIGNALS])
        seen.append((rows.tobytes(), (run_folder / "bus.log").read_bytes()))
    assert seen[0] == seen[1]
    assert len(seen[0][1].splitlines()) > 2500
