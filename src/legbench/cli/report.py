"""`legbench report`: a campaign beside the paper, on one page that needs nothing else."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

from tyro.conf import Positional

from legbench.cli.output import note, print_json, results_in, timed_progress
from legbench.cli.parse import parse
from legbench.errors import ConfigError

MARKS = {True: "held", False: "not held", None: "not shown"}


@dataclass(frozen=True, slots=True, kw_only=True)
class ReportArguments:
    """Write the report of a campaign: figures, numbers and statements beside the paper's."""

    campaign: Annotated[Path, Positional]
    """Folder of a campaign that has come to its end."""
    out: Path | None = None
    """File of the page; by default report.html in the folder of the campaign."""
    figures: tuple[Literal["png", "svg", "pdf"], ...] = ()
    """Kinds of files to write single figures as, into the folder figures beside the page."""
    bench: Path | None = None
    """Folder of the campaign that ran on the bench, for a column of its own."""
    explained: Path | None = None
    """Folder of the campaign of a model that explains the paper, for a column of its own."""
    json: bool = False
    """Whether to print one JSON object on stdout instead of lines."""


def main(arguments: list[str]) -> int:
    """Run `legbench report`; its exit status is 0 whatever the report says of the paper."""
    flags = parse(ReportArguments, "report", arguments)
    from legbench.report.sources import BENCH, EXPLAINED, IDEAL, read_source
    from legbench.report.writing import write_report

    folders = ((IDEAL, flags.campaign), (EXPLAINED, flags.explained), (BENCH, flags.bench))
    sources = [read_source(name, folder) for name, folder in folders if folder is not None]
    out = flags.campaign / "report.html" if flags.out is None else flags.out
    if out.suffix.lower() not in (".html", ".htm"):
        raise ConfigError(f"--out is {out}; the page is a .html file (figures: --figures png)")
    with results_in(out.parent):
        written = write_report(sources, out, suffixes=flags.figures, progress=timed_progress())
    if flags.json:
        print_json(written.content)
        return 0
    _print(written.content)
    for path in (*written.figures, written.page):
        note(f"wrote {path}")
    return 0


def _print(content: dict[str, Any]) -> None:
    """Print what holds of the paper, a line a verdict."""
    for statement in content["statements"]:
        print(f"{statement['statement']} [{statement['place']}]")
        for verdict in statement["verdicts"]:
            about = f", about the {verdict['reference']}" if verdict["reference"] else ""
            print(
                f"  {MARKS[verdict['held']]:<9} {verdict['source']}{about}: {verdict['evidence']}"
            )
    print()
    for name, source in content["sources"].items():
        print(f"{name}: {source['held']} of {source['judged']} statements hold")
        for run in source["invalid"]:
            print(f"  invalid: {run['experiment'][:12]}, {run['reason']}")
