"""The stop: nothing interrupts it, it looks whether it has worked, and says where it has not."""

import json
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import can
import pytest
from can_rig import BUS, LIMITS, ROOT
from drives_rig import MS, START, Rig, config, rig

from legbench.cli import main
from legbench.drives.emulated.bus import LockstepBus
from legbench.drives.emulated.drive import EmulatedDrive
from legbench.drives.emulated.network import Network
from legbench.drives.errors import StopError
from legbench.drives.master.link import LinkState
from legbench.drives.master.session import Session
from legbench.drives.protocol.cia402 import POWERED, DriveState
from legbench.drives.protocol.datatypes import DataType
from legbench.drives.setup.config import Parameter
from legbench.plant import can_open
from legbench.recording.reader import load

SO, OE = DriveState.SWITCH_ON_DISABLED, DriveState.OPERATION_ENABLED
SCRIPT = ROOT / "scripts" / "interruptions.py"
WITHIN_NS = 50 * MS


def jam(drive: EmulatedDrive) -> None:
    """From operation enabled on a drive obeys nobody, its own watchdogs included."""
    power = drive.axis.power
    obey = power.command

    def command(controlword: int, *, cause_gone: bool) -> bool:
        return power.state is not OE and obey(controlword, cause_gone=cause_gone)

    power.command = command
    power.quick_stop = power.connection_lost = power.fault = power.disable = lambda: None


def started(it: Rig) -> None:
    it.link.start()
    it.run(5)


# --- nothing gets in between -----------------------------------------------------------------


@pytest.mark.parametrize("what", [KeyboardInterrupt, SystemExit])
@pytest.mark.parametrize("name", ["send", "recv"])
def test_a_driver_that_raises_in_a_stop_neither_ends_nor_hides_it(
    name: str, what: type[BaseException], tmp_path: Path
) -> None:
    for at in (1, 2, 3, 4, 7, 11):
        with rig(tmp_path) as it:
            started(it)
            real, calls = getattr(it.bus, name), 0

            def raising(
                *arguments: Any,
                _real: Callable[..., Any] = real,
                _at: int = at,
            ) -> Any:
                nonlocal calls
                calls += 1
                if calls in (_at, _at + 1):
                    raise what
                return _real(*arguments)

            setattr(it.bus, name, raising)
            began = it.network.now_ns
            with pytest.raises(what):
                it.link.stop()
            assert it.states == [SO, SO]
            assert it.link.state is LinkState.STOPPED
            assert it.network.now_ns - began < WITHIN_NS
            assert it.link.stopped is not None
            assert it.link.stopped.verified
            assert it.link.stopped.errors == (what.__name__,)


def test_a_stop_moves_no_target(tmp_path: Path) -> None:
    with rig(tmp_path) as it:
        started(it)
        sent = [axis.sent_counts for axis in it.link.cycle.axes]
        for axis in it.link.cycle.axes:
            axis.aim(0.0)
        it.link.stop()
        assert [axis.sent_counts for axis in it.link.cycle.axes] == sent


