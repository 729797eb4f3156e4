"""Whatever a bus file says: if it is taken, its drives stand 100 ms after their master's death."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from drives_rig import LIMITS, MS, START, Rig, config, rig
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from legbench.commissioning.home import home
from legbench.drives.emulated.behaviour import Behaviour
from legbench.drives.emulated.build import emulate
from legbench.drives.emulated.bus import LockstepBus
from legbench.drives.emulated.network import Network
from legbench.drives.master.session import Session
from legbench.drives.protocol.cia402 import POWERED
from legbench.drives.protocol.datatypes import DataType
from legbench.drives.setup.config import RPDO, BusConfig, Parameter
from legbench.drives.setup.configuration import configuration
from legbench.drives.setup.master_watch import (
    LONGEST_STOP_MS,
    check_master_watch,
    means_of,
    stop_ms,
)
from legbench.drives.setup.waivers import describe_waivers
from legbench.errors import ConfigError
from legbench.limits.upper_ends import MASTER_WATCH

SPEED = 5.0
"""Of both motors when their master dies [rad/s]."""
FAST = replace(LIMITS, command_speed=SPEED)
STEADY = [
    Behaviour(start_pos=pos, missing_limit=1 << 40, sync_loss_periods=1 << 40) for pos in START
]
"""Drives that watch nothing but what CiA 301 makes them watch."""


def bus(
    *,
    beat_ms: int = 10,
    deadlines_ms: tuple[int, int] = (20, 20),
    consumers: tuple[bool, bool] = (True, True),
    ramp: float = 20_000.0,
    waive: tuple[str, ...] = (),
) -> BusConfig:
    """The rig's bus with a watch of its own; the ramp in rad/s2."""
    nodes = []
    for node, deadline_ms, consumer in zip(config().nodes, deadlines_ms, consumers, strict=True):
        counts = round(ramp * abs(node.motor.counts_per_rad))
        stop = Parameter(index=0x6085, sub=0, kind=DataType.UNSIGNED32, value=counts)
        nodes.append(
            replace(
                node,
                rpdos=(replace(RPDO, deadline_ms=deadline_ms),),
                heartbeat_consumer=consumer,
                parameters=(stop,),
            )
        )
    return replace(config(), nodes=tuple(nodes), master_heartbeat_ms=beat_ms, waive=waive)


def moving(it: Rig, cycles: int) -> None:
    """Lead both motors at the highest speed."""
    for _ in range(cycles):
        hip, knee = it.link._guard.applied
        it.link.command((hip + 1e-3 * SPEED, knee - 1e-3 * SPEED))
        it.link.exchange()


def standstill_ms(network: Network, longest_ms: int) -> float:
    """Time until no drive has power and none moves, with nobody on the bus [ms]."""
    began = network.now_ns
    before = [drive.axis.motion.angle for drive in network.drives]
    for _ in range(longest_ms):
        network.advance(network.now_ns + MS)
        angles = [drive.axis.motion.angle for drive in network.drives]
        powered = any(drive.axis.power.state in POWERED for drive in network.drives)
        if not powered and angles == before:
            return (network.now_ns - began) / MS
        before = angles
    return float("inf")


