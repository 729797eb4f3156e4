"""Names of the settings of controller and leg over which a periodic hop is followed."""

from enum import StrEnum


class Setting(StrEnum):
    """Setting over which a hop is followed."""

    Z2 = "z2"
    """Middle of the set points [rad]."""
    DZ2 = "dz2"
    """Amplitude of the push [rad]."""
    DAMPING = "damping"
    """Factor on both dampers [-]; 1 is the design."""
    MISMATCH = "mismatch"
    """Difference of the springs over their mean, `(k1 - k2) / k` [-]."""


SPANS = {Setting.Z2: 0.1, Setting.DZ2: 0.1, Setting.DAMPING: 1.0, Setting.MISMATCH: 0.1}
"""Units by which changes of each setting are scaled, in the unit of the setting."""
