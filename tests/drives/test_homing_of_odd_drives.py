"""Homing of drives that show their mode late, or with power alone; virtual time."""

from dataclasses import replace

import pytest
from can_rig import BUS

from legbench.commissioning.home import home
from legbench.drives.emulated.behaviour import Behaviour
from legbench.drives.emulated.build import emulate
from legbench.drives.emulated.bus import LockstepBus
from legbench.drives.emulated.network import Network
from legbench.drives.errors import DriveError
from legbench.drives.master.session import Session
from legbench.drives.protocol.cia402 import POWERED
from legbench.drives.setup.bus_file import load_bus
from legbench.drives.setup.quirks import ModeShown, Quirks

IN_PLACE = 37


def opened(lag_us: int, *, needs_power: bool, quirks: Quirks) -> tuple[Session, Network]:
    bench = load_bus(BUS)
    config = replace(bench, nodes=tuple(replace(node, quirks=quirks) for node in bench.nodes))
    odd = Behaviour(start_pos=0.2, mode_needs_power=needs_power, mode_lag_us=lag_us)
    network = emulate(config, [odd, Behaviour()], keep_log=True)
    return Session(LockstepBus("leg", network=network), config), network


@pytest.mark.parametrize("lag_us", [0, 300_000, 3_000_000])
def test_a_mode_that_is_shown_with_power_alone_is_waited_for_with_power(lag_us: int) -> None:
    told = Quirks(mode_shown=ModeShown.ENABLED, mode_patience_ms=4000)
    session, network = opened(lag_us, needs_power=True, quirks=told)
    with session:
        found = home(session, session.config.nodes[0], IN_PLACE)
    assert abs(found.after_counts) <= 2 < abs(found.before_counts)
    assert not {drive.axis.power.state for drive in network.drives} & set(POWERED)


def test_a_mode_that_follows_after_seconds_is_waited_for_as_long_as_the_bus_file_says() -> None:
    slow = Quirks(mode_patience_ms=4000)
    session, network = opened(2_500_000, needs_power=False, quirks=slow)
    with session:
        assert abs(home(session, session.config.nodes[0], IN_PLACE).after_counts) <= 2
    assert not {drive.axis.power.state for drive in network.drives} & set(POWERED)


def test_a_mode_that_never_comes_is_refused_and_the_drive_has_no_power() -> None:
    told = Quirks(mode_shown=ModeShown.ENABLED, mode_patience_ms=200)
    session, network = opened(3_000_000, needs_power=True, quirks=told)
    with session, pytest.raises(DriveError, match="does not enter homing mode") as caught:
        home(session, session.config.nodes[0], IN_PLACE)
    assert "within 200 ms" in str(caught.value)
    assert "mode_patience_ms in [node.quirks]" in str(caught.value)
    assert not {drive.axis.power.state for drive in network.drives} & set(POWERED)
