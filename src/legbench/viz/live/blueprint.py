"""Layout of the viewer for what `publish` logs."""

from collections.abc import Sequence

from legbench.signals import Signal
from legbench.viz.facts import Facts
from legbench.viz.force_axis import ForceAxis
from legbench.viz.live._rerun import rr, rrb
from legbench.viz.live.key import state_key_view
from legbench.viz.live.leg2d import leg_view
from legbench.viz.live.plots import plot_specs
from legbench.viz.live.scene import scene_view
from legbench.viz.live.states import states_view
from legbench.viz.live.xyplot import plot_view
from legbench.viz.playback import WHOLE, Playback

WINDOW = 4.0
"""Time that series show while a run is going on [s]."""
GAPS = ", gaps: no motion to rate"
"""Words about the gaps in the lines of ratings."""
LEGEND_SHARE = 0.35
"""Room for the legends beside the data, over the time that series show [-]."""


def blueprint(
    facts: Facts,
    *,
    room: tuple[float, float],
    span: tuple[float, float],
    force: ForceAxis | None = None,
    live: bool = False,
    others: Sequence[str] = (),
    playback: Playback = WHOLE,
) -> rrb.Blueprint:
    """The layout: leg and facts, the four planes, the signals over time.

    Args:
        facts: facts of the run.
        room: lowest and highest point that the pictures of the leg show [m].
        span: first and last time of the rows [s].
        force: axis of the contact force; none: as the data have it.
        live: follow the newest rows and let the series slide.
        others: keys of the other runs that are shown in the same views.
        playback: how a finished run is played; one that is to be played otherwise than usual
            begins to play when it is opened.
    """
    plots = {name: plot_view(spec, others) for name, spec in plot_specs(facts).items()}
    pictures = [leg_view(room), scene_view(room)]
    left = rrb.Vertical(
        rrb.Tabs(*pictures),
        states_view(),
        state_key_view(facts),
        rrb.TextDocumentView(origin="/run", name="run"),
        row_shares=[5, 1.5, 1.4, 2.6],
    )
    middle = rrb.Vertical(
        rrb.Horizontal(plots["polar"], plots["joint"]),
        rrb.Horizontal(plots["periods"], plots["phases"]),
    )
    right = _series(facts.run.layout.own, _window() if live else _whole(*span), force)
    return rrb.Blueprint(
        rrb.Horizontal(left, middle, right, column_shares=[2, 5, 3.2]),
        _time_panel(live, playback),
        collapse_panels=True,
        auto_views=False,
    )


def _time_panel(live: bool, playback: Playback) -> rrb.TimePanel:
    """The time: it follows a run that goes on, and plays one as it was asked to be played."""
    if live or playback == WHOLE:
        play_state = "following" if live else None
        return rrb.TimePanel(state="collapsed", timeline="t", play_state=play_state)
    return rrb.TimePanel(
        state="collapsed",
        timeline="t",
        playback_speed=playback.speed,
        play_state="playing",
        loop_mode="all" if playback.loop else "off",
    )


def _series(own: Sequence[Signal], shown: rr.TimeRange, force: ForceAxis | None) -> rrb.Vertical:
    """The signals over time, legends to the right; each of the controller's own has its own tab."""
    axis = rrb.TimeAxis(view_range=shown)
    limits = None if force is None else rrb.ScalarAxis(range=(force.low, force.high))
    beyond = f", {force.words}" if force is not None and force.words else ""

    def view(path: str, name: str, vertical: rrb.ScalarAxis | None = None) -> rrb.TimeSeriesView:
        return rrb.TimeSeriesView(
            origin=f"/series/{path}",
            name=name,
            axis_x=axis,
            axis_y=vertical,
            plot_legend=rrb.PlotLegend(rrb.Corner2D.RightTop),
        )

    return rrb.Vertical(
        view("joint", "joints and motor targets [rad]"),
        view("torque", "spring torque [N m]"),
        rrb.Tabs(
            view("force", f"contact force [N]{beyond}", limits),
            view("height", "height [m]"),
            view("energy", "energy [J]"),
            *(view(f"own/{signal.name}", f"{signal.name} [{signal.unit}]") for signal in own),
        ),
        # Ratings near one differ in what they lack of it alone.
        rrb.Tabs(view("lost", f"log10(1 - P^r) [-]{GAPS}"), view("rating", f"P^r [-]{GAPS}")),
        view("cycle", "control cycle [us]"),
    )


def _window() -> rr.TimeRange:
    return rr.TimeRange(
        start=rr.TimeRangeBoundary.cursor_relative(seconds=-WINDOW),
        end=rr.TimeRangeBoundary.cursor_relative(seconds=LEGEND_SHARE * WINDOW),
    )


def _whole(begin: float, end: float) -> rr.TimeRange:
    """The time of a finished run, and room beside it."""
    room = LEGEND_SHARE * (end - begin)
    return rr.TimeRange(
        start=rr.TimeRangeBoundary.absolute(seconds=begin),
        end=rr.TimeRangeBoundary.absolute(seconds=end + room),
    )
