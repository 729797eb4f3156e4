import gc
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from hypothesis import settings

from legbench.design import LegDesign, load_design

if TYPE_CHECKING:
    from folder_scheduling import FolderScheduling
    from xdist.remote import Producer

settings.register_profile("repeatable", deadline=None, derandomize=True, max_examples=50)
settings.load_profile("repeatable")

# Tests that are started in the background inherit that ^C and SIGHUP are ignored, and would hand it
# on to the processes that they interrupt.
for _number, _usual in (
    (signal.SIGINT, signal.default_int_handler),
    (signal.SIGHUP, signal.SIG_DFL),
):
    if signal.getsignal(_number) is signal.SIG_IGN:
        signal.signal(_number, _usual)

# Many tests start the package in processes of their own, whose bytecode is compiled once only.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False

MODELS = Path(__file__).parents[1] / "models"


# What is imported and collected stays, with a little garbage that takes half a second to find.
gc.disable()


def pytest_collection_finish() -> None:
    """Take what has been collected out of every later search for garbage, and search less often.

    At Python's own threshold of 700 objects the search takes 7 % of the processor time of a run on
    emulated drives; memory is not scarce here.
    """
    gc.freeze()
    gc.set_threshold(50_000, 20, 20)
    gc.enable()


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(
    config: pytest.Config, log: "Producer"
) -> "FolderScheduling | None":
    """Hand out a folder, not a file, at a time; another `--dist` stands as it was asked for."""
    if config.getoption("dist") != "loadfile":
        return None
    from folder_scheduling import FolderScheduling  # noqa: PLC0415 xdist may be switched off

    return FolderScheduling(config, log)


@pytest.fixture(scope="session")
def models() -> Path:
    """The folder of the designs that come with the project."""
    return MODELS


@pytest.fixture(scope="session")
def optimal() -> LegDesign:
    return load_design(MODELS / "optimal.toml")


@pytest.fixture(scope="session")
def table2() -> LegDesign:
    """The optimal leg with the digits that the paper prints."""
    return load_design(MODELS / "table2.toml")


@pytest.fixture(scope="session")
def prototype() -> LegDesign:
    return load_design(MODELS / "prototype.toml")


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """An empty disk of 256 kB, where one may be mounted."""
    disk = tmp_path / "disk"
    disk.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=256k", "tmpfs", str(disk)]
    try:
        refused = subprocess.run(mount, capture_output=True, check=False).returncode
    except FileNotFoundError:
        refused = 1
    if refused:
        pytest.skip("only root can mount a small disk")
    yield disk
    subprocess.run(["umount", str(disk)], check=True)
