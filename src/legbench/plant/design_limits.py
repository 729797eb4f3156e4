"""Safety limits held against a design: what its stops leave to motors and links."""

from dataclasses import asdict, replace

from legbench.design import LegDesign
from legbench.drives.limits import UNLIMITED, Range, SafetyLimits
from legbench.plant.abstract import AbstractPlant
from legbench.plant.limited import LimitedPlant
from legbench.plant.opening import Leg, OpenPlant


def limits_within(limits: SafetyLimits, design: LegDesign) -> SafetyLimits:
    """Limits whose open ranges are the design's.

    Raises:
        ConfigError: they are looser than the design.
    """
    joint = joint_ranges(design)
    open_range = (UNLIMITED, UNLIMITED)
    limits = replace(
        limits,
        motor_range=joint if limits.motor_range == open_range else limits.motor_range,
        joint_range=joint if limits.joint_range == open_range else limits.joint_range,
    )
    limits.check_within(motor=joint, joint=joint)
    return limits


def joint_ranges(design: LegDesign) -> tuple[Range, Range]:
    """What the stops of a design leave to q1 and q2, and so to the motors [rad]."""
    hip, knee = design.limits.hip, design.limits.knee
    return hip, (hip[0] + knee[0], hip[1] + knee[1])


def open_limited(plant: AbstractPlant, limits: SafetyLimits | None, leg: Leg) -> OpenPlant:
    """A plant in virtual time, under limits if there are any.

    Raises:
        ConfigError: the limits are looser than the design.
    """
    if limits is None:
        return OpenPlant(plant=plant)
    limits = limits_within(limits, leg.design)
    limited = LimitedPlant(plant, limits, delay_cycles=leg.servo.delay_cycles)
    return OpenPlant(plant=limited, facts={"limits": asdict(limits)})
