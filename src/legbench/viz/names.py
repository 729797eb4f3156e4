"""Names of runs that are shown together."""

from collections.abc import Sequence

from legbench.metrics.source import Recorded


def names_of(runs: Sequence[Recorded]) -> list[str]:
    """Name of each run: plant, linkage and design, with the folder where several share these."""
    names = [run.description.title for run in runs]
    return [
        name if names.count(name) == 1 else " ".join([name, run.path.name])
        for name, run in zip(names, runs, strict=True)
    ]