@settings(
    derandomize=True,
    max_examples=20,
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
@given(
    beat_ms=st.integers(2, 60),
    deadlines_ms=st.tuples(*[st.one_of(st.just(0), st.integers(3, 150))] * 2),
    consumers=st.tuples(st.booleans(), st.booleans()),
    ramp=st.floats(40.0, 20_000.0),
    cycles=st.integers(0, 137),
)
def test_what_is_taken_stands_in_time(
    beat_ms: int,
    deadlines_ms: tuple[int, int],
    consumers: tuple[bool, bool],
    ramp: float,
    cycles: int,
    tmp_path_factory: pytest.TempPathFactory,
) -> None:
    chosen = bus(beat_ms=beat_ms, deadlines_ms=deadlines_ms, consumers=consumers, ramp=ramp)
    latest = stop_ms(chosen, speed=SPEED)
    taken = True
    try:
        check_master_watch(chosen, speed=SPEED)
    except ConfigError:
        taken = False
        chosen = replace(chosen, waive=(MASTER_WATCH,))
    assert taken == (latest <= LONGEST_STOP_MS)
    folder = tmp_path_factory.mktemp("watch")
    with rig(folder, bus_config=chosen, behaviours=STEADY, limits=FAST) as it:
        it.link.start()
        moving(it, cycles)
        stood = standstill_ms(it.network, 700)
        # A look a millisecond, and one more to see that it stands.
        assert stood <= latest + 2.0
        if taken:
            assert stood <= LONGEST_STOP_MS + 2.0


MEANS: dict[str, Callable[[], BusConfig]] = {
    "heartbeat": lambda: bus(beat_ms=32, deadlines_ms=(0, 0)),
    "deadline": lambda: bus(beat_ms=300, deadlines_ms=(95, 95), consumers=(False, False)),
    "one each": lambda: bus(beat_ms=30, deadlines_ms=(0, 60), consumers=(True, False)),
    "both": lambda: bus(),
}


@pytest.mark.parametrize("name", list(MEANS))
def test_a_master_may_die_at_any_moment(name: str, tmp_path: Path) -> None:
    worst = 0.0
    for cycles in range(0, 40, 5):
        (tmp_path / str(cycles)).mkdir()
        with rig(
            tmp_path / str(cycles), bus_config=MEANS[name](), behaviours=STEADY, limits=FAST
        ) as it:
            it.link.start()
            moving(it, cycles)
            it.network.advance(it.network.now_ns + 137_000 * (cycles % 7))
            worst = max(worst, standstill_ms(it.network, 200))
    assert worst <= LONGEST_STOP_MS


def test_the_means_of_a_drive_are_those_of_its_file() -> None:
    chosen = bus(beat_ms=10, deadlines_ms=(20, 50), ramp=1000.0)
    hip, knee = (means_of(chosen, node, speed=SPEED) for node in chosen.nodes)
    assert [(one.name, one.time_ms) for one in hip] == [
        ("deadline of RPDO1 1400h:05", 21.0),
        ("heartbeat consumer 1016h", 31.0),
    ]
    assert [one.time_ms for one in knee] == [31.0, 51.0]
    assert hip[0].ramp_ms == pytest.approx(5.0, rel=1e-5)
    assert stop_ms(chosen, speed=SPEED) == pytest.approx(36.0, rel=1e-5)


@pytest.mark.parametrize(
    ("chosen", "words"),
    [
        (bus(beat_ms=20_000, deadlines_ms=(0, 0)), "60002.0 ms by its heartbeat consumer 1016h"),
        (bus(beat_ms=34, deadlines_ms=(0, 0)), "104.0 ms by its heartbeat consumer 1016h"),
        (bus(beat_ms=34, deadlines_ms=(100, 20)), "'hip' .*102.0 ms by its deadline of RPDO1"),
        (bus(deadlines_ms=(20, 0), consumers=(True, False)), "'knee' .*no means to notice"),
    ],
)
def test_a_drive_that_goes_on_is_refused_before_anything_is_sent(
    chosen: BusConfig, words: str, tmp_path: Path
) -> None:
    way = r'give its RPDO a deadline_ms, .*waive = \["master watch"\] in the bus file'
    with rig(tmp_path, bus_config=chosen) as it:
        with pytest.raises(ConfigError, match=rf"{words}.*; {way}"):
            it.link.start()
        assert not [frame for _, frame in it.network.log or [] if frame.cob_id < 0x700]


def test_a_slow_ramp_counts() -> None:
    slow = bus(ramp=40.0)
    check_master_watch(slow)
    with pytest.raises(ConfigError, match=r"146.0 ms by its deadline"):
        check_master_watch(slow, speed=SPEED)


@pytest.mark.parametrize("beat_ms", [21_846, 65_536, 0, -1])
def test_a_heartbeat_that_1016h_cannot_hold_is_refused(beat_ms: int) -> None:
    with pytest.raises(ConfigError, match=rf"master_heartbeat_ms is {beat_ms} ms; it must be 1 to"):
        replace(config(), master_heartbeat_ms=beat_ms)


@pytest.mark.parametrize("master_id", [0, -1, 1, 2, 128, 255])
def test_a_master_is_a_node_of_its_own(master_id: int) -> None:
    with pytest.raises(ConfigError, match=rf"master(_id is)? {master_id}"):
        replace(config(), master_id=master_id)


@pytest.mark.parametrize("beat_ms", [1, 10, 333, 21_845])
@pytest.mark.parametrize("master_id", [3, 126, 127])
def test_1016h_says_what_it_is_to_say(beat_ms: int, master_id: int) -> None:
    chosen = replace(config(), master_heartbeat_ms=beat_ms, master_id=master_id)
    found = {one.key: one.value for one in configuration(chosen, chosen.nodes[0])}
    assert found[0x1016, 1] >> 16 == master_id
    assert found[0x1016, 1] & 0xFFFF == 3 * beat_ms


def test_a_drive_without_1016h_is_not_asked_for_it() -> None:
    chosen = bus(consumers=(False, True))
    hip, knee = ({one.key for one in configuration(chosen, node)} for node in chosen.nodes)
    assert (0x1016, 1) not in hip
    assert (0x1016, 1) in knee


def test_a_homing_counts_no_deadline_of_commands_that_never_come() -> None:
    chosen = bus(consumers=(False, True))
    network = emulate(chosen, STEADY, keep_log=True)
    with (
        Session(LockstepBus("it", network=network), chosen) as session,
        pytest.raises(ConfigError, match=r"'hip' .*it has no means to notice it"),
    ):
        home(session, chosen.nodes[0], 37)
    assert not network.log


def test_a_waiver_says_what_it_costs() -> None:
    slow = bus(beat_ms=200, deadlines_ms=(0, 0), waive=(MASTER_WATCH,))
    limits = replace(LIMITS, lost_frames=3000, waive=("lost_frames",))
    of_bus, of_limits = describe_waivers(slow, limits)
    assert of_bus.startswith(
        "the bus file waives the master watch: drives may go on for 601 ms when their master is "
        "gone, or without end where they lack what stops them"
    )
    assert of_limits == (
        "the limits file waives the upper end of lost_frames: it is 3000 cycles, the usual end 50 "
        "cycles"
    )
    never = bus(deadlines_ms=(0, 0), consumers=(False, False), waive=(MASTER_WATCH,))
    assert "a drive does not stop when its master is gone" in describe_waivers(never, None)[0]
    assert describe_waivers(bus(), LIMITS) == ()
