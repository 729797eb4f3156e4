"""Rating of many imperfect legs in one fixed setup, as the analytic plant would run each.

    shapes = rate_many(experiment, [Imperfections(stiffness_error=(0.0, 0.03)), ...], periods=6)

Motors that stand still between two commands leave the motion to the compiled equations; what acts
on the motors every cycle is integrated as arrays, in step with controller and servo.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from legbench.control import PositionJumpConfig, make_controllers
from legbench.design.setup import SetupKind
from legbench.errors import ConfigError, DesignError
from legbench.experiment import Experiment
from legbench.explain.held import move_held
from legbench.explain.rating import Rows, Shapes, rate_rows
from legbench.explain.rows import targets_of_many
from legbench.explain.sampled import move_sampled
from legbench.imperfections import Imperfections
from legbench.plant.backlash import rest_of
from legbench.plant.start import PERIOD
from legbench.signals import Bools, Ints

ROWS_TOGETHER = 400_000
"""Number of rows of all legs that are kept at once [-]: some tens of megabytes, whatever number of
legs is asked for."""

IN_STEP = 4
"""Number of such batches that move in step where motors move cycle by cycle [-]: the interpreter's
time for a cycle does not grow with the legs."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Watch:
    """Callbacks of a long computation; by default nobody is told of it and nobody stops it."""

    begin: Callable[[str, int], None] = lambda _stage, _legs: None
    """Called with the name of a stage that begins and the number of legs that it rates, about."""
    advance: Callable[[int], None] = lambda _legs: None
    """Called with the number of legs that were rated since the last call."""
    stopped: Callable[[], bool] = lambda: False
    """Asked between batches whether to end with what is there."""


NOBODY = Watch()
"""Watch that tells nobody and never stops."""


def rate_many(
    experiment: Experiment,
    imperfections: Sequence[Imperfections],
    *,
    periods: int,
    watch: Watch = NOBODY,
) -> Shapes:
    """Rate the leading periods of an experiment for many legs with imperfections of their own.

    A guide's damping acts in `ffs` alone and is left out elsewhere, where nothing guides the trunk.
    Legs whose springs do not hold them in the first posture, and those that were not reached before
    the watch stopped, have no ratings (NaN).

    Args:
        experiment: what is done in a fixed setup; its own imperfections and plant do not count.
        imperfections: one for each leg, without noise.
        periods: how many periods to rate.
        watch: told how many legs are done, and asked whether to end.

    Raises:
        ConfigError: the leg jumps or hangs on a boom, an encoder is noisy, or a leg cannot be.
    """
    check(experiment, imperfections)
    legs = [in_setup(each, experiment.setup.kind) for each in imperfections]
    rests = _rests(experiment, legs)
    held = rests & np.array([_held(experiment, each) for each in legs], dtype=np.bool_)
    # Legs without friction and guide have shorter equations, and dry friction needs shorter steps.
    kinds = np.array([2 * bool(leg.coulomb_friction) + bool(leg.guide_damping) for leg in legs])
    together = max(8, ROWS_TOGETHER // round(experiment.duration / PERIOD))
    counting = experiment.controller.describe().counting
    found = Shapes.unknown(len(legs), periods)
    found.broken[~rests] = True

    def take(part: Ints, rows: Rows) -> None:
        found.put(part, rate_rows(rows, periods, counting))
        watch.advance(len(part))

    again: list[int] = []
    for part in _batches(np.flatnonzero(held), kinds, together):
        if not watch.stopped():
            rows, outside = move_held(experiment, [legs[place] for place in part])
            again.extend(part[outside])
            take(part[~outside], rows.taken(~outside))
    rest = np.array([*np.flatnonzero(rests & ~held), *again], dtype=np.int64)
    for batch in _batches(rest, kinds // 2, IN_STEP * together):
        some = [legs[place] for place in batch]
        moved = move_sampled(experiment, some, together, watch.stopped)
        for part, rows in zip(_split(batch, together), moved, strict=False):
            take(part, rows)
    return found


def _rests(experiment: Experiment, legs: Sequence[Imperfections]) -> Bools:
    """Whether the springs of each leg hold it where the experiment begins (n,).

    Raises:
        ConfigError: the leg that the controller believes in is not held there.
    """
    targets = targets_of_many(experiment, len(legs))
    motor_pos = make_controllers([experiment.controller] * len(legs), targets).start_motor_pos
    try:
        rest_of(targets.designs, targets.support, motor_pos, legs)
    except DesignError:
        if len(legs) == 1:
            return np.zeros(1, dtype=np.bool_)
        half = len(legs) // 2
        return np.concatenate([_rests(experiment, legs[:half]), _rests(experiment, legs[half:])])
    return np.ones(len(legs), dtype=np.bool_)


def _batches(places: Ints, kinds: Ints, size: int) -> list[Ints]:
    """Places in batches of one kind and of that size at the most."""
    return [
        part
        for kind in np.unique(kinds[places])
        for part in _split(places[kinds[places] == kind], size)
    ]


def _split(places: Ints, size: int) -> list[Ints]:
    return [places[first : first + size] for first in range(0, len(places), size)]


def check(experiment: Experiment, imperfections: Sequence[Imperfections]) -> None:
    """Refuse what the equations of held legs do not know; raises ConfigError."""
    if not imperfections:
        raise ConfigError("no leg to rate; give the imperfections of one leg or more")
    setup = experiment.setup
    if setup.kind is SetupKind.JUMP or setup.boom_radius is not None:
        raise ConfigError(
            f"setup {setup.kind}{'' if setup.boom_radius is None else ' with a boom'} is not for "
            "many legs at once; hold them in hfts, vfts or ffs, without a boom"
        )
    for each in imperfections:
        if each.link_noise is not None or each.motor_noise is not None:
            raise ConfigError("encoder noise is not rated for many legs at once; leave it out")


def in_setup(imperfections: Imperfections, setup: SetupKind) -> Imperfections:
    """Imperfections that act in a setup: what guides the trunk is there in `ffs` alone."""
    return imperfections if setup is SetupKind.FFS else replace(imperfections, guide_damping=None)


def _held(experiment: Experiment, imperfections: Imperfections) -> bool:
    """Whether the motors stand still from the first control action on."""
    return (
        isinstance(experiment.controller, PositionJumpConfig)
        and experiment.servo.ideal
        and imperfections.backlash is None
        and imperfections.motor_slew_rate is None
        and not any(imperfections.motor_delay_cycles or (0,))
    )
