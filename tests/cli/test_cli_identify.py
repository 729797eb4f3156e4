"""`legbench identify` as a user calls it: answers, files, and what it refuses in one line."""

import json
import tomllib
from dataclasses import replace
from pathlib import Path

import pytest
from commands import called

from legbench.control import ChirpConfig, JumpConfig, PositionJumpConfig
from legbench.design import LegDesign, load_design
from legbench.design.setup import Setup, SetupKind
from legbench.experiment import Experiment, load_experiment, record
from legbench.interrupts import stop_on_interrupt
from legbench.mjcf.options import Linkage, LinkageKind

STEP = PositionJumpConfig(z2=1.0, dz2=0.3, delay=0.05)


def recorded(
    folder: Path,
    design: LegDesign,
    kind: SetupKind,
    controller: PositionJumpConfig | JumpConfig | ChirpConfig = STEP,
    duration: float = 0.5,
) -> Path:
    chosen = Experiment(
        design=design,
        controller=controller,
        setup=Setup(kind=kind),
        linkage=Linkage(kind=LinkageKind.REDUCED),
        duration=duration,
    )
    with stop_on_interrupt(raises=True) as stop:
        return record(chosen, folder, stop=stop).path


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory, prototype: LegDesign) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("runs")
    other = replace(prototype, name="other", stiffness=(2.4, 2.3))
    still = PositionJumpConfig(delay=10.0)
    return {
        "vfts": recorded(folder, prototype, SetupKind.VFTS),
        "ffs": recorded(folder, prototype, SetupKind.FFS),
        "other": recorded(folder, other, SetupKind.FFS, duration=0.1),
        "still": recorded(folder, prototype, SetupKind.FFS, still, duration=0.1),
        "hop": recorded(folder, prototype, SetupKind.JUMP, JumpConfig(), duration=0.1),
        "short": recorded(folder, prototype, SetupKind.FFS, duration=0.03),
    }


def test_two_runs_give_the_leg_its_file_and_one_json_object(
    runs: dict[str, Path], tmp_path: Path, capfd: pytest.CaptureFixture[str], prototype: LegDesign
) -> None:
    out = tmp_path / "identified.toml"
    done = called(capfd, "identify", runs["vfts"], runs["ffs"], "--starts", "1", "--json",
                  "--out", out)  # fmt: skip
    assert done.status == 0, done.err
    answer = json.loads(done.out)
    assert answer["trusted"] is True
    assert answer["estimates"]["k1"]["value"] == pytest.approx(2.3, rel=1e-4)
    assert answer["runs"] == [runs["vfts"].name, runs["ffs"].name]
    found = load_design(out)
    assert found.stiffness[0] == answer["estimates"]["k1"]["value"]
    assert found.thigh == prototype.thigh
    assert runs["vfts"].name in out.read_text()
    assert tomllib.loads(out.read_text())["name"] == "prototype"


def test_people_read_the_verdict_first(
    runs: dict[str, Path], capfd: pytest.CaptureFixture[str]
) -> None:
    done = called(capfd, "identify", runs["vfts"], "--free", "k1,k2,link_zero,motor_zero")
    assert done.status == 1
    assert done.out.startswith("verdict           not to be trusted\n")
    assert "link_zero1 and motor_zero1 (correlation" in done.out
    assert "95 % interval" in done.out
    assert "not white" not in done.out


def test_what_cannot_be_shown_is_refused_and_still_planned_for(
    runs: dict[str, Path], tmp_path: Path, capfd: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    refused = called(capfd, "identify", runs["vfts"], "--free", "nine")
    assert refused.status == 2
    assert refused.out == ""
    assert "all nine scale together" in refused.err.splitlines()[-1]
    chirp = Experiment(
        design=load_design(Path(__file__).parents[2] / "models" / "prototype.toml"),
        controller=ChirpConfig(sweep=0.4, delay=0.05),
        setup=Setup(kind=SetupKind.FFS),
        linkage=Linkage(kind=LinkageKind.REDUCED),
        duration=0.5,
    )
    monkeypatch.setattr("legbench.identify.plan.candidates", lambda _: iter([("ffs chirp", chirp)]))
    plan = tmp_path / "next.toml"
    done = called(capfd, "identify", runs["vfts"], "--free", "nine", "--plan", plan)
    assert done.status == 1
    assert "next run          ffs chirp" in done.out
    assert load_experiment(plan) == chirp


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ((), "no run to learn from; give one run folder or more"),
        (("vfts", "vfts"), "is given twice"),
        (("ffs", "other"), "is of leg 'prototype' and"),
        (("still",), "does not move: its link angles span"),
        (("hop",), "is in setup 'jump', where the foot lifts off"),
        (("short",), "has 30 rows; to learn from it takes 50"),
        (("nowhere",), "does not exist"),
        (("ffs", "--free", "c1"), "c1 cannot be identified"),
        (("ffs", "--mass", "-1"), "mass is -1 kg"),
        (("ffs", "--starts", "0"), "starts is 0"),
        (("ffs", "--noise-deg", "0"), "noise_deg is 0 deg"),
        (("ffs", "--sharpen", "k1"), "--sharpen says what a plan is for"),
        (("ffs", "--plan", "next.toml", "--sharpen", "B"), "--sharpen is B; it must be free"),
        (("ffs", "--out", "/dev/null/a.toml"), "cannot write /dev/null: "),
        (("ffs", "--figure", "a.bmp"), "a figure cannot be written as 'a.bmp'"),
        (("ffs", "--held-out", "other"), "is of leg 'prototype' and"),
    ],
)
def test_what_makes_no_sense_is_refused_in_one_line(
    runs: dict[str, Path],
    capfd: pytest.CaptureFixture[str],
    words: tuple[str, ...],
    said: str,
) -> None:
    done = called(capfd, "identify", *(runs.get(word, word) for word in words))
    done.refused(said)
