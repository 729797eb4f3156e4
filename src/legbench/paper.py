"""Results that the paper reports, as data to compare with; nothing is computed from them."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class JumpReport:
    """The jumping experiment of section VI-C, three consecutive jumps of the prototype."""

    rating_stance: float = 0.99
    """Lower bound of P^r over the stance phases [-]."""
    rating_flight: float = 0.97
    """Lower bound over the flight phases [-]."""
    foot_clearance: float = 0.045
    """[m]"""
    trunk_excursion: float = 0.085
    """[m]"""
    drift: float = 0.018
    """Horizontal travel of the trunk over the three jumps [m]."""
    foot_travel: float = 0.025
    """Horizontal travel of the foot in flight [m]."""


JUMP = JumpReport()
