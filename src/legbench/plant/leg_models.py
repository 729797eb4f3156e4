"""Models of the legs of a batch, each kept as the fields in which it differs from the first."""

from collections.abc import Iterator, Sequence

import mujoco
import numpy as np
from mujoco import batch

from legbench.design import LegDesign
from legbench.errors import ConfigError
from legbench.mjcf import BuildOptions, bare_model, rest_qpos
from legbench.signals import Floats

Built = tuple[LegDesign, BuildOptions]
"""Leg as it was built, and the options that its imperfections ask for."""


def batch_of(
    built: Sequence[Built], designs: Sequence[LegDesign], joint_pos: Floats, threads: int
) -> tuple[batch.Batch, mujoco.MjModel, Floats]:
    """Make a batch of legs, with the first one's model and each one's coordinates at rest (n, nq).

    MuJoCo's bindings spend 60 KiB of Python's arrays on a model, and a leg's own numbers are
    1.5 KiB, so models are compiled one after another and only what differs from the first is kept.

    Args:
        built: each leg as it was built.
        designs: each leg as it is believed to be, which posture and loops are computed from.
        joint_pos: link angles to begin at (n, 2) [rad].
        threads: how many threads step the legs.

    Raises:
        ConfigError: MuJoCo refuses a leg, or one has other parts than the first.
    """
    models = _compiled(built)
    first_legs, model = next(models)
    made = batch.Batch(model, nsim=len(built), nthread=threads)
    start = np.empty((len(built), model.nq))
    fields = _filled_fields(model)
    for leg in first_legs:
        start[leg] = rest_qpos(model, designs[leg], joint_pos[leg])
    for legs, other in models:
        _set_fields(made, legs, other, fields)
        for leg in legs:
            start[leg] = rest_qpos(other, designs[leg], joint_pos[leg])
    return made, model, start


def _compiled(built: Sequence[Built]) -> Iterator[tuple[list[int], mujoco.MjModel]]:
    """Yield the model of each set of equal legs, with their places."""
    dry = any(any(options.friction) for _, options in built)
    places: dict[Built, list[int]] = {}
    for place, leg in enumerate(built):
        places.setdefault(leg, []).append(place)
    for leg, legs in places.items():
        yield legs, bare_model(*leg, dry=dry)


def _filled_fields(model: mujoco.MjModel) -> dict[str, bytes]:
    """Content of every array of a model that holds something.

    Names are no array, and the statistics take no part in the motion: solvers scale their
    tolerance by the inertia of the moment, not by the mean one (MuJoCo 4.0, `statistic`).
    """
    arrays = {name: getattr(model, name) for name in sorted(batch.MODEL_FIELDS) if "." not in name}
    return {name: array.tobytes() for name, array in arrays.items() if array.size}


def _set_fields(
    made: batch.Batch, legs: Sequence[int], model: mujoco.MjModel, fields: dict[str, bytes]
) -> None:
    """Give some legs of a batch the numbers in which their model differs from the first."""
    for name, first in fields.items():
        array = getattr(model, name)
        content = array.tobytes()
        if content == first:
            continue
        if len(content) != len(first):
            raise ConfigError(
                f"leg {legs[0]} of the batch has other parts than leg 0: MuJoCo's {name} takes "
                f"{len(content)} bytes for {len(first)}; run it alone"
            )
        made.expand(name)[legs] = array
