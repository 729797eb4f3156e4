"""`legbench drives learn|check` and runs on drives of a data sheet, as users call them."""

import json
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from commands import Done, called

from legbench.drives.setup.eds import eds_text
from legbench.recording.reader import load

ROOT = Path(__file__).parents[2]
MISSING = ("1006", "1016", "2064", "2070", "605E", "1018sub4")

Call = Callable[..., Done]


def stranger() -> str:
    """Our own data sheet as that of another maker, whose drive lacks and fixes some things."""
    sections = eds_text().split("\n[")
    kept = [one for one in sections if not one.startswith(MISSING)]
    text = "\n[".join(kept).replace("Name=legbench\n", "Name=Fremdwerk\n")
    text = text.replace("=legbench-drive\n", "=Fremd 7\n").replace("Number=0\n", "Number=0x77\n")
    head, heartbeat, rest = text.partition("[1017]")
    fixed = rest.replace("AccessType=rw", "AccessType=const", 1)
    return head + heartbeat + fixed.replace("DefaultValue=0x0", "DefaultValue=30", 1)


@pytest.fixture
def call(capfd: pytest.CaptureFixture[str]) -> Call:
    return lambda *arguments: called(capfd, *arguments)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with the bench's limits and the data sheet of a drive that lacks some things."""
    shutil.copy(ROOT / "hardware" / "limits.toml", tmp_path / "limits.toml")
    (tmp_path / "it.eds").write_text(stranger(), encoding="utf-8")
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
    assert again.status == 2
    assert "is there already, and is left as it is; give another --out" in again.err
    done = call("drives", "check", "--bus", folder / "my.toml")
    assert done.status == 0, done.err


def test_learn_says_of_each_object_whether_it_is_there_fixed_or_missing(
    call: Call, folder: Path
) -> None:
    sections = (folder / "it.eds").read_text(encoding="utf-8").split("\n[")
    lacking = ("6007", "6085", "607E")
    text = "\n[".join(one for one in sections if not one.startswith(lacking))
    head, sync, rest = text.partition("[1005]")
    fixed = rest.replace("AccessType=rw", "AccessType=const", 1)
    (folder / "it.eds").write_text(head + sync + fixed, encoding="utf-8")
    done = learnt(call, folder)
    assert done.status == 0, done.err
    has, *others = done.out.partition("  has ")[2].split("\n  ")
    while others[0].startswith("    "):
        has += f" {others.pop(0).strip()}"
    assert {"6040h:00", "6064h:00", "6084h:00", "1400h:05"} <= set(has.split(", "))
    assert "if present fixed 1005h:00 COB-ID SYNC: as it is wanted" in others
    assert "if present lacks 607Eh:00 Polarity: where it is missing nothing is lost" in others
    assert (
        "protection lacks 6085h:00 Quick stop deceleration [counts/s2]: the drive has no such "
        "object; instead: 6084h:00 Profile deceleration [counts/s2], by 605Ah = 1" in others
    )
    assert others[-1] == "without master no reaction of it is known\n"
    # What the proposal does without is said before anybody reads the file.
    waived = "the bus file waives the master watch: drives may go on for "
    assert waived in done.err
    assert waived in call("drives", "check", "--bus", folder / "my.toml").err
    done = call("drives", "budget", "--bus", folder / "my.toml")
    assert "without master, motor1 is not known to stop\n" in done.out


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
    assert (
        "legbench: 'motor1', 'motor2': 2064h:00 Link position, low 16 bits [counts] is missing"
        in done.err
    )
    done = call("drives", "check", "--bus", bench)
    assert done.status == 2
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
        *("run", "jump", "--plant", "can", *emulated, "--duration", "0.1", "--end", "stop"),
        *("--out", folder / "runs"),
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
    assert done.status == 2
    assert done.err.count("\n") == 1
    assert "it.eds: is no text" in done.err
    assert not (folder / "my.toml").exists()


@pytest.mark.long
def test_emulate_wears_a_sheet_and_says_what_the_bus_file_asks_in_vain(
    call: Call, folder: Path
) -> None:
    where = ("--channel", folder / "leg.sock", "--bare", "--seconds", "0.2")
    learnt(call, folder)
    done = call("drives", "emulate", "--bus", folder / "my.toml", *where)
    assert done.status == 0
    assert done.err.splitlines()[0].startswith("serving ")
    bench = ROOT / "hardware" / "leg.toml"
    done = call("drives", "emulate", "--eds", folder / "it.eds", "--bus", bench, *where)
    assert done.status == 0
    assert (
        "legbench: 'motor1', 'motor2': 2064h:00 Link position, low 16 bits [counts] is missing"
        in done.err
    )
    done = call("drives", "emulate", "--eds", folder / "no.eds", "--bus", bench, *where)
    assert done.status == 2
    assert "no.eds: no such file" in done.err


def test_learn_says_that_limits_are_missing(call: Call, folder: Path) -> None:
    done = call("drives", "learn", folder / "it.eds", "--out", folder / "new" / "my.toml")
    assert done.status == 0, done.err
    assert "a run also needs limits: copy hardware/limits.toml beside it" in done.err


def test_a_budget_counts_the_means_that_the_data_sheet_leaves(call: Call, folder: Path) -> None:
    learnt(call, folder)
    done = call("drives", "budget", "--bus", folder / "my.toml")
    assert done.status == 0, done.err
    assert "without master, motor1 stands after 24 ms by deadline of RPDO1 1400h:05\n" in done.out
    text = (folder / "my.toml").read_text(encoding="utf-8")
    without = "\n".join(line for line in text.splitlines() if not line.startswith("eds ="))
    (folder / "my.toml").write_text(without, encoding="utf-8")
    done = call("drives", "budget", "--bus", folder / "my.toml")
    assert "by deadline of RPDO1 1400h:05 or 34 ms by heartbeat consumer 1016h\n" in done.out