def test_a_ramp_that_takes_too_long_is_cut_off_in_time(tmp_path: Path) -> None:
    slow = Parameter(index=0x6085, sub=0, kind=DataType.UNSIGNED32, value=20_000)
    nodes = tuple(replace(node, parameters=(slow,)) for node in config().nodes)
    slowly = config(nodes=nodes, waive=("master watch",))
    with rig(tmp_path, bus_config=slowly) as it:
        it.link.start()
        for cycle in range(100):
            it.link.command((START[0] + 1e-3 * cycle, START[1]))
            it.link.exchange()
        began, off_ns = it.network.now_ns, None
        real = it.network._body

        def seen(angles: tuple[float, ...]) -> Any:
            nonlocal off_ns
            powered = any(state in POWERED for state in it.states)
            off_ns = off_ns if powered or off_ns is not None else it.network.now_ns
            return real(angles)

        it.network._body = seen
        it.link.stop()
        assert off_ns is not None
        assert 40 * MS < off_ns - began < WITHIN_NS
        assert it.link.stopped is not None
        assert it.link.stopped.cut_off == ("hip",)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_drives_that_are_found_with_power_are_stopped_together(
    number: signal.Signals, tmp_path: Path
) -> None:
    with rig(tmp_path) as it:
        started(it)
        it.bus.shutdown()
        bus = LockstepBus("second", network=it.network)
        with Session(bus, it.config) as session:
            up = session.bring_up()
            real, sent = bus.send, 0

            def interrupting(msg: can.Message, timeout: float | None = None) -> None:
                nonlocal sent
                sent += 1
                real(msg, timeout)
                if sent == 3:  # Two questions, then the first of two quick stops.
                    signal.raise_signal(number)

            bus.send = interrupting
            before = signal.signal(number, signal.default_int_handler)
            with pytest.raises(KeyboardInterrupt):
                up.unpower()
            signal.signal(number, before)
            assert it.states == [SO, SO]


# --- it is looked at whether it has worked ---------------------------------------------------


def test_a_drive_that_keeps_its_power_is_named_and_the_link_is_not_stopped(tmp_path: Path) -> None:
    with rig(tmp_path) as it:
        for drive in it.network.drives[1:]:
            jam(drive)
        started(it)
        it.link.stop()
        assert it.states == [SO, OE]
        assert it.link.state is LinkState.STOPPING
        report = it.link.stopped
        assert report is not None
        assert (report.powered, report.silent, report.cut_off) == (("knee",), (), ("knee",))
        with pytest.raises(StopError, match=r"drive 'knee' keeps its power after the stop \(.*op"):
            it.link.__exit__(None, None, None)


def test_a_stop_that_has_not_worked_is_repeated_when_the_link_is_closed(tmp_path: Path) -> None:
    with rig(tmp_path) as it:
        drive = it.network.drives[0]
        obey = drive.axis.power.command
        jam(drive)
        started(it)
        it.link.stop()
        assert it.states == [OE, SO]
        drive.axis.power.command = obey
        it.link.close()
        assert it.states == [SO, SO]
        assert it.link.state is LinkState.STOPPED
        assert it.link.stopped is not None
        assert it.link.stopped.verified


def test_a_drive_that_no_longer_answers_is_told_apart(tmp_path: Path) -> None:
    with rig(tmp_path) as it:
        started(it)
        real = it.bus.recv

        def deaf(timeout: float | None = None) -> can.Message | None:
            message = real(timeout)
            unheard = message is not None and message.arbitration_id & 0x7F == 1
            return None if unheard else message

        it.bus.recv = deaf
        it.link.close()
        report = it.link.stopped
        assert report is not None
        assert (report.powered, report.silent) == ((), ("hip",))
        assert "drive 'hip' no longer answers, so whether it has power is not" in str(
            report.trouble
        )
        assert it.states == [SO, SO]


def test_an_exception_on_its_way_gets_the_trouble_as_a_note(tmp_path: Path) -> None:
    with rig(tmp_path) as it:
        jam(it.network.drives[0])
        started(it)
        with pytest.raises(ZeroDivisionError) as caught, it.link:
            raise ZeroDivisionError
        assert len(caught.value.__notes__) == 1
        assert "drive 'hip' keeps its power" in caught.value.__notes__[0]


# --- the commands ----------------------------------------------------------------------------


def bench(folder: Path) -> list[str]:
    """Flags of the emulated leg with a bus file of its own, whose searches are fast."""
    text = BUS.read_text(encoding="utf-8")
    text = text.replace('"6099:01 u32" = 12517', '"6099:01 u32" = 60_000')
    (folder / "leg.toml").write_text(text, encoding="utf-8")
    shutil.copy(LIMITS, folder / "limits.toml")
    design = str(ROOT / "models" / "optimal.toml")
    return ["--bus", str(folder / "leg.toml"), "--interface", "legbench", "--design", design]


