"""Recorded observations give the recorded commands, to the bit, through the recorded controller."""

import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from legbench.errors import ConfigError, FormatError, PlantFault, RecordingError
from legbench.recording.layout import ARCHIVE, RUN, STREAM
from legbench.recording.reader import Recording, load
from legbench.recording.stream import BatchEncoder, encode_schema, schema_for
from legbench.replay.controller import replay_controller
from legbench.replay.observations import exact_times, observations
from legbench.replay.recorded import recorded_controller

FORMAT_1 = Path(__file__).parents[1] / "recording" / "format_1"


def edited_manifest(run: Recording, folder: Path, **controller: object) -> Recording:
    """The same run under a manifest whose controller has other entries."""
    shutil.copytree(run.path, folder)
    manifest = json.loads((folder / RUN).read_text())
    manifest["experiment"]["controller"] |= controller
    (folder / RUN).write_text(json.dumps(manifest))
    return load(folder)


@pytest.mark.parametrize("name", ["sim_jump", "analytic_run", "can_swing", "can_jump", "guest_run"])
def test_the_recorded_controller_repeats_itself_to_the_bit(
    name: str, request: pytest.FixtureRequest
) -> None:
    run: Recording = request.getfixturevalue(name)
    commands = replay_controller(run, recorded_controller(run)).commands
    assert commands.identical
    assert commands.first() is None
    assert {"command_pos_1", "command_pos_2", "phase"} <= commands.replayed.keys()
    assert len(commands.time) == len(run.time)
    for each in commands.deviations():
        assert (each.max, each.rms, each.rows, each.first_cycle) == (0.0, 0.0, 0, None)


def test_time_counts_cycles_and_not_nanoseconds(guest_run: Recording) -> None:
    times = exact_times(guest_run, 0.001)
    assert np.array_equal(times, np.arange(len(times)) * 0.001)
    # The law steps on when three times a millisecond have passed: by nanoseconds it does so late.
    for clock, agrees in ((times, True), (guest_run.time, False)):
        law = recorded_controller(guest_run).build()
        phases = []
        for seen in observations(guest_run, clock):
            if not phases:
                law.reset(seen)
            phases.append(int(law.step(seen).phase))
        assert np.array_equal(phases, guest_run["phase"]) is agrees


def test_the_time_of_a_late_sync_is_what_it_was() -> None:
    """As `CanPlant` tells it, for SYNCs off the grid by any nanoseconds."""
    late_ns = np.array([0, 13, 999_999, 250_001])
    cycles = np.array([0, 7, 4321, 3_599_999])
    told = cycles * 0.002 + 1e-9 * late_ns
    columns = {"t_ns": np.rint(1e9 * told).astype(np.int64)}
    fake = Recording(
        path=Path("x"),
        manifest={},
        described=FormatError("none"),
        time=told,
        columns=columns,
        events=(),
    )
    assert np.array_equal(exact_times(fake, 0.002), told)


def test_an_edited_controller_shows_where_it_differs_first(sim_jump: Recording) -> None:
    later = recorded_controller(sim_jump, {"controller.settings.delay": 0.2})
    commands = replay_controller(sim_jump, later).commands
    first = commands.first()
    assert first is not None
    assert (first.cycle, first.time, first.signal) == (100, 0.1, "command_pos_1")
    assert first.recorded == sim_jump["command_pos"][100, 0]
    assert first.replayed == sim_jump["command_pos"][99, 0]
    assert not commands.identical
    content = commands.to_json(allowed=10.0)
    assert content["first"]["cycle"] == 100
    assert content["signals"]["command_pos_1"]["rows"] == 0
    assert content["signals"]["command_pos_1"]["max"] == pytest.approx(
        abs(first.replayed - first.recorded)
    )


def test_a_torn_run_is_replayed_as_far_as_it_goes(sim_jump: Recording, tmp_path: Path) -> None:
    torn = tmp_path / "torn"
    shutil.copytree(sim_jump.path, torn)
    (torn / ARCHIVE).unlink()
    schema = schema_for(sim_jump.manifest)
    named = [sim_jump.columns[name] for name in schema.names[1:]]
    rows = np.stack([sim_jump.time, *named]).astype(np.float64)
    encoder = BatchEncoder(rows[:, :50], schema)
    batches = [rows[:, begin : begin + 50] for begin in range(0, 300, 50)]
    whole = [bytes(encode_schema(schema)), *(bytes(encoder.encode(each)) for each in batches)]
    (torn / STREAM).write_bytes(b"".join(whole)[:-100])
    run = load(torn)
    assert run.torn is not None
    assert len(run.time) == 250
    assert replay_controller(run, recorded_controller(run)).commands.identical


def test_a_controller_that_this_version_lacks_is_named(sim_jump: Recording, tmp_path: Path) -> None:
    run = edited_manifest(sim_jump, tmp_path / "run", kind="trot")
    with pytest.raises(
        ConfigError, match=r"needs controller 'trot', which is not.*jump, bang-bang"
    ):
        recorded_controller(run)
    other = recorded_controller(run, {"controller.kind": "jump"})
    assert other.controller.kind == "jump"


def test_a_guest_whose_copy_is_gone_is_named(guest_run: Recording, tmp_path: Path) -> None:
    run = edited_manifest(guest_run, tmp_path / "run")
    (run.path / "controller_mine.py").unlink()
    with pytest.raises(ConfigError, match=r"needs controller 'controller_mine\.py:Counting'"):
        recorded_controller(run)


def test_a_guest_from_a_module_is_that_of_the_run_folder(
    guest_run: Recording, tmp_path: Path
) -> None:
    """The installed module may have changed, or gone, since."""
    run = edited_manifest(guest_run, tmp_path / "run", kind="gone_since.laws:Counting")
    assert replay_controller(run, recorded_controller(run)).commands.identical


def test_a_law_that_fails_is_told_with_its_line(guest_run: Recording, tmp_path: Path) -> None:
    run = edited_manifest(guest_run, tmp_path / "run")
    copy = run.path / "controller_mine.py"
    copy.write_text(copy.read_text().replace("push = 1e-4", "push = None + 1e-4"))
    with pytest.raises(PlantFault, match=r"in its replay at t = 0\.000 s: TypeError") as caught:
        replay_controller(run, recorded_controller(run))
    assert caught.value.cause == "controller failed"
    assert "push = None" in str(caught.value)


@pytest.mark.parametrize("name", ["jump", "bang-bang-without-truth"])
def test_a_run_that_lacks_rows_is_refused(name: str) -> None:
    """Runs of the first format are kept thinned: their controllers can be built, not replayed."""
    run = load(FORMAT_1 / name)
    controller = recorded_controller(run)
    with pytest.raises(RecordingError, match=r"lacks rows after t = .* s; a replay needs every"):
        replay_controller(run, controller)


def test_a_run_without_rows_is_refused(sim_jump: Recording) -> None:
    columns = {name: values[:0] for name, values in sim_jump.columns.items()}
    empty = replace(sim_jump, time=sim_jump.time[:0], columns=columns)
    with pytest.raises(RecordingError, match="has no rows"):
        replay_controller(empty, recorded_controller(sim_jump))


def test_an_edit_of_what_this_replay_has_not_is_refused(sim_jump: Recording) -> None:
    with pytest.raises(ConfigError, match=r"--set numerics.timestep: this replay has controller"):
        recorded_controller(sim_jump, {"numerics.timestep": 1e-4})
    with pytest.raises(ConfigError, match="did you mean 'dz2'"):
        recorded_controller(sim_jump, {"controller.settings.dz": 0.1})
