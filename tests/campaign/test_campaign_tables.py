"""The table of a campaign: its rows against what a summary of the same run says."""

import math
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pytest
from pyarrow import parquet

from legbench.campaign import measured_rows, measured_table, read_table, whole_table
from legbench.campaign.rows import KINDS
from legbench.campaign.table import MEASURED, UNITS
from legbench.control import JumpConfig, PositionJumpConfig
from legbench.design import LegDesign
from legbench.design.setup import Setup, SetupKind
from legbench.errors import ConfigError, FormatError, RecordingError
from legbench.experiment import Experiment, run_batch
from legbench.kinematics import joint_to_modal
from legbench.metrics import summarise
from legbench.mjcf import Linkage, LinkageKind
from legbench.recording.reader import Recording

REDUCED = Linkage(kind=LinkageKind.REDUCED)


@pytest.fixture(scope="module")
def both(prototype: LegDesign) -> list[Recording]:
    hop = Experiment(design=prototype, controller=JumpConfig(), linkage=REDUCED, duration=1.9)
    step = Experiment(
        design=prototype,
        controller=PositionJumpConfig(z2=1.0, dz2=0.1, delay=0.02),
        setup=Setup(kind=SetupKind.HFTS),
        linkage=REDUCED,
        duration=0.8,
    )
    return run_batch([hop, step])


@pytest.fixture
def hop(both: list[Recording]) -> Recording:
    return both[0]


@pytest.fixture
def step(both: list[Recording]) -> Recording:
    return both[1]


def kinds(rows: list[Any], kind: str) -> list[Any]:
    return [row for row in rows if row["row"] == kind]


def test_periods_are_those_of_the_summary(step: Recording) -> None:
    rows, told = measured_rows(step, "a"), summarise(step)
    assert [row["row"] for row in rows] == ["run", *["period"] * len(told.periods)]
    assert len(told.periods) >= 2
    periods = kinds(rows, "period")
    assert [row["rating"] for row in periods] == told.rating_periods
    assert [row["rating_motor"] for row in periods] == told.rating_periods_motor
    assert [row["rating_equilibrium"] for row in periods] == told.rating_periods_equilibrium
    assert [row["length"] for row in periods] == told.periods
    assert [row["index"] for row in periods] == list(range(1, len(periods) + 1))
    for first, second in pairwise(periods):
        assert second["start"] == pytest.approx(first["start"] + first["length"], abs=1e-12)
    (run,) = kinds(rows, "run")
    assert (run["status"], run["numerics"]) == ("complete", "sound")
    assert run["energy_residual"] == told.energy_residual
    assert run["polar_max"] == told.polar_max
    assert "rating" not in run


def test_the_amplitude_of_a_period_is_about_the_equilibrium(step: Recording) -> None:
    """Without gravity the equilibrium is where the motor stands: z2 = 1.0 after the step.

    The first row of the first period is that of the action, which its motors do not show yet.
    """
    radial = joint_to_modal(step["joint_pos"])[:, 1] - 1.0
    radial[step["motor_pos"][:, 1] > step["motor_pos"][-1, 1] + 1e-9] = 0.0
    for row in kinds(measured_rows(step, "a"), "period"):
        inside = (step.time >= row["start"]) & (step.time < row["start"] + row["length"])
        assert row["amplitude"] == pytest.approx(np.abs(radial[inside]).max(), abs=1e-9)


def test_jumps_and_phases_are_those_of_the_summary(hop: Recording) -> None:
    rows, told = measured_rows(hop, "b"), summarise(hop)
    assert told.jumps >= 3
    jumps, (run,) = kinds(rows, "jump"), kinds(rows, "run")
    assert len(jumps) == told.jumps
    assert [row["rating"] for row in kinds(rows, "stance")] == told.rating_stance
    assert [row["rating_equilibrium"] for row in kinds(rows, "flight")] == (
        told.rating_flight_equilibrium
    )
    limit_cycle = jumps[told.first :]
    assert 1.0 / np.mean([row["length"] for row in limit_cycle]) == pytest.approx(told.hop_freq)
    apexes = [row["apex"] for row in limit_cycle]
    assert run["apex"] == pytest.approx(np.mean(apexes))
    assert run["hop_freq"] == told.hop_freq
    assert run["drift"] == told.drift
    for name in ("foot_clearance", "trunk_excursion", "foot_travel"):
        assert max(row[name] for row in jumps[-3:]) == getattr(told, name), name
        assert run[name] == pytest.approx(np.mean([row[name] for row in limit_cycle])), name
    assert max(row["polar_max"] for row in limit_cycle) == told.polar_max


def test_a_run_without_rows_is_one_row(step: Recording) -> None:
    empty = replace(
        step,
        time=step.time[:0],
        columns={name: column[:0] for name, column in step.columns.items()},
    )
    (row,) = measured_rows(empty, "c")
    assert math.isnan(row["start"])
    table = measured_table([row])
    assert table.schema == MEASURED
    assert math.isnan(table["rating"][0].as_py())


def test_the_table_is_sorted_typed_and_has_its_units(hop: Recording, step: Recording) -> None:
    rows = [*measured_rows(step, "f0"), *measured_rows(hop, "0a")]
    settings: dict[str, dict[str, Any]] = {
        "f0": {"seed": 1, "setup.kind": "hfts", "x.flag": True, "x.pair": [1.0, 2.0], "x.n": 1},
        "0a": {"seed": 2, "setup.kind": "jump", "x.flag": False, "x.n": 2.5},
    }
    axes = ("x.flag", "x.n", "x.pair", "seed")
    table = whole_table(measured_table(rows[::-1]), settings, {"f0": 3, "0a": 4}, axes, b"{}")
    order = [
        (row["experiment"], KINDS.index(row["row"]), row["index"]) for row in table.to_pylist()
    ]
    assert order == sorted(order)
    assert table.num_rows == len(rows)
    assert set(zip(table["experiment"].to_pylist(), table["trial"].to_pylist(), strict=True)) == {
        ("0a", 4),
        ("f0", 3),
    }
    kinds_of = {name: table.schema.field(name).type for name in (*axes, "setup.kind")}
    assert kinds_of == {
        "x.flag": pa.bool_(),
        "x.n": pa.float64(),
        "x.pair": pa.string(),
        "seed": pa.int64(),
        "setup.kind": pa.string(),
    }
    assert set(table["x.pair"].to_pylist()) == {"[1.0, 2.0]", None}
    for name, unit in UNITS.items():
        assert table.schema.field(name).metadata == {b"unit": unit.encode()}
    assert table.schema.names.count("seed") == 1


def test_what_is_no_table_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="is not there: name the folder of a campaign"):
        read_table(tmp_path)
    path = tmp_path / "table.parquet"
    path.write_bytes(b"PAR1 torn")
    with pytest.raises(RecordingError, match="is damaged"):
        read_table(tmp_path)
    parquet.write_table(pa.table({"a": [1]}), str(path))
    with pytest.raises(FormatError, match="has format none; this legbench reads 1"):
        read_table(path)
