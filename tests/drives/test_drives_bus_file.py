import io
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from legbench.drives.protocol.datatypes import FORMATS, DataType, size_of
from legbench.drives.protocol.frame import COB_INVALID
from legbench.drives.protocol.objects import OBJECTS
from legbench.drives.protocol.pdo import Mapped
from legbench.drives.setup.bus_file import (
    bus_from_mapping,
    format_object,
    load_bus,
    load_limits,
    parse_object,
)
from legbench.drives.setup.config import LINK_POSITION, PdoConfig
from legbench.drives.setup.configuration import configuration, interpolation_time
from legbench.drives.setup.eds import dcf_text, eds_text
from legbench.errors import ConfigError

TEXT = """
interface = "socketcan"
channel = "can0"
bitrate = 1_000_000

[[node]]
name = "hip"
id = 1
vendor = 0x1234
product = 7
serial = 100
motor = { counts_per_rev = 4096, gear = 50.0, offset_counts = 12 }
link = { counts_per_rev = 65536, bits = 16 }

[node.parameters]
"6065:00 u32" = 20000
"6085:00 u32" = 4_000_000

[[node]]
name = "knee"
id = 2
vendor = 0x1234
product = 7
motor = { counts_per_rev = 4096, gear = 50, sign = -1 }
link = { counts_per_rev = 1048576 }
link_object = "60E4:01 i32"
temperature_object = "2070:00 i16"

[[node.tpdo]]
number = 1
objects = ["6041:00 u16", "6064:00 i32"]
[[node.tpdo]]
number = 2
objects = ["60E4:01 i32", "6077:00 i16"]
[[node.rpdo]]
number = 1
objects = ["6040:00 u16", "607A:00 i32"]
deadline_ms = 50
"""


def load(tmp_path: Path, text: str) -> object:
    path = tmp_path / "leg.toml"
    path.write_text(text, encoding="utf-8")
    return load_bus(path)


def test_a_bus_file_becomes_a_bus(tmp_path: Path) -> None:
    path = tmp_path / "leg.toml"
    path.write_text(TEXT, encoding="utf-8")
    bus = load_bus(path)
    hip, knee = bus.nodes
    assert (bus.interface, bus.channel, bus.bitrate) == ("socketcan", "can0", 1_000_000)
    assert (hip.identity.serial, knee.identity.serial) == (100, None)
    assert hip.motor.gear == 50.0
    assert knee.link_object == LINK_POSITION
    assert [pdo.number for pdo in knee.tpdos] == [1, 2]
    assert knee.rpdos[0].deadline_ms == 50
    assert [parameter.index for parameter in hip.parameters] == [0x6065, 0x6085]
    assert knee.tpdo_id(knee.tpdos[1]) == 0x282


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("bitrate = 1_000_000", "bitrat = 1", "bus has unknown keys: bitrat; it knows node, eds"),
        ("bitrate = 1_000_000", "bitrate = '1M'", "bus: bitrate is '1M'; it must be of type int"),
        ("id = 1", "id = 200", "node 'hip' has id 200; it must be 1 to 127"),
        ("id = 1", "id = 2", "node ids 2, 2 and master 126 must differ"),
        ("id = 1\n", "", "node 'hip': id must be given"),
        ("sign = -1", "sign = 0", "sign is 0; it must be 1 or -1"),
        ("gear = 50.0", "gear = -50.0", "gear is -50; it must be positive"),
        ('"6065:00 u32"', '"6065 u32"', "'6065 u32' is no object; write index"),
        ("= 20000", "= 2.5", "parameter '6065:00 u32' is 2.5; it must be a whole number"),
        ('["6040:00 u16", ', "[", "maps 6040h:00 0 times; it must stand in one RPDO"),
        (
            "number = 2",
            "number = 9",
            "PDO number 9 has no COB-ID by the standard, .* give it a 'cob_id'",
        ),
        ("number = 2", "number = 513", "PDO number 513; a drive has 1 to 512"),
        ('"6077:00 i16"', '"6064:00 i32", "6064:00 i32"', "has 12 bytes; it must have 1 to 8"),
        ("bits = 16", "bits = 32", "link bits is 32, but 2064h:00 has 16"),
        ("[[node]]", "[[node", "not valid TOML"),
    ],
)
def test_what_makes_no_sense_is_named(tmp_path: Path, old: str, new: str, words: str) -> None:
    assert old in TEXT
    with pytest.raises(ConfigError, match=words) as caught:
        load(tmp_path, TEXT.replace(old, new, 1))
    assert str(caught.value).startswith(str(tmp_path / "leg.toml"))


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="no such file"):
        load_bus(tmp_path / "nothing.toml")
    with pytest.raises(ConfigError, match="at least one node"):
        bus_from_mapping({})


