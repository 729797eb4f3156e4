"""`legbench drives learn|check` and runs on drives of a data sheet, as users call them."""

import json
import shutil
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from commands import Done, called

from legbench.recording.reader import load

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "tests" / "drives"))

from eds_texts import stranger  # noqa: E402

Call = Callable[..., Done]


@pytest.fixture
def call(capfd: pytest.CaptureFixture[str]) -> Call:
    return lambda *arguments: called(capfd, *arguments)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with the bench's limits and the data sheet of a drive that lacks some things."""
    shutil.copy(ROOT / "hardware" / "limits.toml", tmp_path / "limits.toml")
    sheet = stranger().without(0x1016, 0x1006, 0x605E, (0x1018, 4)).fixed({(0x1017, 0): "30"})
    (tmp_path / "it.eds").write_text(sheet.text(), encoding="utf-8")
    return tmp_path


def learnt(call: Call, folder: Path, *more: str) -> Done:
    return call("drives", "learn", folder / "it.eds", "--out", folder / "my.toml", *more)


def test_learn_says_what_a_drive_lacks_and_writes_a_file_that_fits(
    call: Call, folder: Path
) -> None:
    done = learnt(call, folder, "--node", "5", "--node", "9")
    assert done.status == 0, done.err
    assert "motor1, motor2: Fremd 7 of Fremdwerk" in done.out
    assert "protection lacks 1016h:01 Consumer heartbeat time 1: the drive has no such" in done.out
    assert (
        "protection fixed 1017h:00 Producer heartbeat time [ms]: wanted 20, the drive" in done.out
    )
    assert "1018h:04 Serial number: not known is the serial number" in done.out
    assert "without master it reacts after 22 ms by deadline of RPDO1 1400h:05" in done.out
    assert "lines of the bus file are still to be measured; each says MEASURE" in done.err
    again = learnt(call, folder)
    assert again.status == 1
    assert "is there already, and is left as it is; give another --out" in again.err
    done = call("drives", "check", "--bus", folder / "my.toml")
    assert done.status == 0, done.err


def test_check_is_an_object_and_refuses_in_lines(call: Call, folder: Path) -> None:
    learnt(call, folder)
    done = call("drives", "check", "--json", "--bus", folder / "my.toml")
    found = json.loads(done.out)
    assert found["problems"] == []
    assert len(found["to_measure"]) > 20
    needs = {need["object"]: need for need in found["nodes"][0]["needs"]}
    assert needs["6040h:00 Controlword"]["state"] == "has"
    assert needs["1017h:00 Producer heartbeat time [ms]"]["state"] == "fixed"
    assert needs["1016h:01 Consumer heartbeat time 1"]["state"] == "lacks"
    assert any("605Eh:00" in line for line in found["nodes"][0]["not_protected"])
    # The bench's own file maps an object that this drive does not have.
    bench = ROOT / "hardware" / "leg.toml"
    done = call("drives", "check", "--eds", folder / "it.eds", "--bus", bench)
    assert done.status == 1
    assert "legbench: 'motor1': 2064h:00 Link position, low 16 bits [counts] is missing" in done.err
    done = call("drives", "check", "--bus", bench)
    assert done.status == 1
    assert "'motor1' names no data sheet; give --eds, or eds = \"FILE\" in the file" in done.err


def test_a_leg_on_these_drives_is_configured_and_runs(call: Call, folder: Path) -> None:
    learnt(call, folder)
    emulated = ("--interface", "legbench", "--bus", folder / "my.toml")
    done = call("drives", "configure", "--write", *emulated)
    assert done.status == 0, done.err
    assert (
        "drives 'motor1', 'motor2', 605Eh:00 Fault reaction option code: the drive has" in done.out
    )
    assert "0 objects differ" in done.out
    run = call(
        "run", "jump", "--plant", "can", *emulated, "--duration", "0.4", "--out", folder / "runs"
    )
    assert run.status == 0, run.err
    assert "not protected by braking on a fault; instead: the drive's own choice" in run.err
    (path,) = (folder / "runs").iterdir()
    events = load(path).events
    (event,) = (one for one in events if one["name"] == "not protected")
    assert any("605Eh:00" in line for line in event["lines"])


def test_a_sheet_that_is_none_is_one_line(call: Call, folder: Path) -> None:
    (folder / "it.eds").write_bytes(b"\x7fELF\0\0")
    done = learnt(call, folder)
    assert done.status == 1
    assert done.err.count("\n") == 1
    assert "it.eds: is no text" in done.err
    assert not (folder / "my.toml").exists()
