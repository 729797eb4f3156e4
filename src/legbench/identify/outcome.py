"""Outcome of an identification: estimates, how they were reached, and whether to trust them."""

from dataclasses import dataclass

from legbench.identify.adequacy import Residual, Score
from legbench.identify.alternatives import Alternative
from legbench.identify.checks import DataFinding
from legbench.identify.gate import Gate
from legbench.identify.held_out import HeldOut
from legbench.identify.problem import Misfit
from legbench.signals import Floats


@dataclass(frozen=True, slots=True, kw_only=True)
class Estimate:
    """One identified parameter."""

    name: str
    unit: str
    value: float
    """Estimate [unit]."""
    before: float
    """Value of the design [unit]."""
    error: float
    """Standard error, the larger of both [unit]."""
    white_error: float
    """Standard error that white noise of the encoders would give [unit]."""
    low: float
    """Lower end of the 95 % interval [unit]."""
    high: float
    """Upper end of it [unit]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Identification:
    """What was learned from some runs."""

    runs: tuple[str, ...]
    findings: tuple[DataFinding, ...]
    """What is wrong with the data."""
    left_out: tuple[int, ...] = ()
    """Rows of each run that were left out because a drive had not answered [-]."""
    gate: Gate | None = None
    """How well the runs show what was free; none: the data were hopeless."""
    estimates: tuple[Estimate, ...] = ()
    correlation: Floats | None = None
    """Correlation of the estimates' errors (m, m) [-]."""
    alike: tuple[str, ...] = ()
    """Pairs of parameters that are hard to tell apart."""
    values: Floats | None = None
    """All parameters in the order of `PARAMETERS` (p,)."""
    misfit: Misfit | None = None
    """What the fit leaves, row by row."""
    residuals: tuple[Residual, ...] = ()
    scores: tuple[Score, ...] = ()
    alternatives: tuple[Alternative, ...] = ()
    held_out: tuple[HeldOut, ...] = ()
    starts: int = 0
    """Number of starts."""
    agreeing: int = 0
    """Number of starts that ended at the same parameters."""
    evaluations: int = 0
    converged: bool = False
    reasons: tuple[str, ...] = ()
    """Why the estimates are not to be trusted; none: they are."""

    @property
    def trusted(self) -> bool:
        """Whether nothing speaks against the estimates."""
        return bool(self.estimates) and not self.reasons

    def estimate(self, name: str) -> Estimate:
        """Return the estimate of one parameter; raises KeyError if it was not free."""
        for each in self.estimates:
            if each.name == name:
                return each
        raise KeyError(name)
