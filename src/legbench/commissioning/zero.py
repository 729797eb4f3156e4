"""Encoder offsets, measured on a leg in a known posture."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from legbench.commissioning.status import read_counts
from legbench.drives.errors import DriveError
from legbench.drives.master.preparation import check_homed
from legbench.drives.master.session import Session
from legbench.drives.setup.config import NodeConfig
from legbench.drives.setup.encoders import Side
from legbench.drives.setup.file_edit import Place, edit_file
from legbench.drives.setup.units import AxisUnits
from legbench.errors import ConfigError, RecordingError
from legbench.writing import reason

READS = 5
"""Number of reads of every encoder, which have to agree."""
STILL_COUNTS = 40
"""Largest spread of these reads."""


@dataclass(frozen=True, slots=True, kw_only=True)
class EncoderZero:
    """Encoder offsets of one node."""

    node: str
    side: Side
    """Side of the encoder of the position loop, whose table in the bus file has its name."""
    motor_offset: int
    """Offset of the encoder of the position loop [counts]."""
    link_offset: int | None
    """Offset of the second encoder, none without one [counts]."""


def measure(session: Session, posture: Sequence[float]) -> list[EncoderZero]:
    """Offsets with which both encoders of every node show `posture`, one angle a node [rad].

    Raises:
        ConfigError: an angle that no leg stands at.
        PlantFault: somebody else leads these drives.
        DriveError: a drive does not answer, is another one, is not homed, or its encoders move.
    """
    for angle in posture:
        if not abs(angle) <= math.pi:
            raise ConfigError(f"an angle of the posture is {angle:g} rad; it must be -pi to pi rad")
    up = session.bring_up()
    up.listen()
    up.identify()
    check_homed(up, session.config.nodes)
    return [
        _node(session, node, angle)
        for node, angle in zip(session.config.nodes, posture, strict=True)
    ]


def _node(session: Session, node: NodeConfig, angle: float) -> EncoderZero:
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
    return EncoderZero(
        node=node.name,
        side=node.side,
        motor_offset=offsets[0],
        link_offset=offsets[1] if offsets[1:] else None,
    )


def _offset(units: AxisUnits, shown: int, angle: float) -> int:
    return units.nearest(shown - replace(units, offset_counts=0).to_counts(angle), 0)


def write(path: Path, zeros: Sequence[EncoderZero], out: Path | None = None) -> Path:
    """Put the offsets into the bus file that was measured with; whole or not at all.

    Everything else in the file is kept, see `file_edit.edit_file`.

    Args:
        path: bus file.
        zeros: offsets of its nodes, in their order.
        out: file to write; by default the bus file itself.

    Raises:
        ConfigError: the file is no TOML any more, or has other nodes.
        RecordingError: it cannot be written.
    """
    changes: dict[Place, int] = {}
    for number, zero in enumerate(zeros):
        # A drive with one encoder has the table of its side alone.
        changes["node", number, zero.side.value, "offset_counts"] = zero.motor_offset
        if zero.link_offset is not None:
            changes["node", number, "link", "offset_counts"] = zero.link_offset
    try:
        return edit_file(path, changes, out)
    except OSError as error:
        raise RecordingError(f"cannot write offsets to {out or path}: {reason(error)}") from None
