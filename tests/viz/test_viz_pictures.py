"""Pictures say what they show: axes, keys, scales and legends."""

from itertools import pairwise
from types import SimpleNamespace
from typing import Any

import mujoco
import numpy as np
import pytest
from viz_runs import PROTOTYPE, part

from legbench.campaign.curves import Cell, RatingCurve
from legbench.kinematics import leg_points
from legbench.metrics.analysis import Analysis
from legbench.recording.reader import Recording
from legbench.signals import Bools
from legbench.viz import style
from legbench.viz.facts import facts_of
from legbench.viz.film.labels import labelled, scale_length_mm
from legbench.viz.film.render import stills_span
from legbench.viz.force_axis import force_axis
from legbench.viz.live.key import log_key, period_key, phase_key, stance_key
from legbench.viz.print.bars import CRANK, draw_bars
from legbench.viz.print.figures import phase_figure
from legbench.viz.print.legend import UNRATED
from legbench.viz.print.ratings import PrintedRating, RatingPanel, ratings_figure
from legbench.viz.run_model import model_of


def test_the_force_of_stance_fills_the_axis_whatever_impacts_reach() -> None:
    stance = np.tile(np.arange(500) < 250, 4)
    up = np.where(stance, 15.0 + np.sin(np.arange(2000)), 0.0)
    up[::500] = 450.0
    axis = force_axis(np.stack([0.0 * up, up], axis=-1), stance)
    assert axis is not None
    assert 16.0 < axis.high < 25.0
    assert axis.words == "impacts reach 450 N"


def test_a_force_without_impacts_is_shown_whole() -> None:
    up = 10.0 + np.sin(np.arange(2000))
    axis = force_axis(np.stack([0.0 * up, up], axis=-1), np.ones(2000, dtype=np.bool_))
    assert axis is not None
    assert (axis.peak, axis.words) == (None, "")
    assert axis.high > up.max()
    assert force_axis(np.full((5, 2), np.nan), np.ones(5, dtype=np.bool_)) is None


def test_the_ball_at_the_tip_covers_the_round_end_of_the_foot(hop: Recording) -> None:
    model = model_of(hop.description)
    ball, foot = model.geom("tip_ball"), model.geom("foot")
    assert int(foot.type[0]) == int(mujoco.mjtGeom.mjGEOM_CAPSULE)
    assert ball.size[0] > 1.05 * foot.size[0]


def test_the_scale_is_as_long_as_it_says() -> None:
    image = np.full((400, 600, 3), 255, dtype=np.uint8)
    done = labelled(image, 1.25, 1000.0)
    assert scale_length_mm(1000.0, 600) == 100
    dark: Bools = np.asarray(done.max(axis=2) < 100)
    longest = max(
        np.diff(np.flatnonzero(np.diff(np.pad(row, 1).astype(int)))).max(initial=0) for row in dark
    )
    assert longest == pytest.approx(100, abs=4)
    assert image.min() == 255


def test_stills_show_the_last_jump_or_the_widest_period(hop: Recording, swing: Recording) -> None:
    jumps, periods = Analysis(hop).gait.jumps, Analysis(swing).periods
    assert stills_span(hop) == (jumps.start[-1], jumps.end[-1])
    widest = periods.amplitude.max()
    place = periods.start.tolist().index(stills_span(swing)[0])
    assert periods.amplitude[place] >= 0.999 * widest


def test_stills_of_a_run_without_a_period_are_of_its_motion(swing: Recording) -> None:
    short = part(swing, 0, 260)
    still = part(swing, 0, 260)
    still.columns["joint_vel_1"][:100] = still.columns["joint_vel_2"][:100] = 0.0
    assert len(Analysis(short).periods) == 0
    begin, _ = stills_span(still)
    assert begin >= 0.1 - 1e-9


