"""MAT files of MATLAB 5 and later, which scipy writes and MATLAB, Octave and scipy read."""

from collections.abc import ItemsView, Iterator, Mapping
from pathlib import Path
from typing import Any, Final, final

import numpy as np
from scipy.io import savemat

from legbench.errors import ConfigError
from legbench.export.content import Progress, as_json, described
from legbench.recording.reader import Recording

LONGEST_NAME: Final = 63
"""Longest name of a variable that MATLAB takes."""
ABOUT: Final = "legbench"
"""Variable with the fields `units` and `phases`, both in JSON, and `run_json`."""


def write_mat(recording: Recording, path: Path, progress: Progress) -> None:
    """Write each column of a run as a variable (n, 1) of its own, bit for bit.

    `t_ns` is whole nanoseconds, `contact` is -1 where it is not known. The variable `legbench`
    holds units, names of phases and the manifest as JSON, which `jsondecode` reads.

    Raises:
        ConfigError: a column has a name that MATLAB does not take.
        OSError: the file cannot be written.
    """
    long = [name for name in recording.columns if len(name) > LONGEST_NAME or name == ABOUT]
    if long:
        raise ConfigError(
            f"column {long[0]!r} cannot be a variable of MATLAB, which takes names of up to "
            f"{LONGEST_NAME} letters, and {ABOUT!r} holds the units; choose --parquet or --csv"
        )
    savemat(
        str(path),
        _Variables(recording, progress),
        appendmat=False,
        long_field_names=True,
        do_compression=True,
        oned_as="column",
    )


@final
class _Variables(Mapping[str, Any]):
    """Variables of the file, each made when it is its turn: a long run is not in memory whole."""

    def __init__(self, recording: Recording, progress: Progress) -> None:
        self._recording, self._progress = recording, progress

    def __getitem__(self, name: str) -> Any:
        if name != ABOUT:
            return np.array(self._recording.columns[name])
        about = {key: as_json(each).decode() for key, each in described(self._recording).items()}
        return about | {"run_json": as_json(self._recording.manifest).decode()}

    def __iter__(self) -> Iterator[str]:
        return iter((ABOUT, *self._recording.columns))

    def __len__(self) -> int:
        return 1 + len(self._recording.columns)

    def items(self) -> ItemsView[str, Any]:
        """Pairs of name and value; the progress counts them."""
        return _Told(self, self._progress)


@final
class _Told(ItemsView[str, Any]):
    """Items of a mapping that tell how far it has been gone through."""

    def __init__(self, variables: _Variables, progress: Progress) -> None:
        super().__init__(variables)
        self._progress, self._count = progress, len(variables)

    def __iter__(self) -> Iterator[tuple[str, Any]]:
        for done, item in enumerate(super().__iter__(), start=1):
            yield item
            self._progress(done, self._count)
