"""What imperfections do to a leg, against laws and equations that know nothing of the plants."""

from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from plants import OPTIMAL, PROTOTYPE
from scipy.optimize import minimize

from legbench.control import ControllerSettings, JumpConfig, PositionJumpConfig
from legbench.design import LegDesign
from legbench.design.setup import Setup, SetupKind
from legbench.design.statics import GRAVITY
from legbench.encoders import BLOCK, EncoderErrors
from legbench.errors import ConfigError
from legbench.experiment import Experiment
from legbench.experiment.running import record_in_memory
from legbench.imperfections import Imperfections
from legbench.kinematics import leg_points
from legbench.metrics.energy import energy_flows, energy_residual
from legbench.mjcf import Linkage, LinkageKind
from legbench.plant.landing import End
from legbench.plants import AnalyticChoice, CanChoice, PlantSettings, SimChoice
from legbench.recording.reader import Recording
from legbench.signals import Floats

BUS = Path(__file__).parents[2] / "hardware" / "leg.toml"
EMULATED = CanChoice(interface="legbench", bus=BUS, end=End.STOP)
"""The emulated bench, whose power goes at the last row: a pinned leg would swing for 20 s."""
REDUCED = Linkage(kind=LinkageKind.REDUCED)
STEP = PositionJumpConfig(z2=0.9, dz2=0.15, delay=0.05)
LEG = Imperfections(
    stiffness_error=(0.04, -0.02),
    damping_error=(0.5, 0.2),
    trunk_mass_error=0.05,
    mass_error=(0.1, -0.05, 0.2),
    com_error=(0.003, 0.002, 0.004),
    inertia_error=(0.1, 0.2, -0.1),
)
FRICTION = Imperfections(coulomb_friction=(0.010, 0.006))
GUIDE = Imperfections(guide_damping=(1.0, 0.5))
BACKLASH = Imperfections(backlash=(0.010, 0.020))
ZEROS = Imperfections(link_zero=(0.020, -0.010), motor_zero=(0.020, 0.010))
NOISE = Imperfections(link_noise=(1e-3, 2e-3), motor_noise=(1e-3, 5e-4))
MOTORS = Imperfections(
    motor_slew_rate=(5.0, 9.0),
    motor_delay_cycles=(2, 0),
    motor_range=((-1.0, -0.75), (0.0, 2.0)),
)
ALL = {
    "leg": LEG,
    "friction": FRICTION,
    "guide": GUIDE,
    "backlash": BACKLASH,
    "zeros": ZEROS,
    "noise": NOISE,
    "motors": MOTORS,
}
FFS, HFTS = SetupKind.FFS, SetupKind.HFTS


def ran(
    imperfections: Imperfections,
    plant: PlantSettings | None = None,
    *,
    kind: SetupKind = FFS,
    design: LegDesign = PROTOTYPE,
    controller: ControllerSettings = STEP,
    duration: float = 0.4,
    linkage: Linkage = REDUCED,
    seed: int = 0,
) -> Recording:
    experiment = Experiment(
        design=design,
        controller=controller,
        setup=Setup(kind=kind),
        plant=plant or SimChoice(),
        imperfections=imperfections,
        duration=duration,
        linkage=linkage,
        seed=seed,
    )
    return record_in_memory(experiment)


@cache
def perfect(kind: SetupKind) -> Recording:
    """The leg without any of them."""
    return ran(Imperfections(), kind=kind)


@pytest.mark.parametrize("kind", [FFS, HFTS])
@pytest.mark.parametrize("name", ALL)
def test_simulation_and_equations_agree(name: str, kind: SetupKind) -> None:
    """To the softness of dry friction, which sticks by creeping, else to that of the numerics."""
    if name == "guide" and kind is not FFS:
        return
    simulated, computed = ran(ALL[name], kind=kind), ran(ALL[name], AnalyticChoice(), kind=kind)
    assert simulated.complete
    assert computed.complete
    bound = 5e-4 if name == "friction" else 2e-5
    for signal in ("joint_pos", "motor_pos"):
        assert np.max(np.abs(simulated[signal] - computed[signal])) < bound, signal
    assert np.max(np.ptp(simulated["joint_pos"], axis=0)) > 0.15
    assert np.max(np.abs(simulated["joint_pos"] - perfect(kind)["joint_pos"])) > 1e-3


