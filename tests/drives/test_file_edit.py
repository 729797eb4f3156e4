"""Single values of a bus file are replaced; every other byte of it stays."""

import os
import re
import tomllib
from pathlib import Path

import pytest
from can_rig import BUS
from hypothesis import given
from hypothesis import strategies as st

from legbench.commissioning.zero import EncoderZero, write
from legbench.drives.setup.bus_file import load_bus
from legbench.drives.setup.encoders import Side
from legbench.drives.setup.file_edit import edit_file, edited
from legbench.errors import ConfigError, RecordingError
from legbench.reading import UnreadableError

ZEROS = (
    EncoderZero(node="motor1", side=Side.MOTOR, motor_offset=-6242, link_offset=17),
    EncoderZero(node="motor2", side=Side.MOTOR, motor_offset=123456, link_offset=-1),
)
OFFSET = re.compile(rb"offset_counts = [-+\w]+")


def offsets(path: Path) -> list[tuple[int, int]]:
    return [
        (n.motor.offset_counts, n.link.offset_counts)
        for n in load_bus(path).nodes
        if n.link is not None
    ]


def bus(folder: Path, text: bytes | None = None) -> Path:
    path = folder / "leg.toml"
    path.write_bytes(BUS.read_bytes() if text is None else text)
    return path


@pytest.mark.parametrize("notation", [b"0x10", b"0o20", b"0b1_0000", b"-1_6", b"+16", b"16"])
def test_an_offset_in_any_notation_becomes_the_measured_number(
    notation: bytes, tmp_path: Path
) -> None:
    before = BUS.read_bytes().replace(b"offset_counts = 0", b"offset_counts = " + notation)
    path = bus(tmp_path, before)
    write(path, ZEROS)
    assert offsets(path) == [(-6242, 17), (123456, -1)]
    assert OFFSET.sub(b"@", path.read_bytes()) == OFFSET.sub(b"@", before)


def test_line_ends_of_windows_stay() -> None:
    text = BUS.read_bytes().replace(b"\n", b"\r\n").decode()
    changed = edited(text, {("node", 0, "motor", "offset_counts"): 5, ("bitrate",): 500_000})
    assert changed.count("\r\n") == changed.count("\n") == text.count("\n")
    assert changed == text.replace("offset_counts = 0", "offset_counts = 5", 1).replace(
        "bitrate = 1_000_000", "bitrate = 500000"
    )


def test_an_offset_that_is_not_there_is_added_with_the_file_s_line_ends(tmp_path: Path) -> None:
    lines = BUS.read_bytes().replace(b"\n", b"\r\n").splitlines(keepends=True)
    path = bus(tmp_path, b"".join(line for line in lines if b"offset_counts" not in line))
    write(path, ZEROS)
    assert offsets(path) == [(-6242, 17), (123456, -1)]
    assert path.read_bytes().count(b"\r\n") == path.read_bytes().count(b"\n")


def test_tables_in_one_line_are_edited_in_place() -> None:
    text = '[[node]]\nname = "a"\nmotor = { counts_per_rev = 4, offset_counts = 0x10 } # hip\n'
    changed = edited(text, {("node", 0, "motor", "offset_counts"): -3})
    assert changed == text.replace("0x10", "-3")


def test_a_link_stays_a_link_and_its_file_is_the_one_that_changes(tmp_path: Path) -> None:
    (tmp_path / "shared").mkdir()
    real = bus(tmp_path / "shared")
    real.chmod(0o664)
    linked = tmp_path / "leg.toml"
    linked.symlink_to(Path("shared") / "leg.toml")
    assert write(linked, ZEROS) == linked
    assert linked.is_symlink()
    assert os.readlink(linked) == "shared/leg.toml"
    assert offsets(real) == [(-6242, 17), (123456, -1)]
    assert real.stat().st_mode & 0o777 == 0o664
    assert [entry.name for entry in (tmp_path / "shared").iterdir()] == ["leg.toml"]


def test_another_file_is_written_beside_the_one_that_is_read(tmp_path: Path) -> None:
    path, out = bus(tmp_path), tmp_path / "zeroed.toml"
    write(path, ZEROS, out)
    assert path.read_bytes() == BUS.read_bytes()
    assert offsets(out) == [(-6242, 17), (123456, -1)]


def test_a_file_that_cannot_be_written_is_named_and_left_alone(tmp_path: Path) -> None:
    path = bus(tmp_path)
    with pytest.raises(RecordingError, match=r"nowhere.*No such file"):
        write(path, ZEROS, tmp_path / "nowhere" / "leg.toml")
    assert path.read_bytes() == BUS.read_bytes()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (b"bitrate = ", "not valid TOML"),
        (b"\xff", "no UTF-8"),
        (b"bitrate = 1\n", "there is no node.\\[1\\].motor.offset_counts"),
        (b"node = 3\n", "there is no node.\\[0\\].motor.offset_counts"),
    ],
)
def test_what_cannot_be_edited_is_named_and_left_alone(
    text: bytes, words: str, tmp_path: Path
) -> None:
    path = bus(tmp_path, text)
    place = ("node", 0 if text.startswith(b"node") else 1, "motor", "offset_counts")
    with pytest.raises(ConfigError, match=f"leg.toml: .*{words}"):
        edit_file(path, {place: 1})
    assert path.read_bytes() == text


NUMBERS = st.integers(-(1 << 31) + 1, (1 << 31) - 1)


@given(st.lists(NUMBERS, min_size=4, max_size=4))
def test_only_the_numbers_change_whatever_they_are(values: list[int]) -> None:
    text = BUS.read_text(encoding="utf-8")
    places = [
        ("node", node, axis, "offset_counts") for node in (0, 1) for axis in ("motor", "link")
    ]
    changed = edited(text, dict(zip(places, values, strict=True)))
    found = [
        table[axis]["offset_counts"]
        for table in tomllib.loads(changed)["node"]
        for axis in ("motor", "link")
    ]
    assert found == values
    assert OFFSET.sub(b"@", changed.encode()) == OFFSET.sub(b"@", text.encode())


def test_a_text_that_would_read_otherwise_afterwards_is_refused() -> None:
    with pytest.raises(UnreadableError, match="no table for bitrate"):
        edited("bitrate = 1\n", {("bitrate", "inner"): 2})
