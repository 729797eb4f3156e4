"""Events at the end of a run on drives: stop, rest, parking, notices, frames."""

from dataclasses import asdict
from typing import Any

from legbench.drives.master.bus_log import LOG_FAILED
from legbench.drives.master.stop_report import StopReport
from legbench.plant.can import CanPlant


def bus_events(plant: CanPlant) -> dict[str, dict[str, Any]]:
    """Events of a run on drives by name, those that happened and the count of frames."""
    link, log = plant.link, plant.session.log
    events: dict[str, dict[str, Any]] = {}
    if log is not None and log.error is not None:
        events[LOG_FAILED] = {"error": log.error}
    if link.listener_error is not None:
        events["onlooker failed"] = {"who": "listener", "error": link.listener_error}
    if link.unprotected:
        events["not protected"] = {"lines": list(link.unprotected)}
    if link.stopped is not None and link.stopped != StopReport():
        events["stop"] = asdict(link.stopped)
    if plant.landing is not None:
        events["rest"] = asdict(plant.landing)
    if link.not_parked:
        events["not parked"] = {"drives": link.not_parked}
    return {**events, **link.cycle.notices.events, "bus": _frames(plant)}


def _frames(plant: CanPlant) -> dict[str, Any]:
    """Count of what came, was late or was lost on the bus during a run."""
    link, cycle = plant.link, plant.link.cycle
    return {
        "skipped_cycles": link.skipped_total,
        "silent_cycles": cycle.silent_total,
        "late_frames": cycle.late_frames,
        "error_frames": cycle.error_frames,
        "lost_cycles": [watch.lost_total for watch in cycle.watches],
        "emergencies": [str(text) for watch in cycle.watches for text in watch.history],
        "warnings": [
            str(text)
            for node, watch in zip(plant.session.config.nodes, cycle.watches, strict=True)
            for text in watch.history
            if text.code in node.quirks.warnings
        ],
        "state": link.state.name.lower(),
        "began": plant.began,
    }
