"""Drives that must be homed before anything begins."""

import dataclasses
from collections.abc import Callable
from pathlib import Path

import pytest
from can_rig import BUS
from service_rig import (
    BENCH,
    HOMED,
    MS,
    opened,
    states,
    written,
)

from legbench.commissioning.home import home
from legbench.commissioning.status import status
from legbench.commissioning.zero import measure
from legbench.drives.errors import DriveError
from legbench.drives.master.session import Session
from legbench.drives.protocol.cia402 import POWERED
from legbench.drives.setup.bus_file import load_bus, load_limits
from legbench.drives.setup.config import BusConfig
from legbench.errors import ConfigError


def homing_bus() -> BusConfig:
    nodes = tuple(dataclasses.replace(node, homed=HOMED) for node in BENCH.nodes)
    return dataclasses.replace(BENCH, nodes=nodes)


def begin_run(session: Session) -> None:
    limits = load_limits(BUS.parent / "limits.toml")
    session.link(limits, (4.0, 5.0)).open()


def begin_zero(session: Session) -> None:
    measure(session, (0.0, 0.0))


@pytest.mark.parametrize("begin", [begin_run, begin_zero])
def test_nothing_begins_before_every_drive_is_homed(begin: Callable[[Session], None]) -> None:
    session, network = opened(homing_bus())
    words = r"'motor1' \(node 1\) is not homed .*`legbench drives home --node motor1`"
    with session, pytest.raises(DriveError, match=words):
        begin(session)
    assert written(network) == []


def test_a_drive_that_has_been_homed_may_run_until_it_is_switched_off() -> None:
    session, network = opened(homing_bus())
    with session:
        assert [one.homed for one in status(session)] == [False, False]
        home(session, session.config.nodes[0], -1)
        assert [one.homed for one in status(session)] == [True, False]
        with pytest.raises(DriveError, match=r"'motor2' \(node 2\) is not homed"):
            begin_zero(session)
        home(session, session.config.nodes[1], 23)
        assert [one.homed for one in status(session)] == [True, True]
        begin_zero(session)
        begin_run(session)
        network.drives[0].reset(network.now_ns)
        network.advance(network.now_ns + 20 * MS)
        assert [one.homed for one in status(session)] == [False, True]
    assert not set(states(network)) & set(POWERED)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('{ object = "6041:00 u16", mask = 0 }', "mask is 0x0; .* it must be 1 to 0xffff"),
        ('{ object = "6041:00 u16", mask = 0x10000 }', "mask is 0x10000"),
        ('{ object = "6041:00 u16", mask = 1, value = 2 }', "value is 0x2; it must have no bits"),
        ('{ object = "6041:00 u16" }', "mask must be given"),
        ("{ mask = 1 }", "object must be given"),
        ('{ object = "6041", mask = 1 }', "'6041' is no object"),
        ('{ object = "6041:00 u16", mask = 1, bit = 3 }', "unknown keys: bit"),
        ("3", "'homed' must be a table"),
    ],
)
def test_the_condition_is_checked_with_its_place(text: str, words: str, tmp_path: Path) -> None:
    path = tmp_path / "leg.toml"
    path.write_text(
        BUS.read_text("utf-8").replace("soft_limits", f"homed = {text}\nsoft_limits", 1)
    )
    with pytest.raises(ConfigError, match=rf"leg\.toml: node 'motor1' homed.*{words}"):
        load_bus(path)


def test_the_condition_comes_from_the_bus_file(tmp_path: Path) -> None:
    path = tmp_path / "leg.toml"
    homed = 'homed = { object = "2013:02 u8", mask = 0x0C, value = 4 }'
    path.write_text(BUS.read_text("utf-8").replace("soft_limits", f"{homed}\nsoft_limits", 1))
    first, second = load_bus(path).nodes
    assert second.homed is None
    assert first.homed is not None
    assert [value for value in range(16) if first.homed.met(value)] == [4, 5, 6, 7]


def test_a_drive_that_does_not_show_its_homing_is_told() -> None:
    blind = dataclasses.replace(HOMED, mask=0x4000)
    nodes = tuple(dataclasses.replace(node, homed=blind) for node in BENCH.nodes)
    session, network = opened(dataclasses.replace(BENCH, nodes=nodes))
    with session, pytest.raises(DriveError, match="'motor1' has homed, and does not show it"):
        home(session, session.config.nodes[0], 37)
    assert not set(states(network)) & set(POWERED)
