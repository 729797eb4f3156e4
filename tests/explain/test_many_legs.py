"""Many legs rated at once against runs of the analytic plant, one by one."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from legbench.control import BangBangConfig, ControllerSettings, PositionJumpConfig
from legbench.design import load_design
from legbench.design.setup import Setup, SetupKind
from legbench.errors import ConfigError
from legbench.experiment import Experiment
from legbench.experiment.run import run
from legbench.imperfections import Imperfections
from legbench.metrics import Analysis
from legbench.phases import Counting
from legbench.plant.start import PERIOD
from legbench.plants import AnalyticChoice
from legbench.servo import PERFECT, Servo

pytest.importorskip("heyoka")

from legbench.explain.engine import Watch, in_setup, rate_many
from legbench.explain.rating import Rows, count_leading, rate_rows
from legbench.explain.rows import measured

PROTOTYPE = load_design(Path(__file__).parents[2] / "models" / "prototype.toml")
STEP = PositionJumpConfig(z2=1.0, dz2=0.3, delay=0.05)
BANG = BangBangConfig(z2=1.24, dz2=0.077, delay=0.05)
FLAWS = {
    "perfect": Imperfections(),
    "springs, segments": Imperfections(
        stiffness_error=(0.04, -0.03),
        damping_error=(0.5, -0.2),
        mass_error=(0.05, -0.05, 0.1),
        com_error=(0.004, 0.0, -0.003),
        inertia_error=(0.3, -0.2, 0.1),
    ),
    "zero errors": Imperfections(link_zero=(0.02, 0.015), motor_zero=(-0.01, 0.02)),
    "friction": Imperfections(coulomb_friction=(0.004, 0.001)),
    "guide": Imperfections(guide_damping=(0.3, 0.4)),
    "backlash": Imperfections(backlash=(0.01, 0.02)),
    "motors": Imperfections(motor_delay_cycles=(0, 4), motor_slew_rate=(12.0, 30.0)),
    "range": Imperfections(motor_range=((-9.0, 9.0), (-9.0, 0.69))),
}


def experiment(setup: SetupKind, controller: ControllerSettings, duration: float) -> Experiment:
    return Experiment(
        design=PROTOTYPE,
        controller=controller,
        setup=Setup(kind=setup),
        plant=AnalyticChoice(),
        duration=duration,
    )


@pytest.mark.parametrize(
    ("setup", "controller", "duration", "flaws"),
    [
        pytest.param(
            *(SetupKind.FFS, STEP, 1.4, ("springs, segments", "friction", "guide", "range")),
            marks=pytest.mark.long,
        ),
        (SetupKind.HFTS, STEP, 0.5, ("perfect", "friction", "backlash", "motors")),
        pytest.param(
            *(SetupKind.VFTS, STEP, 0.5, ("zero errors", "backlash", "motors")),
            marks=pytest.mark.long,
        ),
        (SetupKind.HFTS, BANG, 0.6, ("springs, segments", "friction", "motors")),
        pytest.param(*(SetupKind.FFS, BANG, 1.5, ("zero errors", "guide")), marks=pytest.mark.long),
    ],
)
def test_ratings_are_those_of_the_runs(
    setup: SetupKind, controller: ControllerSettings, duration: float, flaws: tuple[str, ...]
) -> None:
    template = experiment(setup, controller, duration)
    legs = [in_setup(FLAWS[name], setup) for name in flaws]
    shapes = rate_many(template, legs, periods=4)
    for place, leg in enumerate(legs):
        alone = Analysis(run(replace(template, imperfections=leg)))
        rated = alone.ratings.equilibrium.periods[:4]
        count = len(rated)
        assert count >= 1
        assert shapes.counted[place] == min(count, 4)
        # Steps do not end where play is used up, and dry friction is a little softer in them.
        allowed = 2e-4 if leg.coulomb_friction else 1e-4 if leg.backlash else 1e-7
        for found, wanted in (
            (shapes.equilibrium, rated),
            (shapes.motor, alone.ratings.motor.periods[:4]),
            (shapes.amplitude, alone.periods.amplitude[:4]),
        ):
            assert np.allclose(found[place, :count], wanted, rtol=0.0, atol=allowed), leg


def test_a_leg_does_not_depend_on_its_company_and_order() -> None:
    template = experiment(SetupKind.FFS, STEP, 0.9)
    legs = [FLAWS["backlash"], FLAWS["perfect"], FLAWS["friction"], FLAWS["zero errors"]]
    together = rate_many(template, legs, periods=1)
    backwards = rate_many(template, legs[::-1], periods=1)
    assert np.allclose(together.equilibrium, backwards.equilibrium[::-1], rtol=0.0, atol=1e-9)
    assert len(np.unique(together.equilibrium)) == len(legs)


def test_a_leg_at_its_stop_is_followed_by_the_equations_that_know_stops() -> None:
    # The motors stand by so much farther apart that the knee is pressed onto its stop at first.
    template = experiment(SetupKind.HFTS, PositionJumpConfig(z2=1.8, dz2=0.2, delay=0.05), 0.45)
    leg = Imperfections(motor_zero=(-0.06, 0.06))
    shapes = rate_many(template, [leg, FLAWS["perfect"]], periods=2)
    alone = Analysis(run(replace(template, imperfections=leg)))
    knee = np.diff(alone["joint_pos"], axis=1)
    assert knee.max() > PROTOTYPE.limits.knee[1] > knee.min()
    wanted = alone.ratings.equilibrium.periods[:2]
    assert np.allclose(shapes.equilibrium[0], wanted, rtol=0.0, atol=1e-4)


def test_a_leg_that_its_springs_do_not_hold_has_no_ratings_and_harms_no_other() -> None:
    template = experiment(SetupKind.FFS, STEP, 0.9)
    soft = Imperfections(stiffness_error=(-0.7, -0.7))
    shapes = rate_many(template, [FLAWS["perfect"], soft, FLAWS["backlash"]], periods=1)
    assert shapes.broken.tolist() == [False, True, False]
    assert np.isfinite(shapes.equilibrium[:, 0]).tolist() == [True, False, True]


def test_a_leg_that_runs_away_is_broken_and_harms_no_other() -> None:
    template = experiment(SetupKind.FFS, STEP, 0.4)
    servo = Servo(template.servo, PERIOD, [PERFECT] * 3)
    swing = 0.3 * np.cos(20.0 * np.arange(350) * PERIOD)
    joint_pos = np.repeat(np.stack([-0.7 - swing, 0.7 + swing], axis=-1)[np.newaxis], 3, axis=0)
    joint_vel = np.gradient(joint_pos, PERIOD, axis=1)
    joint_pos[1, 200:] = [-np.inf, np.nan]
    joint_pos[2, 300] = [0.2, 0.2]
    motor_pos = np.tile([-0.45, 0.45], (3, 350, 1))
    rows = measured(template, [PERFECT] * 3, servo, joint_pos, joint_vel, motor_pos)
    shapes = rate_rows(rows, 1, Counting())
    assert shapes.broken.tolist() == [False, True, True]
    assert np.isfinite(shapes.equilibrium[:, 0]).tolist() == [True, False, False]


def test_who_stops_gets_what_there_is() -> None:
    done: list[int] = []
    template = experiment(SetupKind.HFTS, STEP, 0.4)
    watch = Watch(advance=done.append, stopped=lambda: bool(done))
    legs = [FLAWS["perfect"], FLAWS["friction"], FLAWS["backlash"]]
    shapes = rate_many(template, legs, periods=2, watch=watch)
    assert sum(done) == np.isfinite(shapes.equilibrium[:, 0]).sum() == 1


def test_what_the_equations_do_not_know_is_refused() -> None:
    template = experiment(SetupKind.FFS, STEP, 0.4)
    with pytest.raises(ConfigError, match="no leg to rate"):
        rate_many(template, [], periods=1)
    with pytest.raises(ConfigError, match="encoder noise is not rated"):
        rate_many(template, [Imperfections(link_noise=(0.001, 0.001))], periods=1)
    boom = replace(template, setup=Setup(kind=SetupKind.FFS, boom_radius=1.5))
    with pytest.raises(ConfigError, match="setup ffs with a boom is not for many legs at once"):
        rate_many(boom, [Imperfections()], periods=1)


def test_periods_of_rows_end_where_the_paper_stops_counting() -> None:
    time = np.arange(2000) * 0.001
    swing = np.exp(-1.2 * time) * np.cos(2.0 * np.pi * 4.0 * time)
    radial = np.stack([swing, 0.0 * swing])
    deflection = np.stack([-radial, radial], axis=-1)
    rows = Rows(
        radial=radial,
        radial_rate=np.gradient(radial, time, axis=1),
        about_equilibrium=deflection,
        about_motor=deflection + 1e-12,
        broken=np.array([False, False]),
    )
    shapes = rate_rows(rows, 6, Counting(smallest=0.3))
    assert np.allclose(shapes.equilibrium[0], 1.0)
    assert np.isnan(shapes.equilibrium[1]).all()
    # It moves from the first row on, so that the first period begins at the first crest after it;
    # a crest is exp(-1.2 / 4) of the one before, and the trough between them exp(-1.2 / 8).
    wanted = np.exp(-0.3 * np.arange(1, 7)) * 0.5 * (1.0 + np.exp(-0.15))
    assert np.allclose(shapes.amplitude[0], wanted, rtol=0.02)
    assert shapes.counted.tolist() == [int((wanted > 0.3).sum()), 0]


def test_counting_ends_at_the_first_small_period_and_at_the_most() -> None:
    amplitude = np.array([[0.3, 0.05, 0.4], [0.3, 0.2, 0.11], [np.nan, 0.3, 0.3]])
    assert count_leading(amplitude, Counting(smallest=0.1)).tolist() == [1, 3, 0]
    assert count_leading(amplitude, Counting(most=2)).tolist() == [2, 2, 0]
