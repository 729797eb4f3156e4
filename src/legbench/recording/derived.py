"""Torque of the springs, which a file of samples may leave out: two other signals give it exactly.

With noise on the encoders a column is worth six bytes a row however it is packed, so that the
torque of two springs is a tenth of a recording and more.
"""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, Final

import numpy as np

from legbench.design.leg import LegDesign
from legbench.errors import FormatError
from legbench.recording.description import RunDescription
from legbench.recording.layout import TIME

DERIVED: Final = "derived"
"""Key of the manifest that names the signals which the samples leave out, with their formulas."""
TORQUE: Final = "spring_torque"
FORMULA: Final = "stiffness * (motor_pos - joint_pos)"

Columns = Mapping[str, np.ndarray]


def derivable(columns: Columns, described: RunDescription | FormatError) -> tuple[str, ...]:
    """Names of the columns that others give to the last bit: torques of the design's springs.

    A torque that came from elsewhere, as from a sensor, differs and is not among them.
    """
    if isinstance(described, FormatError):
        return ()
    torques = _torques(columns, described.design)
    same = (
        name in columns and columns[name].tobytes() == values.tobytes()
        for name, values in torques.items()
    )
    return tuple(torques) if all(same) else ()


def completed(
    columns: Columns, manifest: Mapping[str, Any], described: RunDescription | FormatError
) -> Columns:
    """Return the columns of a run, with those that its samples leave out, in their usual order."""
    named = manifest.get(DERIVED)
    if not isinstance(named, Mapping) or TORQUE not in named or isinstance(described, FormatError):
        return columns
    whole = {**_torques(columns, described.design), **columns}
    order = [TIME, *described.layout.names]
    return MappingProxyType({name: whole[name] for name in order if name in whole})


def _torques(columns: Columns, design: LegDesign) -> dict[str, np.ndarray]:
    """Torque of each spring (n,) [N m] as a plant computes it from what its encoders read."""
    found = {}
    for joint, stiffness in zip("12", design.stiffness, strict=True):
        motor, link = columns.get(f"motor_pos_{joint}"), columns.get(f"joint_pos_{joint}")
        if motor is None or link is None:
            return {}
        torque = stiffness * (motor - link)
        torque.flags.writeable = False
        found[f"{TORQUE}_{joint}"] = torque
    return found