def test_limits_come_from_a_file(tmp_path: Path) -> None:
    path = tmp_path / "limits.toml"
    path.write_text("motor_range = [[-1, 1.5], [0, 2]]\nspring_torque = 8\n", encoding="utf-8")
    limits = load_limits(path)
    assert limits.motor_range == ((-1.0, 1.5), (0.0, 2.0))
    limits.check_within(((-1.0, 1.5), (0.0, 2.0)), limits.joint_range)
    with pytest.raises(ConfigError, match=r"motor_range of axis 2 is \[0, 2\] rad, looser than"):
        limits.check_within(((-1.0, 1.5), (0.0, 1.9)), limits.joint_range)
    for text, words in (
        ("motor_range = [[1, -1], [0, 2]]", r"motor_range is \[1, -1\] rad; low must be below"),
        ("command_speed = 0", "command_speed is 0 rad/s; it must be positive"),
        ("motor_range = [[1], [0, 2]]", r"motor_range needs pairs \[low, high\]"),
        ("speed = 1", "limits has unknown keys: speed"),
        ("spring_torque = true", "spring_torque is True; it must be of type float"),
    ):
        path.write_text(text, encoding="utf-8")
        with pytest.raises(ConfigError, match=words):
            load_limits(path)


@settings(derandomize=True, max_examples=80)
@given(st.integers(0, 0xFFFF), st.integers(0, 0xFF), st.sampled_from(list(FORMATS)))
def test_names_of_objects_come_back(index: int, sub: int, kind: DataType) -> None:
    entry = Mapped(index, sub, kind)
    assert parse_object(format_object(entry)) == entry


def test_interpolation_time_says_the_period() -> None:
    for period_us in (500, 1000, 2000, 4000, 10_000, 250):
        value, exponent = interpolation_time(period_us)
        assert value * 10.0**exponent == pytest.approx(1e-6 * period_us)
        assert 0 < value < 256
    with pytest.raises(ConfigError, match="object 60C2h cannot say it"):
        interpolation_time(1001)


def test_a_pdo_is_off_while_it_is_mapped_and_every_object_exists(tmp_path: Path) -> None:
    path = tmp_path / "leg.toml"
    path.write_text(TEXT, encoding="utf-8")
    bus = load_bus(path)
    for node in bus.nodes:
        off: dict[int, bool] = {}
        for parameter in configuration(bus, node):
            entry = OBJECTS[parameter.key]
            assert entry.kind is parameter.kind
            described = 0x1400 <= parameter.index < 0x1C00 and not parameter.index & 0x200
            if described and parameter.sub == 1:
                off[parameter.index] = bool(parameter.value & COB_INVALID)
            if parameter.index & 0x1A00 in (0x1600, 0x1A00) and parameter.index < 0x1C00:
                assert off[parameter.index & ~0x200]


def test_process_data_of_every_type_has_a_length() -> None:
    for kind in FORMATS:
        assert (size_of(kind) or 0) * 8 == Mapped(1, 0, kind).bits
    with pytest.raises(ConfigError, match="must have 1 to 8"):
        PdoConfig(number=1, objects=())


def test_data_sheets_are_read_by_another_library(tmp_path: Path) -> None:
    canopen = pytest.importorskip("canopen")
    path = tmp_path / "leg.toml"
    path.write_text(TEXT, encoding="utf-8")
    bus = load_bus(path)
    texts = {"drive.eds": eds_text(), "knee.dcf": dcf_text(bus, bus.nodes[1])}
    for name, text in texts.items():
        file = io.StringIO(text)
        file.name = name
        dictionary = canopen.objectdictionary.import_od(file, node_id=2)
        for (index, sub), entry in OBJECTS.items():
            found = dictionary.get_variable(index, sub)
            assert found is not None, entry
            assert found.data_type == entry.kind
            assert found.access_type == entry.access.value
            assert found.pdo_mappable == entry.mappable
        if name.endswith("dcf"):
            assert dictionary.node_id == 2
            assert dictionary.bitrate == 1_000_000
            for parameter in {p.key: p for p in configuration(bus, bus.nodes[1])}.values():
                assert dictionary.get_variable(*parameter.key).value == parameter.value
