from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from viz_runs import part

from legbench.errors import ConfigError, RecordingError
from legbench.metrics.analysis import Analysis
from legbench.metrics.rating_text import shown as as_shown
from legbench.recording.reader import Recording
from legbench.viz import style
from legbench.viz.print.figures import phase_figure
from legbench.viz.print.save import save_figure


def collection(figure: Figure, panel: int) -> LineCollection:
    (found,) = figure.axes[panel].collections
    assert isinstance(found, LineCollection)
    return found


@pytest.mark.parametrize("suffix", [".png", ".svg", pytest.param(".pdf", marks=pytest.mark.long)])
def test_figures_are_the_same_bytes_each_time(hop: Recording, tmp_path: Path, suffix: str) -> None:
    run = part(hop, 0, 900)
    first = save_figure(phase_figure(run), tmp_path / f"first{suffix}")
    with mpl.rc_context({"font.size": 20.0, "axes.grid": True, "savefig.transparent": True}):
        second = save_figure(phase_figure(run), tmp_path / f"second{suffix}")
    assert first.read_bytes() == second.read_bytes()
    assert sorted(path.stem for path in tmp_path.iterdir()) == ["first", "second"]


def test_a_jump_shows_its_last_three_jumps_by_stance_and_flight(hop: Recording) -> None:
    figure = phase_figure(hop)
    lines = collection(figure, 1)
    colours = [tuple(colour[:3]) for colour in np.asarray(lines.get_colors())]
    stance, flight = style.unit(style.STANCE), style.unit(style.FLIGHT)
    assert colours == [stance, flight] * 3 + [stance]
    jumps = Analysis(hop).gait.jumps
    rows = sum(len(segment) - 1 for segment in lines.get_segments())
    assert rows == pytest.approx(1e3 * (jumps.end[-1] - jumps.start[-3]), abs=2)
    assert [text.get_text() for text in figure.legends[0].get_texts()] == [
        "stance",
        "flight",
        "earlier",
    ]


@pytest.mark.parametrize("rows", [500, 860, 1200, 1600, 2500])
def test_the_title_says_over_how_many_jumps_it_rates(hop: Recording, rows: int) -> None:
    run = part(hop, 0, rows)
    jumps = len(Analysis(run).gait.jumps)
    title = str(phase_figure(run).get_suptitle())
    expected = {0: "", 1: "(1 jump)", 2: "(2 jumps)", 3: "(3 jumps)"}
    assert title.endswith(expected.get(jumps, "(last 3 jumps)"))
    ratings = Analysis(run).ratings.chosen
    shown = min(3, jumps)
    for name, values in (("st", ratings.stance), ("fl", ratings.flight)) if jumps else ():
        assert f"$P^r_{{{name}}}$ = {as_shown(float(np.nanmean(values[-shown:])))}" in title


def test_the_title_rates_about_both_references(hop: Recording, swing: Recording) -> None:
    for run, first, other in ((hop, "motor", "equilibrium"), (swing, "equilibrium", "motor")):
        head, second = str(phase_figure(run).get_suptitle()).split("\n")
        assert f"— about the {first}: $P^r" in head
        assert second.startswith(f"about the {other}: $P^r")


def test_periods_have_a_colour_each_and_a_bar(swing: Recording) -> None:
    figure = phase_figure(swing)
    periods = Analysis(swing).periods
    assert len(collection(figure, 2).get_segments()) == len(periods)
    assert len(np.unique(collection(figure, 2).get_colors(), axis=0)) == len(periods)
    assert figure.axes[3].get_ylabel() == "oscillation period"


def test_panels_are_those_of_the_paper(hop: Recording) -> None:
    figure = phase_figure(hop)
    titles = [axes.get_title(loc="left") for axes in figure.axes]
    assert titles == ["(a) foot tip, polar", "(b) joint space", "(c) modal phase"]
    assert figure.axes[1].get_aspect() == 1.0
    title = figure.get_suptitle()
    assert "prototype · jump · z2 = 1, dz2 = 0.15 — about the motor: $P^r_{st}$ = 0." in title


def test_a_real_leg_has_the_same_figure(hop: Recording, real_hop: Recording) -> None:
    ours, theirs = phase_figure(real_hop), phase_figure(hop)
    for panel in range(3):
        for got, expected in zip(
            collection(ours, panel).get_segments(),
            collection(theirs, panel).get_segments(),
            strict=True,
        ):
            assert len(got) == pytest.approx(len(expected), abs=1)


def test_motion_that_is_purely_radial_looks_like_a_line(swing: Recording) -> None:
    columns = dict(swing.columns)
    columns["joint_pos_2"] = -columns["joint_pos_1"] + 1e-9 * np.sin(swing.time)
    radial = Recording(
        path=swing.path,
        manifest={},
        described=swing.described,
        time=swing.time,
        columns=columns,
        events=(),
    )
    low, high = phase_figure(radial).axes[0].get_xlim()
    assert high - low == pytest.approx(style.POLAR_LEAST)


@pytest.mark.parametrize("rows", [1, 30])
def test_a_stub_of_a_run_has_a_figure(hop: Recording, rows: int, tmp_path: Path) -> None:
    save_figure(phase_figure(part(hop, 0, rows)), tmp_path / "stub.png")


def test_wrong_wishes_say_what_is_possible(hop: Recording, tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"'a\.jpg'; choose from \.png, \.svg, \.pdf"):
        save_figure(Figure(), tmp_path / "a.jpg")
    (tmp_path / "file").touch()
    with pytest.raises(RecordingError, match=r"cannot write .*: File exists \[EEXIST\]"):
        save_figure(Figure(), tmp_path / "file" / "a.png")
    with pytest.raises(RecordingError, match="has no rows"):
        phase_figure(part(hop, 0, 0))
