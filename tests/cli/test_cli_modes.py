"""`legbench modes` and `legbench hop`: what they answer, what they refuse, how they stop."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from commands import MODELS, called

from legbench.cli import main

pytest.importorskip("heyoka")

PROTOTYPE, TABLE_2 = MODELS / "prototype.toml", MODELS / "table2.toml"
OPTIMAL = MODELS / "optimal.toml"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("modes", "--z2", "2.6"), ("set point z2 = 2.6 rad", "allows (-2.2, 0.9)")),
        (("modes", "--z2", "nan"), ("z2 is nan rad; it must be a number",)),
        (
            ("modes", "--at", "50"),
            ("mode does not exist at 50 J", "the knee reaches its limit of 0.3 rad"),
        ),
        (("modes", "--at", "-1"), ("at is -1 J; it must be positive",)),
        (("modes", "--energy", "-1"), ("energy is -1 J; it must be positive",)),
        (("modes", "--reach", "0"), ("reach is 0 rad; it must be positive",)),
        (("hop", "--height", "0.1"), ("mm below the ground; raise the trunk from",)),
        (("hop", "--height", "nan"), ("height is nan m; an apex lies above the ground",)),
        (("hop", "--z2", "3"), ("z2 + dz2",)),
        (("hop", "--passive", "--rest", "2.6"), ("set point z2 = 2.6 rad",)),
        (("hop", "--basin", "5"), ("a basin map needs --out",)),
        (("hop", "--basin", "1", "--out", "x"), ("basin is 1 points a side; it must be 0",)),
        (("hop", "--basin", "5", "--out", "x", "--workers", "0"), ("workers is 0",)),
        (("hop", "--basin", "5", "--out", "x", "--up", "width"), ("axis 'width' is unknown",)),
        (("hop", "--basin", "5", "--out", "x", "--passive"), ("there is no basin to map",)),
        (("hop", "--across", "foo"), ("axis 'foo' is unknown; an apex has height",)),
        (("hop", "--across-span", "nan"), ("axis z1 runs from nan to nan",)),
        (("hop", "--across", "speed"), ("both axes are speed; a map needs two",)),
        (
            ("hop", "--basin", "1000", "--out", "x"),
            ("1000 x 1000 = 1000000 cells, some", "up to 500 points a side, or say --large"),
        ),
        (("hop", "--delay", "-5"), ("delay is -5 s; it must be zero or more",)),
        (("hop", "--dz2", "-0.1"), ("dz2 is -0.1 rad; a push needs a positive amplitude",)),
        (
            ("hop", "--touchdown-load", "0.1", "--release-load", "0.5"),
            ("release_load 0.5 and touchdown_load 0.1 must satisfy 0 < release < touchdown < 1",),
        ),
        (("hop", "--apex-turn", "0"), ("apex_turn is 0 rad; it must be positive",)),
        (("hop", "--release-time", "nan"), ("release_time is nan s; it must be 0 or more",)),
    ],
    ids=lambda value: " ".join(value) if value[0] in ("modes", "hop") else "",
)
def test_a_question_that_makes_no_sense(
    arguments: tuple[str, ...], words: tuple[str, ...], capfd: pytest.CaptureFixture[str]
) -> None:
    called(capfd, arguments[0], PROTOTYPE, *arguments[1:], "--json").refused(*words)


def test_strictness_is_checked_as_far_as_the_joints_go(capfd: pytest.CaptureFixture[str]) -> None:
    done = called(capfd, "modes", TABLE_2, "--reach", "2", "--energy", "0.02", "--json")
    assert done.status == 0
    assert "there a joint reaches its limit" in done.err
    content = json.loads(done.out)
    assert 0.5 < content["reach"] < 0.7
    assert set(content["modes"]) == {"radial", "polar"}
    assert content["out"] is None


def test_a_leg_that_is_not_quite_matched_is_told_what_its_free_hops_need(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    done = called(capfd, "hop", TABLE_2, "--passive", "--out", tmp_path)
    assert done.status == 0
    assert "hops without impact: 3" in done.out
    assert "at z1 = 0 there is none" in done.out
    assert "indication only, the map is not smooth here" in done.out
    points = json.loads((tmp_path / "hop.json").read_text(encoding="utf-8"))["fixed_points"]
    assert all(point["impact"] < 1e-12 < point["symmetric_loss"] for point in points)
    assert all(abs(point["motor_z1"]) > 1e-3 for point in points)


def test_a_hop_that_is_not_stable_has_no_basin_and_the_status_says_so(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """The optimal leg's own hop turns into one of twice the period."""
    optimal = PROTOTYPE.with_name("optimal.toml")
    assert main(["hop", str(optimal), "--basin", "3", "--out", str(tmp_path)]) == 1
    assert "no basin: the periodic hop is not stable" in capfd.readouterr().err
    assert (tmp_path / "hop.json").exists()
    assert not (tmp_path / "basin.jsonl").exists()


