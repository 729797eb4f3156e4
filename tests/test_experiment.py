import hashlib
import json
import signal
import subprocess
import sys
import threading
from dataclasses import replace
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

from legbench.clock import AbstractClock
from legbench.control import BangBangConfig, Jump, JumpConfig, PositionJumpConfig
from legbench.design import LegDesign
from legbench.design.setup import Setup, SetupKind
from legbench.errors import ConfigError, RecordingError
from legbench.experiment import Experiment, record, start_of
from legbench.interrupts import StopFlag
from legbench.mjcf import Linkage, LinkageKind
from legbench.recording.reader import load
from legbench.servo import ServoConfig
from legbench.signals import Observation

CONTROLLERS = (JumpConfig(), BangBangConfig(), PositionJumpConfig())


def short(design: LegDesign, **choices: Any) -> Experiment:
    experiment = Experiment(design=design, controller=JumpConfig(), duration=0.12)
    return replace(experiment, **choices)


@pytest.mark.parametrize("linkage", LinkageKind)
@pytest.mark.parametrize("config", CONTROLLERS, ids=lambda config: config.kind)
@pytest.mark.parametrize("kind", SetupKind)
def test_every_controller_runs_in_every_setup_that_it_knows(
    tmp_path: Path,
    prototype: LegDesign,
    kind: SetupKind,
    config: JumpConfig | BangBangConfig | PositionJumpConfig,
    linkage: LinkageKind,
) -> None:
    experiment = short(
        prototype, controller=config, setup=Setup(kind=kind), linkage=Linkage(kind=linkage)
    )
    if isinstance(config, JumpConfig) and kind in (SetupKind.HFTS, SetupKind.VFTS):
        with pytest.raises(ConfigError, match="jumping needs setup 'jump' or 'ffs'"):
            record(experiment, tmp_path)
        assert list(tmp_path.iterdir()) == []
        return
    finished = record(experiment, tmp_path)
    assert (finished.outcome.status, finished.outcome.cycles) == ("complete", 120)
    recording = load(finished.path)
    assert recording.complete
    assert np.array_equal(recording.time, np.arange(120) / 1000.0)
    assert recording["loop_gap"].max() < 2e-5
    assert recording.description.setup.kind == kind


def test_the_same_experiment_gives_the_same_samples(tmp_path: Path, optimal: LegDesign) -> None:
    first, second = (load(record(short(optimal), tmp_path).path) for _ in range(2))
    for signal_name in first.signals:
        if signal_name != "cycle_us":
            assert np.array_equal(first[signal_name], second[signal_name]), signal_name


def test_the_manifest_tells_what_ran(tmp_path: Path, prototype: LegDesign) -> None:
    experiment = short(prototype, servo=ServoConfig(slew_rate=5.0))
    finished = record(experiment, tmp_path)
    recording = load(finished.path)
    found, written = recording.description, recording.manifest
    assert found.design == prototype
    xml = (finished.path / "leg.xml").read_bytes()
    assert found.model_hash == hashlib.sha256(xml).hexdigest()
    mujoco.MjModel.from_xml_path(str(finished.path / "leg.xml"))
    assert (found.controller, found.plant, found.linkage) == ("jump", "sim", "bars")
    assert (found.z2, found.dz2) == (JumpConfig().z2, JumpConfig().dz2)
    assert (found.planned_duration, found.duration) == (experiment.duration, pytest.approx(0.119))
    assert {"python", "numpy", "pyarrow"} <= found.versions.keys()
    assert found.initial_state is not None
    start = start_of(experiment)
    assert found.initial_state.joint_pos == tuple(start.joint_pos)
    assert found.initial_state.motor_pos == tuple(start.motor_pos)
    assert found.period == 0.001
    assert written["units"] == found.layout.units
    tables = found.experiment
    assert tables["servo"]["slew_rate"] == 5.0
    assert tables["conventions"] == {
        "modal": "orthonormal",
        "setpoint": "link",
        "rating_reference": "setup",
    }
    assert {"plant", "setup", "linkage", "ground", "numerics", "seed"} <= tables.keys()


def test_the_applied_command_is_the_one_before(tmp_path: Path, prototype: LegDesign) -> None:
    recording = load(record(short(prototype), tmp_path).path)
    assert np.array_equal(recording["applied_pos"][1:], recording["command_pos"][:-1])


def test_a_fault_is_kept_as_the_cause(tmp_path: Path, prototype: LegDesign) -> None:
    violent = JumpConfig(z2=1.0, dz2=0.6, delay=0.01)
    soft_stop = replace(prototype, stiffness=(20.0, 20.0))
    finished = record(short(soft_stop, controller=violent, duration=4.0), tmp_path)
    assert finished.outcome.status == "fault"
    recording = load(finished.path)
    assert recording.description.status == "fault"
    assert recording.description.cause == finished.outcome.cause
    assert finished.outcome.cause is not None
    assert len(recording.time) == finished.outcome.cycles
    assert recording.events[-1]["name"] == "end"
    assert recording.events[-1]["cause"] == finished.outcome.cause


