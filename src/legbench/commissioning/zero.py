"""Encoder offsets from a leg that stands in a known posture."""

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from legbench.commissioning.status import read_counts
from legbench.drives.errors import DriveError
from legbench.drives.master.session import Session
from legbench.drives.setup.config import NodeConfig
from legbench.drives.setup.units import AxisUnits
from legbench.errors import ConfigError, RecordingError
from legbench.recording.files import write_whole

READS = 5
"""Number of reads of every encoder, which have to agree."""
STILL_COUNTS = 40
"""Largest spread of these reads."""
_SECTION = re.compile(r"^\s*\[+\s*([\w.]+)\s*\]+")
_OFFSET = re.compile(r"^(\s*offset_counts\s*=\s*)-?[\d_]+", re.MULTILINE)


@dataclass(frozen=True, slots=True, kw_only=True)
class Zero:
    """Offsets of one node."""

    node: str
    motor_offset: int
    """Offset of the encoder of the position loop [counts]."""
    link_offset: int | None
    """Offset of the second encoder, none without one [counts]."""


def measure(session: Session, posture: Sequence[float]) -> list[Zero]:
    """Offsets with which both encoders of every node show `posture`, one angle a node [rad].

    Raises:
        ConfigError: an angle that no leg stands at.
        PlantFault: somebody else leads these drives.
        DriveError: a drive does not answer, is another one, or its encoders move.
    """
    for angle in posture:
        if not abs(angle) <= math.pi:
            raise ConfigError(f"an angle of the posture is {angle:g} rad; it must be -pi to pi rad")
    up = session.bring_up()
    up.listen()
    up.identify()
    return [
        _node(session, node, angle)
        for node, angle in zip(session.config.nodes, posture, strict=True)
    ]


def _node(session: Session, node: NodeConfig, angle: float) -> Zero:
    reads = [read_counts(session, node) for _ in range(READS)]
    offsets = []
    for place, (axis, units) in enumerate(((node.side.value, node.motor), ("link", node.link))):
        if units is None:
            continue
        shown = sorted(count for read in reads if (count := read[place]) is not None)
        if shown[-1] - shown[0] > STILL_COUNTS:
            raise DriveError(
                f"{axis} encoder of '{node.name}' moves by {shown[-1] - shown[0]} counts while it "
                f"is read, the limit is {STILL_COUNTS}; hold the leg still"
            )
        offsets.append(_offset(units, shown[READS // 2], angle))
    return Zero(
        node=node.name, motor_offset=offsets[0], link_offset=offsets[1] if offsets[1:] else None
    )


def _offset(units: AxisUnits, shown: int, angle: float) -> int:
    return units.nearest(shown - replace(units, offset_counts=0).to_counts(angle), 0)


def write(path: Path, zeros: Sequence[Zero], out: Path | None = None) -> Path:
    """Put offsets into a bus file, comments kept; whole or not at all.

    Raises:
        ConfigError: it has not one `offset_counts` for every encoder.
        RecordingError: it cannot be read or written.
    """
    out = out or path
    wanted = [
        value
        for zero in zeros
        for value in (zero.motor_offset, zero.link_offset)
        if value is not None
    ]
    try:
        lines = path.read_text(encoding="utf-8").splitlines(keepends=True)
        section, place = "", 0
        for number, line in enumerate(lines):
            found = _SECTION.match(line)
            if found is not None:
                section = found[1]
            if section in ("node.motor", "node.link") and _OFFSET.match(line):
                if place < len(wanted):
                    lines[number] = _OFFSET.sub(rf"\g<1>{wanted[place]}", line)
                place += 1
        if place != len(wanted):
            raise ConfigError(
                f"{path} has {place} lines 'offset_counts', {len(wanted)} encoders need one each; "
                "add them to [node.motor] and [node.link], motor first"
            )
        write_whole(out, "".join(lines).encode())
    except OSError as error:
        raise RecordingError(f"cannot write offsets to {out}: {error.strerror}") from None
    return out
