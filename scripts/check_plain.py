"""Step the models of `legbench model --plain` in MJX and MuJoCo Warp, against MuJoCo.

    python -m venv /elsewhere && /elsewhere/bin/pip install mujoco-mjx mujoco-warp
    scripts/check_plain.py /elsewhere/bin/python

Both engines bring a MuJoCo of their own, so that they live in an environment beside this one. Exit
status 1 if an engine differs by more than its bound, or if none is there.
"""

import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path

STEPS = 100
BOUNDS = {"MJX": 1e-9, "MuJoCo Warp": 1e-4}
"""Largest differences of a joint position after all steps: MJX in double, Warp in single
precision [rad, m]."""
DESIGNS, SETUPS = ("prototype", "optimal"), ("jump", "hfts", "vfts", "ffs")


def main() -> int:
    """Print a line a model and engine; returns the exit status."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("python", type=Path, help="interpreter that has the engines")
    parser.add_argument("--linkage", choices=("bars", "reduced"), default="bars")
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        for design in DESIGNS:
            for setup in SETUPS:
                words = ["--design", design, "--setup", setup, "--linkage", asked.linkage]
                out = ["--out", f"{folder}/{design}-{setup}.xml"]
                command = [sys.executable, "-m", "legbench", "model", "--plain", *words, *out]
                subprocess.run(command, check=True, capture_output=True)
        engines = Path(__file__).with_name("plain_engines.py")
        command = [str(asked.python), str(engines), folder, str(STEPS)]
        done = subprocess.run(command, check=True, capture_output=True, text=True)
    rows = [json.loads(line) for line in done.stdout.splitlines() if line.startswith("{")]
    wrong = not any("difference" in row for row in rows)
    for row in rows:
        if "refused" in row:
            wrong |= "model" in row
            print(f"{row['engine']:<12} {row.get('model', '')}: {row['refused']}")
            continue
        missed = not row["difference"] <= BOUNDS[row["engine"]]
        wrong |= missed
        print(
            f"{row['engine']:<12} {row['model']:<20} differs by {row['difference']:.1e} after "
            f"{STEPS} steps (bound {BOUNDS[row['engine']]:g}), moved by {row['moved']:.1e}"
            f"{'  MISSED' if missed else ''}"
        )
    return int(wrong)


if __name__ == "__main__":
    sys.exit(main())
