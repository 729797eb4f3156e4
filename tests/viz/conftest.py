import pytest
import rerun as rr
from viz_runs import record

from legbench.design.setup import SetupKind
from legbench.recording.reader import Recording


@pytest.fixture(autouse=True, scope="session")
def _strict() -> None:
    """By default rerun swallows its errors."""
    rr.set_strict_mode(True)


@pytest.fixture(scope="session")
def hop(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    return record(tmp_path_factory.mktemp("hop"), SetupKind.JUMP, 2500)


@pytest.fixture(scope="session")
def swing(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    return record(tmp_path_factory.mktemp("swing"), SetupKind.VFTS, 2500)


@pytest.fixture(scope="session")
def real_hop(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    """A hop of which only the encoders are known."""
    return record(tmp_path_factory.mktemp("real"), SetupKind.JUMP, 2500, truth=False)
