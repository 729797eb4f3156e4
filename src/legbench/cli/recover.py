"""`legbench recover`: make a run whole that was cut off."""

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated

from tyro.conf import Positional

from legbench.cli.output import print_json
from legbench.cli.parse import parse
from legbench.recording.repair import recover


@dataclass(frozen=True, slots=True, kw_only=True)
class RecoverArguments:
    """Repair a run that was cut off: keeps every whole batch of rows, loses nothing else."""

    run: Annotated[Path, Positional]
    """Run folder."""
    json: bool = False
    """Print one JSON object on stdout."""


def main(arguments: list[str]) -> int:
    """Run `legbench recover`; its exit status is 0 also if there was nothing to repair."""
    chosen = parse(RecoverArguments, "recover", arguments)
    report = recover(chosen.run)
    if chosen.json:
        content = asdict(report)
        print_json({"run": str(content.pop("path"))} | content)
    else:
        print(report)
    return 0
