"""`legbench campaign`: many experiments from one file, and the one table that they leave."""

import re
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import tyro

from legbench.cli.output import duration_text, note, print_json, progress, report_error
from legbench.cli.parse import parse
from legbench.errors import CampaignError, ConfigError

if TYPE_CHECKING:
    from legbench.campaign.executor import AbstractExecutor
    from legbench.campaign.plan import CampaignPlan
    from legbench.campaign.running import FinishedCampaign
    from legbench.campaign.shards import Shard

EXECUTORS = "serial, local, dask, dask://HOST:PORT, slurm"


@dataclass(frozen=True, slots=True, kw_only=True)
class CampaignArguments:
    """Run a campaign: a grid of experiments, in parallel, resumable, into one table."""

    file: Annotated[Path, tyro.conf.Positional]
    """Campaign file."""
    out: Path | None = None
    """Folder of the campaign; by default runs/NAME. A campaign that was begun there is gone on
    with."""
    executor: str = "local"
    """Executor of the experiments: serial (in this process), local (processes of this machine),
    dask (a scheduler of its own, on loopback), dask://HOST:PORT (one that runs) or slurm."""
    workers: int | None = None
    """Number of processes of local and dask; by default one a processor."""
    shard: str | None = None
    """Part of the campaign to run, as 1/4: several callers with a part each share one folder."""
    records: Literal["none", "parquet"] = "none"
    """Recordings to keep: none, or every run's as a folder under records, by its hash."""
    set: Annotated[tuple[str, ...], tyro.conf.UseAppendAction] = ()
    """Setting of every cell that replaces the file's, as dotted.key=value; may be repeated."""
    plant: Literal["can"] | None = None
    """Plant can runs all cells on the bench, one after another, and stops at the first fault."""
    bus: Path = Path("hardware/leg.toml")
    """Bus file of the bench."""
    interface: str | None = None
    """Interface of the bench in python-can, legbench for an emulated leg; else the bus file's."""
    channel: str | None = None
    """Channel of the bench such as can0; by default the bus file's."""
    pause: float = 2.0
    """Time between two runs on the bench [s]."""
    slurm: Annotated[tuple[str, ...], tyro.conf.UseAppendAction] = ()
    """Parameter of the jobs of slurm, as slurm_partition=NAME or timeout_min=120; may be
    repeated."""
    plan: bool = False
    """Whether to tell what would be run, and run nothing."""
    large: bool = False
    """Whether more than 10 000 experiments are meant."""
    json: bool = False
    """Whether to print one JSON object instead of lines."""


def main(arguments: list[str]) -> int:
    """Run `legbench campaign`.

    Returns:
        0 when the campaign, or its part, came to its end; 1 when experiments could not be run;
        130 after ^C, with everything kept that was done.
    """
    flags = parse(CampaignArguments, "campaign", arguments)
    part = _part(flags.shard)
    from legbench.campaign.planning import plan_campaign
    from legbench.campaign.reading import load_campaign
    from legbench.campaign.shards import shards_of

    plan = plan_campaign(load_campaign(flags.file, _changes(flags)), large=flags.large)
    shards = shards_of(plan)
    if flags.plan:
        _tell_plan(plan, shards, flags)
        return 0
    _note_skipped(plan)
    out = flags.out if flags.out is not None else Path("runs") / plan.campaign.name
    if flags.plant is not None:
        return _on_bench(plan, out, flags)
    from legbench.campaign.running import run_campaign
    from legbench.interrupts import stop_on_interrupt

    executor = _executor(flags, out)
    with stop_on_interrupt() as stop:
        finished = run_campaign(
            plan,
            out,
            executor,
            shards,
            part=part,
            records=flags.records == "parquet",
            stop=stop,
            progress=progress,
            note=report_error,
        )
    return _report(plan, finished, as_json=flags.json)


def _part(text: str | None) -> tuple[int, int] | None:
    """Number and count of a part such as `1/4`; raises ConfigError."""
    if text is None:
        return None
    found = re.fullmatch(r"(\d{1,6})/(\d{1,6})", text)
    number, count = (int(each) for each in found.groups()) if found else (0, 0)
    if not 1 <= number <= count:
        raise ConfigError(f"shard is {text!r}; write 1/4 to 4/4 for the parts of four callers")
    return number, count


def _changes(flags: CampaignArguments) -> dict[str, Any]:
    """Settings of every cell that flags replace; raises ConfigError."""
    from legbench.experiment.overrides import parse_setting
    from legbench.plants import CanChoice

    changes = dict(parse_setting(text) for text in flags.set)
    if flags.plant is not None:
        if flags.shard is not None or flags.executor != "local":
            raise ConfigError(
                "a bench runs one experiment after another: leave --shard and --executor out"
            )
        # Relative to here, not to the campaign's file; emulated drives may take the package's own.
        bus = CanChoice(bus=flags.bus, interface=flags.interface).bus_file
        changes |= {"plant.kind": flags.plant, "plant.settings.bus": str(bus.resolve())}
        for name in ("interface", "channel"):
            if getattr(flags, name) is not None:
                changes[f"plant.settings.{name}"] = getattr(flags, name)
    return changes


