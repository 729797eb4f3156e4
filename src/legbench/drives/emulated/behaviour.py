"""Settings of an emulated drive: latencies, lags, limits, and reaction to missing targets."""

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum

from legbench.drives.protocol.objects import Key
from legbench.drives.protocol.sdo import Abort
from legbench.drives.protocol.sdo_server import SdoAnswers


class MissingSetpoint(Enum):
    """Reactions of a drive to a SYNC without a new target."""

    HOLD = "hold"
    EXTRAPOLATE = "extrapolate"


@dataclass(frozen=True, slots=True, kw_only=True)
class Behaviour:
    """Properties of the emulated hardware; no master has access to them."""

    reply_delay_us: tuple[int, int] = (50, 250)
    """Shortest and longest delay of a reply after SYNC or a request, uniformly distributed [us]."""
    seed: int = 0
    """Seed of the random reply delays."""
    interpolate: bool = True
    """Ramp linearly to a target over 60C2h; otherwise jump to it at SYNC."""
    missing_setpoint: MissingSetpoint = MissingSetpoint.HOLD
    missing_limit: int = 3
    """More SYNCs than this without a new target while enabled are a fault."""
    sync_loss_periods: int = 5
    """More communication cycles (1006h) than this without SYNC while enabled are a fault."""
    slow_loop: bool = False
    """Whether controlwords are read once a body step, so that of two only the second counts."""
    ignores: frozenset[int] = frozenset()
    """Controlwords that it does not obey, such as 02h of a drive without a quick stop."""
    status_lag_us: int = 0
    """Delay of the statusword, rounded to whole motion cycles [us]."""
    bandwidth: float | None = None
    """Corner frequency of the position loop [Hz]; none stands for a loop without lag."""
    slew_rate: float | None = None
    """Highest speed of the motor, whatever 6080h allows [rad/s]; none: as fast as it is told."""
    setpoint_delay: int = 0
    """Number of targets that wait in the drive before one is followed."""
    motor_noise: Callable[[], float] | None = None
    """Function that returns the error of the motor's reading in this period of the body [rad]."""
    mode_lag_us: int = 2000
    """Delay of the mode display (6061h) after a mode change (6060h) [us]."""
    mode_needs_power: bool = False
    """Whether 6061h shows 0 until the drive is enabled, and follows with its delay only then."""
    follows_bit: bool = True
    """Whether bit 12 of the statusword is set while the drive follows its target."""
    sdo_answers: SdoAnswers = SdoAnswers.SIZED
    lacks: frozenset[Key | int] = frozenset()
    """Objects that it has not, by index, or by index and sub-index."""
    lacking: Abort = Abort.NO_OBJECT
    """Code with which it refuses them."""
    defaults: tuple[tuple[Key, int], ...] = ()
    """Values that its objects hold at power-on, where they are not the usual ones."""
    rpdos: int = 4
    tpdos: int = 4
    """Number of PDOs that it has, each way."""
    fixed_mapping: bool = False
    """Whether its PDOs are mapped for good, as the bus file wants them."""
    warnings: tuple[int, ...] = ()
    """Codes of emergency messages that it sends when it becomes enabled and that mean nothing."""
    halt_blocks_mode: bool = True
    """Whether mode changes are refused while the halt bit is set."""
    boot_us: int = 5000
    """Delay of the boot-up message after a reset [us]."""
    hard_stop: tuple[float, float] | None = None
    """Mechanical range of the motor [rad]."""
    home_switch: tuple[float, float] | None = None
    """Range of the motor in which its home switch is active [rad]; none stands for no switch."""
    start_pos: float = 0.0
    """Motor position at power-on [rad]."""
    rated_torque: float = 10.0
    """Rated torque, of which 6077h shows permille [N m]."""

    @classmethod
    def ideal(cls, start_pos: float = 0.0) -> "Behaviour":
        """Behaviour without latency, interpolation or motor lag; only count resolution is left."""
        return cls(reply_delay_us=(0, 0), interpolate=False, start_pos=start_pos)
