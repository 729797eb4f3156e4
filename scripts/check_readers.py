"""Other libraries read what `legbench export` writes, number by number.

    make test-readers
    scripts/check_readers.py PYTHON     a Python that has pandas, polars, DuckDB and fastparquet

These libraries live in an environment of their own: pandas beside pyarrow makes every program
that uses pyarrow start late. This script records and exports a jump and leaves the numbers in a
NumPy file; `scripts/readers.py`, which that Python runs, compares.
"""

import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from legbench.control import JumpConfig, PositionJumpConfig
from legbench.design import load_design
from legbench.design.setup import Setup, SetupKind
from legbench.experiment import Experiment
from legbench.experiment.running import record, record_in_memory
from legbench.export.formats import Format, export
from legbench.imperfections import Imperfections
from legbench.recording.reader import load
from legbench.recording.saved import save_recording
from legbench.recording.sealed import sealed_bytes
from legbench.recording.writer import RunWriter
from legbench.signals import Command, Observation

ROOT = Path(__file__).parents[1]


def torn_streams(folder: Path) -> None:
    """Leave a stream that was cut between two batches, and one that was cut within one."""
    writer = RunWriter.create(folder / "torn", {})
    for row in range(200):
        pair = np.array([float(row), -float(row)])
        seen = Observation(
            time=row / 1000,
            motor_pos=pair,
            joint_pos=pair,
            joint_vel=pair,
            spring_torque=pair,
            applied_pos=pair,
        )
        writer.append(Command.holding(pair), seen, 0.0, 0.0)
    stream = (writer.path / "samples.arrows").read_bytes()
    writer.close()
    (folder / "boundary.arrows").write_bytes(stream)
    (folder / "torn.arrows").write_bytes(stream[:-100])


def kept_of_a_campaign(folder: Path) -> None:
    """Leave what a campaign keeps of a run, with noise on the encoders, and what was recorded."""
    noise = (1e-4, 1e-4)
    recording = record_in_memory(
        Experiment(
            design=load_design(ROOT / "models/prototype.toml"),
            controller=PositionJumpConfig(z2=1.0, dz2=0.2),
            setup=Setup(kind=SetupKind.FFS),
            duration=0.5,
            imperfections=Imperfections(motor_noise=noise, link_noise=noise),
        )
    )
    save_recording(recording, folder / "kept")
    stiffness = recording.description.design.stiffness
    columns: dict[str, Any] = dict(recording.columns)
    np.savez(folder / "kept.npz", stiffness=stiffness, **columns)


def main(arguments: list[str]) -> int:
    """Record, export, and have the other Python compare; its exit status."""
    if len(arguments) != 1 or shutil.which(arguments[0]) is None:
        print(__doc__, file=sys.stderr)
        return 2
    experiment = Experiment(
        design=load_design(ROOT / "models/prototype.toml"),
        controller=JumpConfig(),
        setup=Setup(kind=SetupKind.JUMP),
        duration=1.0,
    )
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        recording = load(record(experiment, folder / "runs").path)
        for kind in Format:
            export(recording, folder / f"run.{kind.value}", kind)
        shutil.copy(recording.path / "samples.parquet", folder)
        columns: dict[str, Any] = dict(recording.columns)
        np.savez(folder / "run.npz", **columns)
        # Written as the table of a campaign is.
        (folder / "table.parquet").write_bytes(sealed_bytes(recording.to_arrow()))
        kept_of_a_campaign(folder)
        torn_streams(folder)
        command = [arguments[0], str(ROOT / "scripts/readers.py"), str(folder)]
        return subprocess.run(command, check=False).returncode


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
