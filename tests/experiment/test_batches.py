"""Experiments side by side: each to the bit as alone, in whatever company."""

from dataclasses import replace
from typing import Any

import pytest
from experiments import GUESTS, LIMITS, PROTOTYPE

from legbench.control import (
    BangBangConfig,
    ControllerSettings,
    JumpConfig,
    PositionJumpConfig,
    SetpointMeaning,
)
from legbench.design.setup import Setup, SetupKind
from legbench.errors import ConfigError
from legbench.experiment import Conventions, Experiment, run_batch
from legbench.experiment.running import record_in_memory
from legbench.guests import module_of_file
from legbench.imperfections import Imperfections
from legbench.mjcf import Linkage, LinkageKind
from legbench.plants import AnalyticChoice, SimChoice
from legbench.recording.reader import Recording
from legbench.servo import ServoConfig

REDUCED = Linkage(kind=LinkageKind.REDUCED)
JUMP, FFS = Setup(kind=SetupKind.JUMP), Setup(kind=SetupKind.FFS)


def chosen(controller: ControllerSettings, setup: Setup = FFS, **more: Any) -> Experiment:
    given: dict[str, Any] = {"linkage": REDUCED, "duration": 0.25} | more
    return Experiment(design=PROTOTYPE, controller=controller, setup=setup, **given)


def flawed(place: int) -> Imperfections:
    kinds = (
        Imperfections(),
        Imperfections(stiffness_error=(0.04, -0.02), mass_error=(0.1, 0.0, 0.1)),
        Imperfections(coulomb_friction=(0.01, 0.006), backlash=(0.01, 0.02)),
        Imperfections(link_zero=(0.02, 0.0), link_noise=(1e-3, 1e-3), motor_zero=(0.0, 0.01)),
        Imperfections(motor_slew_rate=(9.0, 30.0), motor_delay_cycles=(2, 0)),
        Imperfections(motor_range=((-0.6, 1.0), (-1.0, 0.6)), com_error=(0.002, 0.001, 0.0)),
    )
    return kinds[place % len(kinds)]


def all_different(count: int = 16) -> list[Experiment]:
    """Set points, amplitudes, thresholds, times, servo, offsets, noise: each leg its own."""
    found = []
    for place in range(count):
        more = {
            "imperfections": flawed(place),
            "seed": place,
            "servo": (ServoConfig(), ServoConfig(slew_rate=20.0, encoder_counts=8192))[place % 2],
            "duration": 0.2 + 0.01 * (place % 3),
        }
        z2, dz2, delay = 0.7 + 0.02 * place, 0.06 + 0.005 * place, 0.02 * (place % 3)
        step = PositionJumpConfig(z2=z2, dz2=dz2, delay=delay)
        threshold = 0.02 + 0.002 * place
        swing = BangBangConfig(
            z2=z2,
            dz2=dz2,
            delay=delay,
            threshold=threshold,
            three_levels=place % 5 == 0,
        )
        hop = JumpConfig(
            z2=0.42 + 0.005 * place, delay=0.02 * (1 + place % 3), apex_turn=0.008 + 0.001 * place
        )
        kind = place % 3
        found.append(chosen((step, swing, hop)[kind], (FFS, FFS, JUMP)[kind], **more))
    return found


def same(first: Recording, second: Recording) -> None:
    assert first.columns.keys() == second.columns.keys()
    for name in first.columns.keys() - {"cycle_us", "late_us"}:
        assert first.columns[name].tobytes() == second.columns[name].tobytes(), name
    for key in ("status", "cause", "rows", "duration", "experiment", "controller", "initial_state"):
        assert first.manifest.get(key) == second.manifest.get(key), key


@pytest.mark.parametrize("controllers", ["mixed", "step", "swing", "hop"])
def test_every_leg_is_as_alone(controllers: str) -> None:
    legs = all_different(9)
    if controllers != "mixed":
        kind = ("step", "swing", "hop").index(controllers)
        legs = [leg for place, leg in enumerate(all_different(12)) if place % 3 == kind]
    for leg, together in zip(legs, run_batch(legs, threads=2), strict=True):
        same(record_in_memory(leg), together)


@pytest.mark.long
def test_company_and_threads_change_nothing() -> None:
    legs = all_different(12)
    whole = run_batch(legs, threads=1)
    for again in (run_batch(legs, threads=2), run_batch(legs[::-1])[::-1]):
        for first, second in zip(whole, again, strict=True):
            same(first, second)
    for first, second in zip(whole[:7], run_batch(legs[:7]), strict=True):
        same(first, second)
    (alone,) = run_batch(legs[5:6])
    same(whole[5], alone)


