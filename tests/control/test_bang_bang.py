from dataclasses import replace

import numpy as np
import pytest
from torque_traces import Pulled

from legbench.control import BangBang, BangBangConfig, LegTargets
from legbench.control.bang_bang import BangBangPhase
from legbench.control.jump_rules import JumpPhase
from legbench.design import LegDesign
from legbench.design.setup import Setup, SetupKind
from legbench.design.statics import Support
from legbench.errors import ConfigError
from legbench.kinematics import joint_to_modal
from legbench.mjcf import BuildOptions, Linkage, LinkageKind
from legbench.plant.sim import SimPlant
from legbench.plant.start import Start
from legbench.servo import ServoConfig
from legbench.signals import Floats

SLOW = ServoConfig(slew_rate=4.0, bandwidth=30.0, delay_cycles=3)
EARLY = BangBangConfig(delay=0.005)


def pulled(design: LegDesign, config: BangBangConfig, rest: float = 0.0) -> Pulled:
    return Pulled(BangBang(config, LegTargets(designs=design, support=Support.NONE)), rest)


def swing(
    design: LegDesign, config: BangBangConfig, kind: SetupKind, servo: ServoConfig | None = None
) -> Floats:
    """Width of the motion of z2 in each half second of two [rad]."""
    setup = Setup(kind=kind)
    targets = LegTargets(designs=design, support=setup.support)
    controller = BangBang(config, targets)
    motor_pos = controller.start_motor_pos
    start = Start(joint_pos=targets.link_at_rest(motor_pos), motor_pos=motor_pos)
    options = BuildOptions(setup=setup, linkage=Linkage(kind=LinkageKind.REDUCED))
    plant = SimPlant(design, options, start, servo)
    seen = plant.reset()
    controller.reset(seen)
    z2 = []
    for _ in range(2000):
        seen = plant.step(controller.step(seen))
        z2.append(joint_to_modal(seen.joint_pos)[1])
    return np.ptp(np.reshape(z2, (4, 500)), axis=1)


@pytest.mark.parametrize(
    "three_levels",
    [False, pytest.param(True, marks=pytest.mark.long)],
    ids=["two levels", "three levels"],
)
@pytest.mark.parametrize("kind", [SetupKind.HFTS, SetupKind.VFTS, SetupKind.FFS])
def test_the_law_sustains_the_motion_and_its_inverse_does_not(
    prototype: LegDesign, kind: SetupKind, three_levels: bool
) -> None:
    config = BangBangConfig(three_levels=three_levels)
    sustained = swing(prototype, config, kind)
    assert np.all(sustained[1:] > 2.0 * config.dz2)
    assert sustained[-1] > 0.9 * sustained[1]
    inverted = swing(prototype, replace(config, sign=-1), kind)
    assert inverted[-1] < 0.05 * config.dz2
    assert inverted[-1] < 0.9 * inverted[0]


@pytest.mark.parametrize("three_levels", [False, True], ids=["two levels", "three levels"])
def test_motors_that_follow_slowly_start_the_motion_too(
    prototype: LegDesign, three_levels: bool
) -> None:
    widths = swing(prototype, BangBangConfig(three_levels=three_levels), SetupKind.FFS, SLOW)
    assert np.all(widths[1:] > 0.1)


@pytest.mark.parametrize("three_levels", [False, True])
def test_it_rests_first_and_kicks_to_the_longer_leg(optimal: LegDesign, three_levels: bool) -> None:
    leg = pulled(optimal, replace(EARLY, three_levels=three_levels))
    for _ in range(5):
        command = leg.pull(0.0)
        assert command.phase == JumpPhase.REST
        assert np.allclose(joint_to_modal(command.motor_pos), [0.0, EARLY.z2])
    for _ in range(30):
        command = leg.pull(0.0)
        assert command.phase == BangBangPhase.STRETCHED
        assert np.allclose(joint_to_modal(command.motor_pos), [0.0, EARLY.z2 - EARLY.dz2])


