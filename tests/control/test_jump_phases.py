"""The jump's state machine under torques that somebody else makes."""

from dataclasses import replace

import numpy as np
import pytest
from torque_traces import Pulled, load_of_standing

from legbench.control import Jump, JumpConfig, LegTargets
from legbench.control.jump_rules import JumpPhase
from legbench.design import LegDesign
from legbench.design.statics import Support
from legbench.errors import ConfigError
from legbench.kinematics import joint_to_modal

EARLY = JumpConfig(delay=0.01, release_time=0.02, touchdown_time=0.005)
RING = [JumpPhase.PUSH, JumpPhase.RELEASE, JumpPhase.FLIGHT, JumpPhase.COMPRESS]


def legs(design: LegDesign | list[LegDesign], config: JumpConfig = EARLY) -> tuple[Pulled, float]:
    """The controller under torque, and the torque of standing (of the first leg)."""
    targets = LegTargets(designs=design, support=Support.FOOT)
    controller = Jump(config, targets)
    rest = load_of_standing(targets, controller.start_motor_pos)
    return Pulled(controller, rest), float(np.ravel(rest)[0])


def test_one_hop_goes_once_round_the_ring(optimal: LegDesign) -> None:
    leg, standing = legs(optimal)
    assert standing < 0.0
    for _ in range(10):
        assert leg.phase(standing) == JumpPhase.REST
    assert leg.phase(standing) == JumpPhase.PUSH
    assert leg.phase(1.6 * standing, 5) == JumpPhase.PUSH
    assert leg.phase(0.21 * standing, 5) == JumpPhase.PUSH
    assert leg.phase(0.19 * standing) == JumpPhase.RELEASE
    for _ in range(20):
        assert leg.phase(2.0 * standing) == JumpPhase.RELEASE or leg.phase(0.0) == JumpPhase.FLIGHT
    assert leg.phase(0.0, 20) == JumpPhase.FLIGHT
    assert leg.phase(0.74 * standing, 10) == JumpPhase.FLIGHT
    assert leg.phase(0.76 * standing, 4) == JumpPhase.FLIGHT
    assert leg.phase(0.74 * standing) == JumpPhase.FLIGHT
    assert leg.phase(0.76 * standing, 4) == JumpPhase.FLIGHT
    assert leg.phase(0.76 * standing) == JumpPhase.COMPRESS
    assert leg.phase(1.0 * standing) == JumpPhase.COMPRESS
    assert leg.phase(2.5 * standing, 3) == JumpPhase.COMPRESS
    turn = EARLY.apex_turn * optimal.stiffness[0]
    assert leg.phase(2.5 * standing + 0.9 * turn, 3) == JumpPhase.COMPRESS
    assert leg.phase(2.5 * standing + 1.1 * turn) == JumpPhase.PUSH


def test_a_push_that_does_not_lift_the_leg_ends_at_the_upper_apex(optimal: LegDesign) -> None:
    leg, standing = legs(optimal)
    leg.pull(standing, 11)
    turn = EARLY.apex_turn * optimal.stiffness[0]
    assert leg.phase(0.6 * standing, 3) == JumpPhase.PUSH
    assert leg.phase(0.6 * standing - 0.9 * turn, 3) == JumpPhase.PUSH
    assert leg.phase(0.6 * standing - 1.1 * turn) == JumpPhase.RELEASE


def test_a_release_is_not_touched_down_at_once(optimal: LegDesign) -> None:
    """Lift-off leaves the load falling through the threshold of touchdown: that is no ground."""
    leg, standing = legs(optimal)
    leg.pull(standing, 11)
    assert leg.phase(0.1 * standing) == JumpPhase.RELEASE
    phases = [leg.phase(1.5 * standing) for _ in range(26)]
    assert phases == [JumpPhase.RELEASE] * 19 + [JumpPhase.FLIGHT] * 5 + [JumpPhase.COMPRESS] * 2


@pytest.mark.parametrize("period_ms", [20, 60, 90])
def test_vibration_in_the_air_is_no_ground_however_large(
    optimal: LegDesign, period_ms: int
) -> None:
    """It loads the springs for half a period at a time, the ground for longer."""
    leg, standing = legs(optimal, JumpConfig(delay=0.01))
    leg.pull(standing, 11)
    assert leg.phase(0.1 * standing) == JumpPhase.RELEASE
    turns = 2.0 * np.pi / period_ms * np.arange(1000)
    swings = [leg.phase(5.0 * standing * float(np.sin(turn))) for turn in turns]
    assert set(swings[30:]) == {JumpPhase.FLIGHT}
    leg.pull(0.0)
    assert leg.phase(0.76 * standing, 49) == JumpPhase.FLIGHT
    assert leg.phase(0.76 * standing) == JumpPhase.COMPRESS