def test_a_leg_that_faults_ends_alone() -> None:
    """A push that is far too strong straightens the leg through its stop."""
    wild = replace(
        PROTOTYPE,
        limits=replace(PROTOTYPE.limits, knee=(0.02, 3.1)),
        damping=(0.0, 0.0),
    )
    hard = [
        chosen(
            PositionJumpConfig(z2=0.08, dz2=1.3, delay=0.02),
            Setup(kind=SetupKind.HFTS),
            duration=0.4,
        )
    ]
    hard = [replace(each, design=wild) for each in hard]
    calm = [
        chosen(
            PositionJumpConfig(z2=0.8 + 0.05 * place, dz2=0.1),
            Setup(kind=SetupKind.HFTS),
            duration=0.4,
        )
        for place in range(3)
    ]
    together = run_batch([calm[0], *hard, *calm[1:]])
    alone = record_in_memory(hard[0])
    assert alone.manifest["status"] == "fault"
    assert alone.description.cause == "leg straightened through"
    assert 20 < len(alone.time) < 400
    same(alone, together[1])
    assert together[1].events == alone.events
    without = run_batch(calm)
    for first, second in zip([together[0], *together[2:]], without, strict=True):
        assert first.complete
        same(first, second)


WAYS = ("none", "raise", "write", "nothing", "nan", "shape", "phase", "signals")


def test_a_law_that_fails_ends_its_own_leg_alone() -> None:
    """Same cause, same message, same rows as alone; the others go on to the bit."""
    wrong = module_of_file(GUESTS / "wrong.py").Wrong
    legs = [chosen(wrong(way=way), duration=0.06) for way in WAYS]
    alone = [record_in_memory(leg) for leg in legs]
    for first, second in zip(alone, run_batch(legs), strict=True):
        same(first, second)
        assert first.events == second.events
    assert [len(run.time) for run in alone] == [60, *[19] * (len(WAYS) - 1)]
    assert {run.description.cause for run in alone[1:]} == {"controller failed"}
    (last,) = run_batch(legs[1:2])
    same(alone[1], last)


def test_a_jumper_that_does_not_stand_ends_alone() -> None:
    """Zero errors of its encoders make one leg look as if it hung from its springs."""
    hop = JumpConfig(z2=0.45, delay=0.02)
    legs = [
        chosen(hop, JUMP, imperfections=Imperfections(link_zero=(zero, -zero)), duration=0.1)
        for zero in (0.0, 0.3, 0.001)
    ]
    alone = [record_in_memory(leg) for leg in legs]
    together = run_batch(legs)
    for first, second in zip(alone, together, strict=True):
        same(first, second)
    assert [len(run.time) for run in together] == [100, 0, 100]
    assert together[1].description.cause == "controller failed"
    assert "the leg does not load its springs at rest" in together[1].events[-1]["message"]


def test_a_set_point_that_one_leg_refuses_is_named() -> None:
    legs = [chosen(PositionJumpConfig(z2=z2, dz2=0.1)) for z2 in (0.8, 2.2, 0.9)]
    with pytest.raises(ConfigError, match=r"set point z2 \+ dz2 = 2\.3 rad"):
        run_batch(legs)


def test_motor_set_points_are_solved_together() -> None:
    reading = Conventions(setpoint=SetpointMeaning.MOTOR)
    legs = [
        chosen(PositionJumpConfig(z2=z2, dz2=0.05), conventions=reading, duration=0.05)
        for z2 in (0.4, 0.5, 0.6)
    ]
    for leg, together in zip(legs, run_batch(legs), strict=True):
        same(record_in_memory(leg), together)


@pytest.mark.parametrize(
    ("plant", "message"),
    [
        (AnalyticChoice(), "experiment 1 of the batch is on plant 'analytic'; a batch runs on"),
        (SimChoice(limits=LIMITS), "on plant 'sim' under limits; a batch runs on plant 'sim' wi"),
    ],
)
def test_what_no_batch_can_run(plant: Any, message: str) -> None:
    legs = [chosen(PositionJumpConfig())] * 2
    with pytest.raises(ConfigError, match=message):
        run_batch([legs[0], replace(legs[1], plant=plant)])
