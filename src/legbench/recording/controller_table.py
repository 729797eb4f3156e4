"""Table `controller` of `run.json`, which holds the description of the controller of a run."""

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

from legbench.errors import ConfigError, FormatError
from legbench.phases import ControllerDescription, Counting, PhaseInfo, Role
from legbench.recording.tables import ManifestTable
from legbench.signals import Signal


def controller_table(kind: str, description: ControllerDescription) -> dict[str, Any]:
    """Table that `run.json` holds of a controller of some kind."""
    return {"kind": kind, **asdict(description)}


def parse_controller(table: ManifestTable) -> ControllerDescription:
    """Description that a table holds; an empty one for an empty table.

    Raises:
        FormatError: the table describes phases or signals that no controller can have.
    """
    counting = table.table("counting")
    try:
        return ControllerDescription(
            phases=tuple(_phase(entry) for entry in table.tables("phases")),
            signals=parse_signals(table),
            counting=Counting(
                most=counting.whole("most"), smallest=counting.number("smallest") or 0.0
            ),
        )
    except ConfigError as error:
        raise FormatError(f"manifest {table.path}: {error}") from None


def parse_signals(table: ManifestTable) -> tuple[Signal, ...]:
    """Own signals that a table `controller` declares.

    Raises:
        FormatError: an entry is no signal.
    """
    return tuple(
        Signal(
            name=_text(entry, "name"),
            components=entry.texts("components"),
            unit=entry.text("unit") or "-",
            doc=entry.text("doc") or "",
        )
        for entry in table.tables("signals")
    )


def _phase(entry: ManifestTable) -> PhaseInfo:
    code = entry.whole("code")
    if code is None:
        raise entry.refusal("code", None, "a whole number")
    return PhaseInfo(
        code=code,
        name=_text(entry, "name"),
        role=entry.choice("role", Role),
        doc=entry.text("doc") or "",
        late=entry.number("late") or 0.0,
    )


def _text(entry: ManifestTable, key: str) -> str:
    found = entry.text(key)
    if not found:
        raise entry.refusal(key, found, "a text")
    return found


def declared_signals(manifest: Mapping[str, Any]) -> tuple[Signal, ...]:
    """Own signals of the controller that a manifest of the current format describes.

    Raises:
        FormatError: an entry is no signal.
    """
    return parse_signals(ManifestTable(entries=manifest).table("controller"))
