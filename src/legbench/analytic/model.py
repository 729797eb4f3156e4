"""Constants of the equations of motion for a design, and the quantities computed from them."""

from collections.abc import Sequence
from dataclasses import dataclass

from legbench.analytic.boom import Boom, BoomMotion
from legbench.analytic.equations import (
    SCALAR,
    Ops,
    Pair,
    Term,
    contact_force,
    damped,
    free_foot_acceleration,
    pair_acceleration,
    pair_kinetic,
    pair_potential,
    pair_solve,
    spring_energy,
    spring_torque,
    sweep,
    sweep_rate,
    trunk_acceleration,
)
from legbench.analytic.losses import Losses
from legbench.analytic.stops import Stop, make_stops, pushes
from legbench.analytic.terms import (
    Bars,
    FloatingTerms,
    PairTerms,
    floating_terms,
    stance_terms,
)
from legbench.design import LegDesign
from legbench.design.statics import GRAVITY


@dataclass(frozen=True, slots=True, kw_only=True)
class LegModel:
    """Constants of one leg: inertias and gravity, springs and dampers, joint stops."""

    floating: FloatingTerms
    stance: PairTerms
    """Inertia and gravity of the angles while the foot is pinned."""
    hanging: PairTerms
    """Inertia and gravity of the angles while the trunk is fixed."""
    falling: PairTerms
    """Inertia of the angles about the falling centre of mass."""
    stiffness: tuple[float, float]
    """Stiffness of the springs on q1 and q2 [N m/rad]."""
    damping: tuple[float, float]
    """Viscous damping of q1 and q2 [N m s/rad]."""
    stops: tuple[Stop, ...]
    """Joint stops; if there are none, joints turn freely, through the straight leg, too."""
    ops: Ops = SCALAR
    """The kind of numbers that the methods work on."""
    losses: Losses | None = None
    """Dry friction, damped guide and backlash, for plain floats alone; none for a perfect leg."""
    boom: Boom | None = None
    """Boom that guides the trunk over a pinned foot, for plain floats alone; none: a plane."""

    @classmethod
    def of(
        cls,
        design: LegDesign,
        *,
        gravity: float = GRAVITY,
        bars: Bars | None = None,
        stops: bool = True,
        undamped: bool = False,
        losses: Losses | None = None,
        boom: Boom | None = None,
    ) -> "LegModel":
        """Collect the terms of a design; `gravity` in [m/s^2], bars without mass if not given."""
        floating = floating_terms(design, gravity, bars)
        return cls(
            floating=floating,
            stance=stance_terms(design, gravity) if bars is None else floating.pinned(),
            hanging=floating.hanging(),
            falling=floating.falling(),
            stiffness=design.stiffness,
            damping=(0.0, 0.0) if undamped else design.damping,
            stops=make_stops(design.limits) if stops else (),
            losses=losses,
            boom=boom,
        )

    def torque(self, motor: Pair, q: Pair, v: Pair) -> Pair:
        """Torque of springs, dampers and other losses on q1 and q2 [N m]."""
        losses = self.losses
        if losses is None:
            return damped(spring_torque(self.stiffness, motor, q), self.damping, v)
        spring = spring_torque(self.stiffness, losses.gear(motor, q), q)
        torque, drag = damped(spring, self.damping, v), losses.drag(self.floating.reach, q, v)
        return torque[0] + drag[0], torque[1] + drag[1]

    def acceleration(self, terms: PairTerms, motor: Pair, q: Pair, v: Pair) -> Pair:
        """Accelerations of q1 and q2 under the inertia `terms`, joint stops included [rad/s^2]."""
        beyond = [stop.depth(q) > 0.0 for stop in self.stops]
        if any(beyond):
            return self.pushed(terms, motor, q, v, beyond)[1]
        return pair_acceleration(self.ops, terms, q, v, self.torque(motor, q, v))

    def pushed(
        self, terms: PairTerms, motor: Pair, q: Pair, v: Pair, beyond: Sequence[bool]
    ) -> tuple[list[float], Pair]:
        """Torque of each touched stop [N m], and the accelerations that result [rad/s^2]."""
        a = pair_acceleration(self.ops, terms, q, v, self.torque(motor, q, v))

        def solve(torque: Pair) -> Pair:
            return pair_solve(self.ops, terms, q, torque)

        return pushes(solve, self.stops, beyond, q, v, a)

    def stance_acceleration(self, motor: Pair, q: Pair, v: Pair) -> Pair:
        """Accelerations of q1 and q2 while the foot stands [rad/s^2]."""
        if self.boom is None:
            return self.acceleration(self.stance, motor, q, v)
        return self._on_boom(self.boom.motion(q, v), motor, q, v)

    def _on_boom(self, motion: BoomMotion, motor: Pair, q: Pair, v: Pair) -> Pair:
        a = motion.acceleration(self.torque(motor, q, v))
        beyond = [stop.depth(q) > 0.0 for stop in self.stops]
        return pushes(motion.solve, self.stops, beyond, q, v, a)[1] if any(beyond) else a

    def hanging_acceleration(self, motor: Pair, q: Pair, v: Pair) -> Pair:
        """Accelerations of q1 and q2 while the trunk is held [rad/s^2]."""
        return self.acceleration(self.hanging, motor, q, v)

    def flight_acceleration(self, motor: Pair, q: Pair, v: Pair) -> tuple[Pair, Pair]:
        """Accelerations of trunk [m/s^2] and of q1, q2 [rad/s^2] in flight."""
        a = self.acceleration(self.falling, motor, q, v)
        return trunk_acceleration(self.ops, self.floating, q, v, a), a

    def stance_force(self, motor: Pair, q: Pair, v: Pair) -> Pair:
        """Contact force on the standing foot (forward, up) [N]."""
        if self.boom is not None:
            motion = self.boom.motion(q, v)
            return motion.force(self._on_boom(motion, motor, q, v))
        a = self.stance_acceleration(motor, q, v)
        force = contact_force(self.ops, self.floating, q, v, a)
        if self.losses is None:
            return force
        guide = self.losses.guide_force(self.floating.reach, q, v)
        return force[0] - guide[0], force[1] - guide[1]

    def released_rise(self, motor: Pair, q: Pair, v: Pair) -> float:
        """Upward acceleration that the standing foot would have if it were released [m/s^2]."""
        a = self.acceleration(self.falling, motor, q, v)
        return free_foot_acceleration(self.ops, self.floating, q, v, a)[1]

    def foot_from_hip(self, q: Pair) -> Pair:
        """Foot tip seen from the hip (forward, up) [m]."""
        return sweep(self.ops, q, (self.floating.reach, self.floating.reach))

    def foot_vel_from_hip(self, q: Pair, v: Pair) -> Pair:
        """Velocity of the foot tip seen from the hip [m/s]."""
        return sweep_rate(self.ops, q, v, (self.floating.reach, self.floating.reach))

    def hip_over_foot(self, q: Pair) -> Pair:
        """Hip seen from a foot tip that stands (forward, up) [m]."""
        if self.boom is not None:
            return self.boom.hip(q)
        foot = self.foot_from_hip(q)
        return -foot[0], -foot[1]

    def hip_vel_over_foot(self, q: Pair, v: Pair) -> Pair:
        """Velocity of the hip over a foot tip that stands (forward, up) [m/s]."""
        if self.boom is not None:
            return self.boom.hip_vel(q, v)
        foot_vel = self.foot_vel_from_hip(q, v)
        return -foot_vel[0], -foot_vel[1]

    def mass_centre_from_hip(self, q: Pair) -> Pair:
        """Centre of mass seen from the hip [m]."""
        moved = sweep(self.ops, q, self.floating.first)
        return moved[0] / self.floating.mass, moved[1] / self.floating.mass

    def mass_centre_vel_from_hip(self, q: Pair, v: Pair) -> Pair:
        """Velocity of the centre of mass seen from the hip [m/s]."""
        moved = sweep_rate(self.ops, q, v, self.floating.first)
        return moved[0] / self.floating.mass, moved[1] / self.floating.mass

    def spring_energy(self, motor: Pair, q: Pair) -> Term:
        """Energy stored in the series springs [J]."""
        return spring_energy(self.stiffness, motor, q)

    def pair_energy(self, terms: PairTerms, q: Pair, v: Pair) -> Pair:
        """Gravity's potential and kinetic energy of a leg whose foot or trunk is held [J]."""
        return pair_potential(self.ops, terms, q), pair_kinetic(self.ops, terms, q, v)

    def floating_energy(self, height: Term, hip_vel: Pair, q: Pair, v: Pair) -> Pair:
        """Potential over the ground and kinetic energy of the free leg, hip at `height` [J].

        Koenig: the centre of mass, and the angles around it.
        """
        mass = self.floating.mass
        centre = self.mass_centre_from_hip(q)
        inner = self.mass_centre_vel_from_hip(q, v)
        moved = hip_vel[0] + inner[0], hip_vel[1] + inner[1]
        kinetic = 0.5 * mass * (moved[0] * moved[0] + moved[1] * moved[1])
        kinetic += pair_kinetic(self.ops, self.falling, q, v)
        return mass * self.floating.gravity * (height + centre[1]), kinetic
