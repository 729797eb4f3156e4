"""A log of raw frames tells what the master of the bus has recorded."""

import struct
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path

import can
import numpy as np
import pytest
from replay_runs import BUS

from legbench.drives.protocol.datatypes import DataType, size_of
from legbench.drives.protocol.pdo import Mapped
from legbench.drives.protocol.sdo import MUX
from legbench.drives.setup.bus_file import load_bus
from legbench.drives.setup.config import BusConfig
from legbench.drives.setup.configuration import configuration
from legbench.drives.setup.pdos import POSITION_ACTUAL, STATUSWORD, PdoConfig
from legbench.errors import ConfigError, RecordingError
from legbench.metrics import summarise
from legbench.recording.reader import Recording
from legbench.replay.log import DecodedLog, load_log
from legbench.replay.moved import MotionSource
from legbench.replay.recorded import recorded_controller, recorded_leg
from legbench.replay.resimulation import resimulate

CONFIG = load_bus(BUS)
EXACT = ("motor_pos", "joint_pos", "spring_torque")
SHORT = 4000
"""Frames of the logs that are written again in another format: the start, 0.5 s of the run."""


def decoded(run: Recording, path: Path, config: BusConfig = CONFIG) -> DecodedLog:
    return load_log(path, config, "leg.toml", run.description.design, run.description.setup)


def frames_of(path: Path) -> list[can.Message]:
    with can.LogReader(path) as reader:
        return list(reader)


def written(path: Path, frames: Iterable[can.Message]) -> Path:
    with can.Logger(path) as logger:
        for frame in frames:
            logger.on_message_received(frame)
    return path


def frame(cob_id: int, data: bytes, timestamp: float, channel: str = "leg") -> can.Message:
    return can.Message(
        arbitration_id=cob_id,
        data=data,
        timestamp=timestamp,
        channel=channel,
        is_extended_id=False,
    )


@pytest.fixture(scope="module")
def log(can_swing: Recording) -> Path:
    return can_swing.path / "bus.log"


@pytest.fixture(scope="module")
def short(log: Path) -> list[can.Message]:
    return frames_of(log)[:SHORT]


@pytest.fixture(scope="module")
def whole(can_swing: Recording, log: Path) -> DecodedLog:
    return decoded(can_swing, log)


def first_row(run: Recording, log: Path) -> int:
    """Row of a log in which its run begins: SYNC comes every millisecond."""
    (bus,) = [event for event in run.events if event["name"] == "bus"]
    sync = next(each for each in frames_of(log) if each.arbitration_id == 0x080)
    return round(1e3 * (bus["began"] - sync.timestamp))


def test_a_log_shows_what_the_master_saw(
    can_swing: Recording, whole: DecodedLog, log: Path
) -> None:
    seen, first = whole.recording, first_row(can_swing, log)
    rows = slice(first, first + len(can_swing.time))
    assert np.diff(seen.time[rows]) == pytest.approx(1e-3)
    # Of an answer that came too late for the master the log has the right value.
    (bus,) = [event for event in can_swing.events if event["name"] == "bus"]
    for name in EXACT:
        same = (seen[name][rows] == can_swing[name]).all(axis=1)
        assert np.count_nonzero(~same) <= sum(bus["lost_cycles"])
    half_a_count = 0.5 * CONFIG.nodes[0].motor.resolution
    for name in ("applied_pos", "command_pos"):
        wanted = can_swing["applied_pos"][1:] if name == "command_pos" else can_swing[name]
        found = seen[name][rows][: len(wanted)]
        np.testing.assert_allclose(found, wanted, atol=1.001 * half_a_count)
    enabled = seen["statusword"][rows].astype(int) & 0x6F
    assert (enabled == 0x27).all()
    assert (seen["controlword"][rows][:, 0] == 0x0F).all()


