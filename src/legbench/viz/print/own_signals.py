"""Panels of a print figure for the signals that a controller has declared, over time."""

from collections.abc import Sequence
from string import ascii_lowercase

from legbench.metrics.source import Recorded
from legbench.signals import Signal
from legbench.viz import style
from legbench.viz.print._matplotlib import Axes
from legbench.viz.print.off_data import legend_beside
from legbench.viz.print.overlay import look_of
from legbench.viz.print.thinning import draw_line, peaks, stride

COLOURS = tuple(map(style.unit, style.COMPONENTS))
"""Colours of a signal's components in turn."""


def own_signals_of(recording: Recorded) -> tuple[Signal, ...]:
    """Signals that the controller of a run has declared beside those of every run."""
    return recording.description.layout.own


def draw_own_signals(
    panels: Sequence[Axes], above: int, run: Recorded, others: Sequence[Recorded]
) -> None:
    """Draw each own signal over time in a panel of its own, with its description and its unit.

    Args:
        panels: one panel a signal, in the order of `own_signals_of`.
        above: number of panels that have letters already.
        run: the run.
        others: runs drawn dashed over it where their controllers declare the same signal.
    """
    signals = own_signals_of(run)
    for number, (panel, signal) in enumerate(zip(panels, signals, strict=True), start=above):
        letter = ascii_lowercase[number % 26] * (1 + number // 26)
        what = f"{signal.name}: {signal.doc}" if signal.doc else signal.name
        panel.set_title(_plain(f"({letter}) {what}"), loc="left")
        panel.set_xlabel("$t$ [s]")
        panel.set_ylabel(_plain(f"{signal.name} [{signal.unit}]"))
        _draw(panel, signal, run)
        for place, other in enumerate(others):
            if signal in own_signals_of(other):
                _draw(panel, signal, other, place)
        panel.grid(alpha=0.25, linewidth=0.5)
        panel.margins(x=0.0)
        if signal.components:
            legend_beside(panel)


def _draw(panel: Axes, signal: Signal, run: Recorded, other: int | None = None) -> None:
    """Draw the components of a signal; another run has the look of its place, and no legend."""
    rows = run[signal.name].reshape(len(run.time), -1)
    names = signal.components or (signal.name,)
    for place, (name, values) in enumerate(zip(names, rows.T, strict=True)):
        shown = peaks(values, stride(len(values)))
        draw_line(
            panel,
            run.time[shown],
            values[shown],
            color=COLOURS[place % len(COLOURS)] if other is None else look_of(other).colour,
            linestyle="-" if other is None else look_of(other).dashes,
            linewidth=1.0 if other is None else 0.8,
            label=_plain(name) if other is None else "_",
            rasterized=True,
        )


def _plain(text: str) -> str:
    """Text of a guest as it is written: matplotlib would take dollars for mathematics."""
    return text.replace("$", r"\$")
