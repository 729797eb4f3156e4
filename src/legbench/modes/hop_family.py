"""A periodic hop followed over one setting of controller or leg, with its stability."""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import final

import numpy as np

from legbench.analytic.taylor import TaylorLeg
from legbench.control import JumpConfig
from legbench.design import LegDesign
from legbench.errors import ConfigError, DesignError
from legbench.modes.continuation import (
    LOST,
    MANY,
    CurvePoint,
    Stride,
    correct,
    trace,
)
from legbench.modes.cycles import HopCycle, described, stacked
from legbench.modes.drive import JumpLaw
from legbench.modes.fixed_point import UNITS
from legbench.modes.hop import Apex, return_map
from legbench.modes.hop_setting import tools_at, value_of
from legbench.modes.settings import SPANS, Setting
from legbench.signals import Floats

CLOSED = 1e-8
"""Largest distance between the two ends of a cycle of the family, in `fixed_point.UNITS` [-]."""
DIFFERENCE = 1e-5
"""Step of the central difference by the setting, in its `SPANS` [-]."""
STEP = 0.1
"""Longest arc between two hops, apexes in `UNITS` and the setting in its `SPANS` [-]."""
MOST = 120
"""Largest number of hops of a family [-]."""
MARGINAL = 1e-4
"""Distance from 1 of the largest multiplier at a change of stability that is solved for [-]."""
LOOKS = 12
"""Largest number of hops that are solved for at a change of stability [-]."""
AGAIN_NEAR, AGAIN_AFTER = 0.03, 5
"""Distance within which a family has returned to one of its hops, and how many hops later [-]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Member:
    """Periodic hop at one value of the setting."""

    value: float
    cycle: HopCycle


@dataclass(frozen=True, slots=True, kw_only=True)
class Change:
    """Change of stability between two hops of a family."""

    member: Member
    """The hop whose largest multiplier has the size 1, to `MARGINAL`."""
    stable_after: bool
    """Whether hops beyond it are stable."""

    @property
    def value(self) -> float:
        """Value of the setting there."""
        return self.member.value

    @property
    def kind(self) -> str:
        """Kind of the change of stability, in words."""
        multiplier = self.member.cycle.multipliers[0]
        if abs(multiplier.imag) > 1e-3:
            return "a pair of multipliers, to hops that wander around it"
        if multiplier.real < 0.0:
            return "a multiplier of -1, to hops of twice the period"
        return "a multiplier of +1"


@dataclass(frozen=True, slots=True, kw_only=True)
class HopFamily:
    """Periodic hops over one setting."""

    setting: Setting
    members: tuple[Member, ...]
    changes: tuple[Change, ...]
    ended: str
    """Reason why there are no more, in words."""


@final
class _Equations:
    """Closure of all hops, of unknowns (apexes in `UNITS`, setting in its `SPANS`)."""

    def __init__(self, design: LegDesign, jump: JumpConfig, setting: Setting) -> None:
        self.design, self.jump, self.setting = design, jump, setting
        self.span = SPANS[setting]
        self.why = ""
        self._leg: TaylorLeg | None = None

    def tools(self, value: float) -> tuple[TaylorLeg, JumpLaw]:
        tools = tools_at(self.design, self.jump, self.setting, value, self._leg)
        self._leg = tools[0]
        return tools

    def __call__(self, unknown: Floats) -> tuple[Floats, Floats]:
        apexes, value = unknown[:-1].reshape(-1, 6), float(unknown[-1]) * self.span
        size = apexes.size
        try:
            residual, slope, _ = stacked(*self.tools(value), apexes)
            ends = [
                self._ends(apexes, value + sign * DIFFERENCE * self.span) for sign in (1.0, -1.0)
            ]
        except (ConfigError, DesignError) as error:
            # The part before the semicolon is the cause; the rest is advice on choosing a start.
            self.why = str(error).partition(";")[0]
            return np.full(size, np.nan), np.zeros((size, size + 1))
        by_setting = (ends[0] - ends[1]) / (2.0 * DIFFERENCE)
        return residual, np.column_stack([slope, by_setting])

    def _ends(self, apexes: Floats, value: float) -> Floats:
        leg, law = self.tools(value)
        ends = []
        for row in apexes:
            done = return_map(leg, law, Apex.of(row * UNITS))
            if done.after is None:
                raise ConfigError(f"the hop does not return: it ended as '{done.ending}'")
            ends.append(done.after.vector() / UNITS)
        return np.concatenate(ends)


def follow_hop(
    design: LegDesign,
    jump: JumpConfig,
    setting: Setting,
    start: HopCycle,
    to: float,
    *,
    progress: Callable[[int, int], None] | None = None,
) -> HopFamily:
    """Follow a periodic hop from the present value of a setting to another one.

    Args:
        design: the leg.
        jump: settings of the controller.
        setting: the setting that is varied.
        start: the hop at the present value.
        to: value at which the family ends, if it gets there.
        progress: called with the share of the way that is done, in hundredths, and 100.

    Raises:
        ConfigError: a value that leg or controller refuse, or the present one.
    """
    value = value_of(design, jump, setting)
    tools_at(design, jump, setting, to)
    if to == value:
        raise ConfigError(f"{setting} is {value:g} already; a family needs another value to go to")
    equations = _Equations(design, jump, setting)
    first = _first(equations, start, value)
    walk = _Walk(equations, first, value, to, progress)
    along = np.sign(to - value) * np.eye(len(first.unknown))[-1]
    stride = Stride(first=STEP, longest=STEP * 3.0, shortest=1e-3, most=MOST)
    ended = trace(equations, first.towards(along), stride, CLOSED, walk.visit)
    if ended == MANY:
        ended = f"{MOST} hops"
    elif ended == LOST:
        ended = f"no hop continues it at {setting} = {walk.members[-1].value:.4g}"
        ended += f": {equations.why}" if equations.why else ""
    if progress is not None:
        progress(100, 100)
    return HopFamily(
        setting=setting,
        members=tuple(walk.members),
        changes=tuple(walk.changes()),
        ended=ended,
    )


def _first(equations: _Equations, start: HopCycle, value: float) -> CurvePoint:
    """The hop at the present value of the setting, as a solution of the equations."""
    apexes = np.array([apex.vector() for apex in start.apexes]) / UNITS
    guess = np.append(apexes.ravel(), value / equations.span)
    row = np.eye(len(guess))[-1]
    first = correct(equations, guess, row, float(guess[-1]), CLOSED)
    if first is None:
        why = equations.why or "it is lost"
        raise ConfigError(f"the hop cannot be followed in {equations.setting}: {why}")
    return first


@final
class _Walk:
    """Hops that a family has passed, and the conditions that end it."""

    def __init__(
        self,
        equations: _Equations,
        first: CurvePoint,
        value: float,
        to: float,
        progress: Callable[[int, int], None] | None,
    ) -> None:
        self.members = [_member(equations, first)]
        self._equations, self._from, self._to = equations, value, to
        self._passed, self._progress = [first.unknown], progress

    def visit(self, found: CurvePoint) -> str | None:
        """Add a hop; return why it is the last one, or None if it is not."""
        self._equations.why = ""
        setting, member = self._equations.setting, _member(self._equations, found)
        self.members.append(member)
        older = self._passed[:-AGAIN_AFTER]
        self._passed.append(found.unknown)
        if older and min(np.max(np.abs(found.unknown - one)) for one in older) < AGAIN_NEAR:
            return f"it comes back to a hop that it has passed, at {setting} = {member.value:.4g}"
        share = (member.value - self._from) / (self._to - self._from)
        if self._progress is not None:
            self._progress(min(99, int(100.0 * abs(share))), 100)
        if share >= 1.0:
            return f"{setting} = {self._to:g}"
        return f"it turned back past {self._from:g}" if share < 0.0 else None

    def changes(self) -> list[Change]:
        """Changes of stability between neighbouring hops, each located by a root search."""
        pairs = zip(pairwise(self.members), pairwise(self._passed), strict=True)
        return [
            Change(member=self._marginal(before, after, *ends), stable_after=after.cycle.stable)
            for (before, after), ends in pairs
            if before.cycle.stable != after.cycle.stable
        ]

    def _marginal(self, before: Member, after: Member, first: Floats, last: Floats) -> Member:
        """The hop between two, in `_passed` at `first` and `last`, whose multiplier has size 1."""
        sizes, shares = [_excess(before), _excess(after)], [0.0, 1.0]
        best = before if abs(sizes[0]) < abs(sizes[1]) else after
        row = (last - first) / np.linalg.norm(last - first)
        for count in range(LOOKS):
            share = shares[0] - sizes[0] * (shares[1] - shares[0]) / (sizes[1] - sizes[0])
            share = 0.5 * sum(shares) if count % 3 == 2 else share
            guess = first + share * (last - first)
            found = correct(self._equations, guess, row, float(row @ guess), CLOSED)
            if found is None:
                break
            member = _member(self._equations, found)
            size = _excess(member)
            best = member if abs(size) < abs(_excess(best)) else best
            if abs(size) < MARGINAL:
                break
            side = 0 if size * sizes[0] > 0.0 else 1
            sizes[side], shares[side] = size, share
        return best


def _excess(member: Member) -> float:
    """Size of the largest multiplier beyond 1 [-]."""
    return abs(member.cycle.multipliers[0]) - 1.0


def _member(equations: _Equations, found: CurvePoint) -> Member:
    value = float(found.unknown[-1]) * equations.span
    apexes = found.unknown[:-1].reshape(-1, 6)
    leg, law = equations.tools(value)
    residual, _, slopes = stacked(leg, law, apexes)
    worst = float(np.max(np.abs(residual)))
    return Member(value=value, cycle=described(leg, law, apexes, slopes, worst))
