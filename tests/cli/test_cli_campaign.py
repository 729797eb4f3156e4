"""`legbench campaign`: what it tells, what it refuses, how it is interrupted."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from commands import MODELS, called

from legbench.campaign import dask_workers, read_table

TEXT = f"""
name = "few"
infeasible = "skip"
[base]
design = "{MODELS / "prototype.toml"}"
duration = 0.05
setup.kind = "ffs"
linkage.kind = "reduced"
controller.kind = "position-jump"
[grid]
"controller.settings.z2" = [1.0, 1.8]
"controller.settings.dz2" = [0.2, 0.3]
"""


@pytest.fixture
def few(tmp_path: Path) -> Path:
    path = tmp_path / "few.toml"
    path.write_text(TEXT)
    return path


def test_a_campaign_leaves_its_table(
    few: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    done = called(capfd, "campaign", few, "--out", out, "--executor", "serial", "--json")
    assert done.status == 0
    content = json.loads(done.out)
    assert content["experiments"] == content["done"] == content["wanted"] == 3
    assert (content["faults"], content["unsound"], content["infeasible"]) == (0, 0, 1)
    assert content["table"] == str(out / "table.parquet")
    assert "skipped: cells: set point z2 + dz2 = 2.1 rad" in done.err
    assert read_table(out).num_rows == 3
    again = called(capfd, "campaign", few, "--out", out, "--executor", "serial")
    assert again.out == f"3 experiments, table {out / 'table.parquet'}\n"
    told = json.loads((out / "campaign.json").read_text())
    assert told["axes"] == ["controller.settings.dz2", "controller.settings.z2"]
    assert told["infeasible"][0]["nearest"]["controller.settings.dz2"] == 0.2506
    assert told["provenance"]["versions"]["legbench"]
    assert (out / "campaign.toml").read_text() == TEXT


def test_a_plan_runs_nothing(few: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "out"
    told = called(capfd, "campaign", few, "--plan", "--out", out)
    assert told.status == 0
    for line in (
        "few: 3 experiments in 1 shards",
        "4 cells x   1 trials  cells",
        "infeasible  cells: set point z2 + dz2 = 2.1 rad",
        "varied: controller.settings.dz2, controller.settings.z2",
        "0.15 s of motion, some 0:00 on one processor",
    ):
        assert line in told.out
    content = json.loads(called(capfd, "campaign", few, "--plan", "--json").out)
    assert len(content["planned"]) == 3
    assert content["cells"] == 3
    assert not out.exists()


def test_settings_of_the_command_line_replace_those_of_the_file(
    few: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    told = called(
        capfd, "campaign", few, "--plan", "--set", "duration=2", "--set", "controller.settings.z2=1"
    )
    assert "few: 2 experiments" in told.out
    assert "4 s of motion" in told.out


def test_all_cells_on_an_emulated_bench(
    few: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    bus = MODELS.parent / "hardware" / "leg.toml"
    done = called(
        *(capfd, "campaign", few, "--out", tmp_path / "out", "--plant", "can"),
        *("--interface", "legbench", "--bus", bus, "--set", "setup.kind=hfts"),
        *("--set", "controller.settings.z2=1", "--set", "controller.settings.dz2=0.1"),
    )
    assert done.status == 0, done.err
    assert done.out.startswith("1 experiments, table")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--executor", "clouds"), ("no executor 'clouds'; there are serial, local, dask",)),
        (("--workers", "0"), ("workers is 0; a campaign needs 1 process or more",)),
        (("--shard", "3/2"), ("shard is '3/2'; write 1/4 to 4/4",)),
        (("--shard", "0/2"), ("shard is '0/2'",)),
        (("--shard", "half"), ("shard is 'half'",)),
        (("--plant", "can", "--shard", "1/2"), ("leave --shard and --executor out",)),
        (("--set", "controller.settings.z=1"), ("z: unknown key; did you mean 'z2'?",)),
        (("--set", "duration"), ("write dotted.key=value",)),
        (("--executor", "dask://127.0.0.1:9"), ("no Dask scheduler answers at 127.0.0.1:9",)),
    ],
)
def test_what_makes_no_sense_is_one_line(
    arguments: tuple[str, ...],
    words: tuple[str, ...],
    few: Path,
    tmp_path: Path,
    capfd: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(dask_workers, "CONNECT", 0.1)
    few.write_text(TEXT.replace(", 0.3]", "]"))
    called(capfd, "campaign", few, "--out", tmp_path / "out", *arguments).refused(*words)


def test_interrupted_it_keeps_what_is_done(few: Path, tmp_path: Path) -> None:
    few.write_text(
        TEXT.replace("duration = 0.05\n", "").replace(", 0.3]", "]") + "duration = [0.02, 1000.0]\n"
    )
    out = tmp_path / "out"
    code = "import sys; from legbench.cli import main; sys.exit(main(sys.argv[1:]))"
    command = [sys.executable, "-c", code, "campaign", str(few), "--out", str(out)]
    with subprocess.Popen(
        [*command, "--executor", "serial"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=os.environ | {"PYTHONUNBUFFERED": "1"},
    ) as process:
        end = time.monotonic() + 120.0
        while not list(out.glob("shards/*.parquet")):
            assert time.monotonic() < end
            time.sleep(0.01)
        process.send_signal(signal.SIGINT)
        printed, complained = process.communicate(timeout=120.0)
    assert process.returncode == 130
    assert printed == f"2 of 4 experiments are done in {out}\n"
    assert complained == "legbench: interrupted; call again to go on\n"
    assert len(list(out.glob("shards/*"))) == 1
