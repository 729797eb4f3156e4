"""Simulation on systems that lack what only POSIX has; drives say what they need."""

import json
import os
import subprocess
import sys
from pathlib import Path

PROGRAM = Path(__file__).parent / "without_posix.py"
EMULATED = ("--plant", "can", "--interface", "legbench")


def run(folder: Path, *lines: list[str]) -> tuple[list[int], str]:
    """Exit statuses of command lines in one process, and what it printed on stderr before them."""
    done = subprocess.run(
        [sys.executable, str(PROGRAM), json.dumps(lines)],
        cwd=folder,
        env=os.environ | {"PYTHONPATH": str(Path(__file__).parents[2] / "src")},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    *printed, statuses = done.stderr.splitlines()
    return json.loads(statuses), "\n".join(printed)


def test_simulation_runs_without_posix_and_drives_say_what_they_need(tmp_path: Path) -> None:
    statuses, printed = run(
        tmp_path,
        ["run", "position-jump", "--duration", "0.05", "--out", "runs"],
        ["replay", "RUN"],
        ["recover", "RUN"],
        [*("run", "jump", "--duration", "0.05", "--end", "stop"), *EMULATED],
        ["model", "--design", "prototype", "--out", "leg.xml"],
        ["drives", "emulate", "--channel", "x.sock"],
        ["check", "optimal", "--no-model"],
    )
    assert statuses[:6] == [0, 0, 0, 0, 0, 1]
    assert statuses[6] in (0, 1)
    (folder, *_) = sorted((tmp_path / "runs").iterdir())
    assert (folder / "samples.parquet").exists()
    assert "AF_UNIX" in printed
    assert "use Linux" in printed


def test_commands_of_simulation_can_be_loaded_without_posix(tmp_path: Path) -> None:
    names = ("analytic", "cli.render", "cli.design", "cli.replay", "cli.hop", "viz.film")
    program = (
        "import sys, runpy; "
        f"runpy.run_path({str(PROGRAM)!r})['hide'](); "
        f"[__import__('legbench.' + name) for name in {names!r}]"
    )
    environment = os.environ | {"PYTHONPATH": str(Path(__file__).parents[2] / "src")}
    subprocess.run([sys.executable, "-c", program], cwd=tmp_path, env=environment, check=True)
