from dataclasses import replace
from pathlib import Path
from types import MappingProxyType

import numpy as np
import pytest

from legbench.control import JumpConfig
from legbench.design import LegDesign
from legbench.design.setup import Setup, SetupKind
from legbench.experiment import Experiment
from legbench.experiment.running import record
from legbench.recording.reader import Recording, load


@pytest.fixture(scope="session")
def jump(prototype: LegDesign, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a run of half a second."""
    setup = Setup(kind=SetupKind.JUMP)
    experiment = Experiment(design=prototype, controller=JumpConfig(), setup=setup, duration=0.5)
    return record(experiment, tmp_path_factory.mktemp("jump")).path


@pytest.fixture(scope="session")
def run(jump: Path) -> Recording:
    """The same run with every number that a format may lose."""
    recording = load(jump)
    columns = {name: np.array(values) for name, values in recording.columns.items()}
    hard = [np.nan, np.inf, -np.inf, -0.0, 5e-324, 1.7976931348623157e308, 0.1 + 0.2, 1e-17, 1e22]
    columns["joint_vel_1"][: len(hard)] = hard
    columns["spring_torque_2"][3:9] = np.nan
    columns["contact"][5:20] = -1
    columns["phase"][7] = 99
    columns["late_us"] = np.random.default_rng(3).standard_normal(len(recording.time)) * 1e-3
    return replace(recording, columns=MappingProxyType(columns))
