"""Cycles of 1, 2 and 4 ms, and a channel for each drive."""

import itertools
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from can_rig import BUS, LIMITS
from drives_rig import MS, config, rig

from legbench import load_design, run, summarise
from legbench.control import JumpConfig
from legbench.drives.emulated.behaviour import Behaviour
from legbench.drives.emulated.bus import LockstepBus
from legbench.drives.emulated.channels_bus import ChannelsBus
from legbench.drives.emulated.faults import NodeFault, NodeFaultKind
from legbench.drives.emulated.network import Network
from legbench.drives.setup.bus_file import load_bus, load_limits, parse_object
from legbench.drives.setup.checks import check_together
from legbench.drives.setup.config import BusConfig
from legbench.drives.setup.configuration import configuration
from legbench.drives.setup.exchange import check_budget, exchanges
from legbench.drives.setup.pdos import POSITION_ACTUAL, STATUSWORD, PdoConfig
from legbench.drives.setup.wire import bus_load, check_load
from legbench.errors import ConfigError
from legbench.experiment import Experiment
from legbench.plant import can_open
from legbench.plant.can_choice import CanChoice
from legbench.plant.landing import End
from legbench.recording.reader import Recording

ROOT = Path(__file__).parents[2]
PERIODS_US = (1000, 2000, 4000)
TWELVE_BITS = """
[node.link]
counts_per_rev = 4096
modulus_counts = 4096
sign = {sign}
offset_counts = 391
bits = 16
"""
"""An encoder of 12 bits and a single turn that shows 0 at 0.6 rad, passed in every jump."""


def bus_text(*, channels: bool = False, twelve: bool = False, **numbers: int) -> str:
    """The bench's bus file with other numbers, a channel for each drive, or coarse encoders."""
    text = BUS.read_text(encoding="utf-8").replace("tpdo_deadline_us = 720\n", "")
    for name, value in numbers.items():
        lines = [
            f"{name} = {value}" if line.startswith(f"{name} =") else line
            for line in text.splitlines()
        ]
        text = "\n".join(lines) + "\n"
    head, *nodes = text.split("[[node]]")
    for place, node in enumerate(nodes):
        if channels:
            nodes[place] = f'\nchannel = "can{place}"{node}'
        if twelve:
            before, _, after = nodes[place].partition("[node.link]")
            after = after[after.index("[node.parameters]") :]
            nodes[place] = before + TWELVE_BITS.format(sign=1 - 2 * place) + "\n" + after
    return head + "".join(f"[[node]]{node}" for node in nodes)


def jumped(folder: Path, text: str, duration: float = 2.0) -> Recording:
    """A jump of the emulated leg on a bus file with this text."""
    (folder / "leg.toml").write_text(text, encoding="utf-8")
    (folder / "limits.toml").write_bytes(LIMITS.read_bytes())
    choice = CanChoice(bus=folder / "leg.toml", interface="legbench", end=End.STOP)
    design = load_design(ROOT / "models" / "optimal.toml")
    chosen = Experiment(design=design, controller=JumpConfig(), plant=choice, duration=duration)
    return run(chosen)


# --- what follows from the period ------------------------------------------------------------


@pytest.mark.parametrize("period_us", PERIODS_US)
def test_all_times_of_the_drives_follow_from_the_period(period_us: int) -> None:
    bus = config(period_us=period_us)
    told = {entry.key: entry.value for entry in configuration(bus, bus.nodes[0])}
    assert told[0x1006, 0] == period_us
    assert told[0x60C2, 1] * 10.0 ** told[0x60C2, 2] == pytest.approx(1e-6 * period_us)
    assert bus.deadline_us == 0.72 * period_us
    # A heartbeat of 10 ms leaves on ticks: after 12 ms, where these are 4 ms apart.
    assert told[0x1016, 1] & 0xFFFF == {1000: 30, 2000: 30, 4000: 36}[period_us]
    assert bus.cycles_in(40) == 40_000 // period_us
    assert bus.cycles_in(0.5) == 1


@pytest.mark.parametrize("period_us", PERIODS_US)
def test_a_leg_is_enabled_led_and_stopped_at_every_period(tmp_path: Path, period_us: int) -> None:
    with rig(tmp_path, bus_config=config(period_us=period_us)) as it:
        it.link.start()
        it.run(200)
        sync = [at for at, frame in it.network.log or [] if frame.cob_id == 0x080]
        assert sync[-1] - sync[-201] == pytest.approx(200 * 1000 * period_us, abs=0.14 * MS)
        beats = [at for at, frame in it.network.log or [] if frame.cob_id == 0x77E]
        # It leaves after the answers, whose delays differ by 0.2 ms, and a frame may be in front.
        assert max(np.diff(beats[1:])) <= MS * (it.config.beat_ms + 0.34)
        before_ns = it.network.now_ns
        it.link.stop()
        assert it.link.stopped is not None
        assert it.link.stopped.verified
        # Quick stop at once, no voltage after 40 ms at the latest.
        assert it.network.now_ns - before_ns < 50 * MS


