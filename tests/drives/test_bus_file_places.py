"""Every error of a bus file names the file, the node and the key, before any bus is opened."""

from pathlib import Path

import pytest
from can_rig import BUS

from legbench.drives.setup.bus_file import load_bus
from legbench.errors import ConfigError

COMMANDS = '"6040:00 u16", "607A:00 i32"'
WINDOW = '"6066:00 u16" = 10 '
SOFT = "soft_limits = [-1.2, 1.0]"
FIELDS = ("node_id", "identity", "side", "rpdos", "tpdos")
"""Names of a node that a bus file has other keys for."""
CASES = [
    (WINDOW, '"6066:00 u16" = 100000 ', '"6066:00 u16"', "100000, but its type UNSIGNED16 holds 0"),
    (WINDOW, '"6066:00 u16" = 1.5 ', "6066:00 u16", "1.5; it must be a whole number"),
    (WINDOW, '"6066:00 x16" = 1 ', "6066:00 x16", "is no object"),
    (WINDOW, '"1010:01 u32" = 0x65766173 ', '"1010:01 u32"', "legbench drives store"),
    (WINDOW, '"1014:00 u32" = 0x80 ', '"1014:00 u32"', "moves a service"),
    (WINDOW, '"1200:01 u32" = 0x601 ', '"1200:01 u32"', "moves a service"),
    (WINDOW, '"1016:01 u32" = 0 ', '"1016:01 u32"', "is written by itself"),
    (WINDOW, '"1016:02 u32" = 0x7E0064 ', '"1016:02 u32"', "watches another node: give 0"),
    ("counts_per_rev = 65536", "counts_per_rev = 0", "motor: counts_per_rev", "positive"),
    ("counts_per_rev = 65536", 'counts_per_rev = "x"', "motor: counts_per_rev", "of type int"),
    ("gear = 6.0", "gear = -6.0", "motor: gear", "the sign is 'sign'"),
    ("gear = 6.0", "gaer = 6.0", "motor has unknown keys: gaer", "it knows counts_per_rev"),
    ("vendor = 0x0000_0123", "vendor = 0x1_0000_0000", "vendor", "must be 0 to 4294967295"),
    ("vendor = 0x0000_0123", "", "vendor", "must be given"),
    ("id = 1\n", "", ": id", "must be given"),
    ('"2070:00 i16"', '"2070 i16"', "temperature_object", "is no object"),
    ("temperature_scale = 0.1 ", "temperature_scale = 0 ", "temperature_scale", "0.0001 to 10"),
    (SOFT, "soft_limits = [1.2]", "soft_limits", "pairs [low, high]"),
    (SOFT, "link_object = 3", "link_object", "is no object"),
    (SOFT, "rpdo = 3", "'rpdo'", "must be a list"),
    (SOFT, f"rpdo = [{{number=7,objects=[{COMMANDS}]}}]", "rpdo: PDO number 7", "1 to 4"),
    (SOFT, f"rpdo = [{{cob_id=0x601,number=1,objects=[{COMMANDS}]}}]", "rpdo: cob_id 601h", "SDO"),
    (SOFT, f"rpdo = [{{cob_id=0x6E0,number=1,objects=[{COMMANDS}]}}]", "cob_id 6E0h", "reserved"),
    ("bits = 16", "bits = 17", "link: bits", "8, 16, 32, 64"),
    (SOFT, "soft_limit = 3", "keys: soft_limit;", "it knows name, id, vendor, product, serial, mo"),
    *((SOFT, f"{name} = [1]", f"keys: {name};", "rpdo, tpdo") for name in FIELDS),
]


@pytest.mark.parametrize(("old", "new", "key", "words"), CASES, ids=[case[1] for case in CASES])
def test_file_node_and_key_are_named(
    old: str, new: str, key: str, words: str, tmp_path: Path
) -> None:
    text = BUS.read_text(encoding="utf-8")
    assert old in text
    path = tmp_path / "mine.toml"
    path.write_text(text.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(ConfigError) as caught:
        load_bus(path)
    said = str(caught.value)
    assert said.startswith(f"{path}: node 'motor1'")
    assert said.count("node 'motor1'") == 1
    assert key in said
    assert words in said
    assert "\n" not in said


def test_a_drive_that_watches_another_node_by_itself_is_told_not_to(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    text = BUS.read_text(encoding="utf-8").replace(WINDOW, '"1016:02 u32" = 0 ', 1)
    path.write_text(text, encoding="utf-8")
    assert load_bus(path).nodes[0].parameters[1].key == (0x1016, 2)


def test_a_node_without_a_name_is_told_by_its_place(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(BUS.read_text(encoding="utf-8").replace('name = "motor2"', ""), "utf-8")
    with pytest.raises(ConfigError, match=r"mine\.toml: node 2 of the file: name must be given"):
        load_bus(path)


def test_nodes_are_tables_of_the_file_and_no_key_of_the_bus(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(f"nodes = 3\n{BUS.read_text(encoding='utf-8')}", encoding="utf-8")
    with pytest.raises(ConfigError, match="unknown keys: nodes; it knows node, eds, "):
        load_bus(path)


def test_a_period_that_no_drive_can_be_told_is_refused_with_the_file(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    text = BUS.read_text(encoding="utf-8").replace("period_us = 1000", "period_us = 1001")
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ConfigError, match=r"mine\.toml: period_us is 1001; object 60C2h cannot"):
        load_bus(path)
