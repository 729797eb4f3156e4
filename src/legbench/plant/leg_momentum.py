"""What the angular momentum of a leg obeys in a setup, for the limits that watch its encoders."""

import math

from legbench.analytic.terms import PairTerms, floating_terms
from legbench.design import LegDesign
from legbench.design.setup import Setup, SetupKind
from legbench.drives.setup.config import BusConfig
from legbench.imperfections import Imperfections
from legbench.limits.momentum import LegMomentum, SupportPoint


def momentum_of(
    design: LegDesign, setup: Setup, link_step: float, imperfections: Imperfections
) -> LegMomentum | None:
    """Return what the limits may expect of a leg; nothing of one on a boom, which turns about it.

    Args:
        design: as it is believed to be; the bars weigh too little to matter.
        setup: how the leg is held.
        link_step: smallest step that the link encoders can show [rad].
        imperfections: noise on the link encoders counts as a larger step of the same scatter.
    """
    if setup.boom_radius is not None:
        return None
    noise = max(imperfections.link_noise or (0.0,))
    return LegMomentum(
        stiffness=design.stiffness,
        damping=design.damping,
        supports=tuple(_support(terms) for terms in _held(design, setup.kind)),
        hip_range=design.limits.hip,
        knee_range=design.limits.knee,
        link_step=max(link_step, math.sqrt(12.0) * noise),
    )


def momentum_on(
    config: BusConfig, design: LegDesign, setup: Setup, imperfections: Imperfections
) -> LegMomentum | None:
    """Return what the limits may expect of a leg on a bus; nothing where links have no encoder."""
    links = [node.link for node in config.nodes if node.link is not None]
    if len(links) < len(config.nodes):
        return None
    step = max(1.0 / abs(link.counts_per_rad) for link in links)
    return momentum_of(design, setup, step, imperfections)


def _held(design: LegDesign, kind: SetupKind) -> tuple[PairTerms, ...]:
    """Constants about each point that the leg may turn about in a setup."""
    terms = floating_terms(design)
    match kind:
        case SetupKind.JUMP:
            return terms.pinned(), terms.falling()
        case SetupKind.FFS:
            return (terms.pinned(),)
        case SetupKind.VFTS:
            return (terms.hanging(),)
        case SetupKind.HFTS:
            return (floating_terms(design, gravity=0.0).hanging(),)


def _support(terms: PairTerms) -> SupportPoint:
    return SupportPoint(inertia=terms.inertia, coupling=terms.coupling, moment=terms.moment)
