"""Link what a wheel needs from this environment into another one."""

import sysconfig
from collections.abc import Iterator
from importlib import metadata
from pathlib import Path

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name


def link_needed(wheel: Path, place: Path) -> None:
    """Link the files of every distribution that a wheel needs, without any of its extras.

    Args:
        wheel: archive whose metadata name what it needs.
        place: folder of the environment into which files are linked.

    Raises:
        importlib.metadata.PackageNotFoundError: this environment lacks one of them.
    """
    (itself,) = metadata.distributions(path=[str(wheel)])
    paths = {"base": str(place), "platbase": str(place)}
    site = Path(sysconfig.get_path("platlib", scheme="venv", vars=paths))
    for needed in _closure(itself).values():
        for file in needed.files or ():
            # Programs of a distribution lie outside of the packages' folder, and nobody needs them.
            if ".." not in file.parts:
                link = site / file
                link.parent.mkdir(parents=True, exist_ok=True)
                link.symlink_to(file.locate())


def _closure(itself: metadata.Distribution) -> dict[str, metadata.Distribution]:
    """Distributions that one needs, by name, and those that these need."""
    found: dict[str, metadata.Distribution] = {}
    asked: set[tuple[str, str]] = set()
    left = list(_needs(itself, ""))
    while left:
        name, extra = left.pop()
        if (name, extra) not in asked:
            asked.add((name, extra))
            found.setdefault(name, metadata.distribution(name))
            left += _needs(found[name], extra)
    return found


def _needs(distribution: metadata.Distribution, extra: str) -> Iterator[tuple[str, str]]:
    """Names and extras that a distribution with one of its extras asks for on this system."""
    for text in distribution.requires or ():
        asked = Requirement(text)
        if asked.marker is None or asked.marker.evaluate({"extra": extra}):
            for more in ("", *asked.extras):
                yield canonicalize_name(asked.name), more
