import json
import re
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
import pytest
from campaign_tables import STEP, as_the_paper_says, periods
from pyarrow import parquet

from legbench.campaign import read_table
from legbench.campaign.again import experiment_of
from legbench.campaign.curves import rows_of
from legbench.cli import main
from legbench.errors import CampaignError, ConfigError
from legbench.experiment import experiment_hash
from legbench.report import write_report
from legbench.viz.print._matplotlib import Axes, Figure
from legbench.viz.print.inline import panel_svg
from legbench.viz.print.ratings import PrintedRating, RatingPanel, draw_ratings, looks_of

VOID = {"meta", "link", "img", "br"}
LARGEST = 3_000_000
"""Largest page [bytes]."""


class Outline(HTMLParser):
    """Tags of a page, each closed in its turn."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.ids: list[str] = []
        self.counts: dict[str, int] = {}
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.counts[tag] = self.counts.get(tag, 0) + 1
        self.ids += [value for name, value in attrs if name == "id" and value]
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.handle_starttag(tag, attrs)
        if tag not in VOID:
            self.open.pop()

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


@pytest.mark.long
def test_the_page_is_whole_small_and_asks_for_nothing(
    reported: tuple[Path, dict[str, Any]],
) -> None:
    text = reported[0].read_text(encoding="utf-8")
    outline = Outline(text)
    assert outline.open == []
    assert len(text.encode()) < LARGEST
    assert "script" not in outline.counts
    assert len(outline.ids) == len(set(outline.ids))
    assert outline.counts["details"] >= 5
    assert not re.search(r"(src|href|url\()\s*=?\s*[\"'(]?\s*(https?:)?//", text)
    # Panels of Figs. 4 (twice), 5 (twice), 6 and 7.
    assert text.count('<div class="panel">') == 2 * 3 + 2 * 6 + 3 + 8


@pytest.mark.long
def test_names_of_a_campaign_are_text(reported: tuple[Path, dict[str, Any]]) -> None:
    text = reported[0].read_text(encoding="utf-8")
    assert "small &lt;b&gt; &amp; fair" in text
    assert "small <b>" not in text


@pytest.mark.long
def test_experiments_without_recordings_are_run_afresh_under_their_hash(
    reported: tuple[Path, dict[str, Any]], small: Path
) -> None:
    page, content = reported
    text = page.read_text(encoding="utf-8")
    rows = {row["experiment"]: row for row in rows_of(read_table(small), "run")}
    for name, z2 in (("step", 1.0), ("bang-bang", 1.24), ("jump", 0.45)):
        told = content["experiments"][name]
        assert told["origin"] == "run afresh, as the campaign kept no recordings"
        assert rows[told["experiment"]]["controller.settings.z2"] == z2
        assert told["experiment"] in text


@pytest.mark.long
def test_every_experiment_of_a_campaign_is_made_anew_from_its_folder(small: Path) -> None:
    rows = rows_of(read_table(small), "run")
    for row in rows:
        experiment = experiment_of(small, row)
        assert experiment_hash(experiment) == row["experiment"]
        assert experiment.controller.kind == row["controller.kind"]
        assert experiment.imperfections.link_noise == (1e-4, 1e-4)
    assert {experiment_of(small, row).setup.kind.value for row in rows} == {
        "hfts",
        "vfts",
        "ffs",
        "jump",
    }


@pytest.mark.long
def test_an_experiment_that_would_be_another_is_refused(small: Path, tmp_path: Path) -> None:
    row = next(row for row in rows_of(read_table(small), "run"))
    told = json.loads((small / "campaign.json").read_bytes())
    for example in told["examples"]:
        example["design"]["springs"]["stiffness"] = [2.4, 2.3]
    (tmp_path / "campaign.json").write_text(json.dumps(told), encoding="utf-8")
    with pytest.raises(CampaignError, match="cannot be made anew: what the folder tells is"):
        experiment_of(tmp_path, row)
    (tmp_path / "campaign.json").write_text("{}", encoding="utf-8")
    with pytest.raises(CampaignError, match="has no whole experiment with this controller"):
        experiment_of(tmp_path, row)


@pytest.mark.long
def test_numbers_stand_beside_the_paper(reported: tuple[Path, dict[str, Any]]) -> None:
    numbers = {row["key"]: row for row in reported[1]["numbers"]}
    assert numbers["step_rating_1"]["published"] == "0.94"
    equilibrium, motor = numbers["step_rating_1_caption"]["counterparts"]["ideal"]
    assert (equilibrium["reference"], motor["reference"]) == ("equilibrium", "motor")
    assert 0.98 < equilibrium["value"] < 1.0
    assert equilibrium["agrees"] is False
    assert motor["value"] == pytest.approx(1.0, abs=1e-3)
    assert numbers["step_rating_1"]["counterparts"]["ideal"][0]["text"] == "no run shows it"
    assert numbers["foot_clearance"]["published"] == "45 mm"
    assert numbers["jump_rating_flight"]["published"] == "> 0.97"
    assert numbers["experiments"]["counterparts"]["ideal"][0]["agrees"] is False


def synthetic(folder: Path) -> Path:
    """Folder of a campaign that is nothing but a table, with two invalid runs and trials."""
    runs = as_the_paper_says()
    runs.add("ffs", STEP, 1.4, 0.3, periods([0.99]), status="fault", cause="straightened")
    runs.add("hfts", STEP, 1.4, 0.1, periods([0.99]), numerics="unsound", energy_residual=0.65)
    runs.add("ffs", STEP, 1.0, 0.3, periods([0.7, 0.6]), trial=1)
    folder.mkdir()
    parquet.write_table(runs.table(), folder / "table.parquet")
    return folder


def test_a_report_is_about_something(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="a report needs a campaign"):
        write_report([], tmp_path / "report.html")


@pytest.mark.long
def test_single_figures_are_written_beside_the_page(reported: tuple[Path, dict[str, Any]]) -> None:
    page, content = reported
    assert content["out"] == str(page)
    stems = ("fig4-step", "fig4-bang-bang", "fig5-ideal-equilibrium", "fig5-ideal-motor")
    names = {f"{stem}.png" for stem in (*stems, "fig6", "fig7")}
    assert {path.name for path in (page.parent / "figures").iterdir()} == names
    assert {Path(path).name for path in content["figures"]} == names
    assert all(Path(path).stat().st_size > 3000 for path in content["figures"])


def test_the_same_panel_is_the_same_text_whatever_the_style_of_the_user() -> None:
    def draw(panel: Axes) -> None:
        panel.plot([0.0, 1.0], [2.0, 3.0])
        panel.set_xlabel("x")

    first = panel_svg("one", 'a "line"', (2.0, 2.0), draw)
    with mpl.rc_context({"font.size": 20.0, "axes.facecolor": "red", "svg.fonttype": "path"}):
        assert panel_svg("one", 'a "line"', (2.0, 2.0), draw) == first
    assert first.startswith('<svg role="img" aria-label="a &quot;line&quot;"')
    assert "currentColor" in first
    assert not re.search(r"<metadata|<!DOCTYPE|<\?xml| d=\"[^\"]*\.\d{3}", first)
    ids, used = re.findall(r'id="([^"]+)"', first), re.findall(r"#([\w-]+)", first)
    assert len(ids) == len(set(ids))
    assert set(ids) <= set(used)


def test_a_panel_without_a_run_says_so_and_shows_a_printed_level_as_a_line() -> None:
    level = PrintedRating(first=4, last=None, rating=0.94)
    content = RatingPanel(title="(f)", group="bang-bang", curves=(), printed=(level,))
    panel = Figure().add_subplot()
    draw_ratings(panel, content, looks_of([content]), "black")
    assert [each.get_text() for each in panel.texts] == ["no run"]
    (line,) = panel.get_lines()
    assert np.ptp(np.asarray(line.get_xdata())) == 2.0


def test_a_table_alone_is_reported_and_invalid_runs_are_flagged(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = synthetic(tmp_path / "table")
    assert main(["report", str(folder), "--explained", str(folder)]) == 0
    told = capsys.readouterr()
    assert "ideal: 14 of 15 statements hold\n" in told.out
    assert "  invalid: 130000000000, fault (straightened) after 2 s\n" in told.out
    assert "  invalid: 140000000000, numerics unsound: energy residual 0.65\n" in told.out
    assert told.err == f"wrote {folder / 'report.html'}\n"
    text = (folder / "report.html").read_text(encoding="utf-8")
    assert Outline(text).open == []
    assert text.count("2 of 16 runs did not come to their end or left the") == 2
    assert text.count('data-label="explained"') == 14
    assert "Fig. 5, explained" in text
    for figure in ("Fig. 4, step", "Fig. 4, bang-bang", "Fig. 6", "Fig. 7"):
        block = text[text.index(f"<h2>{figure}") :]
        assert block.partition("<figcaption>")[2].startswith("Not drawn: ")


def test_a_folder_without_a_table_is_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["report", str(tmp_path)]) == 2
    told = capsys.readouterr()
    assert told.out == ""
    assert told.err.startswith(f"legbench: {tmp_path / 'table.parquet'} is not there")
    assert told.err.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_a_page_that_cannot_be_written_is_refused_at_once(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = synthetic(tmp_path / "table")
    (tmp_path / "file").write_text("")
    monkeypatch.setattr("legbench.report.writing.write_report", None)
    assert main(["report", str(folder), "--out", str(tmp_path / "file" / "report.html")]) == 1
    told = capsys.readouterr()
    assert told.err.startswith(f"legbench: cannot write {tmp_path / 'file'}")
    assert told.err.count("\n") == 1
    assert main(["report", str(folder), "--out", str(tmp_path / "page.png")]) == 2
    assert "the page is a .html file" in capsys.readouterr().err