def _executor(flags: CampaignArguments, out: Path) -> "AbstractExecutor":
    """The executor that is asked for.

    Raises:
        ConfigError: there is none of that name, or no worker.
        MissingExtraError: its library is not installed.
    """
    name = flags.executor
    if name == "serial":
        from legbench.campaign.executor import SerialExecutor

        return SerialExecutor()
    if name == "local":
        from legbench.campaign.pool import PoolExecutor

        return PoolExecutor(flags.workers)
    if name == "dask" or name.startswith("dask://"):
        from legbench.campaign.dask_workers import DaskExecutor

        return DaskExecutor(name.removeprefix("dask://") if ":" in name else None, flags.workers)
    if name == "slurm":
        from legbench.campaign.slurm import SlurmExecutor
        from legbench.experiment.overrides import parse_setting

        return SlurmExecutor(out / "slurm", options=dict(map(parse_setting, flags.slurm)))
    raise ConfigError(f"no executor '{name}'; there are {EXECUTORS}")


def _on_bench(plan: "CampaignPlan", out: Path, flags: CampaignArguments) -> int:
    """Run every cell on the bench."""
    from legbench.campaign.bench import run_on_bench
    from legbench.interrupts import stop_on_interrupt

    with stop_on_interrupt() as stop:
        finished = run_on_bench(
            plan, out, pause=flags.pause, stop=stop, progress=progress, note=report_error
        )
    return _report(plan, finished, as_json=flags.json)


def _note_skipped(plan: "CampaignPlan") -> None:
    """Say which cells are left out because the leg cannot do them."""
    from legbench.campaign.planning import TOLD

    for each in plan.infeasible[:TOLD]:
        report_error(f"skipped: {each}")
    if len(plan.infeasible) > TOLD:
        report_error(f"skipped: {len(plan.infeasible) - TOLD} more; --plan tells all of them")


def _tell_plan(plan: "CampaignPlan", shards: "tuple[Shard, ...]", flags: CampaignArguments) -> None:
    from legbench.campaign.folder import description

    simulated = sum(each.experiment.duration for each in plan.planned)
    if flags.json:
        print_json(
            {
                **description(plan),
                "simulated": simulated,
                "processor_time": plan.cost,
                "shards": len(shards),
                "planned": [
                    {"experiment": each.hash, "block": each.block, "trial": each.trial}
                    for each in plan.planned
                ],
            }
        )
        return
    print(f"{plan.campaign.name}: {len(plan.planned)} experiments in {len(shards)} shards")
    for block in plan.campaign.blocks:
        print(f"  {block.cells:5d} cells x {block.trials:3d} trials  {block.name}")
    for settings in plan.excluded:
        print(f"  excluded    {_settings_text(settings)}")
    for each in plan.infeasible:
        print(f"  infeasible  {each}")
    if plan.repeated:
        print(f"  {plan.repeated} experiments occur twice and are run once")
    print(f"  varied: {', '.join(plan.axes)}")
    print(f"  {simulated:.6g} s of motion, some {duration_text(plan.cost)} on one processor")


def _settings_text(settings: Any) -> str:
    from legbench.experiment.toml_text import toml_value

    return ", ".join(f"{key} = {toml_value(value)}" for key, value in settings.items())


def _report(plan: "CampaignPlan", finished: "FinishedCampaign", *, as_json: bool) -> int:
    """Tell how the campaign has ended; returns the exit status."""
    for failure in finished.failures:
        report_error(f"not run: {failure}")
    faults = _count(finished, "status", "fault")
    unsound = _count(finished, "numerics", "unsound")
    if as_json:
        print_json(
            {
                "campaign": plan.campaign.name,
                "out": str(finished.folder),
                "experiments": finished.total,
                "done": finished.done,
                "wanted": finished.wanted,
                "stopped": finished.stopped,
                "failures": list(finished.failures),
                "table": None if finished.table is None else str(finished.table),
                "faults": faults,
                "unsound": unsound,
                "infeasible": len(plan.infeasible),
                "excluded": len(plan.excluded),
            }
        )
    elif finished.table is not None:
        print(f"{finished.total} experiments, table {finished.table}")
    else:
        print(f"{finished.done} of {finished.wanted} experiments are done in {finished.folder}")
    if faults or unsound:
        note(
            f"legbench: {faults} runs ended in a fault, the numerics of {unsound} are unsound; "
            "status, cause and numerics in the table say which"
        )
    if finished.failures:
        raise CampaignError(
            f"{len(finished.failures)} shards were not run; what is done is kept in "
            f"{finished.folder}: call again to try them once more"
        )
    if finished.stopped:
        report_error("interrupted; call again to go on")
        return 130
    return 0


def _count(finished: "FinishedCampaign", column: str, value: str) -> int:
    """Number of runs in the table with a value; 0 while there is no table."""
    if finished.table is None:
        return 0
    from legbench.campaign.table import read_table

    rows = read_table(finished.table).select(["row", column]).to_pylist()
    return sum(row["row"] == "run" and row[column] == value for row in rows)
