"""Figures of a report: blocks of the page, and print figures by name, from the same data."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Final

from legbench.campaign.curves import rating_curves
from legbench.design.setup import SetupKind
from legbench.metrics.source import Reference
from legbench.paper import Published
from legbench.report.blocks import (
    FigureBlock,
    planes_block,
    ratings_block,
    relabelled,
    stills_block,
    without_panels,
)
from legbench.report.judging import SETUP_NAMES
from legbench.report.measures import TRANSIENT
from legbench.report.named import Named
from legbench.report.sources import CampaignSource
from legbench.report.trends import BANG_BANG, STEP, THREE
from legbench.viz.print._matplotlib import Figure
from legbench.viz.print.figures import phase_figure
from legbench.viz.print.ratings import PrintedRating, RatingPanel, ratings_figure
from legbench.viz.print.stills import stills_figure

TITLES: Final = {
    "step": "Fig. 4, step: a fixed foot after a step of the equilibrium",
    "bang-bang": "Fig. 4, bang-bang: a fixed foot on its limit cycle",
    "jump": "Fig. 6: the last three jumps",
}
"""Titles of the figures of named experiments."""
GROUPS: Final = {STEP: "step", BANG_BANG: "bang-bang"}
"""Word for each controller of Fig. 5."""
ABOUT: Final = {
    Reference.EQUILIBRIUM: "Gravity's sag is no deflection here. It is the reference that the "
    "paper's figures can be about.",
    Reference.MOTOR: "As eq. (14) is printed: where springs carry weight, its sag counts as radial "
    "deflection and hides everything else.",
}
"""What each reference of the rating means, in words."""


def rating_panels(
    source: CampaignSource, reference: Reference, numbers: Mapping[str, Published]
) -> tuple[RatingPanel, ...]:
    """Panels (a) to (f) of Fig. 5; none where the campaign has no sound run with rated periods."""
    curves = rating_curves(source.table, reference)
    if not curves:
        return ()
    printed = _printed(numbers)
    kinds = [(controller, kind) for controller in (STEP, BANG_BANG) for kind in THREE]
    return tuple(
        RatingPanel(
            title=f"({letter}) {SETUP_NAMES[kind]}, {GROUPS[controller]}",
            group=GROUPS[controller],
            curves=tuple(
                each
                for each in curves
                if each.cell.controller == controller and each.cell.setup == kind
            ),
            printed=printed[controller] if kind is SetupKind.FFS else (),
        )
        for letter, (controller, kind) in zip("abcdef", kinds, strict=True)
    )


def _printed(numbers: Mapping[str, Published]) -> dict[str, tuple[PrintedRating, ...]]:
    """Ratings that the paper prints of a fixed foot, by controller."""
    first, last, level = (
        numbers[key].value for key in ("step_rating_1", "step_rating_6", "bang_bang_rating")
    )
    return {
        STEP: (
            PrintedRating(first=1, last=1, rating=first),
            PrintedRating(first=6, last=6, rating=last),
        ),
        BANG_BANG: (PrintedRating(first=TRANSIENT + 1, last=None, rating=level),),
    }


def blocks_of(
    sources: Sequence[CampaignSource], named: Sequence[Named], numbers: Mapping[str, Published]
) -> Iterator[FigureBlock]:
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


def _planes(named: Named) -> FigureBlock:
    name, title = f"planes-{named.name}", TITLES[named.name]
    if named.recording is None:
        return without_panels(name, title, named.origin)
    hashed = f"Experiment {named.experiment[:12]}" if named.experiment else "Experiment"
    caption = f"{named.settings}. {hashed}, {named.origin}."
    return planes_block(name, title, caption, named.recording)


def _ratings(
    source: CampaignSource, reference: Reference, numbers: Mapping[str, Published]
) -> FigureBlock:
    panels = rating_panels(source, reference, numbers)
    title = f"Fig. 5, {source.name}: P^r about the {reference.value}"
    name = f"ratings-{source.name}-{reference.value}"
    if not panels:
        return without_panels(name, title, "no sound run has a rated period")
    caption = (
        f"P^r of each oscillation period: mean over the trials, in a band of one standard "
        f"deviation where they differ. {ABOUT[reference]}"
    )
    return ratings_block(name, title, caption, panels)


def print_figures(
    sources: Sequence[CampaignSource], named: Sequence[Named], numbers: Mapping[str, Published]
) -> Iterator[tuple[str, Figure]]:
    """Print figures by name, each drawn when it is asked for; those without data are left out."""
    recordings = {each.name: each.recording for each in named}
    for name, file in (("step", "fig4-step"), ("bang-bang", "fig4-bang-bang"), ("jump", "fig6")):
        if (recording := recordings[name]) is not None:
            yield file, phase_figure(recording)
    for source in sources:
        for reference in Reference:
            if panels := rating_panels(source, reference, numbers):
                title = f"{source.title}: $P^r$ about the {reference.value}"
                yield f"fig5-{source.name}-{reference.value}", ratings_figure(panels, title)
    jump = recordings["jump"]
    if jump is not None and (figure := stills_figure(jump)) is not None:
        yield "fig7", figure
