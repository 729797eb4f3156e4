"""What runs shown together are called."""

from collections.abc import Sequence

from legbench.metrics.source import Recorded


def names_of(runs: Sequence[Recorded]) -> list[str]:
    """Plant, linkage and design of each run; its folder, too, where that names several."""
    names = [run.description.title for run in runs]
    return [
        name if names.count(name) == 1 else " ".join([name, run.path.name])
        for name, run in zip(names, runs, strict=True)
    ]