def test_limits_in_cycles_may_not_last_longer_than_50_ms() -> None:
    bus = replace(load_bus(BUS), period_us=4000, tpdo_deadline_us=None)
    limits = load_limits(LIMITS)
    check_together(bus, replace(limits, lost_frames=12))
    words = r"lost_frames is 13 cycles, 52 ms with period_us = 4000; .*lower it to 12, or waive"
    with pytest.raises(ConfigError, match=words):
        check_together(bus, replace(limits, lost_frames=13))
    check_together(bus, replace(limits, lost_frames=13, waive=("lost_frames",)))
    check_together(replace(bus, period_us=1000), replace(limits, lost_frames=50))


def test_a_deadline_of_commands_has_room_for_a_late_one() -> None:
    bus = load_bus(BUS)
    nodes = tuple(
        replace(node, rpdos=(replace(node.rpdos[0], deadline_ms=11),)) for node in bus.nodes
    )
    short = replace(bus, nodes=nodes, tpdo_deadline_us=None)
    check_together(replace(short, period_us=2000), load_limits(LIMITS))
    words = r"deadline_ms of RPDO1 of 'motor1' is 11 ms, with period_us = 4000 .*raise it to 12"
    with pytest.raises(ConfigError, match=words):
        check_together(replace(short, period_us=4000), load_limits(LIMITS))


def test_other_periods_lead_no_leg(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="period_us is 3000 us; a run needs 1000, 2000, 4000 us"):
        jumped(tmp_path, bus_text(period_us=3000))


# --- the budget ------------------------------------------------------------------------------


def two_answers(bus: BusConfig) -> BusConfig:
    """A bus whose drives answer with two frames, of six and of four bytes."""
    entry = parse_object("60E4:01 i32")
    tpdos = (
        PdoConfig(number=1, objects=(STATUSWORD, POSITION_ACTUAL)),
        PdoConfig(number=2, objects=(entry,)),
    )
    nodes = [
        replace(
            node, link_object=entry, tpdos=tpdos, link=node.link and replace(node.link, bits=32)
        )
        for node in bus.nodes
    ]
    return replace(bus, nodes=tuple(nodes))


def test_answers_that_cannot_come_in_time_are_refused_whatever_the_load() -> None:
    bus = load_bus(BUS)
    check_budget(bus)
    both = two_answers(bus)
    assert check_load(both) == pytest.approx(0.718, abs=1e-3)
    words = (
        "the last answer may come 855 us after SYNC at 1000000 bit/s, tpdo_deadline_us is 720 us: "
        "map fewer objects in fewer PDOs, raise bitrate or period_us"
    )
    with pytest.raises(ConfigError, match=words):
        check_budget(both)
    # With a later deadline the commands would miss the next SYNC.
    with pytest.raises(ConfigError, match="the last command may go out 1150 us after SYNC"):
        check_budget(replace(both, tpdo_deadline_us=900))
    # Each of these is a way out.
    check_budget(replace(both, reply_delay_us=100))
    check_budget(replace(both, period_us=2000, tpdo_deadline_us=None))
    first, second = both.nodes
    check_budget(replace(both, nodes=(replace(first, channel="can1"), second)))


def test_500_kbit_carry_2_ms_and_not_1() -> None:
    slow = replace(load_bus(BUS), bitrate=500_000, tpdo_deadline_us=None)
    check_budget(replace(slow, period_us=2000))
    with pytest.raises(ConfigError, match="takes 114 % of 500000 bit/s at worst"):
        check_budget(slow)


@pytest.mark.parametrize("answers", [1, 2])
def test_no_answer_of_the_slowest_drives_comes_later_than_the_budget_says(
    tmp_path: Path, answers: int
) -> None:
    bus = config(period_us=2000, heartbeat_ms=4)
    bus = two_answers(bus) if answers == 2 else bus
    slowest = [Behaviour(start_pos=pos, reply_delay_us=(250, 250)) for pos in (-0.5, 1.9)]
    with rig(tmp_path, bus_config=bus, behaviours=slowest) as it:
        it.link.start()
        it.run(400)
        log = it.network.log or []
    (budget,) = exchanges(bus)
    latest, sync_ns = 0.0, 0
    for at_ns, frame in log:
        if frame.cob_id == 0x080:
            sync_ns = at_ns
        elif frame.cob_id in (0x181, 0x182, 0x281, 0x282) and sync_ns:
            latest = max(latest, 1e-3 * (at_ns - sync_ns) + 55)
    # Counted from the begin of SYNC, in front of which one of two heartbeats of 65 us may be.
    assert budget.answers_us - 2 * 65 - 1 < latest <= budget.answers_us - 65


# --- channels --------------------------------------------------------------------------------


class Shown:
    """Counts of the link encoders as the wires carried them."""

    def __init__(self, networks: Sequence[Network]) -> None:
        self.counts = [
            [
                int.from_bytes(frame.data[6:8], "little")
                for _, frame in network.log or []
                if frame.cob_id in (0x181, 0x182) and len(frame.data) == 8
            ]
            for network in networks
        ]


