"""Programs that stand for Slurm's: what `sbatch` is given runs when `sacct` is next asked.

They take what submitit writes, its directives and the call of `srun`, as Slurm does: each task of
an array runs the script once, with Slurm's variables. Nothing runs beside the test.
"""

import os
from pathlib import Path
from typing import final

import pytest

SBATCH = r"""#!/bin/sh
if [ -e refusal ]; then cat refusal >&2; exit 1; fi
number=$(( $(cat number 2>/dev/null || echo 100) + 1 ))
echo $number > number
last=$(sed -n 's/^#SBATCH --array=0-\([0-9]*\)%.*/\1/p' "$1")
if [ -n "$last" ]; then names=$(seq -f "${number}_%g" 0 "$last"); else names=$number; fi
for name in $names; do mkdir -p "jobs/$name"; cp "$1" "jobs/$name/script"; done
echo "Submitted batch job $number"
"""
SRUN = r"""#!/bin/sh
[ "$1 $2 $4" = "--unbuffered --output --error" ] || exit 2
place() { echo "$1" | sed "s/%j/$SLURM_JOB_ID/; s/%A/$SLURM_ARRAY_JOB_ID/;
  s/%a/$SLURM_ARRAY_TASK_ID/; s/%t/$SLURM_PROCID/"; }
out=$(place "$3") err=$(place "$5")
if [ -e "jobs/$SLURM_NAME/dies" ]; then echo "out of memory" > "$err"; kill -9 $$; fi
shift 5
exec "$@" > "$out" 2> "$err"
"""
SACCT = r"""#!/bin/sh
echo "JobID|State|NodeList"
for place in jobs/*; do
  name=${place##*/}
  if [ ! -e "$place/state" ]; then
    export SLURM_NAME=$name SLURM_JOB_ID=9${name%%_*}
    export SLURM_ARRAY_JOB_ID=${name%%_*} SLURM_ARRAY_TASK_ID=${name##*_}
    case $name in *_*) ;; *)
      SLURM_JOB_ID=$name
      unset SLURM_ARRAY_JOB_ID SLURM_ARRAY_TASK_ID;;
    esac
    export SLURM_NTASKS=1 SLURM_JOB_NUM_NODES=1 SLURM_NODEID=0 SLURM_PROCID=0 SLURM_LOCALID=0
    export SLURM_JOB_NODELIST=here
    if [ -e held ]; then state=PENDING
    elif sh "$place/script"; then state=COMPLETED
    else state=FAILED
    fi
    [ $state = PENDING ] || echo $state > "$place/state"
  fi
  state=$(cat "$place/state" 2>/dev/null || echo PENDING)
  echo "$name|$state|here"
  echo "$name.batch|$state|here"
done
"""
SCANCEL = r"""#!/bin/sh
if [ ! -d "jobs/$1" ] || [ -e "jobs/$1/state" ] || [ -e "jobs/$1/purged" ]; then
  echo "scancel: error: Kill job error on job id $1: Invalid job id specified" >&2
  exit 1
fi
echo "CANCELLED by 1000" > "jobs/$1/state"
"""
PROGRAMS = {"sbatch": SBATCH, "srun": SRUN, "sacct": SACCT, "scancel": SCANCEL}


@final
class Cluster:
    """Cluster of one node, whose programs are the first on the path while a test runs."""

    def __init__(self, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        self.folder = folder
        programs = folder / "bin"
        programs.mkdir(parents=True)
        for name, text in PROGRAMS.items():
            head, body = text.split("\n", 1)
            (programs / name).write_text(f"{head}\ncd '{folder}' || exit 2\n{body}")
            (programs / name).chmod(0o755)
        monkeypatch.setenv("PATH", f"{programs}{os.pathsep}{os.environ['PATH']}")

    def refuse(self, why: str) -> None:
        """Let `sbatch` accept nothing more."""
        (self.folder / "refusal").write_text(why)

    def hold(self) -> None:
        """Let jobs wait in the queue for ever."""
        (self.folder / "held").touch()

    def mark(self, job: str, what: str) -> None:
        """Say of a job to come that it `dies`, or that `scancel` will find it `purged`."""
        (self.folder / "jobs" / job).mkdir(parents=True)
        (self.folder / "jobs" / job / what).touch()

    def cancel(self, job: str) -> None:
        """Cancel a job that will be submitted, as an administrator does."""
        (self.folder / "jobs" / job).mkdir(parents=True)
        (self.folder / "jobs" / job / "state").write_text("CANCELLED by 0\n")

    def states(self) -> dict[str, str]:
        """State of each job; one that was never run has none."""
        places = sorted((self.folder / "jobs").iterdir())
        return {
            place.name: (place / "state").read_text().strip()
            for place in places
            if (place / "state").exists()
        }

    def script(self, job: str) -> str:
        """What was submitted for a job."""
        return (self.folder / "jobs" / job / "script").read_text()