def test_only_the_push_stretches_the_leg(optimal: LegDesign) -> None:
    leg, standing = legs(optimal)
    rng = np.random.default_rng(5)
    support = LegTargets(designs=optimal, support=Support.FOOT)
    levels: dict[int, set[tuple[float, ...]]] = {}
    for torque in standing * (1.0 + np.sin(0.05 * np.arange(1000)) + 0.1 * rng.normal(size=1000)):
        command = leg.pull(float(torque))
        levels.setdefault(int(command.phase), set()).add(tuple(command.motor_pos.tolist()))
    assert set(levels) == {JumpPhase.REST, *RING}
    for phase, commanded in levels.items():
        (motor_pos,) = commanded
        z2 = joint_to_modal(support.link_at_rest(np.array(motor_pos)))[1]
        expected = EARLY.z2 - EARLY.dz2 if phase == JumpPhase.PUSH else EARLY.z2 + EARLY.dz2
        assert z2 == pytest.approx(expected, abs=1e-9)


def test_phases_follow_each_other_round_the_ring_whatever_comes(
    optimal: LegDesign, prototype: LegDesign
) -> None:
    """And a batch is its legs: equal phases and commands, bit by bit."""
    designs = [optimal, prototype, replace(optimal, stiffness=(3.4, 3.0)), prototype]
    targets = LegTargets(designs=designs, support=Support.FOOT)
    controller = Jump(EARLY, targets)
    rest = load_of_standing(targets, controller.start_motor_pos)
    batch = Pulled(controller, rest)
    alone = [legs(design)[0] for design in designs]
    rng = np.random.default_rng(6)
    walk = np.cumsum(rng.normal(scale=0.06, size=(3000, 4)), axis=0)
    loads = rest * (1.0 + np.sin(0.03 * np.arange(3000))[:, np.newaxis] + walk)
    turned = np.zeros(4)
    before = np.full(4, JumpPhase.REST)
    for load in loads:
        together = batch.pull(load)
        for row, leg in enumerate(alone):
            command = leg.pull(float(load[row]))
            assert command.phase == together.phase[row]
            assert np.array_equal(command.motor_pos, together.motor_pos[row])
        for row in np.flatnonzero(together.phase != before):
            if before[row] == JumpPhase.REST:
                assert together.phase[row] == JumpPhase.PUSH
            else:
                place = RING.index(JumpPhase(int(before[row])))
                assert together.phase[row] == RING[(place + 1) % 4]
            turned[row] += 1
        before = together.phase
    assert np.all(turned > 20)


def test_a_reset_forgets_everything(optimal: LegDesign) -> None:
    targets = LegTargets(designs=optimal, support=Support.FOOT)
    controller = Jump(EARLY, targets)
    rest = load_of_standing(targets, controller.start_motor_pos)
    rng = np.random.default_rng(7)
    waves = np.sin(0.05 * np.arange(600)) + rng.normal(scale=0.01, size=600)
    trace = float(rest) * (1.0 + waves)
    runs = []
    for _ in range(2):
        leg = Pulled(controller, rest)
        runs.append([leg.phase(float(torque)) for torque in trace])
    assert runs[0] == runs[1]
    assert set(runs[0]) == {JumpPhase.REST, *RING}


@pytest.mark.parametrize("support", [Support.NONE, Support.TRUNK])
def test_a_leg_that_does_not_stand_cannot_jump(optimal: LegDesign, support: Support) -> None:
    with pytest.raises(ConfigError, match="jumping needs setup 'jump' or 'ffs'"):
        Jump(JumpConfig(), LegTargets(designs=optimal, support=support))


def test_a_leg_that_hangs_at_reset_cannot_jump(optimal: LegDesign) -> None:
    with pytest.raises(ConfigError, match="does not load its springs at rest"):
        Pulled(Jump(EARLY, LegTargets(designs=optimal, support=Support.FOOT)), 0.1)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"dz2": 0.0}, r"dz2 is 0 rad; a push needs a positive amplitude"),
        ({"dz2": np.nan}, r"dz2 is nan rad"),
        ({"touchdown_load": 0.1}, r"release_load 0\.2 and touchdown_load 0\.1 must satisfy 0 <"),
        ({"touchdown_load": 1.0}, r"release < touchdown < 1"),
        ({"release_load": 0.0}, r"release_load 0 and"),
        ({"release_load": np.nan}, r"release_load nan"),
        ({"apex_turn": 0.0}, r"apex_turn is 0 rad; it must be positive"),
        ({"apex_turn": np.nan}, r"apex_turn is nan rad"),
        ({"release_time": -1.0}, r"release_time is -1 s; it must be 0 or more"),
        ({"release_time": np.nan}, r"release_time is nan s"),
        ({"touchdown_time": -1.0}, r"touchdown_time is -1 s; it must be 0 or more"),
        ({"touchdown_time": np.inf}, r"touchdown_time is inf s"),
        ({"z2": 0.3}, r"set point z2 - dz2 = 0\.15 rad \(link\) puts the knee at 0\.212 rad"),
        ({"z2": 2.0}, r"set point z2 \+ dz2 = 2\.15 rad"),
    ],
)
def test_settings_that_make_no_sense(
    optimal: LegDesign, change: dict[str, float], message: str
) -> None:
    with pytest.raises(ConfigError, match=message):
        Jump(JumpConfig(**change), LegTargets(designs=optimal, support=Support.FOOT))
