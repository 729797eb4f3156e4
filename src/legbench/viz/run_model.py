"""The MuJoCo model of a run, made anew from what the run says of itself."""

import warnings

import mujoco

from legbench.errors import ConfigError, FormatError
from legbench.mjcf import BuildOptions, Ground, Linkage, LinkageKind, build_spec
from legbench.recording.description import RunDescription
from legbench.recording.tables import ManifestTable

SHORTEST, LONGEST = 1e-3, 100.0
"""Legs and booms between these are drawn [m]; beyond them a manifest is damaged."""


def model_of(run: RunDescription) -> mujoco.MjModel:
    """Compile the model that a run describes, to be posed, not to be simulated.

    The `leg.xml` in its folder is for other programs and is not opened: a file in a folder that
    somebody sent may include other files, or ask for more bodies than memory holds.

    Raises:
        FormatError: the run describes no leg that can be drawn.
    """
    tables = ManifestTable(entries=run.experiment)
    reach = sum(run.design.lengths)
    _check_length("design, length of the leg", reach, SHORTEST, LONGEST)
    if run.setup.boom_radius is not None:
        _check_length("setup.boom_radius", run.setup.boom_radius, SHORTEST, LONGEST)
    tip = tables.table("ground").number("tip_radius")
    tip = Ground().tip_radius if tip is None else tip
    _check_length("ground.tip_radius", tip, 0.0, reach)
    linkage = _linkage_of(tables.table("linkage"))
    _check_length("linkage.crank_length", linkage.crank_length, 0.0, reach)
    try:
        options = BuildOptions(setup=run.setup, linkage=linkage, ground=Ground(tip_radius=tip))
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            return build_spec(run.design, options).compile()
    except (ConfigError, ValueError, UserWarning) as error:
        why = " ".join(str(error).split())
        raise FormatError(f"the run describes no model that can be drawn: {why}") from error


def _linkage_of(table: ManifestTable) -> Linkage:
    """Read the linkage of a run; what an older one lacks has its default.

    Raises:
        FormatError: there is no such linkage.
    """
    usual = Linkage()
    kind = table.choice("kind", LinkageKind, usual.kind)
    crank = table.number("crank_length")
    try:
        return Linkage(
            kind=kind,
            bar_density=table.number("bar_density"),
            crank_length=usual.crank_length if crank is None else crank,
        )
    except ConfigError as error:
        raise FormatError(f"manifest linkage: {error}") from None


def _check_length(entry: str, length: float, low: float, high: float) -> None:
    if not low < length < high:
        raise FormatError(
            f"manifest {entry} is {length:g} m; between {low:g} and {high:g} m it can be drawn"
        )
