"""Shards of a campaign: experiments that are run together, and the file that holds their rows.

A shard's name is the hash of what is in it, so that a file that is there is a file that is right.
"""

import hashlib
import json
import math
from collections.abc import Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import pyarrow as pa

from legbench.campaign.plan import CampaignPlan, Planned, cost_of
from legbench.campaign.provenance import provenance, versions
from legbench.campaign.rows import Row
from legbench.campaign.table import FORMAT_KEY, PROVENANCE_KEY, TABLE_FORMAT, measured_table
from legbench.errors import CampaignError
from legbench.experiment.alike import alike, runs_in_batch
from legbench.recording.sealed import UNREADABLE, opened, sealed_bytes
from legbench.writing import reason

SHARDS: Final = "shards"
"""Folder of the shards in that of the campaign."""
USUAL: Final = 16
"""Usual number of experiments in a shard: batches of 16 legs come within 2 % of those of 32 [-]."""
LEAST_WORK: Final = 0.4
"""Least time that one processor should take for a shard [s]: what hands it out takes 3 ms."""
NAME_KEY: Final = b"legbench shard"
"""Key of the metadata under which a shard holds its own name."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Shard:
    """Experiments that are run together."""

    name: str
    """Hash of the experiments in it and of the version, without the ending of its file."""
    planned: tuple[Planned, ...]
    together: bool
    """Whether they are stepped side by side, as one batch; else one after another."""

    @property
    def cost(self) -> float:
        """Time that one processor takes for it, about [s]."""
        return sum(cost_of(each.experiment) for each in self.planned)


def shards_of(plan: CampaignPlan, size: int | None = None) -> tuple[Shard, ...]:
    """Shards of a plan, those of experiments that are alike next to each other.

    They follow from the plan alone, not from who runs it, so that a campaign that goes on finds
    what is there.

    Args:
        plan: what is to be run.
        size: number of experiments in a shard; none: `USUAL`, or more where they are short.
    """
    groups: dict[Hashable, list[Planned]] = {}
    for each in plan.planned:
        groups.setdefault(_company(each), []).append(each)
    found: list[Shard] = []
    for group in groups.values():
        together = runs_in_batch(group[0].experiment)
        usual = USUAL if together else 1
        least = math.ceil(LEAST_WORK / cost_of(group[0].experiment))
        count = math.ceil(len(group) / (size or max(usual, least)))
        for part in range(count):
            low, high = part * len(group) // count, (part + 1) * len(group) // count
            chosen = tuple(group[low:high])
            found.append(Shard(name=_name(chosen), planned=chosen, together=together))
    return tuple(found)


def _company(planned: Planned) -> Hashable:
    """What experiments of one shard have in common, so that their batch is one."""
    experiment = planned.experiment
    if not runs_in_batch(experiment):
        return experiment.plant.kind, str(experiment.linkage.kind), experiment.duration
    return alike(experiment), experiment.controller.kind, experiment.duration


def _name(planned: Iterable[Planned]) -> str:
    hashes = sorted(each.hash for each in planned)
    text = "\n".join([f"shard {TABLE_FORMAT}", versions()["legbench"], *hashes])
    return hashlib.sha256(text.encode()).hexdigest()[:32]


def shard_bytes(name: str, rows: Sequence[Row]) -> bytes:
    """Content of a shard's file: measured rows as Parquet, with provenance."""
    table = measured_table(rows)
    metadata = {
        FORMAT_KEY: str(TABLE_FORMAT).encode(),
        NAME_KEY: name.encode(),
        PROVENANCE_KEY: json.dumps(provenance(), sort_keys=True).encode(),
    }
    return sealed_bytes(table.replace_schema_metadata(metadata))


def told_of(content: Path | bytes) -> Mapping[bytes, bytes]:
    """Return what a shard says of itself, without reading its rows.

    Raises:
        CampaignError: it cannot be read.
    """
    try:
        with opened(content) as file:
            return file.schema_arrow.metadata or {}
    except UNREADABLE as error:
        where = "a shard" if isinstance(content, bytes) else str(content)
        raise CampaignError(
            f"{where} is damaged: {reason(error)}; remove it, and it is run again"
        ) from error


def check_version(told: Mapping[bytes, bytes], where: str) -> None:
    """Refuse a shard whose rows another version has made; raises CampaignError."""
    found = told.get(FORMAT_KEY, b"none").decode()
    if found != str(TABLE_FORMAT):
        raise CampaignError(
            f"{where} has format {found}; this legbench writes {TABLE_FORMAT}: name a new --out"
        )
    made: dict[str, Any] = json.loads(told.get(PROVENANCE_KEY, b"{}")).get("versions", {})
    ours = versions()
    other = [name for name in ours if made.get(name) != ours[name]]
    if other:
        was = ", ".join(f"{name} {made.get(name, 'none')}" for name in other)
        now = ", ".join(f"{name} {ours[name]}" for name in other)
        raise CampaignError(
            f"{where} was written by {was}; here is {now}: go on with those versions, or name a "
            "new --out"
        )


def read_shard(path: Path) -> pa.Table:
    """Read the rows of a shard; raises CampaignError."""
    try:
        with opened(path) as file:
            return file.read()
    except UNREADABLE as error:
        raise CampaignError(
            f"{path} is damaged: {reason(error)}; remove it, and it is run again"
        ) from error
