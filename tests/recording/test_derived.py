"""Signals that a saved recording leaves out because two others give them exactly."""

from dataclasses import replace
from pathlib import Path
from types import MappingProxyType

import numpy as np
import pytest
from pyarrow import parquet

import legbench
from legbench.control import PositionJumpConfig
from legbench.design import load_design
from legbench.design.setup import Setup, SetupKind
from legbench.errors import FormatError
from legbench.experiment import Experiment
from legbench.experiment.running import record_in_memory
from legbench.imperfections import Imperfections
from legbench.recording.derived import completed, derivable
from legbench.recording.reader import Recording
from legbench.recording.saved import save_recording

MODELS = Path(__file__).parents[2] / "models"
TORQUES = ("spring_torque_1", "spring_torque_2")


@pytest.fixture(scope="module")
def noisy() -> Recording:
    """A step under noisy encoders, on springs that are not what they are taken for."""
    flaws = Imperfections(
        stiffness_error=(0.05, -0.03), link_noise=(1e-4, 1e-4), motor_noise=(1e-4, 1e-4)
    )
    return record_in_memory(
        Experiment(
            design=load_design(MODELS / "prototype.toml"),
            controller=PositionJumpConfig(z2=1.0, dz2=0.2),
            setup=Setup(kind=SetupKind.HFTS),
            duration=0.3,
            imperfections=flaws,
        )
    )


def altered(recording: Recording, name: str, values: np.ndarray) -> Recording:
    return replace(recording, columns=MappingProxyType({**recording.columns, name: values}))


def test_a_torque_that_encoders_give_is_left_out_and_read_back_to_the_bit(
    noisy: Recording, tmp_path: Path
) -> None:
    save_recording(noisy, tmp_path / "run")
    with parquet.ParquetFile(tmp_path / "run" / "samples.parquet") as samples:
        file = samples.read()
    assert set(file.column_names) == noisy.columns.keys() - set(TORQUES)
    found = legbench.load(tmp_path / "run")
    assert list(found.columns) == list(noisy.columns)
    for name, values in noisy.columns.items():
        assert found.columns[name].tobytes() == values.tobytes(), name
        assert not found.columns[name].flags.writeable
    assert "spring_torque" in found.signals
    assert found.manifest["derived"] == {"spring_torque": "stiffness * (motor_pos - joint_pos)"}
    # Whoever reads the file with another library has the formula, and what it needs, at hand.
    springs = found.manifest["experiment"]["design"]["springs"]["stiffness"]
    for joint, stiffness in zip("12", springs, strict=True):
        spring = file[f"motor_pos_{joint}"].to_numpy() - file[f"joint_pos_{joint}"].to_numpy()
        wanted = noisy.columns[f"spring_torque_{joint}"]
        assert (stiffness * spring).tobytes() == wanted.tobytes()
    # Saved once more it is the same again, with and without `run.json`.
    save_recording(found, tmp_path / "again")
    (tmp_path / "again" / "run.json").unlink()
    again = legbench.load(tmp_path / "again")
    assert np.array_equal(again["spring_torque"], noisy["spring_torque"])


def test_a_torque_that_was_measured_otherwise_is_kept(noisy: Recording, tmp_path: Path) -> None:
    measured = noisy.columns[TORQUES[1]].copy()
    measured[7] = np.nextafter(measured[7], np.inf)
    save_recording(altered(noisy, TORQUES[1], measured), tmp_path / "run")
    assert set(TORQUES) <= set(parquet.read_schema(tmp_path / "run" / "samples.parquet").names)
    found = legbench.load(tmp_path / "run")
    assert found.columns[TORQUES[1]].tobytes() == measured.tobytes()
    assert "derived" not in found.manifest


def test_rows_without_a_reading_stay_what_they_are(noisy: Recording, tmp_path: Path) -> None:
    blind = noisy.columns["motor_pos_1"].copy()
    blind[3] = np.nan
    unread = noisy.columns[TORQUES[0]].copy()
    unread[3] = np.nan
    gone = altered(altered(noisy, "motor_pos_1", blind), TORQUES[0], unread)
    save_recording(gone, tmp_path / "run")
    found = legbench.load(tmp_path / "run")
    assert found.columns[TORQUES[0]].tobytes() == unread.tobytes()
    assert found.columns["motor_pos_1"].tobytes() == blind.tobytes()


def test_torques_need_the_encoders_of_both_sides_and_the_word_of_the_file(
    noisy: Recording,
) -> None:
    described = noisy.description
    said = {"derived": {"spring_torque": "stiffness * (motor_pos - joint_pos)"}}
    bare = {name: values for name, values in noisy.columns.items() if name not in TORQUES}
    whole = completed(bare, said, described)
    assert list(whole) == list(noisy.columns)
    for missing in ("motor_pos_1", "joint_pos_1", "motor_pos_2", "joint_pos_2"):
        rest = {name: values for name, values in noisy.columns.items() if name != missing}
        assert derivable(rest, described) == ()
        blind = {name: values for name, values in bare.items() if name != missing}
        assert not set(TORQUES) & completed(blind, said, described).keys()
    # A file that names nothing, another signal or something odd has all that it is meant to have.
    unknown = FormatError("no leg")
    for manifest in ({}, {"derived": {"gain": "2"}}, {"derived": ["spring_torque"]}):
        assert completed(bare, manifest, described) is bare
        assert completed(bare, manifest, unknown) is bare
    assert completed(bare, said, unknown) is bare
    assert derivable(noisy.columns, unknown) == ()