def test_a_log_is_rated_and_drawn_as_far_as_it_tells(
    can_swing: Recording, whole: DecodedLog, log: Path
) -> None:
    first = first_row(can_swing, log)
    rows = slice(first, first + len(can_swing.time))
    columns = {name: values[rows] for name, values in whole.recording.columns.items()}
    part = replace(whole.recording, time=whole.recording.time[rows], columns=columns)
    mine, theirs = summarise(part), summarise(can_swing)
    assert len(theirs.rating_periods) >= 1
    np.testing.assert_allclose(mine.rating_periods, theirs.rating_periods, atol=1e-4)
    assert mine.status is None
    assert "controller unknown names no phase" in mine.warnings[0]
    again = resimulate(part, recorded_leg(part), MotionSource.MOTORS)
    apart = {each.signal: each.max for each in again.signals.deviations()}
    assert apart["joint_pos_1"] < CONFIG.nodes[0].link_units.resolution
    with pytest.raises(ConfigError, match="does not tell its controller"):
        recorded_controller(part)


@pytest.mark.parametrize("suffix", [".log", ".asc", ".blf", ".trc", ".csv", ".log.gz"])
def test_every_format_tells_the_same(
    suffix: str,
    can_swing: Recording,
    whole: DecodedLog,
    short: list[can.Message],
    tmp_path: Path,
) -> None:
    """Also with the time of an epoch, far above one second, which some of them keep."""
    channel = 0 if suffix in (".asc", ".blf", ".trc") else "can0"
    later = [
        frame(each.arbitration_id, bytes(each.data), each.timestamp + 1_700_000_000.0)
        for each in short
    ]
    for each in later:
        each.channel = channel
    found = decoded(can_swing, written(tmp_path / f"run{suffix}", later)).recording
    rows = len(found.time)
    assert rows > 500
    for name in EXACT:
        np.testing.assert_array_equal(found[name], whole.recording[name][:rows])
    np.testing.assert_allclose(found.time, whole.recording.time[:rows], atol=3e-6)


def test_a_log_that_begins_in_mid_run_takes_the_mapping_of_the_bus_file(
    can_swing: Recording, whole: DecodedLog, short: list[can.Message], tmp_path: Path
) -> None:
    path = written(tmp_path / "part.log", short[1503:])
    found = decoded(can_swing, path)
    assert found.notes == (
        "the log begins after motor1 and motor2 had been configured; their process data is taken "
        "as leg.toml maps it",
    )
    rows = len(found.recording.time)
    offset = next(
        row
        for row in range(200, 500)
        if np.array_equal(
            found.recording["joint_pos"], whole.recording["joint_pos"][row : row + rows]
        )
    )
    assert found.recording.time[0] == 0.0
    assert found.recording.time[-1] == pytest.approx(
        whole.recording.time[offset + rows - 1] - whole.recording.time[offset]
    )


def configured(config: BusConfig) -> list[can.Message]:
    """SDO writes with which a master configures the drives, expedited."""
    frames = []
    for node in config.nodes:
        for entry in configuration(config, node):
            size = size_of(entry.kind) or 0
            head = MUX.pack(0x23 | (4 - size) << 2, entry.index, entry.sub)
            value = int(entry.value).to_bytes(size, "little", signed=entry.value < 0)
            frames.append(frame(0x600 + node.node_id, (head + value).ljust(8, b"\0"), 0.1))
    return frames


def test_a_log_with_the_configuration_needs_no_note(
    can_swing: Recording, short: list[can.Message], tmp_path: Path
) -> None:
    path = written(tmp_path / "all.log", [*configured(CONFIG), *short])
    assert decoded(can_swing, path).notes == ()


def test_a_log_of_drives_that_were_mapped_otherwise_is_refused(
    can_swing: Recording, short: list[can.Message], tmp_path: Path
) -> None:
    first, second = CONFIG.nodes
    tpdo = first.tpdos[0]
    turned = replace(tpdo, objects=(tpdo.objects[1], tpdo.objects[0], *tpdo.objects[2:]))
    other = replace(CONFIG, nodes=(replace(first, tpdos=(turned,)), second))
    path = written(tmp_path / "all.log", [*configured(other), *short])
    message = (
        "the log maps 6064h:00, 6041h:00, .* into TPDO1 of 'motor1', leg.toml 6041h:00, 6064h:00"
    )
    with pytest.raises(ConfigError, match=message):
        decoded(can_swing, path)
    moved = replace(CONFIG, nodes=(replace(first, tpdos=(replace(tpdo, cob_id=0x1C0),)), second))
    path = written(tmp_path / "moved.log", [*configured(moved), *short])
    with pytest.raises(ConfigError, match=r"the COB-ID 1C0h, leg\.toml 181h"):
        decoded(can_swing, path)


