"""Safety limits that follow from a design: what its stops leave to motors and links."""

import math
from collections.abc import Sequence
from dataclasses import asdict, replace
from typing import Any

from legbench.design import LegDesign
from legbench.drives.setup.waivers import describe_waivers
from legbench.errors import ConfigError
from legbench.guests import load_text
from legbench.limits.knee import Range
from legbench.limits.safety import UNLIMITED, SafetyLimits
from legbench.limits.shortfall import Shortfall
from legbench.plant.abstract import AbstractPlant
from legbench.plant.limited import LimitedPlant
from legbench.plant.opening import Leg, OpenPlant
from legbench.servo import ServoConfig

KNEE_WIND = 0.1
"""Angle by which motors may wind beyond a knee stop; it loads each spring by half of it [rad]."""
SINGULAR_SHARE = 0.2
"""Share of the way from a singular pose of the bars to the knee stop that links keep [-]."""


def limits_within(limits: SafetyLimits, design: LegDesign) -> SafetyLimits:
    """Return limits whose open ranges are the design's.

    Raises:
        ConfigError: they are looser than the design.
    """
    joint, open_range = joint_ranges(design), (UNLIMITED, UNLIMITED)
    motor_knee, joint_knee = knee_ranges(design)
    own_motor, own_joint = limits.motor_knee_range, limits.joint_knee_range
    limits = replace(
        limits,
        motor_range=joint if limits.motor_range == open_range else limits.motor_range,
        joint_range=joint if limits.joint_range == open_range else limits.joint_range,
        motor_knee_range=motor_knee if own_motor == UNLIMITED else own_motor,
        joint_knee_range=joint_knee if own_joint == UNLIMITED else own_joint,
    )
    limits.check_within(motor=joint, joint=joint, motor_knee=motor_knee, joint_knee=joint_knee)
    return limits


def joint_ranges(design: LegDesign) -> tuple[Range, Range]:
    """What the stops of a design leave to q1 and q2, and so to the motors [rad]."""
    hip, knee = design.limits.hip, design.limits.knee
    return hip, (hip[0] + knee[0], hip[1] + knee[1])


def knee_ranges(design: LegDesign) -> tuple[Range, Range]:
    """Return what the knee stops of a design leave to q2 - q1 of the motors and of the links [rad].

    Motors may wind the springs against a stop by a little, as a push does that straightens the
    leg. The stops give way: a jump of the optimal leg goes 0.18 rad into them. Links must stay
    away from the singular poses 0 and pi by a share of what lies between these and the stops.
    """
    low, high = design.limits.knee
    links = (SINGULAR_SHARE * low, math.pi - SINGULAR_SHARE * (math.pi - high))
    return (low - KNEE_WIND, high + KNEE_WIND), links


def open_limited(plant: AbstractPlant, limits: SafetyLimits | None, leg: Leg) -> OpenPlant:
    """Return a plant in virtual time, under limits if there are any.

    Raises:
        ConfigError: the limits are looser than the design.
    """
    if limits is None:
        return OpenPlant(plant=plant)
    limits = limits_within(limits, leg.design)
    _check_servo(leg.servo, limits)
    counts = leg.servo.encoder_counts
    momentum = load_text("legbench.plant.leg_momentum:momentum_of")(
        leg.design,
        leg.options.setup,
        0.0 if counts is None else 2.0 * math.pi / counts,
        leg.imperfections,
    )
    delay = leg.servo.delay_cycles
    limited = LimitedPlant(plant, limits, delay_cycles=delay, momentum=momentum)
    waived = describe_waivers(None, limits)
    return OpenPlant(
        plant=limited,
        facts={"limits": asdict(limits)},
        events=lambda: limits_events(waived, limited.shortfall),
    )


def limits_events(waived: Sequence[str], shortfall: Shortfall) -> dict[str, dict[str, Any]]:
    """Events by name: protections that a run did without, and commands that its limits changed.

    Args:
        waived: protections, a line each.
        shortfall: which commands the limits changed.
    """
    events: dict[str, dict[str, Any]] = {}
    if waived:
        events["waived"] = {"protections": list(waived)}
    if told := shortfall.told():
        events["limited"] = told
    return events


def _check_servo(servo: ServoConfig, limits: SafetyLimits) -> None:
    """Refuse a simulated servo that the limits would take for a jammed motor.

    Raises:
        ConfigError: it is slower than they take for healthy.
    """
    if math.isinf(limits.following_error):
        return
    if servo.bandwidth is not None and servo.bandwidth < limits.servo_bandwidth:
        raise ConfigError(
            f"servo bandwidth is {servo.bandwidth:g} Hz, the limits take {limits.servo_bandwidth:g}"
            " Hz for the slowest healthy one: lower servo_bandwidth in the limits file"
        )
    if servo.slew_rate is not None and servo.slew_rate < limits.command_speed:
        raise ConfigError(
            f"servo slew_rate is {servo.slew_rate:g} rad/s, the limits let commands through at "
            f"{limits.command_speed:g} rad/s: lower command_speed in the limits file"
        )