def test_a_pinned_foot_feels_the_damped_guide() -> None:
    """A solver tells the force of its last step, which ends before the row: hence the margin."""
    guide = Imperfections(guide_damping=(8.0, 4.0))
    simulated, computed = ran(guide), ran(guide, AnalyticChoice())
    apart = np.abs(simulated["contact_force"] - computed["contact_force"])[1:]
    assert np.all(apart < 0.5 * np.abs(np.diff(computed["contact_force"], axis=0)) + 1e-3)
    carried = 4.0 * np.abs(computed["trunk_vel"][1:, 1])
    assert np.max(carried) > 100.0 * np.median(apart[:, 1])


@pytest.mark.parametrize("name", [name for name in ALL if name != "noise"])
def test_energy_is_accounted_for(name: str) -> None:
    """Work of the motors, less what dampers, dry friction and the guide take."""
    run = ran(ALL[name], duration=0.8)
    flows = energy_flows(run)
    assert energy_residual(run, flows) < 2e-5
    if name in ("friction", "guide"):
        perfect = energy_flows(ran(Imperfections(), duration=0.8))
        assert np.sum(flows.damper_loss) > 1.3 * np.sum(perfect.damper_loss)


def test_noise_hides_the_energy_instead_of_inventing_a_loss() -> None:
    run = ran(NOISE)
    assert np.isnan(energy_residual(run, energy_flows(run)))


def test_dry_friction_takes_the_same_from_every_swing() -> None:
    """Between two turns of a joint a spring loses `f (A1 + A2) = k (A1^2 - A2^2) / 2`, whatever
    the inertia does: each swing is shorter than the last by `2 f / k`.
    """
    friction = 0.01
    design = replace(OPTIMAL, damping=(0.0, 0.0))
    run = ran(
        Imperfections(coulomb_friction=(friction, friction)),
        kind=HFTS,
        design=design,
        controller=PositionJumpConfig(z2=0.9, dz2=0.15, delay=0.0),
        duration=0.8,
    )
    angle = run["joint_pos"][:, 1] - run["motor_pos"][:, 1]
    turns = np.flatnonzero(np.diff(np.sign(np.diff(angle))))
    # A row may miss the turn by half a millisecond: a parabola through three rows finds it.
    sizes = np.array([peak(angle[turn : turn + 3]) for turn in turns])
    assert len(sizes) >= 6
    # The first turn is the step of the motors.
    assert -np.diff(sizes[1:]) == pytest.approx(2.0 * friction / design.stiffness[1], rel=1e-3)


def peak(three: Floats) -> float:
    """Size of the extreme of a parabola through three equidistant values."""
    before, middle, after = np.abs(three)
    bend = before - 2.0 * middle + after
    return float(middle - (after - before) ** 2 / (8.0 * bend))


def lowest(design: LegDesign, shaft: Floats) -> Floats:
    """Link angles of least energy on a pinned foot, heights counted body by body."""
    thigh, shank, foot = design.segments

    def energy(q: Floats) -> float:
        hip, knee, ankle, tip = leg_points(q, design.lengths)[:, 1]
        heights = (
            (design.trunk_mass, hip),
            (thigh.mass, hip + (knee - hip) * thigh.com / thigh.length),
            (shank.mass, knee + (ankle - knee) * shank.com / shank.length),
            (foot.mass, ankle + (tip - ankle) * foot.com / foot.length),
        )
        weight = GRAVITY * sum(mass * (height - tip) for mass, height in heights)
        return weight + 0.5 * float(np.asarray(design.stiffness) @ np.square(shaft - q))

    found = minimize(energy, shaft, method="Nelder-Mead", options={"xatol": 1e-9, "fatol": 1e-15})
    return found.x