@pytest.mark.long
@pytest.mark.skipif(os.name == "nt", reason="signals of a terminal")
def test_a_map_that_is_interrupted_ends_and_keeps_its_rows(tmp_path: Path) -> None:
    rows = tmp_path / "basin.jsonl"
    command = [sys.executable, "-m", "legbench", "hop", str(PROTOTYPE), "--basin", "100"]
    process = subprocess.Popen(
        [*command, "--out", str(tmp_path)],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    try:
        while not (rows.exists() and rows.read_text(encoding="utf-8").count("\n") > 2):
            assert process.poll() is None
            time.sleep(0.05)
        os.killpg(process.pid, signal.SIGINT)
        _, said = process.communicate(timeout=300)
    finally:
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()
    assert process.returncode == 130
    assert said.endswith("legbench: interrupted\n")
    lines = rows.read_text(encoding="utf-8").splitlines()
    assert all(len(json.loads(line)["fates"]) == 100 for line in lines[1:])


@pytest.mark.parametrize(
    "settings",
    [
        ("--delay", "-5"),
        ("--dz2", "-0.1"),
        ("--touchdown-load", "0.1", "--release-load", "0.5"),
        ("--touchdown-time", "inf"),
        ("--z2", "3"),
    ],
)
def test_hop_refuses_the_settings_that_run_refuses_in_the_same_words(
    settings: tuple[str, ...], tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    said = []
    for command in (("hop", PROTOTYPE), ("run", "jump", "--design", PROTOTYPE)):
        end = ("--out", tmp_path / "run") if command[0] == "run" else ()
        done = called(capfd, *command, *settings, *end)
        assert done.status != 0
        said.append(done.err.splitlines()[-1])
    assert said[0] == said[1]


def test_the_basin_that_is_mapped_unasked_shows_its_boundary(tmp_path: Path) -> None:
    content = tmp_path / "hop.json"
    assert main(["hop", str(PROTOTYPE), "--basin", "9", "--out", str(tmp_path)]) == 0
    shares = json.loads(content.read_text(encoding="utf-8"))["basin"]
    assert shares["returns"] > 0.2
    assert shares["stands"] + shares["fell"] > 0.2


def test_hop_makes_the_folder_that_it_writes_to(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "new" / "one"
    done = called(capfd, "hop", PROTOTYPE, "--hops", "20", "--out", out, "--json")
    assert (done.status, json.loads(done.out)["out"]) == (0, str(out))
    assert {path.name for path in out.iterdir()} == {"hop.json", "return.png"}
    (tmp_path / "file").write_text("", encoding="utf-8")
    done = called(capfd, "hop", PROTOTYPE, "--hops", "20", "--out", tmp_path / "file", "--json")
    done.refused("cannot write", "name a folder that you can write")


@pytest.mark.parametrize("command", ["hop", "modes"])
def test_an_interrupt_leaves_no_empty_folder(
    command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("legbench.cli.hop_driven.answer", interrupt)
    monkeypatch.setattr("legbench.cli.modes._found", interrupt)
    kept = tmp_path / "there"
    kept.mkdir()
    for out in (tmp_path / "new" / "one", kept):
        assert main([command, str(PROTOTYPE), "--out", str(out)]) == 130
    assert [path.name for path in tmp_path.iterdir()] == ["there"]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("hop", "--family", "dz2"), ("needs both --family, what is varied, and --to",)),
        (("hop", "--to", "0.1"), ("needs both --family, what is varied, and --to",)),
        (("hop", "--family", "dz2", "--to", "0.4"), ("set point z2 - dz2 = 0.05 rad",)),
        (("hop", "--family", "damping", "--to", "-1"), ("it cannot be negative",)),
        (("hop", "--family", "mismatch", "--to", "3"), ("a spring has no stiffness beyond",)),
        (("hop", "--period", "9"), ("period is 9 hops; it must be 1 to 8",)),
        (("hop", "--period", "0"), ("period is 0 hops; it must be 1 to 8",)),
        (("hop", "--passive", "--period", "2"), ("--family and --period are for driven hops",)),
        (("modes", "--respond", "-0.1"), ("respond is -0.1 rad; it must be positive",)),
        (("modes", "--ride", "0.001"), ("needs motors of 0.00", "lower --threshold or raise")),
        (("modes", "--threshold", "0"), ("threshold is 0 N m; it must be positive",)),
        (("modes", "--energy", "inf"), ("energy is inf J; it must be positive and finite",)),
    ],
)
def test_a_family_that_makes_no_sense(
    arguments: tuple[str, ...], words: tuple[str, ...], capfd: pytest.CaptureFixture[str]
) -> None:
    called(capfd, arguments[0], PROTOTYPE, *arguments[1:], "--json").refused(*words)


def test_a_period_that_no_hop_has_is_told(capfd: pytest.CaptureFixture[str]) -> None:
    done = called(capfd, "hop", PROTOTYPE, "--period", "3", "--json")
    done.refused("no hop of period 3 is found: there is one of period 1")


def test_one_mode_is_shown_where_the_other_has_no_such_orbit(
    capfd: pytest.CaptureFixture[str],
) -> None:
    done = called(capfd, "modes", PROTOTYPE, "--at", "0.5", "--json")
    assert done.status == 0
    assert "the radial mode does not exist at 0.5 J" in done.err
    shown = {name: mode["shown"] for name, mode in json.loads(done.out)["modes"].items()}
    assert shown["radial"] is None
    assert shown["polar"]["energy"] == pytest.approx(0.5, rel=1e-9)


@pytest.mark.long
def test_modes_in_full_are_printed_and_written(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    flags = ("--setup", "hfts", "--z2", "1.1", "--energy", "0.12", "--family", "radial")
    more = ("--branches", "--damped", "--respond", "0.005", "--ride", "0.006")
    done = called(capfd, "modes", OPTIMAL, *flags, *more, "--out", tmp_path / "new")
    assert done.status == 0
    assert "loses stability at 0.0597 J, by a multiplier of +1" in done.out
    assert "gains stability at 0.1036 J, by a multiplier of +1" in done.out
    assert "circles, not stable" in done.out
    assert "1:1 resonance: the linear frequencies" in done.err
    assert "polar mode" not in done.out
    names = {"modes.json", "orbits.json", "orbits.parquet", "modes.png", "responses.png"}
    assert {path.name for path in (tmp_path / "new").iterdir()} == names
    content = json.loads((tmp_path / "new" / "modes.json").read_text(encoding="utf-8"))
    radial = content["modes"]["radial"]
    assert [one["changes_stability"] for one in radial["passings"]] == [True, True]
    assert len(radial["branches"]) == 4
    assert content["bang_bang"]["cycles"][-1]["dz2"] >= 0.006
    assert all(one["damping_ratio"] > 0.0 for one in content["damped"]["radial"]["orbits"])


def test_the_mode_in_flight_is_asked_for_as_any_other(capfd: pytest.CaptureFixture[str]) -> None:
    done = called(capfd, "modes", OPTIMAL, "--setup", "flight", "--energy", "0.05", "--json")
    content = json.loads(done.out)
    assert content["setup"] == "flight"
    assert content["strictness"]["invariance"] < 1e-5
    assert all(one["bend"] < 1e-4 for one in content["modes"]["radial"]["orbits"])


@pytest.mark.long
def test_a_hop_of_two_is_found_and_followed(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    flags = ("--period", "2", "--family", "damping", "--to", "1.03")
    done = called(capfd, "hop", OPTIMAL, *flags, "--out", tmp_path)
    assert done.status == 0
    assert "grow by 6.8 % a period, alternating" in done.out
    assert "hop of period 2" in done.out
    assert "ended: damping = 1.03" in done.out
    content = json.loads((tmp_path / "hop.json").read_text(encoding="utf-8"))
    one, two = content["fixed_points"]
    assert (one["hops"], two["hops"]) == (1, 2)
    assert abs(two["apexes"][0]["z1"]) == pytest.approx(0.023, rel=0.02)
    assert len(two["directions"]) >= 1
    assert all(member["hops"] == 2 for member in content["family"]["members"])
    assert (tmp_path / "family.png").exists()