def test_a_stopped_run_is_whole(tmp_path: Path, prototype: LegDesign) -> None:
    stop = StopFlag()

    class Impatient(AbstractClock):
        def start(self) -> None:
            """Nothing."""

        def wait(self, cycle: int) -> float:
            if cycle == 70:
                stop.set()
            return 0.0

    finished = record(short(prototype), tmp_path, stop=stop, clock=Impatient())
    assert finished.outcome.status == "interrupted"
    recording = load(finished.path)
    assert recording.description.status == "interrupted"
    assert recording.torn is None
    assert len(recording.time) == 71


def test_an_error_on_the_way_closes_the_run(tmp_path: Path, prototype: LegDesign) -> None:
    class Stopped(AbstractClock):
        def start(self) -> None:
            """Nothing."""

        def wait(self, cycle: int) -> float:
            raise ZeroDivisionError(cycle)

    before = threading.active_count()
    with pytest.raises(ZeroDivisionError):
        record(short(prototype), tmp_path, clock=Stopped())
    (run,) = tmp_path.iterdir()
    found = load(run).description
    assert (found.status, found.cause) == ("fault", "ZeroDivisionError")
    assert threading.active_count() <= before


def test_an_operating_system_error_names_the_run(
    tmp_path: Path, prototype: LegDesign, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(path: Path, *_content: object, **_options: Any) -> None:
        raise PermissionError(13, "no", str(path))

    monkeypatch.setattr(Path, "write_text", refuse)
    with pytest.raises(RecordingError, match=str(tmp_path)):
        record(short(prototype), tmp_path)


def test_onlookers_that_fail_are_events_of_a_run_that_goes_on(
    tmp_path: Path, prototype: LegDesign
) -> None:
    def burst(run: Path) -> None:
        raise ZeroDivisionError("no view")

    def gone(done: int, total: int) -> None:
        raise BrokenPipeError(32, "nobody reads")

    chosen = short(prototype, duration=0.6)
    finished = record(chosen, tmp_path, on_started=burst, progress=gone)
    assert finished.outcome.status == "complete"
    recording = load(finished.path)
    assert recording.complete
    assert len(recording.time) == 600
    assert [event for event in recording.events if event["name"] == "onlooker failed"] == [
        {
            "time": pytest.approx(0.6),
            "name": "onlooker failed",
            "who": "on_started",
            "error": "ZeroDivisionError: no view",
        },
        {
            "time": pytest.approx(0.6),
            "name": "onlooker failed",
            "who": "progress",
            "error": "BrokenPipeError: [Errno 32] nobody reads",
        },
    ]


@pytest.mark.parametrize("where", ["reset", "step"])
def test_a_controller_that_fails_leaves_a_whole_recording_of_a_fault(
    tmp_path: Path, prototype: LegDesign, monkeypatch: pytest.MonkeyPatch, where: str
) -> None:
    usual, calls = getattr(Jump, where), []

    def fail(jump: Jump, observation: Observation) -> object:
        calls.append(where)
        if where == "reset" or len(calls) > 77:
            raise IndexError("off the table")
        return usual(jump, observation)

    monkeypatch.setattr(Jump, where, fail)
    finished = record(short(prototype), tmp_path)
    recording = load(finished.path)
    manifest = recording.manifest
    assert (manifest["status"], manifest["cause"]) == ("fault", "controller failed")
    assert recording.torn is None
    assert len(recording.time) == finished.outcome.cycles == (0 if where == "reset" else 77)
    assert "IndexError: off the table" in str(finished.outcome.message)
    assert "in fail: raise IndexError" in str(finished.outcome.message)
    assert recording.events[-1]["name"] == "end"


@pytest.mark.parametrize("duration", [0.0, -1.0, 0.0005, float("nan"), float("inf")])
def test_a_duration_that_makes_no_run(prototype: LegDesign, duration: float) -> None:
    with pytest.raises(ConfigError, match=r"duration is .* s; it must be at least one cycle of"):
        short(prototype, duration=duration)


@pytest.mark.parametrize(
    # A master on drives that gets SIGINT is among the tests of processes.
    "number",
    [pytest.param(signal.SIGINT, marks=pytest.mark.long), signal.SIGTERM],
)
def test_an_interrupted_command_leaves_a_whole_run(
    tmp_path: Path, models: Path, number: signal.Signals
) -> None:
    """The signal comes after the first rows are on disk; the run is a minute of real time."""
    runs = tmp_path / "runs"
    design = str(models / "prototype.toml")
    code = "import sys; from legbench.cli import main; sys.exit(main(sys.argv[1:]))"
    command = [sys.executable, "-c", code, "run", "jump", "--design", design]
    command += ["--out", str(runs), "--duration", "60", "--real-time", "--json"]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=tmp_path
    ) as process:
        started = threading.Event()
        while process.poll() is None and not started.wait(0.02):
            if any(path.stat().st_size > 20_000 for path in runs.glob("*/samples.arrows")):
                started.set()
        process.send_signal(number)
        out, err = process.communicate(timeout=300)
    assert process.returncode == 0, err
    assert "Traceback" not in err
    summary = json.loads(out)
    assert summary["status"] == "interrupted"
    recording = load(Path(summary["run"]))
    assert recording.description.status == "interrupted"
    assert recording.torn is None
    assert 50 <= len(recording.time) < 60_000
    assert not (Path(summary["run"]) / "samples.arrows").exists()