@pytest.fixture
def logged(monkeypatch: pytest.MonkeyPatch) -> list[Network]:
    """Networks that runs are made on, each with its log."""
    made: list[Network] = []

    def lockstep(channel: str, *, network: Network, bitrate: int | None = None) -> LockstepBus:
        network.log = []
        made.append(network)
        return LockstepBus(channel, network=network, bitrate=bitrate)

    def channels(networks: tuple[Network, ...], bus: BusConfig, bitrate: int | None) -> ChannelsBus:
        for network in networks:
            network.log = []
        made.extend(networks)
        return ChannelsBus(networks, bus, bitrate)

    monkeypatch.setattr(can_open, "LockstepBus", lockstep)
    monkeypatch.setattr(can_open, "ChannelsBus", channels)
    return made


@pytest.mark.long
def test_2_ms_at_500_kbit_on_two_channels_with_12_bits_that_wrap_in_mid_jump(
    tmp_path: Path, logged: list[Network]
) -> None:
    (tmp_path / "a").mkdir()
    usual = jumped(tmp_path / "a", BUS.read_text(encoding="utf-8"))
    logged.clear()
    text = bus_text(channels=True, twelve=True, period_us=2000, bitrate=500_000)
    coarse = jumped(tmp_path, text)
    assert len(logged) == 2
    for counts in Shown(logged).counts:
        assert max(counts) < 4096
        seams = [a for a, b in itertools.pairwise(counts) if abs(a - b) > 2048]
        assert len(seams) > 4
    assert np.diff(coarse.time) == pytest.approx(0.002)
    assert coarse.description.period == 0.002
    frames = next(event for event in coarse.events if event["name"] == "bus")
    assert frames["lost_cycles"] == [0, 0]
    assert frames["late_frames"] == frames["skipped_cycles"] == 0
    ratings = [summarise(each) for each in (usual, coarse)]
    assert ratings[0].jumps == ratings[1].jumps > 2
    for name in ("rating_stance", "rating_flight"):
        mine, theirs = (getattr(found, name) for found in ratings)
        assert mine == pytest.approx(theirs, abs=1e-4)


def test_two_channels_show_what_one_shows(tmp_path: Path) -> None:
    (tmp_path / "a").mkdir()
    one = jumped(tmp_path / "a", bus_text(), duration=0.6)
    two = jumped(tmp_path, bus_text(channels=True), duration=0.6)
    # A heartbeat of another drive, 65 us long, may hold SYNC up on one wire and not on two. A set
    # point that is late begins where the one before has come to: the lags are a geometric series.
    # The limits let motors move at 40 and links at 60 rad/s.
    late = 65e-6 / (1.0 - 0.065)
    for name, speed in (("motor_pos", 40.0), ("joint_pos", 60.0)):
        assert np.max(np.abs(one[name] - two[name])) < late * speed


def test_every_frame_goes_to_the_channel_of_its_drive(
    tmp_path: Path, logged: list[Network]
) -> None:
    jumped(tmp_path, bus_text(channels=True), duration=0.2)
    for place, network in enumerate(logged):
        ids = {frame.cob_id for _, frame in network.log or []}
        own, other = place + 1, 2 - place
        assert {0x080, 0x77E, 0x200 + own, 0x600 + own, 0x580 + own, 0x180 + own} <= ids
        assert not {base + other for base in (0x200, 0x600, 0x580, 0x180, 0x700)} & ids
        orders = {frame.data[1] for _, frame in network.log or [] if frame.cob_id == 0}
        assert orders == {own}


def test_a_drive_that_is_lost_on_its_channel_stops_the_other(tmp_path: Path) -> None:
    (tmp_path / "leg.toml").write_text(bus_text(channels=True), encoding="utf-8")
    (tmp_path / "limits.toml").write_bytes(LIMITS.read_bytes())
    fault = NodeFault(kind=NodeFaultKind.SILENT, node_id=2, start_ns=1500 * MS)
    choice = CanChoice(bus=tmp_path / "leg.toml", interface="legbench", faults=(fault,))
    design = load_design(ROOT / "models" / "optimal.toml")
    ended = run(Experiment(design=design, controller=JumpConfig(), plant=choice))
    events = {event["name"]: event for event in ended.events}
    assert events["end"]["cause"] == "process data lost"
    assert events["stop"]["silent"] == ["motor2"]
    assert not events["stop"]["powered"]


def test_the_load_is_that_of_the_fullest_channel() -> None:
    bus = load_bus(BUS)
    first, second = bus.nodes
    two = replace(bus, nodes=(first, replace(second, channel="can1")))
    assert two.channels == ("can0", "can1")
    # SYNC, a command, an answer; heartbeats of the drive and of the master.
    load = 1e-6 * (1000 * (55 + 115 + 135) + 65 * (50 + 100))
    assert bus_load(two, "can0") == bus_load(two, "can1") == pytest.approx(load)
    assert check_load(two) == bus_load(two, "can0")
