"""The MuJoCo model of a run, made anew from what the run's manifest says."""

import warnings
from collections.abc import Mapping
from typing import Any

import mujoco

from legbench.design.setup import Setup
from legbench.errors import ConfigError, FormatError
from legbench.metrics.source import terms_of
from legbench.mjcf import BuildOptions, Ground, Linkage, LinkageKind, build_spec
from legbench.viz.entries import number_of

SHORTEST, LONGEST = 1e-3, 100.0
"""Legs and booms between these are drawn [m]; beyond them a manifest is damaged."""


def model_of(manifest: Mapping[str, Any]) -> mujoco.MjModel:
    """Compile the model that a run's manifest describes, to be posed, not to be simulated.

    The `leg.xml` beside the manifest is for other programs and is not opened: a file in a folder
    that somebody sent may include other files, or ask for more bodies than memory holds.

    Raises:
        FormatError: the manifest describes no leg that can be drawn.
    """
    terms = terms_of(manifest)
    reach = sum(terms.design.lengths)
    _check_length("design, length of the leg", reach, SHORTEST, LONGEST)
    radius = None
    if manifest.get("setup", {}).get("boom_radius") is not None:
        radius = number_of(manifest, "setup", "boom_radius", 0.0)
        _check_length("setup.boom_radius", radius, SHORTEST, LONGEST)
    tip = number_of(manifest, "ground", "tip_radius", Ground().tip_radius)
    _check_length("ground.tip_radius", tip, 0.0, reach)
    linkage = _linkage_of(manifest)
    _check_length("linkage.crank_length", linkage.crank_length, 0.0, reach)
    try:
        options = BuildOptions(
            setup=Setup(kind=terms.setup, boom_radius=radius),
            linkage=linkage,
            ground=Ground(tip_radius=tip),
        )
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            return build_spec(terms.design, options).compile()
    except (ConfigError, ValueError, UserWarning) as error:
        why = " ".join(str(error).split())
        raise FormatError(f"the manifest describes no model that can be drawn: {why}") from error


def _linkage_of(manifest: Mapping[str, Any]) -> Linkage:
    """Read the linkage of a run's manifest; what an older one lacks has its default.

    Raises:
        FormatError: there is no such linkage.
    """
    usual = Linkage()
    kind = manifest.get("linkage", {}).get("kind", usual.kind)
    if kind not in list(LinkageKind):
        raise FormatError(f"manifest linkage.kind is {kind!r}; known are {', '.join(LinkageKind)}")
    density = number_of(manifest, "linkage", "bar_density", usual.bar_density)
    crank = number_of(manifest, "linkage", "crank_length", usual.crank_length)
    try:
        return Linkage(kind=LinkageKind(kind), bar_density=density, crank_length=crank)
    except ConfigError as error:
        raise FormatError(f"manifest linkage: {error}") from None


def _check_length(entry: str, length: float, low: float, high: float) -> None:
    if not low < length < high:
        raise FormatError(
            f"manifest {entry} is {length:g} m; between {low:g} and {high:g} m it can be drawn"
        )