def test_two_levels_switch_at_the_threshold_and_hold_between(optimal: LegDesign) -> None:
    leg, eps = pulled(optimal, EARLY), EARLY.threshold
    leg.pull(0.0, 6)
    for torque, phase in (
        (-1.1 * eps, BangBangPhase.STRETCHED),
        (0.0, BangBangPhase.STRETCHED),
        (0.99 * eps, BangBangPhase.STRETCHED),
        (1.01 * eps, BangBangPhase.FOLDED),
        (0.0, BangBangPhase.FOLDED),
        (-0.99 * eps, BangBangPhase.FOLDED),
        (-1.01 * eps, BangBangPhase.STRETCHED),
    ):
        assert leg.phase(torque, 3) == phase
    command = leg.pull(2.0 * eps)
    assert np.allclose(joint_to_modal(command.motor_pos), [0.0, EARLY.z2 + EARLY.dz2])


def test_three_levels_return_to_the_middle(optimal: LegDesign) -> None:
    leg, eps = pulled(optimal, replace(EARLY, three_levels=True)), EARLY.threshold
    leg.pull(0.0, 6)
    for torque, phase in (
        (-1.1 * eps, BangBangPhase.STRETCHED),
        (-0.99 * eps, BangBangPhase.MIDDLE),
        (0.99 * eps, BangBangPhase.MIDDLE),
        (1.01 * eps, BangBangPhase.FOLDED),
        (0.0, BangBangPhase.MIDDLE),
    ):
        command = leg.pull(torque, 3)
        assert command.phase == phase
    assert np.allclose(joint_to_modal(command.motor_pos), [0.0, EARLY.z2])


def test_the_torque_counts_from_rest(optimal: LegDesign) -> None:
    eps = EARLY.threshold
    for rest in (-0.8, 0.6):
        leg = pulled(optimal, EARLY, rest)
        leg.pull(rest, 6)
        assert leg.phase(rest + 1.01 * eps) == BangBangPhase.FOLDED
        assert leg.phase(rest - 0.99 * eps) == BangBangPhase.FOLDED
        assert leg.phase(rest - 1.01 * eps) == BangBangPhase.STRETCHED


def test_rows_of_a_batch_are_single_legs(optimal: LegDesign, prototype: LegDesign) -> None:
    legs = [optimal, prototype, optimal]
    rng = np.random.default_rng(8)
    trace = 0.05 * np.cumsum(rng.normal(size=(300, 3)), axis=0)
    for config in (EARLY, replace(EARLY, three_levels=True), replace(EARLY, sign=-1)):
        batch = Pulled(
            BangBang(config, LegTargets(designs=legs, support=Support.NONE)), np.zeros(3)
        )
        alone = [pulled(design, config) for design in legs]
        for torque in trace:
            together = batch.pull(torque)
            for row, leg in enumerate(alone):
                command = leg.pull(float(torque[row]))
                assert command.phase == together.phase[row]
                assert np.array_equal(command.motor_pos, together.motor_pos[row])


@pytest.mark.parametrize("threshold", [0.3, 0.25, 0.0, -0.1, np.nan])
def test_a_threshold_that_its_own_deflection_cannot_pass(
    optimal: LegDesign, prototype: LegDesign, threshold: float
) -> None:
    config = BangBangConfig(threshold=threshold)
    with pytest.raises(
        ConfigError, match=r"threshold is .* N m; .* stay below k dz2 = 0\.25 N m.*: lower it"
    ):
        BangBang(config, LegTargets(designs=optimal, support=Support.NONE))
    with pytest.raises(ConfigError, match=r"k dz2 = 0\.184 N m"):
        BangBang(config, LegTargets(designs=[optimal, prototype], support=Support.NONE))


def test_other_settings_that_make_no_sense(optimal: LegDesign) -> None:
    targets = LegTargets(designs=optimal, support=Support.NONE)
    with pytest.raises(ConfigError, match="sign is 0; it must be 1 or -1"):
        BangBang(BangBangConfig(sign=0), targets)
    for dz2 in (0.0, -0.1, np.nan):
        with pytest.raises(ConfigError, match=r"dz2 is .* rad; bang-bang needs a positive"):
            BangBang(BangBangConfig(dz2=dz2), targets)
    with pytest.raises(ConfigError, match=r"set point z2 \+ dz2 = 2\.1 rad"):
        BangBang(BangBangConfig(z2=2.0, dz2=0.1), targets)
    with pytest.raises(ConfigError, match=r"set point z2 - dz2 = 0\.1 rad"):
        BangBang(BangBangConfig(z2=0.3, dz2=0.2), targets)
