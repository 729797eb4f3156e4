"""Keys of the colours in the viewer: of an XY plot above its box, of all states in a view."""

from collections.abc import Sequence

import numpy as np

from legbench.phases import Role
from legbench.viz import style
from legbench.viz.facts import Facts
from legbench.viz.live._rerun import rr, rrb

Entry = tuple[str, style.Rgb]
"""Word of a key, and the colour that it explains."""

PATH = "/key"
"""Entity path of the key of the states."""
GLYPH, PAD = 0.105, 0.30
"""Width of a letter, and of the margins of a word, in an XY plot of the usual size [plot units]."""
LONGEST = 3.25
"""Longest key beside an axis' title [plot units]."""
LABEL_DROP = 0.15
"""Height by which the viewer writes a label below its point in the states' key [key units]."""
ROW, WORD = 0.5, 0.16
"""Height of a row of the states' key, and width of one of its letters [key units]."""
WIDTH = 6.5
"""Width of that key [key units]."""
SHOWN_PERIODS = (1, 5, 10, 15, style.PERIODS_SHOWN)
"""Periods whose colours a key shows."""


def stance_key() -> tuple[Entry, ...]:
    """Key of stance and flight."""
    return (("stance", style.STANCE), ("flight", style.FLIGHT))


def phase_key(facts: Facts, *, at_rest: bool = True) -> tuple[Entry, ...]:
    """Key of the controller's states as it declares them; those at rest may be left out."""
    colours = style.phase_colours(facts.run.phases)
    return tuple(
        (phase.name, colours[phase.code])
        for phase in facts.run.phases
        if at_rest or phase.role is not Role.REST
    )


def period_key(word: str) -> tuple[Entry, ...]:
    """Key of periods or jumps, whichever `word` says, by some of their numbers."""
    colours = style.period_colours(np.array(SHOWN_PERIODS, dtype=np.int64) - 1).tolist()
    last = SHOWN_PERIODS[-1]
    words = [f"{number}+" if number == last else str(number) for number in SHOWN_PERIODS]
    words[0] = f"{word} {words[0]}"
    return tuple((text, (r, g, b)) for text, (r, g, b) in zip(words, colours, strict=True))


def log_key(
    stream: rr.RecordingStream, path: str, key: Sequence[Entry], right: float, y: float
) -> None:
    """Write a key in a row that ends at `right`, at the height `y` of a plot [plot units].

    One that would cover the axis' title is left out; the view of all colours has it.
    """
    if sum(PAD + GLYPH * len(word) for word, _ in key) > LONGEST:
        return
    points: list[tuple[float, float]] = []
    for word, _ in reversed(key):
        width = PAD + GLYPH * len(word)
        points.append((right - 0.5 * width, y))
        right -= width
    _log(stream, path, key, points[::-1])


def _state_rows(facts: Facts) -> list[list[Entry]]:
    """Rows of the key of the controller's and the foot's states, none longer than the view."""
    keys = [("controller", phase_key(facts))]
    if facts.run.jumps:
        keys.append(("foot", stance_key()))
    rows: list[list[Entry]] = []
    for name, key in keys:
        rows.append([(f"{name}:", style.GREY)])
        for entry in key:
            if sum(map(_width, (*rows[-1], entry))) > WIDTH:
                rows.append([])
            rows[-1].append(entry)
    return rows


def _width(entry: Entry) -> float:
    """Width of a word in the states' key [key units]."""
    return PAD + WORD * len(entry[0])


def log_state_key(stream: rr.RecordingStream, facts: Facts) -> None:
    """Write the key of the states, for `state_key_view`."""
    entries: list[Entry] = []
    points: list[tuple[float, float]] = []
    for place, row in enumerate(_state_rows(facts)):
        ends = np.cumsum([0.0, *map(_width, row)])
        entries += row
        points += [(x, ROW * place - LABEL_DROP) for x in (0.5 * (ends[:-1] + ends[1:])).tolist()]
    _log(stream, PATH, entries, points)


def state_key_view(facts: Facts) -> rrb.Spatial2DView:
    """View of the key of the states."""
    bottom = ROW * len(_state_rows(facts)) - 0.5 * ROW
    bounds = rrb.VisualBounds2D(x_range=(0.0, WIDTH), y_range=(-0.5 * ROW, bottom))
    return rrb.Spatial2DView(origin=PATH, name="colours", visual_bounds=bounds)


def _log(
    stream: rr.RecordingStream,
    path: str,
    key: Sequence[Entry],
    points: Sequence[tuple[float, float]],
) -> None:
    words = rr.Points2D(
        points,
        labels=[word for word, _ in key],
        colors=[colour for _, colour in key],
        radii=rr.Radius.ui_points(0.0),
        show_labels=True,
    )
    stream.log(path, words, static=True)