def opened(monkeypatch: pytest.MonkeyPatch, then: Callable[[Network], None]) -> None:
    """Do something to the emulated leg as soon as a command has made it."""
    real = can_open.emulate

    def emulate(*arguments: Any, **more: Any) -> Network:
        network = real(*arguments, **more)
        then(network)
        return network

    monkeypatch.setattr(can_open, "emulate", emulate)


def run_flags(folder: Path) -> list[str]:
    where = [*bench(folder), "--out", str(folder / "runs"), "--json"]
    return ["run", "bang-bang", "--plant", "can", "--duration", "0.05", *where]


def test_a_run_whose_drive_keeps_its_power_is_a_fault(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    opened(monkeypatch, lambda network: jam(network.drives[1]))
    assert main(run_flags(tmp_path)) == 1
    assert "drive 'motor2' keeps its power after the stop" in capfd.readouterr().err
    (run,) = (tmp_path / "runs").iterdir()
    found = load(run)
    assert (found.manifest["status"], found.manifest["cause"]) == ("fault", "stop failed")
    assert len(found.time) == 50
    (event,) = [event for event in found.events if event["name"] == "stop"]
    assert event["powered"] == ["motor2"]


@pytest.mark.parametrize("action", [["jog"], ["home", "--method", "-3"]], ids=["jog", "home"])
def test_a_command_whose_drive_keeps_its_power_names_it(
    action: list[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
) -> None:
    opened(monkeypatch, lambda network: jam(network.drives[0]))
    more = ["--timeout", "0.2"] if action[0] == "home" else ["--by", "0.01"]
    assert main(["drives", *action, "--node", "motor1", *more, *bench(tmp_path)]) == 1
    assert "drive 'motor1' keeps its power after the stop" in capfd.readouterr().err


def strike(monkeypatch: pytest.MonkeyPatch, at: Callable[[can.Message], bool]) -> None:
    """Interrupt at the first frame that fits."""
    real, struck = LockstepBus.send, False

    def send(bus: LockstepBus, msg: can.Message, timeout: float | None = None) -> None:
        nonlocal struck
        if not struck and at(msg):
            struck = True
            signal.raise_signal(signal.SIGINT)
        real(bus, msg, timeout)

    monkeypatch.setattr(LockstepBus, "send", send)


def test_a_run_that_is_interrupted_before_its_folder_leaves_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    strike(monkeypatch, lambda msg: msg.data[:1] == b"\x2b")  # A write of two bytes.
    assert main(run_flags(tmp_path)) == 130
    error = capfd.readouterr().err
    assert error.startswith("legbench: interrupted; drive 'motor1' (node 1) has no power, and")
    assert "holds its configuration in part" in error
    assert not (tmp_path / "runs").exists()


def test_a_run_that_is_interrupted_before_its_first_row_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    made: list[Network] = []
    opened(monkeypatch, made.append)
    strike(monkeypatch, lambda msg: msg.arbitration_id == 0x202 and msg.data[0] == 0x0F)
    assert main(run_flags(tmp_path)) == 130
    (run,) = (tmp_path / "runs").iterdir()
    assert f"interrupted before the first row; {run} holds 0 rows" in capfd.readouterr().err
    manifest = json.loads((run / "run.json").read_text(encoding="utf-8"))
    assert (manifest["status"], manifest["rows"]) == ("interrupted", 0)
    assert [drive.axis.power.state for drive in made[0].drives] == [SO, SO]


@pytest.mark.parametrize(
    "commands", [["jog", "home"], pytest.param(["rest"], marks=pytest.mark.long)]
)
def test_commands_that_are_interrupted_at_any_moment_leave_no_power(commands: list[str]) -> None:
    few = ["--points", "12", "--seed", "4", "--commands", *commands]
    command = [sys.executable, "-W", "error", str(SCRIPT), *few]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "12 interruptions, 0 moments not reached, 0 violations" in done.stdout
