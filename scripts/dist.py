"""Build wheel and sdist, install the wheel in an empty environment, and use it in an empty folder.

The wheel is made from the sdist, so that both are whole. Nothing but the core is installed: a
command that needs an extra must name it in one line. Warnings are errors.

What the wheel asks for is linked into its environment from the one that runs this, package by
package as their metadata name each other; pip then checks that nothing is missing and that all
versions fit. With --fresh, pip installs it from the registry, as it does for a user, and every main
use has a process of its own.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import venv
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from dist_environment import link_needed

ROOT = Path(__file__).parents[1]
CANNOT = "Traceback (most recent call last)"
"""Text that no command may print."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Job:
    """Words of a command line, the status that is right, and a text that must be printed."""

    words: Sequence[str]
    status: int = 0
    prints: str = ""


ELSEWHERE = ("--out", "more")
"""Options that leave one run in `runs/`, the first, which later commands take as `{run}`."""

EMULATED = ("--plant", "can", "--interface", "legbench", "--end", "stop")

JOBS = (
    Job(words=("run", "jump", "--duration", "1"), prints="P^r"),
    Job(
        words=(
            "run",
            "bang-bang",
            "--design",
            "prototype",
            "--duration",
            "0.5",
            "--json",
            *ELSEWHERE,
        )
    ),
    Job(words=("run", "jump", "--duration", "0.3", *EMULATED, *ELSEWHERE)),
    Job(words=("replay", "{run}"), prints="P^r"),
    Job(words=("recover", "{run}")),
    Job(words=("compare", "{run}", "{run}"), prints="P^r"),
    Job(words=("runs",), prints="complete"),
    Job(words=("export", "{run}", "--csv"), prints="wrote"),
    Job(words=("export", "{run}", "--mcap"), status=1, prints="legbench[mcap]"),
    Job(words=("model", "--design", "table2", "--out", "leg.xml")),
    Job(words=("check", "prototype", "--no-model"), status=1, prints="VIOLATED"),
    Job(words=("drives", "budget"), prints="SYNC"),
    Job(words=("drives", "learn", "{eds}", "--out", "my.toml"), status=1, prints="canopen"),
    Job(words=("modes", "prototype"), status=1, prints="legbench[modes]"),
    Job(words=("hop", "optimal"), status=1, prints="legbench[modes]"),
    Job(words=("render", "{run}", "--out", "leg.mp4"), status=1, prints="legbench[render]"),
    Job(words=("model", "--view"), status=1, prints="legbench[render]"),
    Job(words=("report", "{run}"), status=1, prints="legbench[report]"),
    Job(words=("replay", "{run}", "--figure", "phase.png"), status=1, prints="legbench[viz]"),
    Job(words=("run", "jump", "--design", "nobody"), status=2, prints="optimal"),
    Job(words=("run", "jump", "--plant", "can"), status=2, prints="no such file"),
)


TOGETHER = """
import contextlib, io, json, sys
from pathlib import Path
from legbench.cli import COMMANDS, main

found = []
for words in [["--help"], *([name, "--help"] for name in COMMANDS), *json.loads(sys.argv[1])]:
    run = next(map(str, Path("runs").glob("*_*")), "")
    words = [run if word == "{run}" else word for word in words]
    said = io.StringIO()
    with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
        try:
            status = main(words)
        except SystemExit as end:
            status = end.code or 0
    found.append([words, status, said.getvalue()])
print(json.dumps(found))
"""
"""Program that asks every command for help and then calls some, all in one process; {run} is the
first run in its folder."""


def main() -> int:
    """Build, install, use; returns 1 if a command does not do what it should."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=ROOT / "dist", help="folder of the archives")
    parser.add_argument("--fresh", action="store_true", help="let pip install what is needed")
    asked = parser.parse_args()
    out: Path = asked.out
    for old in out.glob("legbench-*"):
        old.unlink()
    run([sys.executable, "-m", "build", "--no-isolation", "--outdir", str(out), str(ROOT)])
    with tempfile.TemporaryDirectory() as place:
        python = installed(next(out.glob("*.whl")), Path(place) / "env", fresh=asked.fresh)
        empty = Path(place) / "empty"
        empty.mkdir()
        wrong = list(faults(python, empty, alone=asked.fresh))
    for line in wrong:
        print(line)
    print(f"{out}: {', '.join(sorted(path.name for path in out.iterdir()))}")
    return 1 if wrong else 0


def run(words: Sequence[str]) -> None:
    """Run a program; what it printed is shown if it fails."""
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    if done.returncode:
        sys.exit(f"{' '.join(words)}\n{done.stdout}{done.stderr}")


def installed(wheel: Path, place: Path, *, fresh: bool) -> Path:
    """Python of a new environment that has the wheel and what it needs."""
    venv.create(place, with_pip=False)
    python = place / "bin" / "python"
    if not fresh:
        link_needed(wheel, place)
    pip = [sys.executable, "-m", "pip", "--python", str(python), "--disable-pip-version-check"]
    sources = ("--constraint", str(ROOT / "constraints.txt")) if fresh else ("--no-index",)
    run([*pip, "install", "--quiet", "--no-compile", *sources, str(wheel)])
    run([*pip, "check"])
    return python


def faults(python: Path, folder: Path, *, alone: bool) -> Iterator[str]:
    """Say which commands do not do what they should in an empty folder.

    Args:
        python: interpreter that has the package.
        folder: empty folder in which commands are called.
        alone: whether main uses have a process each; help and refusals share one in any case.
    """
    eds = str(ROOT / "hardware" / "legbench-drive.eds")
    single = [job for job in JOBS if alone and not job.status]
    for job in single:
        words = [word.replace("{run}", first_run(folder)) for word in filled(job, eds)]
        done = legbench(python, folder, ["-W", "error", "-m", "legbench", *words])
        yield from fault(job, words, done.returncode, done.stdout + done.stderr)
    shared = [job for job in JOBS if job not in single]
    lines = json.dumps([filled(job, eds) for job in shared])
    done = legbench(python, folder, ["-W", "error", "-c", TOGETHER, lines])
    if done.returncode:
        yield f"commands in one process: status {done.returncode}\n{done.stdout}{done.stderr}"
        return
    told = json.loads(done.stdout)
    helped = Job(words=("--help",), prints="usage")
    jobs = [helped] * (len(told) - len(shared)) + shared
    for job, (words, status, printed) in zip(jobs, told, strict=True):
        yield from fault(job, words, status, printed)


def first_run(folder: Path) -> str:
    """The run that is there by now; empty before it."""
    return next(map(str, folder.glob("runs/*_*")), "")


def filled(job: Job, eds: str) -> list[str]:
    """Words of a job, the run still to be named."""
    return [word.replace("{eds}", eds) for word in job.words]


def fault(job: Job, words: Sequence[str], status: int, printed: str) -> Iterator[str]:
    """Say what is wrong with a command that was called."""
    if status != job.status or job.prints not in printed or CANNOT in printed:
        yield f"legbench {' '.join(words)}: status {status}\n{printed}"


def legbench(python: Path, folder: Path, words: Sequence[str]) -> subprocess.CompletedProcess[str]:
    """Run the installed Python in a folder, without the settings of this one."""
    kept = {name: os.environ[name] for name in ("PATH", "HOME", "LANG") if name in os.environ}
    return subprocess.run(
        [str(python), *words], cwd=folder, env=kept, capture_output=True, text=True, check=False
    )


if __name__ == "__main__":
    sys.exit(main())
