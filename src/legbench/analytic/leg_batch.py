"""Batch of legs, each with parameters of its own, that are integrated by the same instructions.

    batch = LegBatch(models, Regime.PINNED, derivatives=True)
    batch.start(states)                  # (n, 4)
    batch.go(0.001, motors)              # one period of a sampled controller
    batch.states, batch.slopes           # (n, 4), (n, 4, 9)
    path = batch.path(times, motors)     # or many times in one call, (n, len(times), 4)

The legs are held by trunk or foot and stay within their joints' limits: a batch has neither events
nor joint stops. `outside` says which legs were seen beyond a limit.
"""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from typing import Any, final

import numpy as np

from legbench.analytic.compiled import (
    TOLERANCE,
    parameters_of,
    smooth_integrator,
    smooth_seeds,
)
from legbench.analytic.model import LegModel
from legbench.analytic.parameters import FRICTION, GUIDE, MOTOR, REACH, SHARPNESS, SMOOTH
from legbench.analytic.state import Regime
from legbench.errors import ConfigError, PlantFault
from legbench.signals import Floats

STATES = 4
"""Number of states of a leg, two angles and their rates [-]."""
LAST = REACH + 1
"""Number of parameters of a leg in a batch [-]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Friction:
    """Coulomb friction in both joints of a leg.

    Raises:
        ConfigError: a torque below zero, or a width that is not positive.
    """

    torque: tuple[float, float]
    """Coulomb friction torque of each joint [N m]."""
    width: float = 0.05
    """Rate at which three quarters of the torque act [rad/s]."""

    def __post_init__(self) -> None:
        if not min(self.torque) >= 0.0:
            raise ConfigError(f"friction torque is {self.torque} N m; it must be zero or more")
        if not self.width > 0.0:
            raise ConfigError(f"friction width is {self.width:g} rad/s; it must be positive")


@final
class LegBatch:
    """Batch of held legs that move in step, without joint stops and events.

    A guide brakes the trunk of each leg over its pinned foot, forward and upward [N s/m].

    Attributes:
        time: present time of all legs [s].
        outside: legs that were seen beyond a joint limit (n,).

    Raises:
        ConfigError: no leg, or a regime in which the foot can lift off.
    """

    def __init__(
        self,
        models: Sequence[LegModel],
        regime: Regime,
        *,
        friction: Sequence[Friction] | None = None,
        guide: Sequence[tuple[float, float]] | None = None,
        derivatives: bool = False,
        tolerance: float = TOLERANCE,
        workers: int = 1,
    ) -> None:
        if not models:
            raise ConfigError("no leg to follow; give one model or more")
        if regime not in (Regime.PINNED, Regime.HANGING):
            raise ConfigError(
                f"legs side by side cannot be in '{regime}', which ends by an event; follow each "
                f"by its course, or hold them: {Regime.PINNED}, {Regime.HANGING}"
            )
        self.time, self._count, self._workers = 0.0, len(models), workers
        self._models = tuple(models)
        self._seeds = len(smooth_seeds(friction=friction is not None)) if derivatives else 0
        new = partial(
            smooth_integrator,
            tolerance,
            varied=derivatives,
            friction=friction is not None,
            guide=guide is not None,
        )
        first = new()
        self._width = int(first.batch_size)
        blocks = -(-self._count // self._width)
        self._blocks: list[Any] = [first, *(new() for _ in range(blocks - 1))]
        self._pars = np.array([_parameters(model, regime) for model in models])
        for index, rub in enumerate(friction or ()):
            self._pars[index, FRICTION : FRICTION + 2] = rub.torque
            self._pars[index, SHARPNESS] = 1.0 / rub.width
        if guide is not None:
            self._pars[:, GUIDE : GUIDE + 2] = guide
            self._pars[:, REACH] = [model.floating.reach for model in models]
        self.outside = np.zeros(self._count, dtype=np.bool_)
        self.start(np.zeros((self._count, STATES)))

    def start(self, states: Floats) -> None:
        """Set the states at time zero, (n, 4) [rad, rad/s]; derivatives are zero there."""
        self.time = 0.0
        self.outside[:] = False
        for block, part in zip(self._blocks, self._parts(states), strict=True):
            block.set_time(0.0)
            block.state[:] = 0.0
            block.state[:STATES] = part.T

    def go(self, until: float, motors: Floats) -> Floats:
        """States (n, 4) at `until` [s], motors held at (n, 2) [rad].

        Raises:
            PlantFault: a leg runs away.
        """
        self._hold(motors)
        self._each(lambda block: block.propagate_until(until))
        self.time = until
        return self.states

    def path(self, times: Floats, motors: Floats) -> Floats:
        """States (n, t, 4) at `times` (t,) [s], the first of which is now; motors held (n, 2).

        Raises:
            PlantFault: a leg runs away.
        """
        self._hold(motors)
        grid = np.repeat(times[:, np.newaxis], self._width, axis=1)
        found = self._each(lambda block: block.propagate_grid(grid)[-1])
        self.time = float(times[-1])
        whole = np.concatenate([part[:, :STATES] for part in found], axis=2)
        states = np.moveaxis(whole, 2, 0)[: self._count]
        self._look(states)
        return states

    @property
    def states(self) -> Floats:
        """Angles and rates of each leg (n, 4) [rad, rad/s]."""
        whole = np.concatenate([block.state[:STATES] for block in self._blocks], axis=1)
        states = whole.T[: self._count]
        self._look(states[:, np.newaxis])
        return states

    @property
    def slopes(self) -> Floats:
        """Derivatives of the states by the leg's parameters (n, 4, seeds), in their order."""
        whole = np.concatenate([block.state[STATES:] for block in self._blocks], axis=1)
        return whole.T[: self._count].reshape(self._count, STATES, self._seeds)

    def _look(self, states: Floats) -> None:
        """Note which legs are beyond a limit in states (n, t, 4)."""
        q = (states[..., 0], states[..., 1])
        for index, model in enumerate(self._models):
            for stop in model.stops:
                depth = stop.depth((q[0][index], q[1][index]))
                self.outside[index] |= bool(np.any(depth > 0.0))

    def _hold(self, motors: Floats) -> None:
        self._pars[:, MOTOR:SMOOTH] = motors
        for block, part in zip(self._blocks, self._parts(self._pars), strict=True):
            block.pars[:] = part.T[: len(block.pars)]

    def _parts(self, rows: Floats) -> list[Floats]:
        """Rows of the legs, split by block; the last leg is repeated to fill the last block."""
        missing = len(self._blocks) * self._width - self._count
        filled = np.concatenate([rows, np.repeat(rows[-1:], missing, axis=0)])
        return np.split(filled, len(self._blocks))

    def _each(self, act: Callable[[Any], Any]) -> list[Any]:
        """Results of `act` for every block, on as many threads as there are workers.

        Raises:
            PlantFault: a leg runs away.
        """
        if self._workers > 1 and len(self._blocks) > 1:
            with ThreadPoolExecutor(self._workers) as pool:
                answers = list(pool.map(act, self._blocks))
        else:
            answers = [act(block) for block in self._blocks]
        if not all(np.all(np.isfinite(block.state)) for block in self._blocks):
            raise PlantFault(
                "integration failed",
                f"integration failed after t = {self.time:.6f} s: a leg runs away",
            )
        return answers


def _parameters(model: LegModel, regime: Regime) -> Floats:
    values = np.zeros(LAST)
    values[:SMOOTH] = parameters_of(model, regime, (0.0, 0.0))[:SMOOTH]
    return values
