"""Folder of a campaign: whose it is, who works in it, and which shards are there."""

import json
import shutil
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any, Final

from legbench.campaign.again import CAMPAIGN, EXAMPLES, examples_of
from legbench.campaign.data import Settings
from legbench.campaign.locks import locked
from legbench.campaign.plan import CampaignPlan
from legbench.campaign.provenance import provenance
from legbench.campaign.records import RECORDS
from legbench.campaign.shards import NAME_KEY, SHARDS, Shard, check_version, told_of
from legbench.errors import CampaignError
from legbench.strict_json import null_for_nan
from legbench.writing import reason, write_whole

SOURCE: Final = "campaign.toml"
LOCK: Final = ".lock"
"""File whose lock is held by whoever works in the folder; the system lets go of it when a process
dies, however it dies."""
FORMAT: Final = 1
"""Version of `campaign.json`."""

Part = tuple[int, int]
"""Part of the shards that one of several callers does: number from 1, and number of parts."""


@contextmanager
def open_folder(folder: Path, plan: CampaignPlan, part: Part | None = None) -> Iterator[None]:
    """Make the folder of a campaign, or go on in it, and keep others out of it meanwhile.

    Args:
        folder: where the campaign is kept.
        plan: what it is.
        part: part of its shards that this caller does; several callers with a part of their own
            may work in one folder.

    Raises:
        CampaignError: it holds another campaign or results of another version, somebody works in
            it, or it cannot be written.
    """
    with _told(folder):
        (folder / SHARDS).mkdir(parents=True, exist_ok=True)
    with _alone(folder / LOCK, folder, shared=part is not None):
        if part is None:
            _clean(folder)
            _begin(folder, plan)
            yield
            return
        number, count = part
        with _alone(folder / f"{LOCK}-{number}-of-{count}", folder, shared=False):
            with one_at_a_time(folder):
                _begin(folder, plan)
            yield


@contextmanager
def one_at_a_time(folder: Path) -> Iterator[None]:
    """Keep callers with other parts from writing what all of them share at the same time."""
    with locked(folder / f"{LOCK}-shared", wait=True):
        yield


@contextmanager
def _told(folder: Path) -> Iterator[None]:
    """Turn a failure of the disk into one line; raises CampaignError."""
    try:
        yield
    except OSError as error:
        raise CampaignError(
            f"cannot write {folder}: {reason(error)}; make room or name another --out, and call "
            "again: what is done is kept"
        ) from error


def write_into(path: Path, content: bytes) -> None:
    """Write a file of a campaign, whole or not at all; raises CampaignError."""
    with _told(path):
        write_whole(path, content)


@contextmanager
def _alone(path: Path, folder: Path, *, shared: bool) -> Iterator[None]:
    """Hold a lock of the folder; raises CampaignError where somebody else holds it."""
    with ExitStack() as stack:
        try:
            with _told(folder):
                stack.enter_context(locked(path, shared=shared))
        except CampaignError as error:
            if not isinstance(error.__cause__, BlockingIOError):
                raise
            raise CampaignError(
                f"another campaign works in {folder}: wait for it, name another --out, or give "
                "each of several callers its part with --shard"
            ) from None
        yield


def _clean(folder: Path) -> None:
    """Remove what a caller that was killed left half-written."""
    for room in (folder, folder / SHARDS, folder / RECORDS):
        for draft in room.glob(".*.draft"):
            if draft.is_dir():
                shutil.rmtree(draft, ignore_errors=True)
            else:
                draft.unlink(missing_ok=True)


def _begin(folder: Path, plan: CampaignPlan) -> None:
    """Take over the folder for a plan, or see that it is this plan's already."""
    path = folder / CAMPAIGN
    if path.is_file():
        try:
            found = json.loads(path.read_bytes())
            name, digest = str(found["name"]), found["experiments_sha256"]
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise CampaignError(f"{path} is damaged: {error}; name a new --out") from error
        if digest != plan.digest:
            raise CampaignError(
                f"{folder} holds another campaign, '{name}' of {found.get('experiments')} "
                f"experiments; this is '{plan.campaign.name}' of {len(plan.planned)}, which are "
                "others: name another --out"
            )
    elif any(folder.glob(f"{SHARDS}/*")) or (folder / "run.json").exists():
        raise CampaignError(
            f"{folder} holds something else, without a {CAMPAIGN}: name a new --out"
        )
    for shard in sorted((folder / SHARDS).glob("*.parquet")):
        check_version(told_of(shard), str(shard))
    if not path.is_file():
        write_into(folder / SOURCE, plan.campaign.source.encode())
        write_into(path, json.dumps(description(plan), indent=1).encode() + b"\n")


def description(plan: CampaignPlan) -> Mapping[str, Any]:
    """Content of `campaign.json`: what the campaign is, and what made it."""

    def plain(settings: Settings) -> dict[str, Any]:
        return null_for_nan(settings)

    return {
        "format": FORMAT,
        "name": plan.campaign.name,
        "experiments": len(plan.planned),
        "experiments_sha256": plan.digest,
        "cells": plan.cells,
        "blocks": [
            {"name": block.name, "cells": block.cells, "trials": block.trials}
            for block in plan.campaign.blocks
        ],
        "axes": list(plan.axes),
        "excluded": [plain(settings) for settings in plan.excluded],
        "infeasible": [
            {
                "block": each.block,
                "settings": plain(each.settings),
                "reason": each.reason,
                "nearest": plain(each.nearest),
            }
            for each in plan.infeasible
        ],
        "repeated": plan.repeated,
        "provenance": provenance(),
        EXAMPLES: examples_of(plan),
    }


def shard_path(folder: Path, shard: Shard) -> Path:
    """File of a shard."""
    return folder / SHARDS / f"{shard.name}.parquet"


def is_done(folder: Path, shard: Shard) -> bool:
    """Whether the rows of a shard are there.

    Raises:
        CampaignError: its file is damaged, or holds something else.
    """
    path = shard_path(folder, shard)
    if not path.exists():
        return False
    if told_of(path).get(NAME_KEY) != shard.name.encode():
        raise CampaignError(f"{path} holds another shard; remove it, and it is run again")
    return True
