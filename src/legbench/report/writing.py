"""Writing of a report: the page, single figures, and the same content for JSON."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final

from legbench.errors import ConfigError
from legbench.loop import Progress
from legbench.paper import published
from legbench.report.named import Named, named_experiments
from legbench.report.page import JudgedPaper, headlines, judge, page_html
from legbench.report.paper_figures import blocks_of, print_figures
from legbench.report.sources import CampaignSource
from legbench.viz.print.save import save_figure
from legbench.writing import save_whole

FIGURES: Final = "figures"
"""Folder of single figures, beside the page."""


@dataclass(frozen=True, slots=True, kw_only=True)
class WrittenReport:
    """Report that was written."""

    page: Path
    figures: tuple[Path, ...]
    content: dict[str, Any]
    """Statements, numbers and invalid runs, for JSON."""


def write_report(
    sources: Sequence[CampaignSource],
    out: Path | str,
    *,
    suffixes: Sequence[str] = (),
    progress: Progress | None = None,
) -> WrittenReport:
    """Write the report of campaigns.

    Args:
        sources: the campaigns, the one that is reported on first.
        out: file of the page; its folder is made if need be.
        suffixes: kinds of files, `png`, `svg` or `pdf`, that single figures are written as, into
            the folder `figures` beside the page.
        progress: told how far a run is that is done afresh because its recording was not kept.

    Raises:
        ConfigError: the page cannot be written.
        RecordingError: a figure cannot be written.
        MissingExtraError: jinja2 or matplotlib is not installed.
    """
    if not sources:
        raise ConfigError("a report needs a campaign")
    out, numbers = Path(out), published()
    named = named_experiments(sources[0], numbers, progress)
    judged = judge(sources, numbers)
    html = page_html(sources, judged, tuple(blocks_of(sources, named, numbers)), named)
    save_whole(out, html)
    figures = [
        save_figure(figure, out.parent / FIGURES / f"{name}.{suffix}")
        for name, figure in (print_figures(sources, named, numbers) if suffixes else ())
        for suffix in suffixes
    ]
    content = report_content(sources, judged, named)
    content |= {"out": str(out), "figures": [str(path) for path in figures]}
    return WrittenReport(page=out, figures=tuple(figures), content=content)


def report_content(
    sources: Sequence[CampaignSource], judged: JudgedPaper, named: Sequence[Named]
) -> dict[str, Any]:
    """Everything that the page says in words and numbers, as plain values."""
    return {
        "sources": {
            source.name: {
                "folder": str(source.folder),
                "campaign": source.title,
                "held": sum(trend.held is True for trend in headlines(judged, source.name)),
                "judged": sum(trend.held is not None for trend in headlines(judged, source.name)),
                "invalid": [asdict(run) for run in judged.invalid[source.name]],
            }
            for source in sources
        },
        "statements": [
            {
                "key": statement.trend.key,
                "statement": statement.trend.statement,
                "place": statement.trend.place,
                "verdicts": [
                    {
                        "source": verdict.source,
                        "reference": verdict.about or None,
                        "held": verdict.trend.held,
                        "evidence": verdict.trend.evidence,
                    }
                    for verdict in statement.verdicts
                ],
            }
            for statement in judged.statements
        ],
        "numbers": [asdict(row) for row in judged.numbers],
        "experiments": {
            each.name: {"experiment": each.experiment, "origin": each.origin} for each in named
        },
    }
