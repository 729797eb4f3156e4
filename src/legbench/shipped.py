"""Designs, campaigns and bench files that come with the package, wherever it is installed.

A wheel carries the folders `models` and `hardware` beside its modules; in a checkout they are those
of the checkout.
"""

from pathlib import Path
from typing import Final

FOLDERS: Final = ("models", "hardware")
"""Folders of files that come with the package."""
_INSTALLED: Final = Path(__file__).parent / "_shipped"
_CHECKOUT: Final = Path(__file__).parents[2]


def shipped_root() -> Path:
    """Folder that holds `models` and `hardware`."""
    return _INSTALLED if _INSTALLED.is_dir() else _CHECKOUT


def shipped_designs() -> tuple[str, ...]:
    """Names of the designs that come with the package, in alphabetical order."""
    return tuple(sorted(path.stem for path in (shipped_root() / "models").glob("*.toml")))


def locate(path: Path, folder: Path = Path()) -> Path:
    """Path of a file that is to be read, which may be one that comes with the package.

    A file that exists is always the one that is meant. One that does not, and is named
    `models/...` or `hardware/...`, or by the bare name of a design, is looked for in the package;
    if it is not there either, the path is returned as it would have been read.

    Args:
        path: what the user names.
        folder: what it is relative to.
    """
    here = folder / path
    if path.is_absolute() or here.exists():
        return here
    if path.parts and path.parts[0] in FOLDERS:
        there = shipped_root() / path
    elif len(path.parts) == 1 and not path.suffix:
        there = shipped_root() / "models" / f"{path.name}.toml"
    else:
        return here
    return there if there.is_file() and ".." not in path.parts else here
