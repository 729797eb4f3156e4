"""MCAP for Foxglove, PlotJuggler and rerun: joint states, rows, events, and run.json attached."""

from collections.abc import Iterator, Mapping
from datetime import datetime
from pathlib import Path
from typing import Any, Final

import numpy as np

from legbench.export._mcap import Writer
from legbench.export.content import (
    Field,
    Progress,
    as_json,
    described,
    fields_of,
    phase_names,
    phases_of,
)
from legbench.export.mcap_schemas import EVENT, JOINT_STATES, joint_states, row_schema
from legbench.recording.layout import RUN, TIME
from legbench.recording.manifest import to_json
from legbench.recording.reader import Recording

JOINT_TOPIC: Final = "/joint_states"
ROWS_TOPIC: Final = "/rows"
EVENTS_TOPIC: Final = "/events"
WINDOW_ROWS: Final = 1 << 12
"""Rows that are text at once: 4 s at 1 kHz, some 10 MB."""
NOT_FINITE: Final = {"nan": "null", "inf": "1e999", "-inf": "-1e999"}
"""Text of what is no number of JSON, which has no infinity but takes numbers beyond any double."""


def write_mcap(recording: Recording, path: Path, progress: Progress) -> None:
    """Write the rows of a run as JSON messages whose numbers read back as the same numbers.

    `/joint_states` has links and motors as `foxglove.JointStates`; `/rows` has every column and
    the name of the phase; `/events` what happened rarely. Times are those of the clock at the start
    of the run plus the plant's. A number that is not known is null.

    Raises:
        MissingExtraError: mcap is not installed.
        OSError: the file cannot be written.
    """
    start, fields = _start(recording), fields_of(recording)
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start(profile="", library="legbench")
        topics = {
            JOINT_TOPIC: JOINT_STATES,
            ROWS_TOPIC: row_schema(fields),
            EVENTS_TOPIC: EVENT,
        }
        channels = {topic: _channel(writer, topic, schema) for topic, schema in topics.items()}
        for name, entries in described(recording).items():
            writer.add_metadata(name, dict(entries))
        manifest = to_json(recording.manifest)
        writer.add_attachment(start, start, RUN, "application/json", manifest)
        done = 0
        for part in recording.windows(WINDOW_ROWS):
            times = (start + part.columns[TIME]).tolist()
            rows = zip(times, joint_states(part, times), _rows(part, fields), strict=True)
            for time, joints, row in rows:
                writer.add_message(channels[JOINT_TOPIC], time, joints, time)
                writer.add_message(channels[ROWS_TOPIC], time, row, time)
            done += len(times)
            progress(done, len(recording.time))
        for event in recording.events:
            time = start + round(1e9 * float(event.get("time", 0.0)))
            writer.add_message(channels[EVENTS_TOPIC], time, as_json(event), time)
        writer.finish()


def _channel(writer: Writer, topic: str, schema: Mapping[str, Any]) -> int:
    known = writer.register_schema(schema["title"], "jsonschema", as_json(schema))
    return writer.register_channel(topic, "json", known)


def _start(recording: Recording) -> int:
    """Time of the clock at the start of a run since 1970; 0 where it does not tell [ns]."""
    created = recording.manifest.get("created")
    try:
        return 1_000_000_000 * round(datetime.fromisoformat(str(created)).timestamp())
    except ValueError:
        return 0


def _rows(part: Recording, fields: tuple[Field, ...]) -> Iterator[bytes]:
    """Message of each row with every column."""
    texts: list[list[str]] = []
    keys: list[str] = []
    for field in fields:
        values = part.columns[field.name]
        keys.append(field.name)
        texts.append(_texts(values))
        if field.name == "phase":
            keys.append("phase_name")
            names = phase_names(phases_of(part), values)
            quoted = {name: as_json({"": name})[5:-1].decode() for name in set(names)}
            texts.append([quoted[name] for name in names])
    template = "{" + ",".join(f'"{key}":%s' for key in keys) + "}"
    for row in zip(*texts, strict=True):
        yield (template % row).encode()


def _texts(values: np.ndarray) -> list[str]:
    """JSON of each value: the shortest that reads back as the same; null where it is unknown."""
    if values.dtype.kind != "f":
        return list(map(str, values.tolist()))
    texts = list(map(repr, values.tolist()))
    for place in np.flatnonzero(~np.isfinite(values)).tolist():
        texts[place] = NOT_FINITE[repr(float(values[place]))]
    return texts
