"""Trace of a search: its evaluations in memory, and as a file from which the search goes on.

The file has one JSON object a line: first the problem, then one line a generation. A search is
reproducible from its seed, so a resumed one takes the costs that stand in the file instead of
computing them again, and refuses a file that some other search wrote.
"""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TextIO, final

import numpy as np

from legbench.errors import ConfigError
from legbench.reading import UnreadableError, parse_json
from legbench.signals import Floats, Ints
from legbench.writing import write_whole

LINE = {"points", "costs"}
"""Keys of a generation's line."""


@final
class Trace:
    """All evaluations of a search in order.

    Args:
        identity: everything that decides the search, as JSON.
        path: where to keep it; an existing file is continued. None: memory only.

    Raises:
        ConfigError: the file cannot be used, or belongs to another search.
    """

    def __init__(self, identity: Mapping[str, Any], path: Path | None = None) -> None:
        self._points: list[Floats] = []
        self._costs: list[Floats] = []
        self._known: list[dict[str, Any]] = []
        self._file: TextIO | None = None
        self._path = path
        if path is not None:
            self._open(path, json.loads(json.dumps(identity)))

    @property
    def points(self) -> Floats:
        """Ratios (n, 7) [-]."""
        return np.concatenate(self._points) if self._points else np.zeros((0, 7))

    @property
    def costs(self) -> Floats:
        """Cost of every evaluation (n,) [-]."""
        return np.concatenate(self._costs) if self._costs else np.zeros(0)

    @property
    def generation(self) -> Ints:
        """Generation of every evaluation (n,)."""
        return np.repeat(np.arange(len(self._costs)), [len(costs) for costs in self._costs])

    def __len__(self) -> int:
        return sum(len(costs) for costs in self._costs)

    def best(self) -> tuple[Floats, float]:
        """Cheapest ratios so far (7,), and their cost."""
        costs = self.costs
        index = int(np.argmin(costs))
        return self.points[index], float(costs[index])

    def recall(self, points: Floats) -> Floats | None:
        """Costs of this generation, if the file has them; the search then does not compute them.

        Raises:
            ConfigError: the file's generation is not this one.
        """
        if not self._known:
            return None
        known = self._known.pop(0)
        if not np.array_equal(np.array(known["points"]), points):
            raise ConfigError(
                f"{self._path}: generation {len(self._costs)} differs from what this version "
                "searches; delete the file to start again"
            )
        return np.array(known["costs"], dtype=np.float64)

    def append(self, points: Floats, costs: Floats, *, recalled: bool) -> None:
        """Add a generation; it is written out at once unless it came from the file."""
        self._points.append(points)
        self._costs.append(costs)
        if self._file is not None and not recalled:
            line = {"points": points.tolist(), "costs": costs.tolist()}
            self._file.write(json.dumps(line) + "\n")
            self._file.flush()

    def close(self) -> None:
        """Close the file; may be called twice."""
        if self._file is not None:
            self._file.close()
            self._file = None

    def _open(self, path: Path, identity: Any) -> None:
        try:
            lines = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
            entries = _whole(lines)
            if entries and entries[0] != identity:
                raise ConfigError(
                    f"{path}: was written for other requirements or settings; delete it or name "
                    "another file"
                )
            if lines and not entries:
                raise ConfigError(f"{path}: is not a search trace; name another file")
            self._known = entries[1:]
            if any(not isinstance(known, dict) or set(known) != LINE for known in self._known):
                raise ConfigError(f"{path}: is not a search trace; name another file")
            path.parent.mkdir(parents=True, exist_ok=True)
            if len(entries) < max(1, len(lines)):
                _rewrite(path, [identity, *self._known])
            self._file = path.open("a", encoding="utf-8")
        except (OSError, UnicodeDecodeError) as error:
            raise ConfigError(f"{path}: cannot keep the search there: {error}") from None


def _rewrite(path: Path, entries: list[Any]) -> None:
    """Put whole lines in place of what is there, all at once."""
    write_whole(path, "".join(json.dumps(entry) + "\n" for entry in entries).encode())


def _whole(lines: list[str]) -> list[Any]:
    """Return the lines up to the first that a crash has cut short."""
    entries: list[Any] = []
    for line in lines:
        try:
            entries.append(parse_json(line))
        except UnreadableError:
            break
    return entries
