"""One leg in the equations of the paper, with the same interface as the simulated one."""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import final

import numpy as np

from legbench.analytic import HybridLeg, LegModel, LegState, Regime, Transition, standing
from legbench.analytic.boom import Boom
from legbench.analytic.losses import Losses
from legbench.analytic.smooth import Accuracy
from legbench.analytic.terms import Bars, bodies_of
from legbench.design import LegDesign
from legbench.design.rig import BOOM_BEND
from legbench.design.setup import Setup, SetupKind
from legbench.design.statics import GRAVITY
from legbench.encoders import EncoderErrors
from legbench.errors import PlantFault
from legbench.imperfections import Imperfections
from legbench.mjcf.options import BuildOptions
from legbench.plant.abstract import AbstractPlant
from legbench.plant.start import PERIOD, Start
from legbench.servo import PERFECT, Servo, ServoConfig
from legbench.signals import Command, Floats, Observation, Truth

STRAIGHT_MARGIN = 0.02
"""Distance of a knee from 0 or pi at which it has gone through its stop [rad]."""


@final
class AnalyticPlant(AbstractPlant):
    """The leg of a design under eqs. (1) and (12), commands sampled and held at 1 kHz.

    Joint stops are those of `legbench.analytic.stops`, the foot neither slides nor bounces, and
    the bars have no mass unless `bars` says so. The contact force is that of the instant; contact
    is told also for a touch that began and ended within the cycle.

    What moves is the leg as it was built, with its imperfections; springs are read as those of
    the design.

    Attributes:
        transitions: touchdowns and lift-offs since the reset, in order.

    Raises:
        ConfigError: a boom that is shorter than the leg, or imperfections that leave no leg or
            need another setup.
    """

    def __init__(
        self,
        design: LegDesign,
        setup: Setup,
        start: Start,
        servo: ServoConfig | None = None,
        accuracy: Accuracy | None = None,
        bars: Bars | None = None,
        *,
        imperfections: Imperfections = PERFECT,
        seed: int = 0,
    ) -> None:
        self.period = PERIOD
        self.transitions: list[Transition] = []
        gravity = 0.0 if setup.kind is SetupKind.HFTS else GRAVITY
        BuildOptions(setup=setup).built(imperfections)
        built = imperfections.leg_of(design)
        boom = _boom(built, setup, bars, imperfections, gravity)
        # The guide of a boom is damped at its pivot.
        joints = imperfections if boom is None else replace(imperfections, guide_damping=None)
        losses = Losses.of(joints)
        self._model = LegModel.of(built, gravity=gravity, bars=bars, losses=losses, boom=boom)
        self._leg = HybridLeg(self._model, accuracy)
        self._setup, self._start = setup, start
        self._servo = Servo(servo or ServoConfig(), PERIOD, imperfections)
        self._errors = EncoderErrors(imperfections, seed)
        self._stiffness = np.asarray(design.stiffness)
        self._state = self._first_state()
        self._shaft = start.motor_pos
        self._touched = False
        self._cycle = 0

    def reset(self) -> Observation:
        """Put the leg at rest in its start posture."""
        self._state = self._first_state()
        self._servo.reset(self._start.motor_pos)
        self._shaft = self._servo.shaft(self._servo.position)
        self._errors.reset()
        self.transitions = []
        self._touched = False
        self._cycle = 0
        return self._observe(Command.holding(self._start.motor_pos))

    def step(self, command: Command) -> Observation:
        """Apply a command over one period.

        Raises:
            PlantFault: the integration failed, or the leg straightened or folded through.
        """
        self._shaft = self._servo.shaft(self._servo.follow(command.motor_pos))
        self._cycle += 1
        motor = (float(self._shaft[0]), float(self._shaft[1]))
        self._state, happened = self._leg.advance(self._state, self._cycle * PERIOD, motor)
        self._touched = bool(happened)
        self.transitions += happened
        knee = self._state.q[1] - self._state.q[0]
        if not STRAIGHT_MARGIN <= knee <= math.pi - STRAIGHT_MARGIN:
            cause = "leg straightened through" if knee < 1.0 else "leg folded through"
            raise PlantFault(
                cause,
                f"{cause} at t = {self._cycle * PERIOD:.3f} s: the stops did not hold; push less "
                "(--dz2) or limit the servo (--slew-rate)",
            )
        return self._observe(command)

    def rest(self, motor_pos: Floats, interrupted: Callable[[], bool]) -> None:
        """Leave the computed leg where it is."""

    def close(self) -> None:
        """Nothing to release."""

    def _first_state(self) -> LegState:
        q = (float(self._start.joint_pos[0]), float(self._start.joint_pos[1]))
        if self._setup.trunk_moves:
            return standing(self._model, q, pinned=self._setup.kind is SetupKind.FFS)
        height = _bent_height(self._model.floating.reach)
        return LegState(
            time=0.0,
            regime=Regime.HANGING,
            q=q,
            v=(0.0, 0.0),
            trunk_pos=(0.0, height),
            trunk_vel=(0.0, 0.0),
        )

    def _observe(self, command: Command) -> Observation:
        state = self._state
        joint_pos, motor_pos = np.array(state.q), self._servo.position.copy()
        if not self._errors.exact:
            self._errors.advance()
            motor_pos, joint_pos = motor_pos + self._errors.motor, joint_pos + self._errors.link
        motor_pos, joint_pos = self._servo.encode(motor_pos), self._servo.encode(joint_pos)
        return Observation(
            time=self._cycle * PERIOD,
            motor_pos=motor_pos,
            joint_pos=joint_pos,
            joint_vel=np.array(state.v),
            spring_torque=self._stiffness * (motor_pos - joint_pos),
            applied_pos=command.motor_pos.copy(),
            truth=self._truth(state),
        )

    def _truth(self, state: LegState) -> Truth:
        model = self._model
        foot = model.foot_from_hip(state.q)
        tip = (state.trunk_pos[0] + foot[0], state.trunk_pos[1] + foot[1])
        force = (0.0, 0.0)
        if state.regime.stands:
            motor = (float(self._shaft[0]), float(self._shaft[1]))
            hip = model.hip_over_foot(state.q)
            force, tip = (
                model.stance_force(motor, state.q, state.v),
                (state.trunk_pos[0] - hip[0], 0.0),
            )
        if model.boom is not None:
            energy = model.boom.energy(state.q, state.v)
        elif state.regime is Regime.HANGING:
            energy = model.pair_energy(model.hanging, state.q, state.v)
        else:
            energy = model.floating_energy(state.trunk_pos[1], state.trunk_vel, state.q, state.v)
        return Truth(
            trunk_pos=np.array(state.trunk_pos),
            trunk_vel=np.array(state.trunk_vel),
            foot_pos=np.array(tip),
            contact_force=np.array(force),
            contact=np.asarray(state.regime.stands or self._touched),
            energy=np.array(energy),
            loop_gap=np.zeros(2),
        )


def _boom(
    design: LegDesign,
    setup: Setup,
    bars: Bars | None,
    imperfections: Imperfections,
    gravity: float,
) -> Boom | None:
    """Boom of a leg as it was built, where the setup has one."""
    if setup.boom_radius is None:
        return None
    setup.check_boom(design)
    bodies, reach = bodies_of(design, bars), design.lengths[1]
    trunk_mass = design.total_mass - sum(body.mass for body in bodies)
    return Boom(
        bodies,
        trunk_mass,
        reach,
        radius=setup.boom_radius,
        height=_bent_height(reach),
        gravity=gravity,
        guide=imperfections.guide_damping or (0.0, 0.0),
    )


def _bent_height(reach: float) -> float:
    """Height of a hip that is held, or carried by a level boom [m]."""
    return 2.0 * reach * math.cos(BOOM_BEND)