def test_keys_have_the_colours_of_what_they_name(swing: Recording) -> None:
    assert dict(stance_key()) == {"stance": style.STANCE, "flight": style.FLIGHT}
    colours = style.phase_colours(swing.description.phases)
    named = {phase.name: colours[phase.code] for phase in swing.description.phases}
    assert dict(phase_key(facts_of(swing.description))) == named
    first, *_ = period_key("jump")
    assert first == ("jump 1", tuple(style.period_colours(np.zeros(1, dtype=np.int64))[0].tolist()))


def test_a_key_that_would_cover_the_title_of_its_axis_is_left_out() -> None:
    logged: list[str] = []
    stream: Any = SimpleNamespace(log=lambda path, *_, **__: logged.append(path))
    log_key(stream, "/short", stance_key(), right=1.0, y=0.0)
    log_key(stream, "/long", [*stance_key(), *stance_key(), *stance_key()], right=1.0, y=0.0)
    assert set(logged) == {"/short"}


def test_unrated_lines_are_named_and_ticks_keep_their_distance(
    hop: Recording, swing: Recording
) -> None:
    figure = phase_figure(swing)
    (legend,) = figure.legends
    assert UNRATED in [text.get_text() for text in legend.get_texts()]
    for each in (figure, phase_figure(hop)):
        each.draw_without_rendering()
        for panel in each.axes[:3]:
            low, high = sorted(panel.get_xlim())
            boxes = sorted(
                (label.get_window_extent().x0, label.get_window_extent().x1)
                for label in panel.get_xticklabels()
                if low <= label.get_position()[0] <= high
            )
            gaps = [after[0] - before[1] for before, after in pairwise(boxes)]
            assert min(gaps, default=10.0) > 5.0


def test_bars_are_parallel_to_thigh_and_shank() -> None:
    points = 500.0 * leg_points(np.array([-0.6, 0.6]), PROTOTYPE.lengths)
    drawn: list[np.ndarray] = []

    class Paper:
        def plot(self, x: np.ndarray, y: np.ndarray, **_looks: object) -> None:
            drawn.append(np.stack([x, y], axis=-1))

    draw_bars(Paper(), points, 500.0)
    green, black = drawn
    thigh, shank = points[1] - points[0], points[2] - points[1]
    np.testing.assert_allclose(green[2] - green[1], thigh, atol=1e-9)
    np.testing.assert_allclose(black[2] - black[1], shank, atol=1e-9)
    assert np.linalg.norm(green[1] - green[0]) == pytest.approx(500.0 * CRANK)
    foot = points[3] - points[2]
    across = black[2] - points[2]
    assert abs(foot[0] * across[1] - foot[1] * across[0]) < 1e-9


def panel(mean: list[float], printed: float) -> RatingPanel:
    """A panel of one curve, and of one rating that is printed."""
    cell = Cell(setup="ffs", controller="bang-bang", z2=1.0, dz2=0.1)
    ratings = np.array(mean)
    curve = RatingCurve(
        cell=cell, mean=ratings, spread=0.0 * ratings, trials=np.ones(len(mean), dtype=np.int64)
    )
    shown = PrintedRating(first=1, last=1, rating=printed)
    return RatingPanel(title="a", group="bang-bang", curves=(curve,), printed=(shown,))


def test_ratings_near_one_are_drawn_as_what_they_lack_of_it() -> None:
    figure = ratings_figure([panel([0.999, 0.99999], 1.0)], "near")
    (axes,) = figure.axes
    assert (axes.get_yscale(), axes.get_ylabel()) == ("log", "1 - $P^r$")
    low, high = axes.get_ylim()
    assert low > 1.5e-3 > 0.8e-5 > high
    np.testing.assert_allclose(
        np.asarray(axes.lines[0].get_ydata(), dtype=np.float64), [1e-3, 1e-5], rtol=1e-6
    )
    far = ratings_figure([panel([0.99, 0.8], 0.78)], "far").axes[0]
    assert (far.get_yscale(), far.get_ylabel()) == ("linear", "$P^r$")
    assert far.get_ylim()[0] < 0.78
