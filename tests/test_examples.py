"""The examples of `scripts/examples` run as they stand, and are as short as they are said to be."""

import os
import runpy
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import legbench
from legbench.plants import PLANTS

ROOT = Path(__file__).parents[1]
EXAMPLES = ROOT / "scripts" / "examples"
LONGEST = {"own_controller.py": 25}
"""Lines that are not blank; 30 of any other."""


def beside(folder: Path) -> None:
    """Put the designs and the bus file where an example looks for them."""
    for needed in ("models", "hardware"):
        (folder / needed).symlink_to(ROOT / needed)


def printed(name: str, folder: Path) -> list[str]:
    """Lines that an example prints in a process of its own."""
    beside(folder)
    done = subprocess.run(
        [sys.executable, str(EXAMPLES / name)],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
        timeout=300,
        env=os.environ,
    )
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    return done.stdout.splitlines()


@pytest.mark.parametrize("path", sorted(EXAMPLES.glob("*.py")), ids=lambda path: path.stem)
def test_an_example_is_short_and_told_in_the_documents(path: Path) -> None:
    lines = [line for line in path.read_text(encoding="utf-8").splitlines() if line.strip()]
    assert len(lines) <= LONGEST.get(path.name, 30)
    told = [ROOT / "README.md", *(ROOT / "docs").glob("*.md")]
    assert any(path.name in text.read_text(encoding="utf-8") for text in told)


@pytest.mark.long
def test_a_sweep_prints_a_row_for_each_amplitude(tmp_path: Path) -> None:
    head, *rows = printed("sweep.py", tmp_path)
    assert head.split("  ") == ["dz2 [rad]", "P^r flight [-]", "foot clearance [mm]"]
    amplitude, rating, clearance = np.array([row.split() for row in rows], dtype=float).T
    assert amplitude.tolist() == [0.1, 0.12, 0.14, 0.16, 0.18]
    assert np.all((rating > 0.9) & (rating <= 1.0))
    assert np.all(np.diff(clearance) > 0.0)


@pytest.mark.long
def test_the_bench_is_emulated_recorded_and_compared(tmp_path: Path) -> None:
    *table, difference = printed("bench.py", tmp_path)
    assert "ended       complete" in table
    assert 0.0 < float(difference.split()[5]) < 0.05
    (run,) = (tmp_path / "runs").iterdir()
    assert (run / "bus.log").is_file()
    assert legbench.load(run).description.plant == "can"


def test_the_cells_of_a_notebook_run_one_after_the_other(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    beside(tmp_path)
    monkeypatch.chdir(tmp_path)
    runpy.run_path(str(EXAMPLES / "notebook_figure.py"), run_name="__main__")
    assert "ended       complete" in capsys.readouterr().out.splitlines()
    assert list(tmp_path.glob("20*")) == []


def test_a_plant_around_another_alters_what_is_seen_and_nothing_else() -> None:
    """The noise has the spread that was asked for; the leg itself moves as without it."""
    noisy = PLANTS.find(f"{EXAMPLES / 'own_plant.py'}:Noisy")
    leg = legbench.load_design(ROOT / "models" / "prototype.toml")
    pushed = legbench.PositionJumpConfig()
    runs = [
        legbench.run(
            legbench.Experiment(
                design=leg,
                controller=pushed,
                setup=legbench.Setup(kind=legbench.SetupKind.HFTS),
                plant=plant,
                duration=1.0,
            )
        )
        for plant in (legbench.SimChoice(), noisy(noise=2e-3), noisy(noise=2e-3))
    ]
    true, seen, again = runs
    noise = seen["joint_pos"] - true["joint_pos"]
    assert np.std(noise) == pytest.approx(2e-3, rel=0.05)
    assert np.array_equal(seen["trunk_pos"], true["trunk_pos"])
    assert np.array_equal(seen["foot_pos"], true["foot_pos"])
    assert np.array_equal(seen["joint_pos"], again["joint_pos"])
