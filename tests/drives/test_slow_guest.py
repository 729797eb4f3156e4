"""A controller from a file whose steps take 5 ms, on drives that want a command every 1 ms."""

from dataclasses import replace
from pathlib import Path
from typing import final

import numpy as np
from can_rig import MS, experiment, stage

from legbench.control import CONTROLLERS, AbstractController
from legbench.drives.emulated.network import Network
from legbench.drives.emulated.network_time import NetworkTime
from legbench.drives.protocol.cia402 import DriveState
from legbench.experiment.running import record_in_memory
from legbench.loop import run
from legbench.recording.controller_table import controller_table
from legbench.recording.memory import MemoryRun
from legbench.signals import Command, Floats, Observation

OWN = Path(__file__).parents[2] / "scripts" / "examples" / "own_controller.py"
STEP = "def step(self, observation: Observation) -> Command:"
SLOW_FROM = 50
"""Cycle from which a step takes 5 ms."""


@final
class Slow(AbstractController):
    """Another law, whose steps take 5 ms of the bus's time once it has been asked 50 times."""

    def __init__(self, law: AbstractController, network: Network) -> None:
        self._law, self._time, self._asked = law, NetworkTime(network), 0

    @property
    def start_motor_pos(self) -> Floats:
        return self._law.start_motor_pos

    def reset(self, observation: Observation) -> None:
        self._law.reset(observation)

    def step(self, observation: Observation) -> Command:
        self._asked += 1
        if self._asked > SLOW_FROM:
            self._time.wait_until(self._time.now_ns() + 5 * MS)
        return self._law.step(observation)


def test_a_law_that_takes_five_milliseconds_ends_the_run_and_stops_the_drives() -> None:
    settings = CONTROLLERS.find(f"{OWN}:Pump")()
    chosen = experiment(settings, duration=0.5)
    brief = record_in_memory(replace(chosen, duration=0.01))
    with stage(chosen) as it:
        manifest = {
            "experiment": brief.manifest["experiment"],
            "controller": controller_table(settings.kind, settings.describe()),
        }
        writer = MemoryRun(manifest)
        slow, now = Slow(it.controller, it.network), lambda: 1e-9 * it.network.now_ns
        outcome = run(it.plant, slow, 500, sink=writer, now=now)
        writer.close(outcome.status, outcome.cause)
        recording = writer.recording()
        powers = [drive.axis.power.state for drive in it.network.drives]
    assert powers == [DriveState.SWITCH_ON_DISABLED] * 2
    assert outcome.cause == "cycle overruns"
    said, own = str(outcome.message).split("\n")
    assert "ticks of 1000 us missed in a row, the limit is 3; free the processor" in said
    assert said.endswith("; the controller's step took 5 periods")
    assert own == f"  {__file__}:{Slow.step.__code__.co_firstlineno} in step: {STEP}"
    assert recording.description.cause == "cycle overruns"
    assert len(recording.time) == outcome.cycles == SLOW_FROM + 1
    assert np.all(np.isfinite(recording["fold_rate"]))
