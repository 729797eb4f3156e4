"""Logs of raw frames as recordings: `load_log` reads what a bus log tells of a leg."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import can
import numpy as np

from legbench.design import LegDesign
from legbench.design.setup import Setup
from legbench.design.toml import design_to_mapping
from legbench.drives.protocol.frame import SYNC_ID
from legbench.drives.setup.config import BusConfig
from legbench.errors import ConfigError, RecordingError
from legbench.loop import Progress
from legbench.mjcf.options import Linkage
from legbench.phases import ControllerDescription, PhaseInfo, Role
from legbench.recording.controller_table import controller_table
from legbench.recording.layout import TIME
from legbench.recording.memory import MemoryRun
from legbench.recording.reader import Recording, described
from legbench.replay.log_frames import HEAD, LogFrames, with_head
from legbench.replay.log_mapping import MappingsSeen
from legbench.replay.log_nodes import NodesSeen, channels_of
from legbench.replay.log_rows import RowMaker, signals_of
from legbench.signals import REST

OFF_PERIOD: Final = 0.005
"""Share by which SYNC may come at another period than the bus file says [-]; crystals keep 1e-4."""
TOLD_EVERY: Final = 20_000
"""Number of frames between two calls of the progress function; a shorter log is read at once."""
UNKNOWN: Final = "unknown"
"""Kind of the controller of a log, which tells commands but not who gave them."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DecodedLog:
    """Log of a bus as a recording, and what was met in it."""

    recording: Recording
    """Rows of the log, one for each SYNC; time is that since the first one."""
    notes: tuple[str, ...]
    """What was assumed or left out, a sentence each."""


def load_log(
    path: Path,
    config: BusConfig,
    source: str,
    design: LegDesign,
    setup: Setup | None = None,
    progress: Progress | None = None,
) -> DecodedLog:
    """Read a log of raw frames as a run.

    Commands are those that went over the bus, which limits have shaped; links and torques are what
    the bus file's encoders tell; statuswords and controlwords are signals of their own. Nothing is
    known of phases, so that the run acts from where its command first moves.

    Args:
        path: a log in one of the formats of `log_names`, possibly torn.
        config: drives on the bus, two of them.
        source: name of their bus file, for messages.
        design: leg on the drives, whose stiffness makes torques of angles.
        setup: setup of the leg, by default a jump.
        progress: told now and then how far the file has been read [bytes].

    Raises:
        RecordingError: the file cannot be read, or holds no SYNC.
        ConfigError: the drives are not those of the bus file, or are mapped otherwise.
    """
    if len(config.nodes) != 2:
        raise ConfigError(f"{source}: {len(config.nodes)} nodes; a leg has 2")
    frames = LogFrames(path)
    run = MemoryRun(_manifest(config, source, design, setup or Setup()), name=path.stem)
    nodes, mappings = NodesSeen(config), MappingsSeen(config)
    rows = RowMaker(config, design.stiffness, run)
    for message in _on_the_bus(frames, config, source, progress):
        nodes.take(message.arbitration_id)
        mappings.take(message.arbitration_id, bytes(message.data))
        rows.take(message)
    rows.finish()
    unseen = mappings.check(config, source)
    _require_drives(path, config, source, nodes, rows)
    recording = _recording(run, path, frames.tear)
    notes = _notes(config, source, recording, unseen, nodes, rows)
    return DecodedLog(recording=recording, notes=tuple(notes))


def _on_the_bus(
    frames: LogFrames, config: BusConfig, source: str, progress: Progress | None
) -> Iterator[can.Message]:
    """Frames of the channels of a bus file, with the SYNC of one of them.

    Raises:
        ConfigError: it is not clear which channel of the log is meant.
    """
    head, messages = with_head(frames)
    channels = channels_of(head, config, source)
    clocks = {message.channel for message in head if message.arbitration_id == SYNC_ID}
    # Several channels have a SYNC each, at the same time: one of them counts the cycles.
    leading = min(clocks & (channels or clocks), key=str, default=None)
    size = 0
    for number, message in enumerate(messages):
        if progress is not None and number > HEAD and number % TOLD_EVERY == 0:
            place, size = frames.place
            progress(place, size)
        if channels is not None and message.channel not in channels:
            continue
        if message.arbitration_id != SYNC_ID or leading in (None, message.channel):
            yield message
    if progress is not None and size:
        progress(size, size)


