"""SLIP template: a point mass on a massless spring with the leg's stiffness (Fig. 2c)."""

import math
from dataclasses import dataclass

from legbench.analytic.contact import switch
from legbench.analytic.model import LegModel
from legbench.analytic.state import LegState, Regime
from legbench.analytic.taylor import Levels, TaylorLeg, Watched
from legbench.design.statics import GRAVITY
from legbench.errors import ConfigError
from legbench.modes.drive import Passive
from legbench.modes.hop import CALLS, HORIZON, Apex, return_map


@dataclass(frozen=True, slots=True, kw_only=True)
class Slip:
    """Spring-loaded inverted pendulum, hopping upright.

    Raises:
        ConfigError: a spring, a mass or a length that is not positive.
    """

    mass: float
    """Mass of the point [kg]."""
    stiffness: float
    """Stiffness of the spring [N/m]."""
    length: float
    """Length of the relaxed spring [m]."""
    gravity: float = GRAVITY
    """Acceleration of gravity [m/s^2]."""

    def __post_init__(self) -> None:
        for name in ("mass", "stiffness", "length", "gravity"):
            if not getattr(self, name) > 0.0:
                raise ConfigError(f"slip {name} is {getattr(self, name):g}; it must be positive")

    @classmethod
    def of(cls, model: LegModel, motor_half: float) -> "Slip":
        """The template of a leg whose springs relax at a half angle [rad].

        `k_leg = (k1 + k2) / (4 l2^2 sin^2 half)`: radial stiffness at the relaxed length.
        """
        reach = model.floating.reach
        return cls(
            mass=model.floating.mass,
            stiffness=sum(model.stiffness) / (2.0 * reach * math.sin(motor_half)) ** 2,
            length=2.0 * reach * math.cos(motor_half),
            gravity=model.floating.gravity,
        )

    @property
    def rate(self) -> float:
        """Natural angular frequency sqrt(k/m) [rad/s]."""
        return math.sqrt(self.stiffness / self.mass)

    @property
    def firmness(self) -> float:
        """The dimensionless stiffness k l / (m g) [-]."""
        return self.stiffness * self.length / (self.mass * self.gravity)

    def contact_time(self, drop: float) -> float:
        """Time from touchdown to lift-off after a drop [m]: half a period and the sag [s]."""
        speed = math.sqrt(2.0 * self.gravity * drop)
        return 2.0 / self.rate * (math.pi - math.atan(speed * self.rate / self.gravity))

    def compression(self, drop: float) -> float:
        """Largest compression of the spring [m] after a drop [m]."""
        sag = self.mass * self.gravity / self.stiffness
        return sag + math.sqrt(sag * sag + 2.0 * sag * drop)


@dataclass(frozen=True, slots=True, kw_only=True)
class Groups:
    """Dimensionless numbers of one hop: lengths in l, times in sqrt(m/k), forces in m g."""

    drop: float
    """Height of the apex above touchdown [l]."""
    contact_time: float
    """Time from touchdown to lift-off [sqrt(m/k)]."""
    flight_time: float
    """Time from lift-off to touchdown [sqrt(m/k)]."""
    compression: float
    """Largest compression of the spring [l]."""
    peak_force: float
    """Largest force of the spring [m g]."""
    returned: float
    """Height of the next apex above touchdown over that of this one [-]."""


def slip_groups(slip: Slip, drop: float) -> Groups:
    """The template's hop from a drop [m], in closed form."""
    compression = slip.compression(drop)
    return Groups(
        drop=drop / slip.length,
        contact_time=slip.contact_time(drop) * slip.rate,
        flight_time=2.0 * math.sqrt(2.0 * drop / slip.gravity) * slip.rate,
        compression=compression / slip.length,
        peak_force=slip.stiffness * compression / (slip.mass * slip.gravity),
        returned=1.0,
    )


def leg_groups(leg: TaylorLeg, slip: Slip, motor_half: float, drop: float) -> Groups:
    """The leg's own hop, relaxed and upright, from the same drop [m].

    Raises:
        ConfigError: the leg does not hop from there, or its springs relax beyond a joint limit.
    """
    model, drive = leg.model, Passive((-motor_half, motor_half))
    stretched = any(stop.depth(drive.motor) > 0.0 for stop in model.stops)
    centre = model.mass_centre_from_hip(drive.motor)[1]
    foot = model.foot_from_hip(drive.motor)[1]
    start = Apex(
        height=centre - foot + drop,
        speed=0.0,
        z1=0.0,
        z2=motor_half * math.sqrt(2.0),
        dz1=0.0,
        dz2=0.0,
    )
    done = return_map(leg, drive, start)
    if done.after is None or stretched:
        why = "its springs relax beyond a joint limit" if stretched else f"it {done.ending}"
        raise ConfigError(f"the leg does not hop from {drop:.4g} m: {why}")
    state = start.state(model)
    state = _lower_apex(leg, drive, state)
    depth = slip.length + model.foot_from_hip(state.q)[1]
    force = model.stance_force(drive.motor, state.q, state.v)[1]
    return Groups(
        drop=drop / slip.length,
        contact_time=(done.liftoff - done.touchdown) * slip.rate,
        flight_time=2.0 * math.sqrt(2.0 * drop / slip.gravity) * slip.rate,
        compression=depth / slip.length,
        peak_force=force / (slip.mass * slip.gravity),
        returned=(done.after.height - start.height) / drop + 1.0,
    )


def _lower_apex(leg: TaylorLeg, drive: Passive, state: LegState) -> LegState:
    """State at the lower apex in stance; a touchdown that lifts off at once does not count."""
    for _ in range(CALLS):
        state, what = leg.watch(state, HORIZON, drive.motor, Levels(turns=True))
        if what is Watched.CONTACT:
            state = switch(leg.model, state)
        elif what is Watched.TURN and state.regime is Regime.STANCE:
            return state
        elif what is None:
            break
    raise ConfigError("the leg does not turn round in its stance")
