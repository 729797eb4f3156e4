"""Short runs of every plant, each recorded once."""

import pytest
from replay_runs import emulated, run_of

from legbench.control import BangBangConfig, JumpConfig
from legbench.design import LegDesign
from legbench.plants import AnalyticChoice, SimChoice
from legbench.recording.reader import Recording


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
