"""What lies in `hardware/` is what the code makes and prints."""

import re
from datetime import datetime

import canopen
import eds
import pytest
from can_rig import BUS, LIMITS, ROOT

from legbench.design import load_design
from legbench.drives.setup.bus_file import load_bus
from legbench.drives.setup.stopping import check_stopping
from legbench.drives.setup.wire import check_load
from legbench.plants import limits_for

HARDWARE = ROOT / "hardware"
STEPS = re.findall(
    r"```\n\$ (legbench [^\n]*)\n(.*?)\n```",
    (HARDWARE / "bring-up.md").read_text(),
    flags=re.DOTALL,
)


def test_object_dictionaries_are_up_to_date() -> None:
    for path, text_of in eds.files().items():
        assert eds.renewed(path, text_of, datetime(2030, 1, 2)) is None, path.name


def test_another_stack_reads_them() -> None:
    node = canopen.LocalNode(1, str(HARDWARE / "motor1.dcf"))
    variable = node.object_dictionary.get_variable(0x60C2, 2)
    assert variable is not None
    assert variable.value == -3
    # Read as its slave would say it: the identity of this very drive.
    said = [int.from_bytes(node.get_data(0x1018, sub), "little") for sub in (1, 2, 3, 4)]
    assert said == [0x123, 0x402, 0, 1001]


@pytest.mark.parametrize("name", ["optimal", "prototype"])
def test_bus_and_limits_fit_both_designs(name: str) -> None:
    limits = limits_for(LIMITS, load_design(ROOT / "models" / f"{name}.toml"))
    bus = load_bus(BUS)
    check_stopping(bus, limits)
    assert check_load(bus) < 0.6


def test_there_are_ten_steps() -> None:
    """What each prints is compared with what it prints here by the tests of the documents."""
    told = [command.split()[2 if command.split()[1] == "drives" else 1] for command, _ in STEPS]
    assert told == [
        "budget",
        "scan",
        "status",
        "configure",
        "store",
        "home",
        "zero",
        "jitter",
        "run",
        "jog",
        "jog",
        "run",
        "run",
        "reset",
    ]
