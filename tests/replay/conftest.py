"""Short runs of every plant, each recorded once."""

import shutil
from pathlib import Path

import pytest
from replay_runs import emulated, run_of

from legbench.control import BangBangConfig, JumpConfig
from legbench.design import LegDesign
from legbench.guests import module_of_file
from legbench.limits.safety import SafetyLimits
from legbench.plants import AnalyticChoice, SimChoice
from legbench.recording.reader import Recording

GUEST = Path(__file__).parent / "guests" / "counting.py"
STILL = Path(__file__).parents[1] / "plant" / "guests" / "still.py"


@pytest.fixture(scope="session")
def sim_jump(tmp_path_factory: pytest.TempPathFactory, prototype: LegDesign) -> Recording:
    """A jump from its start to its second stance."""
    return run_of(tmp_path_factory.mktemp("sim"), prototype, JumpConfig(), SimChoice(), 0.8)


@pytest.fixture(scope="session")
def analytic_run(tmp_path_factory: pytest.TempPathFactory, prototype: LegDesign) -> Recording:
    folder = tmp_path_factory.mktemp("analytic")
    return run_of(folder, prototype, JumpConfig(), AnalyticChoice(), 0.6)


@pytest.fixture(scope="session")
def can_swing(tmp_path_factory: pytest.TempPathFactory, prototype: LegDesign) -> Recording:
    """A leg that swings on emulated drives, its foot pinned; one cycle lacks an answer."""
    folder = tmp_path_factory.mktemp("swing")
    return run_of(folder, prototype, BangBangConfig(), emulated(), 0.8)


@pytest.fixture(scope="session")
def can_jump(tmp_path_factory: pytest.TempPathFactory, prototype: LegDesign) -> Recording:
    """A jump on emulated drives, with its landing and the stance after it."""
    return run_of(tmp_path_factory.mktemp("jump"), prototype, JumpConfig(), emulated(), 1.0)


@pytest.fixture(scope="session")
def guest_run(tmp_path_factory: pytest.TempPathFactory, prototype: LegDesign) -> Recording:
    """A run of a law from a file that is not there any more."""
    folder = tmp_path_factory.mktemp("guest")
    mine = folder / "mine.py"
    shutil.copy(GUEST, mine)
    run = run_of(folder, prototype, module_of_file(mine).Counting(), SimChoice(), 0.12)
    mine.unlink()
    return run


@pytest.fixture(scope="session")
def guest_plant(tmp_path_factory: pytest.TempPathFactory, prototype: LegDesign) -> Recording:
    """A run on a plant from a file that is not there any more, under a law of one's own."""
    folder = tmp_path_factory.mktemp("plant")
    law, plant = folder / "law.py", folder / "still.py"
    shutil.copy(GUEST, law)
    shutil.copy(STILL, plant)
    settings = module_of_file(plant).Still(lag=0.3)
    run = run_of(folder, prototype, module_of_file(law).Counting(), settings, 0.12)
    law.unlink()
    plant.unlink()
    return run


@pytest.fixture(scope="session")
def limited_run(tmp_path_factory: pytest.TempPathFactory, prototype: LegDesign) -> Recording:
    """A simulated jump whose commands limits have slewed."""
    limits = SafetyLimits(command_speed=40.0)
    folder = tmp_path_factory.mktemp("limited")
    return run_of(folder, prototype, JumpConfig(), SimChoice(limits=limits), 0.2)