def _manifest(config: BusConfig, source: str, design: LegDesign, setup: Setup) -> dict[str, Any]:
    """Manifest of a log, as far as it and the bus file tell."""
    linkage, boom = Linkage(), setup.boom_radius
    rest = PhaseInfo(code=REST, name="rest", role=Role.REST, doc="a log tells no phases")
    told = ControllerDescription(phases=(rest,), signals=signals_of(config))
    return {
        "experiment": {
            "design": design_to_mapping(design),
            "setup": {"kind": setup.kind.value} | ({} if boom is None else {"boom_radius": boom}),
            "linkage": {"kind": linkage.kind.value, "crank_length": linkage.crank_length},
            "plant": {"kind": "can", "settings": {}},
        },
        "controller": controller_table(UNKNOWN, told),
        "plant": {"kind": "can", "bus": {"file": source}},
        "period": config.period,
    }


def _recording(run: MemoryRun, path: Path, tear: str | None) -> Recording:
    """Return the rows as a recording under the path of the log; how the run ended is not known."""
    rows = run.recording()
    manifest = {**rows.manifest, "id": path.name, "created": None, "status": None, "rows": run.rows}
    return replace(
        rows, path=path, manifest=manifest, described=described(manifest, path), torn=tear
    )


def _require_drives(
    path: Path, config: BusConfig, source: str, nodes: NodesSeen, rows: RowMaker
) -> None:
    """Refuse a log in which the drives of the bus file do not talk."""
    silent = [
        f"{axis.node.node_id} ({', '.join(f'{cob:X}h' for cob in axis.tpdo_ids)})"
        for axis in rows.axes
        if not any(nodes.count(cob) for cob in axis.tpdo_ids)
    ]
    if silent:
        others = ", ".join(map(str, nodes.others)) or "none"
        raise ConfigError(
            f"{path} has no process data of node {' and '.join(silent)} of {source}; nodes that it "
            f"has beside are {others}: give the bus file of these drives"
        )
    if not nodes.count(SYNC_ID):
        raise RecordingError(f"{path} has no SYNC (080h), by which its frames fall into cycles")
    if rows.rows == 0:
        bad = f"; {rows.bad} of their frames have another length than is mapped" if rows.bad else ""
        raise ConfigError(
            f"{path} has no cycle in which both drives of {source} tell all that it maps{bad}: "
            "give the bus file of these drives"
        )


def _notes(
    config: BusConfig,
    source: str,
    recording: Recording,
    unseen: tuple[str, ...],
    nodes: NodesSeen,
    rows: RowMaker,
) -> Iterator[str]:
    """Sentences about what was assumed or left out."""
    if unseen:
        yield (
            f"the log begins after {' and '.join(unseen)} had been configured; their process data "
            f"is taken as {source} maps it"
        )
    if others := nodes.others:
        named = ", ".join(map(str, others))
        yield f"{sum(others.values())} frames of other nodes ({named}) were left out"
    if rows.bad:
        yield f"{rows.bad} frames of the drives have another length than is mapped; left out"
    if rows.backwards:
        yield f"{rows.backwards} SYNCs are no later than the one before; left out"
    times = recording.columns[TIME]
    if len(times) > 1:
        period = 1e-9 * float(np.median(np.diff(times)))
        if abs(period - config.period) > OFF_PERIOD * config.period:
            yield (
                f"SYNC comes every {1e3 * period:.4g} ms; {source} has a period of "
                f"{1e3 * config.period:g} ms"
            )