def test_other_nodes_are_left_out_and_told(
    can_swing: Recording, short: list[can.Message], whole: DecodedLog, tmp_path: Path
) -> None:
    strangers = [
        frame(cob_id, bytes(8), each.timestamp + 1e-6)
        for each in short[::10]
        for cob_id in (0x185, 0x709)
    ]
    odd = [
        can.Message(arbitration_id=0x181, is_extended_id=True, timestamp=0.5, channel="leg"),
        can.Message(arbitration_id=0x182, is_remote_frame=True, timestamp=0.5, channel="leg"),
    ]
    for each in odd[1:]:
        each.is_extended_id = False
    mixed = sorted([*short, *strangers, *odd], key=lambda each: each.timestamp)
    found = decoded(can_swing, written(tmp_path / "mixed.log", mixed))
    assert f"{len(strangers)} frames of other nodes (5, 9) were left out" in found.notes
    np.testing.assert_array_equal(
        found.recording["joint_pos"], whole.recording["joint_pos"][: len(found.recording.time)]
    )


def test_a_log_of_other_drives_is_refused(
    can_swing: Recording, short: list[can.Message], log: Path, tmp_path: Path
) -> None:
    nodes = [replace(node, node_id=node.node_id + 10) for node in CONFIG.nodes]
    others = replace(CONFIG, nodes=tuple(nodes))
    message = r"no process data of node 11 \(18Bh\) and 12 \(18Ch\) of leg.toml; .* are 1, 2: give"
    with pytest.raises(ConfigError, match=message):
        decoded(can_swing, log, others)
    one = [each for each in short if each.arbitration_id != 0x182]
    with pytest.raises(ConfigError, match=r"no process data of node 2 \(182h\)"):
        decoded(can_swing, written(tmp_path / "one.log", one))
    cut = [
        frame(each.arbitration_id, bytes(each.data)[:6], each.timestamp)
        if each.arbitration_id == 0x181
        else each
        for each in short
    ]
    with pytest.raises(ConfigError, match="frames have another length than is mapped"):
        decoded(can_swing, written(tmp_path / "cut.log", cut))


def test_a_log_without_sync_is_refused(
    can_swing: Recording, short: list[can.Message], tmp_path: Path
) -> None:
    silent = [each for each in short if each.arbitration_id != 0x080]
    with pytest.raises(RecordingError, match=r"has no SYNC \(080h\)"):
        decoded(can_swing, written(tmp_path / "silent.log", silent))


def test_two_channels_need_a_bus_file_that_names_one(
    can_swing: Recording, short: list[can.Message], whole: DecodedLog, tmp_path: Path
) -> None:
    twice: list[can.Message] = []
    for each in short:
        for channel, shift in (("can0", 0), ("can7", 1)):
            data = bytes(each.data)
            if each.arbitration_id == 0x181:
                data = bytes([*data[:2], (data[2] + shift) & 0xFF, *data[3:]])
            twice.append(frame(each.arbitration_id, data, each.timestamp, channel))
    path = written(tmp_path / "two.log", twice)
    found = decoded(can_swing, path).recording  # leg.toml names can0
    rows = len(found.time)
    np.testing.assert_array_equal(found["motor_pos"], whole.recording["motor_pos"][:rows])
    elsewhere = replace(CONFIG, channel="can3")
    with pytest.raises(ConfigError, match=r"answers on channels can0, can7; leg\.toml names can3"):
        decoded(can_swing, path, elsewhere)


def test_frames_that_a_log_has_twice_make_one_row(
    can_swing: Recording, short: list[can.Message], whole: DecodedLog, tmp_path: Path
) -> None:
    """As where two channels were logged under one name, or a sender's echo."""
    doubled = [each for each in short for _ in range(2)]
    found = decoded(can_swing, written(tmp_path / "twice.log", doubled)).recording
    rows = len(found.time)
    np.testing.assert_array_equal(found["joint_pos"], whole.recording["joint_pos"][:rows])
    np.testing.assert_allclose(found.time, whole.recording.time[:rows])