@pytest.mark.parametrize("plant", [SimChoice(), AnalyticChoice()])
@pytest.mark.parametrize("imperfections", [LEG, ZEROS], ids=["leg", "zeros"])
def test_a_leg_begins_where_it_rests_and_stays(
    imperfections: Imperfections, plant: PlantSettings
) -> None:
    """The posture of least energy of the leg as it was built, the springs read as designed."""
    calm = PositionJumpConfig(z2=0.9, dz2=0.15, delay=1.0)
    run = ran(imperfections, plant, controller=calm, duration=0.2)
    motor, link = run["motor_pos"], run["joint_pos"]
    zero = np.asarray(imperfections.link_zero or (0.0, 0.0))
    shaft = motor[0] + np.asarray(imperfections.motor_zero or (0.0, 0.0))
    assert link[0] - zero == pytest.approx(lowest(imperfections.leg_of(PROTOTYPE), shaft), abs=1e-6)
    assert np.max(np.abs(link - link[0])) < 1e-6
    read = np.asarray(PROTOTYPE.stiffness) * (motor - link)
    assert run["spring_torque"] == pytest.approx(read, abs=1e-15)


def test_a_spring_within_its_play_carries_nothing() -> None:
    """Without gravity the leg drifts through the play before its spring turns it back."""
    run = ran(
        Imperfections(backlash=(0.04, 0.04)),
        kind=HFTS,
        design=replace(OPTIMAL, damping=(0.0, 0.0)),
        controller=PositionJumpConfig(z2=0.9, dz2=0.15, delay=0.0),
        duration=0.6,
    )
    stretch = (run["motor_pos"] - run["joint_pos"])[2:]
    within = np.abs(stretch) < 0.015
    kinetic = run["energy"][2:, 1]
    both = np.logical_and.reduce(within, axis=1)
    runs = np.split(np.arange(len(both)), np.flatnonzero(np.diff(both)) + 1)
    slack = [rows for rows in runs if both[rows[0]] and len(rows) > 1]
    assert len(slack) >= 3
    for rows in slack:
        assert np.ptp(kinetic[rows]) < 5e-6 * kinetic.max()
    # The swing is as wide as the way through the play is, and turns where it began.
    assert np.max(np.abs(stretch)) == pytest.approx(np.max(np.abs(stretch[:, ::-1])), rel=1e-6)


def test_what_the_controller_believes_is_the_design() -> None:
    commands = [ran(each)["command_pos"] for each in (Imperfections(), LEG, ZEROS)]
    assert np.array_equal(commands[0], commands[1])
    assert np.array_equal(commands[0], commands[2])


def test_noise_comes_from_the_seed_alone() -> None:
    """Whatever else differs, the same noise; another seed, another noise."""

    def noise(imperfections: Imperfections, seed: int, z2: float = 0.9) -> Floats:
        controller = PositionJumpConfig(z2=z2, dz2=0.1, delay=1.0)
        run = ran(imperfections, controller=controller, duration=0.3, seed=seed)
        # At rest everything that moves is noise.
        return run["joint_pos"] - run["joint_pos"][:1]

    links = Imperfections(link_noise=(1e-3, 1e-3))
    first = noise(links, 4)
    assert first == pytest.approx(noise(links, 4, z2=0.7), abs=1e-7)
    both = replace(links, motor_noise=(1e-3, 1e-3), coulomb_friction=(0.01, 0.01))
    assert first == pytest.approx(noise(both, 4), abs=1e-7)
    assert np.max(np.abs(first - noise(links, 5))) > 1e-3


def test_noise_has_its_size_and_no_memory() -> None:
    errors = EncoderErrors(NOISE, 3)
    rows = []
    for _ in range(20 * BLOCK):
        errors.advance()
        rows.append([*errors.motor, *errors.link])
    drawn = np.array(rows)
    wanted = [1e-3, 5e-4, 1e-3, 2e-3]
    assert np.std(drawn, axis=0) == pytest.approx(wanted, rel=0.05)
    correlation = np.corrcoef(np.column_stack([drawn[1:], drawn[:-1]]), rowvar=False)
    assert np.max(np.abs(correlation - np.eye(8))) < 0.06
    errors.reset()
    errors.advance()
    assert np.array_equal([*errors.motor, *errors.link], drawn[0])


def test_rows_of_a_batch_have_the_noise_of_single_legs() -> None:
    quiet = Imperfections(link_zero=(0.01, 0.02))
    batch = EncoderErrors([NOISE, quiet, NOISE], [3, 4, 9])
    alone = [EncoderErrors(NOISE, 3), EncoderErrors(quiet, 4), EncoderErrors(NOISE, 9)]
    for _ in range(BLOCK + 5):
        for each in (batch, *alone):
            each.advance()
        for row, one in enumerate(alone):
            assert np.array_equal(batch.motor[row], one.motor)
            assert np.array_equal(batch.link[row], one.link)


