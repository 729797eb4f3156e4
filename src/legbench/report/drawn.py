"""Figures of a report: blocks of the page, and print figures by name, from the same data."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Final

from legbench.campaign.curves import rating_curves
from legbench.design.setup import SetupKind
from legbench.metrics.source import Reference
from legbench.paper import Published
from legbench.report.blocks import (
    Block,
    planes_block,
    ratings_block,
    relabelled,
    stills_block,
    without_panels,
)
from legbench.report.measures import TRANSIENT
from legbench.report.named import Named
from legbench.report.sources import Source
from legbench.viz.print._matplotlib import Figure
from legbench.viz.print.figures import phase_figure
from legbench.viz.print.ratings import Mark, ratings_figure
from legbench.viz.print.stills import stills_figure

TITLES: Final = {
    "step": "Fig. 4, step: a fixed foot after a step of the equilibrium",
    "bang-bang": "Fig. 4, bang-bang: a fixed foot on its limit cycle",
    "jump": "Fig. 6: the last three jumps",
}
"""Titles of the figures of named experiments."""
ABOUT: Final = {
    Reference.EQUILIBRIUM: "Gravity's sag is no deflection here. It is the reference that the "
    "paper's figures can be about.",
    Reference.MOTOR: "As eq. (14) is printed: where springs carry weight, its sag counts as radial "
    "deflection and hides everything else.",
}
"""What each reference of the rating means, in words."""


def marks_of(numbers: Mapping[str, Published]) -> tuple[Mark, ...]:
    """Ratings that the paper prints for single cells of Fig. 5."""
    first, last, level = (
        numbers[key] for key in ("step_rating_1", "step_rating_6", "bang_bang_rating")
    )
    step = [
        Mark(controller="position-jump", setup=SetupKind.FFS, first=n, last=n, rating=each.value)
        for n, each in ((1, first), (6, last))
    ]
    sustained = Mark(
        controller="bang-bang",
        setup=SetupKind.FFS,
        first=TRANSIENT + 1,
        last=None,
        rating=level.value,
    )
    return (*step, sustained)


def blocks_of(
    sources: Sequence[Source], named: Sequence[Named], numbers: Mapping[str, Published]
) -> Iterator[Block]:
    """Figures of the page in the order of the paper: 4, 5, 6 and 7."""
    by_name = {each.name: each for each in named}
    yield _planes(by_name["step"])
    yield relabelled(_planes(by_name["bang-bang"]), "d")
    for source in sources:
        for reference in (Reference.EQUILIBRIUM, Reference.MOTOR):
            yield _ratings(source, reference, numbers)
    jump = by_name["jump"]
    yield _planes(jump)
    title = "Fig. 7: one jump, from lower apex to lower apex"
    stills, why = None, jump.origin
    if jump.recording is not None:
        caption = (
            f"{jump.settings}. Drawn from the recorded angles and the path of the hip; dotted are "
            "its lowest and highest place."
        )
        stills = stills_block("fig7", title, caption, jump.recording)
        why = "no jump lies complete within the run, or the hip's height is not known"
    yield stills if stills is not None else without_panels("fig7", title, why)


def _planes(named: Named) -> Block:
    name, title = f"planes-{named.name}", TITLES[named.name]
    if named.recording is None:
        return without_panels(name, title, named.origin)
    hashed = f"Experiment {named.experiment[:12]}" if named.experiment else "Experiment"
    caption = f"{named.settings}. {hashed}, {named.origin}."
    return planes_block(name, title, caption, named.recording)


def _ratings(source: Source, reference: Reference, numbers: Mapping[str, Published]) -> Block:
    curves = rating_curves(source.table, reference)
    title = f"Fig. 5, {source.name}: P^r about the {reference.value}"
    name = f"ratings-{source.name}-{reference.value}"
    if not curves:
        return without_panels(name, title, "no sound run has a rated period")
    caption = (
        f"P^r of each oscillation period: mean over the trials, in a band of one standard "
        f"deviation where they differ. {ABOUT[reference]}"
    )
    return ratings_block(name, title, caption, curves, marks_of(numbers))


def print_figures(
    sources: Sequence[Source], named: Sequence[Named], numbers: Mapping[str, Published]
) -> Iterator[tuple[str, Figure]]:
    """Print figures by name, each drawn when it is asked for; those without data are left out."""
    recordings = {each.name: each.recording for each in named}
    for name, file in (("step", "fig4-step"), ("bang-bang", "fig4-bang-bang"), ("jump", "fig6")):
        if (recording := recordings[name]) is not None:
            yield file, phase_figure(recording)
    for source in sources:
        for reference in Reference:
            if curves := rating_curves(source.table, reference):
                title = f"{source.title}: $P^r$ about the {reference.value}"
                figure = ratings_figure(curves, marks_of(numbers), title)
                yield f"fig5-{source.name}-{reference.value}", figure
    jump = recordings["jump"]
    if jump is not None and (figure := stills_figure(jump)) is not None:
        yield "fig7", figure