def test_drives_with_one_encoder_tell_the_other_side_by_their_torque(
    can_swing: Recording, tmp_path: Path
) -> None:
    """Against angles and torques worked out by hand: 65536 x 6 counts a turn, motor 2 mirrored."""
    torque = Mapped(0x6077, 0, DataType.INTEGER16)
    answer = PdoConfig(number=1, objects=(STATUSWORD, POSITION_ACTUAL, torque))
    nodes = tuple(
        replace(node, link=None, torque_object=torque, torque_scale=1e-3, tpdos=(answer,))
        for node in CONFIG.nodes
    )
    config = replace(CONFIG, nodes=nodes)
    frames = []
    for cycle in range(5):
        at = 7.0 + 1e-3 * cycle
        frames.append(frame(0x080, b"", at))
        for cob_id, counts, told in ((0x181, -40_000 + cycle, 500), (0x182, -40_000, 500)):
            frames.append(frame(cob_id, struct.pack("<Hih", 0x1237, counts, told), at + 3e-4))
    seen = decoded(can_swing, written(tmp_path / "one.log", frames), config).recording
    counts_per_rad = 65536 * 6 / (2 * np.pi)
    motor = np.stack([(-40_000 + np.arange(5)) / counts_per_rad, np.full(5, 40_000)], axis=-1)
    motor[:, 1] /= counts_per_rad
    stiffness = can_swing.description.design.stiffness
    np.testing.assert_allclose(seen["motor_pos"], motor, rtol=1e-12)
    np.testing.assert_allclose(seen["spring_torque"], [[0.5, -0.5]] * 5)
    np.testing.assert_array_equal(seen["drive_torque"], seen["spring_torque"])
    np.testing.assert_allclose(seen["joint_pos"], motor - np.array([0.5, -0.5]) / stiffness)
    # Nothing was commanded: the command is where the motors are.
    np.testing.assert_array_equal(seen["command_pos"], seen["motor_pos"])
    assert np.isnan(seen["controlword"]).all()


def test_a_torn_log_is_read_as_far_as_it_goes(
    can_swing: Recording, log: Path, tmp_path: Path
) -> None:
    torn = tmp_path / "torn.log"
    content = log.read_bytes()[:60_000]
    torn.write_bytes(content[: content.rindex(b"#") - 2])
    found = decoded(can_swing, torn).recording
    assert found.torn is not None
    assert "torn.log cannot be read after" in found.torn
    assert len(found.time) > 300


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("empty.log", b"", "holds no frames"),
        ("text.log", b"hello\nworld\n", "cannot be read as a log"),
        ("noise.blf", bytes(range(256)) * 8, "cannot be read as a log"),
        ("noise.asc", bytes(range(256)) * 8, "cannot be read as a log"),
        ("noise.log.gz", b"not packed", "cannot be read"),
    ],
)
def test_what_is_no_log_is_refused_in_one_line(
    name: str, content: bytes, message: str, can_swing: Recording, tmp_path: Path
) -> None:
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(RecordingError, match=message) as caught:
        decoded(can_swing, path)
    assert "\n" not in str(caught.value)


def test_a_clock_that_is_set_back_costs_rows_and_no_order(
    can_swing: Recording, short: list[can.Message], tmp_path: Path
) -> None:
    stepped = [
        frame(each.arbitration_id, bytes(each.data), each.timestamp - 0.01 * (number > 2000))
        for number, each in enumerate(short)
    ]
    found = decoded(can_swing, written(tmp_path / "stepped.log", stepped))
    assert (np.diff(found.recording.time) > 0.0).all()
    assert any("SYNCs are no later than the one before" in note for note in found.notes)


def periods(frames: Sequence[can.Message], factor: float) -> list[can.Message]:
    return [
        frame(each.arbitration_id, bytes(each.data), factor * each.timestamp) for each in frames
    ]


def test_another_period_than_the_bus_file_says_is_told(
    can_swing: Recording, short: list[can.Message], tmp_path: Path
) -> None:
    path = written(tmp_path / "slow.log", periods(short, 1.01))
    notes = decoded(can_swing, path).notes
    assert "SYNC comes every 1.01 ms; leg.toml has a period of 1 ms" in notes