@pytest.mark.parametrize(
    "name",
    ["leg"]
    + [
        pytest.param(name, marks=pytest.mark.long)
        for name in ("friction", "guide", "backlash", "zeros", "noise")
    ],
)
def test_an_emulated_leg_has_them_too(name: str) -> None:
    """To the two cycles that a bus takes, and the counts of its encoders."""
    step = PositionJumpConfig(z2=0.9, dz2=0.05, delay=0.05)
    bars = Linkage()
    simulated = ran(ALL[name], controller=step, linkage=bars)
    emulated = ran(ALL[name], EMULATED, controller=step, linkage=bars)
    assert emulated.complete
    bound = 0.02 if name == "noise" else 1.5e-3
    assert np.max(np.abs(simulated["joint_pos"] - emulated["joint_pos"])) < bound
    perfect = ran(Imperfections(), controller=step, linkage=bars)
    assert np.max(np.abs(perfect["joint_pos"] - emulated["joint_pos"])) > 2e-3
    if name == "noise":
        for signal, sizes in (("motor_pos", (1e-3, 5e-4)), ("joint_pos", (1e-3, 2e-3))):
            shown = np.std(emulated[signal][5:45], axis=0)
            assert shown == pytest.approx(sizes, rel=0.4), signal


def test_emulated_motors_are_slow_and_late_each_for_itself() -> None:
    """The bus itself takes a cycle, and the ramp between two targets another."""
    motors = Imperfections(motor_slew_rate=(20.0, 9.0), motor_delay_cycles=(3, 0))
    step = PositionJumpConfig(z2=0.9, dz2=0.05, delay=0.05)
    shown = [
        ran(each, EMULATED, controller=step, duration=0.2) for each in (Imperfections(), motors)
    ]
    ideal, slow = (run["motor_pos"] for run in shown)
    first = [
        [int(np.flatnonzero(np.diff(run[:, axis]))[0]) for axis in (0, 1)] for run in (ideal, slow)
    ]
    assert first[1][0] - first[0][0] == 3
    assert first[1][1] == first[0][1]
    speed = np.max(np.abs(np.diff(slow, axis=0)), axis=0) / 1e-3
    assert speed[1] == pytest.approx(9.0, rel=0.01)
    assert speed[0] <= 20.2


def test_a_motor_that_ends_at_its_range_ends_a_run_on_the_bench() -> None:
    """As on the real one: the watch over the encoders takes it for jammed."""
    stuck = Imperfections(motor_range=((-2.0, -0.37), (-2.0, 2.0)))
    step = PositionJumpConfig(z2=0.9, dz2=0.05, delay=0.05)
    run = ran(stuck, EMULATED, controller=step)
    assert not run.complete


def test_the_bench_has_its_own_imperfections() -> None:
    with pytest.raises(ConfigError, match="the leg on the bench has its own"):
        ran(ZEROS, CanChoice(interface="socketcan", channel="can0", bus=BUS))


def test_a_jump_needs_no_guide() -> None:
    with pytest.raises(ConfigError, match="setup jump has no guide, only ffs has"):
        ran(GUIDE, kind=SetupKind.JUMP, controller=JumpConfig())


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"backlash": (-0.1, 0.0)}, r"backlash is \(-0.1, 0.0\) rad; it must be 0 or more"),
        ({"mass_error": (0.0, -1.0, 0.0)}, "more than -1 leaves something of it"),
        ({"link_zero": (float("nan"), 0.0)}, "it must be finite"),
        ({"motor_slew_rate": (0.0, 1.0)}, "rad/s; it must be positive"),
        ({"motor_delay_cycles": (0, 2000)}, "it must be 0 to 1000"),
        ({"motor_range": ((0.0, 1.0), (1.0, 1.0))}, "low must be below high"),
    ],
)
def test_what_no_leg_can_have(given: dict[str, Any], message: str) -> None:
    with pytest.raises(ConfigError, match=message):
        Imperfections(**given)


def test_errors_that_leave_no_leg() -> None:
    with pytest.raises(ConfigError, match="imperfections leave no leg of 'prototype': com is"):
        ran(Imperfections(com_error=(-0.5, 0.0, 0.0)))
