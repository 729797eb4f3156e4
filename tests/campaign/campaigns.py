"""Campaigns that are small enough for a test, and how to run them."""

import signal
import sys
from collections.abc import Sequence
from pathlib import Path

from legbench.campaign import load_campaign, plan_campaign, run_campaign, shards_of
from legbench.campaign.executor import AbstractExecutor, SerialExecutor
from legbench.campaign.plan import CampaignPlan
from legbench.campaign.running import FinishedCampaign

MODELS = Path(__file__).parents[2] / "models"
BASE = f"""
[base]
design = "{MODELS / "prototype.toml"}"
duration = 0.12
seed = 5
setup.kind = "ffs"
linkage.kind = "reduced"
controller.kind = "position-jump"
controller.settings.delay = 0.02
imperfections.link_noise = [1e-4, 1e-4]
"""
GRID = """
[grid]
"controller.settings.z2" = [1.0, 1.2]
"controller.settings.dz2" = [0.1, 0.2]
"""
SMALL = 'name = "small"\ntrials = 2\n' + BASE + GRID
MIXED = (
    'name = "mixed"\n'
    + BASE
    + """
[[cells]]
name = "step"
trials = 2
grid.controller.settings.z2 = [1.0, 1.1]
[[cells]]
name = "swing"
trials = 2
set.controller = { kind = "bang-bang", settings = { delay = 0.02 } }
grid.controller.settings.z2 = [1.0, 1.2]
"""
)
"""Two groups that are stepped apart: 8 runs."""
LARGE = MIXED.replace("trials = 2", "trials = 4")
"""The same in 16 runs, of which a kill leaves some to do."""


def written(folder: Path, text: str, name: str = "campaign.toml") -> Path:
    path = folder / name
    path.write_text(text)
    return path


def planned(folder: Path, text: str = SMALL) -> CampaignPlan:
    return plan_campaign(load_campaign(written(folder, text)))


def ran(
    plan: CampaignPlan, out: Path, executor: AbstractExecutor | None = None, size: int | None = None
) -> FinishedCampaign:
    return run_campaign(plan, out, executor or SerialExecutor(1), shards_of(plan, size))


def table_bytes(out: Path) -> bytes:
    return (out / "table.parquet").read_bytes()


PROGRAM = """
import sys
sys.path[:0] = {path!r}
from pathlib import Path
from campaigns import planned, ran
from legbench.campaign.executor import SerialExecutor
from legbench.campaign.pool import PoolExecutor
if __name__ == "__main__":
    folder, out, which = map(Path, sys.argv[1:])
    executor = PoolExecutor(2) if str(which) == "local" else SerialExecutor(1)
    plan = planned(folder, (folder / "campaign.toml").read_text())
    ran(plan, out, executor, size=1)
"""


def program(folder: Path, out: Path, which: str) -> Sequence[str]:
    """Command that runs the campaign in `folder` in a process of its own, a shard a run."""
    path = folder / "program.py"
    path.write_text(PROGRAM.format(path=[str(Path(__file__).parent)]))
    return [sys.executable, str(path), str(folder), str(out), which]


def alive(pid: int) -> bool:
    """Whether a process runs; one that waits for its parent to take note does not."""
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except FileNotFoundError:
        return False
    return state != "Z"


def children_of(pid: int) -> set[int]:
    """Processes that a process has started, and theirs."""
    found: set[int] = set()
    for tasks in Path(f"/proc/{pid}/task").glob("*/children"):
        for child in map(int, tasks.read_text().split()):
            found |= {child} | children_of(child)
    return found


KILL = signal.SIGKILL
