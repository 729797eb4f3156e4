"""JSON schemas of the messages in an MCAP file, and the messages of joint states."""

from collections.abc import Iterator, Sequence
from typing import Any, Final

import numpy as np

from legbench.export.content import Field, as_json
from legbench.recording.reader import Recording

SECOND: Final = 1_000_000_000
"""Nanoseconds in a second."""

_NUMBER: Final = {"type": "number"}
_TIME: Final = {
    "type": "object",
    "title": "time",
    "properties": {
        "sec": {"type": "integer", "minimum": 0},
        "nsec": {"type": "integer", "minimum": 0, "maximum": SECOND - 1},
    },
}

JOINT_STATES: Final[dict[str, Any]] = {
    "title": "foxglove.JointStates",
    "description": "links q1, q2 measured from straight down [rad], with the torque of their "
    "springs [N m]; motors [rad]",
    "type": "object",
    "properties": {
        "timestamp": _TIME,
        "joints": {
            "type": "array",
            "items": {
                "title": "foxglove.JointState",
                "type": "object",
                "properties": {
                    "name": {"type": "string"},
                    "position": _NUMBER,
                    "velocity": _NUMBER,
                    "effort": _NUMBER,
                },
            },
        },
    },
}
"""Schema by whose name Foxglove knows joint states."""

EVENT: Final[dict[str, Any]] = {
    "title": "legbench.Event",
    "type": "object",
    "properties": {"time": {"type": "number", "description": "[s]"}, "name": {"type": "string"}},
}


def row_schema(fields: Sequence[Field]) -> dict[str, Any]:
    """Schema of a message with all columns of a row, their units in brackets."""
    properties: dict[str, Any] = {}
    for field in fields:
        kind = "integer" if field.name in ("t_ns", "phase", "contact") else "number"
        about = " ".join(filter(None, [f"[{field.unit}]", field.doc]))
        properties[field.name] = {"type": [kind, "null"], "description": about}
        if field.name == "phase":
            properties["phase_name"] = {"type": "string", "description": "Name of the phase"}
    return {"title": "legbench.Row", "type": "object", "properties": properties}


def joint_states(part: Recording, times: Sequence[int]) -> Iterator[bytes]:
    """Message of each row with positions, velocities and efforts as far as they are known.

    Args:
        part: the rows.
        times: time of each row since 1970 [ns].
    """
    named = {
        ("q1", "q2"): ("joint_pos", "joint_vel", "spring_torque"),
        ("motor1", "motor2"): ("motor_pos",),
    }
    keys = ("position", "velocity", "effort")
    joints = [
        (name, {key: part[signal][:, place] for key, signal in zip(keys, signals, strict=False)})
        for names, signals in named.items()
        for place, name in enumerate(names)
    ]
    columns = [each for _, values in joints for each in values.values()]
    known = np.all(np.isfinite(np.stack(columns)), axis=0).tolist()
    template = _template(joints)
    texts = zip(*(map(repr, each.tolist()) for each in columns), strict=True)
    for row, (time, values, whole) in enumerate(zip(times, texts, known, strict=True)):
        if whole:
            yield (template % (time // SECOND, time % SECOND, *values)).encode()
        else:
            yield _partial(joints, row, time)


def _template(joints: list[tuple[str, dict[str, Any]]]) -> str:
    each = [
        "{" + ",".join([f'"name":"{name}"', *(f'"{key}":%s' for key in values)]) + "}"
        for name, values in joints
    ]
    return '{"timestamp":{"sec":%d,"nsec":%d},"joints":[' + ",".join(each) + "]}"


def _partial(joints: list[tuple[str, dict[str, Any]]], row: int, time: int) -> bytes:
    """Message of a row without the numbers that are not known."""
    told = []
    for name, values in joints:
        here = {key: float(each[row]) for key, each in values.items()}
        told.append({"name": name} | {key: v for key, v in here.items() if np.isfinite(v)})
    stamp = {"sec": time // SECOND, "nsec": time % SECOND}
    return as_json({"timestamp": stamp, "joints": told})
