"""Homing of drives that show their mode late, or with power alone; virtual time."""

from dataclasses import replace

import pytest
from can_rig import BUS

from legbench.commissioning.home import home
from legbench.commissioning.search_bounds import check_given
from legbench.drives.emulated.behaviour import Behaviour
from legbench.drives.emulated.build import emulate
from legbench.drives.emulated.bus import LockstepBus
from legbench.drives.emulated.network import Network
from legbench.drives.errors import DriveError
from legbench.drives.master.session import Session
from legbench.drives.protocol.cia402 import POWERED
from legbench.drives.setup.bus_file import load_bus
from legbench.drives.setup.quirks import ModeShown, Quirks
from legbench.errors import ConfigError

IN_PLACE, INDEX_PULSE = 37, 33


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


@pytest.mark.parametrize("index", [0x6065, 0x6072])
def test_a_search_is_not_made_by_a_drive_that_lacks_its_bounds(index: int) -> None:
    # The bus file gives both: a value that the drive has no object for bounds nothing.
    config = load_bus(BUS)
    network = emulate(config, [Behaviour(lacks=frozenset({index}))] * 2, keep_log=True)
    words = rf"'motor1' by itself, .* {index:04X}h:00 .*no such"
    session = Session(LockstepBus("leg", network=network), config)
    with session, pytest.raises(DriveError, match=words):
        home(session, config.nodes[0], INDEX_PULSE)
    assert not {drive.axis.power.state for drive in network.drives} & set(POWERED)
    with Session(LockstepBus("leg", network=network), config) as session:
        assert abs(home(session, config.nodes[0], IN_PLACE).after_counts) <= 2


@pytest.mark.parametrize("index", [0x6065, 0x6072, 0x6085])
def test_a_bound_of_a_search_is_above_zero(index: int) -> None:
    node = load_bus(BUS).nodes[0]
    for value in (1, 0):
        given = tuple(
            replace(one, value=value) if one.index == index else one for one in node.parameters
        )
        bound = replace(node, parameters=given)
        if value:
            check_given(bound)
        else:
            with pytest.raises(ConfigError, match=f"leave out {index:04X}h:00"):
                check_given(bound)


def test_a_search_is_bounded_by_the_ramp_that_its_drive_brakes_on() -> None:
    config = load_bus(BUS)
    slow = {(0x6085, 0): 0x6084}
    nodes = tuple(
        replace(
            node,
            parameters=tuple(
                replace(one, index=slow.get(one.key, one.index)) for one in node.parameters
            ),
        )
        for node in config.nodes
    )
    config = replace(config, nodes=nodes)
    with Session(LockstepBus("leg", network=emulate(config)), config) as session:
        assert home(session, config.nodes[0], INDEX_PULSE).method == INDEX_PULSE
    none = tuple(one for one in nodes[0].parameters if one.index != 0x6084)
    bare = replace(config, nodes=(replace(nodes[0], parameters=none), nodes[1]))
    session = Session(LockstepBus("leg", network=emulate(bare)), bare)
    with session, pytest.raises(ConfigError, match=r"leave out 6085h:00 .*; give each a value"):
        home(session, bare.nodes[0], INDEX_PULSE)
