"""How faithful, and how unkind, an emulated drive is."""

from dataclasses import dataclass
from enum import Enum


class MissingSetpoint(Enum):
    """What a drive makes of a SYNC without a new target."""

    HOLD = "hold"
    EXTRAPOLATE = "extrapolate"


@dataclass(frozen=True, slots=True, kw_only=True)
class Behaviour:
    """Properties of the emulated hardware, none of which a master may know."""

    reply_delay_us: tuple[int, int] = (50, 250)
    """From SYNC or a request to the reply being ready, evenly spread [us]."""
    seed: int = 0
    """Of the spread."""
    interpolate: bool = True
    """Ramp linearly to a target over 60C2h; otherwise jump to it at SYNC."""
    missing_setpoint: MissingSetpoint = MissingSetpoint.HOLD
    missing_limit: int = 3
    """More SYNCs than this without a new target while enabled are a fault."""
    sync_loss_periods: int = 5
    """More communication cycles (1006h) than this without SYNC while enabled are a fault."""
    slow_loop: bool = False
    """Controlwords are looked at once a body step: two within it leave only the second."""
    ignores: frozenset[int] = frozenset()
    """Controlwords that it does not obey, such as 02h of a drive without a quick stop."""
    status_lag_us: int = 0
    """Statuswords are shown this much late, whole motion cycles at a time [us]."""
    bandwidth: float | None = None
    """Corner frequency of the position loop [Hz]; none: the motor is where it should be."""
    mode_lag_us: int = 2000
    """From 6060h to 6061h [us]."""
    halt_blocks_mode: bool = True
    """No mode change while the halt bit is set."""
    boot_us: int = 5000
    """From reset to the boot-up message [us]."""
    hard_stop: tuple[float, float] | None = None
    """Mechanical range of the motor [rad]."""
    start_pos: float = 0.0
    """Motor position at power-on [rad]."""
    rated_torque: float = 10.0
    """6077h is in permille of it [N m]."""

    @classmethod
    def ideal(cls, start_pos: float = 0.0) -> "Behaviour":
        """No latency, no interpolation, a perfect motor: only the counts are left."""
        return cls(reply_delay_us=(0, 0), interpolate=False, start_pos=start_pos)
