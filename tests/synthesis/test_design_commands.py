import itertools
import json
import re
from pathlib import Path

import pytest

from legbench.cli import main
from legbench.design import load_design
from legbench.design.scaling import quadruped
from legbench.viz.print.designs import PAGE

MODELS = Path(__file__).parents[2] / "models"
PROTOTYPE = str(MODELS / "prototype.toml")


def test_design_prints_one_json_object_and_writes_a_design(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "new" / "my.toml"
    assert main(["design", "--out", str(out), "--measured", PROTOTYPE, "--json"]) == 0
    printed = capsys.readouterr()
    content = json.loads(printed.out)
    leg = load_design(out)
    assert content["design"]["thigh"]["mass"] == leg.thigh.mass
    assert content["objective"] == pytest.approx(0.2573, abs=1e-4)
    assert content["differential_evolution"]["objective_difference"] < 1e-4
    assert len(content["active_bounds"]) == 6
    assert len(content["manufacture"]) == 17
    assert [weight["segment"] for weight in content["weights"]] == ["thigh", "shank", "foot"]
    assert content["evaluations"] > 1000
    assert f"wrote {out}" in printed.err


def test_design_in_words(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["design", "--no-cross-check", "--seed", "3"]) == 0
    words = capsys.readouterr().out
    assert "objective (11)    0.257312" in words
    assert "(lower bound is active)" in words
    assert "VIOLATED" not in words
    assert "m_2  126.2 g" in words
    assert "differential evolution" not in words


def test_design_of_a_quadruped_from_a_file_and_by_name(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "big.toml"
    path.write_text(
        '[units]\nmass = "g"\n[leg]\ntotal_mass = 2500\nleg_mass = 907.5\n'
        f"leg_com = {quadruped(10.0).leg_com}\nrelaxed_length = {quadruped(10.0).relaxed_length}\n"
        f"leg_stiffness = {quadruped(10.0).leg_stiffness}\ndamping = {quadruped(10.0).damping}\n"
    )
    seen = []
    for asked in (["quadruped", "--mass", "10"], [str(path)]):
        assert main(["design", "--no-cross-check", "--json", "--requirements", *asked]) == 0
        seen.append(json.loads(capsys.readouterr().out))
    for name in ("objective", "ratios"):
        assert seen[0][name] == pytest.approx(seen[1][name], rel=1e-6)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--requirements", "quadruped"], "preset 'quadruped' needs the body's --mass"),
        (["--mass", "3"], "--mass belongs to --requirements quadruped, not to 'paper'"),
        (["--requirements", "none.toml"], "no such requirements file; the presets are 'paper'"),
        (["--requirements", "quadruped", "--mass", "nan"], "body mass is nan kg"),
        (["--seed", "-1"], "seed is -1; it must be 0 or more"),
        (["--out", "/proc/none/my.toml"], "cannot write"),
    ],
)
def test_design_refuses_in_one_line(
    arguments: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    unwritable = message == "cannot write"
    assert main(["design", "--no-cross-check", *arguments]) == (1 if unwritable else 2)
    printed = capsys.readouterr()
    assert printed.out == ""
    (line,) = [line for line in printed.err.splitlines() if line.startswith("legbench: ")]
    assert message in line


@pytest.mark.parametrize("flag", ["--drawing", "--plot"])
def test_a_picture_of_no_kind_is_refused_before_the_search(
    flag: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("legbench.synthesis.solve.solve", None)
    assert main(["design", flag, "leg.bmp"]) == 2
    assert "a figure cannot be written as 'leg.bmp'" in capsys.readouterr().err


def test_progress_tells_the_best_leg_and_the_time_left_at_the_most(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    told: list[str] = []
    clock = itertools.count()
    monkeypatch.setattr("legbench.cli.design.status_line", told.append)
    monkeypatch.setattr("legbench.cli.output.time.monotonic", lambda: float(next(clock)))
    assert main(["design", "--no-cross-check", "--evaluations", "100", "--seed", "2"]) == 0
    first, *later = told
    assert re.fullmatch(r" +20 of at most 100 evaluations, best \S.*", first)
    assert "left" not in first
    # A second a generation: what is left of 100 evaluations in generations of 20.
    assert [line.rsplit(", ", 1)[1] for line in later] == [
        f"0:{seconds:02d} left at the most" for seconds in (3, 2, 1, 0)
    ]


def test_a_stopped_search_keeps_its_best_and_goes_on(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    trace = tmp_path / "search.jsonl"
    arguments = ["design", "--trace", str(trace), "--json", "--no-cross-check"]
    assert main([*arguments, "--evaluations", "400"]) == 0
    stopped = capsys.readouterr()
    part = json.loads(stopped.out)
    assert not part["complete"]
    assert part["evaluations"] == 400
    assert part["active_bounds"] == []
    assert f"this is the best of 400 evaluations; the same command continues {trace}" in stopped.err
    assert main(arguments) == 0
    whole = json.loads(capsys.readouterr().out)
    assert whole["complete"]
    assert whole["objective"] < part["objective"]
    assert len(trace.read_text().splitlines()) == 1 + whole["evaluations"] // 20


@pytest.mark.parametrize("suffix", ["svg", pytest.param("png", marks=pytest.mark.long)])
def test_pictures(tmp_path: Path, suffix: str) -> None:
    leg, plot = tmp_path / f"leg.{suffix}", tmp_path / f"plot.{suffix}"
    pictures = ["--drawing", str(leg), "--plot", str(plot)]
    assert main(["design", "--no-cross-check", *pictures]) == 0
    for path in (leg, plot):
        assert path.stat().st_size > 5000
    if suffix == "svg":
        text = leg.read_text()
        size = re.search(r'width="([\d.]+)pt" height="([\d.]+)pt"', text)
        assert size is not None
        page = [25.4 / 72.0 * float(points) for points in size.groups()]
        assert page == pytest.approx(PAGE, abs=0.01)  # else the scale would not be true
        assert "1 : 2" in text
        assert "253.0" in text


def test_check_of_the_prototype(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", PROTOTYPE]) == 1
    words = capsys.readouterr().out
    verdicts = {
        line.split()[0]: line.split()[1]
        for line in words.splitlines()
        if " met " in line or " VIOLATED " in line
    }
    assert verdicts == {
        "inertia": "met",
        "elastic": "met",
        "gravity": "VIOLATED",
        "damping": "VIOLATED",
        "stability": "met",
    }
    assert "springs.damping (d1): -0.0019 N m s/rad (-21 %) mends it" in words
    assert "model and algebra agree" in words


def test_check_as_json(capsys: pytest.CaptureFixture[str]) -> None:
    table2 = str(MODELS / "table2.toml")
    flags = ["--relaxed-length", "0.253", "--target", table2, "--json"]
    assert main(["check", table2, *flags]) == 0
    content = json.loads(capsys.readouterr().out)
    assert content["met"]
    assert content["model"]["agrees"]
    mend = content["conditions"]["inertia"]["mends"][0]
    assert mend["parameter"] == "thigh.inertia (I1)"
    assert mend["change"] == pytest.approx(-1.54e-6, rel=1e-3)
    assert all(weight["mass"] == 0.0 for weight in content["weights"])


def test_check_tells_exact_from_rounded(capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["check", str(MODELS / "table2.toml"), "--no-model"]
    assert main(arguments) == 0
    assert main([*arguments, "--tolerance", "1e-12"]) == 1
    assert main([*arguments, "--tolerance", "nan"]) == 2
    assert "tolerance is nan; it must be zero or more" in capsys.readouterr().err


def test_check_with_a_small_yield(capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["check", PROTOTYPE, "--no-model", "--tolerances", "default", "--legs", "4"]
    assert main(arguments) == 1
    assert "of 4 legs keep P^r above 0.95" in capsys.readouterr().out
