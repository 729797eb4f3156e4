"""The order in which drives are prepared, and the drives that are refused before anything moves."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import pytest
from drives_rig import config, node

from legbench.drives.emulated.reception import SYNC_LENGTH, Reception
from legbench.drives.errors import DriveError
from legbench.drives.master import preparation
from legbench.drives.master.preparation import (
    check_homed,
    is_homed,
    prepare_to_move,
    read_temperatures,
    refuse_led,
    refuse_powered,
    take_power,
)
from legbench.drives.protocol.datatypes import DataType
from legbench.drives.protocol.nmt import NmtState
from legbench.drives.protocol.pdo import Mapped
from legbench.drives.setup.config import NodeConfig
from legbench.drives.setup.encoders import check_encoder
from legbench.drives.setup.exchange import Exchange, _way, check_exchange, exchanges
from legbench.drives.setup.homed import HomedCondition
from legbench.drives.setup.units import AxisUnits
from legbench.errors import ConfigError

HOMED = HomedCondition(object=Mapped(0x6041, 0, DataType.UNSIGNED16), mask=0x8000)
NAMES = ("hip", "knee")


class Drives:
    """A bring-up that notes what it is asked, of two drives by their names."""

    def __init__(self, *, homed: str = "", powered: str = "") -> None:
        self.asked: list[str] = []
        self.words = {"hip": 0x0250, "knee": 0x0250}
        if homed:
            self.words[homed] |= 0x8000
        self._powered = powered

    def __getattr__(self, name: str) -> Any:
        def ask(*nodes: NodeConfig) -> Any:
            self.asked.append(" ".join([name, *(each.name for each in nodes)]))
            return f"{name} of {nodes[0].name}" if nodes else None

        return ask

    def sdo(self, drive: NodeConfig) -> Any:
        def get_int(index: int, sub: int, kind: DataType) -> int:
            assert (index, sub, kind) == (0x6041, 0, DataType.UNSIGNED16)
            return self.words[drive.name]

        return SimpleNamespace(get_int=get_int)

    def powered(self, drive: NodeConfig) -> bool:
        self.asked.append(f"powered {drive.name}")
        return drive.name == self._powered

    def temperature(self, drive: NodeConfig) -> float | None:
        return {"hip": None, "knee": 41.0}[drive.name]


def up(drives: Drives) -> Any:
    return cast(Any, drives)


TAKEN = ["listen", "identify", "unpower", "poll_frames"]


def test_drives_lose_their_power_before_they_are_configured_and_then_hold_where_they_are(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    it, bus, checked = Drives(), config(), []
    monkeypatch.setattr(
        preparation, "check_taken", lambda *given, speed: checked.append((*given, speed))
    )
    outcomes = prepare_to_move(up(it), bus, speed=20.0)
    assert outcomes == {name: f"configure of {name}" for name in NAMES}
    assert checked == [(bus, outcomes, 20.0)]
    assert it.asked == [
        *TAKEN,
        "pre_operational",
        *(f"configure {name}" for name in NAMES),
        *(f"{act} {name}" for name in NAMES for act in ("check_soft_limits", "preload")),
    ]


@pytest.mark.parametrize("place", [0, 1])
def test_a_drive_that_is_not_homed_is_refused_before_it_loses_its_power(place: int) -> None:
    nodes = [node(0), node(1)]
    nodes[place] = replace(nodes[place], homed=HOMED)
    it = Drives()
    assert [is_homed(up(it), each) for each in nodes] == [
        False if at == place else None for at in (0, 1)
    ]
    words = rf"'{NAMES[place]}' \(node {place + 1}\) is not homed .*home --node {NAMES[place]}"
    with pytest.raises(DriveError, match=words):
        take_power(up(it), nodes)
    assert it.asked == TAKEN[:2]
    with pytest.raises(DriveError, match=words):
        prepare_to_move(up(it), config(nodes=tuple(nodes)), speed=20.0)
    it = Drives(homed=NAMES[place])
    assert is_homed(up(it), nodes[place])
    check_homed(up(it), nodes)
    take_power(up(it), nodes)
    assert it.asked == TAKEN


@pytest.mark.parametrize("place", [0, 1])
def test_a_drive_with_power_or_that_somebody_leads_is_refused(place: int) -> None:
    bus, name = config(), NAMES[place]
    who = rf"^drive '{name}' \(node {place + 1}\) "
    with pytest.raises(DriveError, match=who + "has power; end the program"):
        refuse_powered(up(Drives(powered=name)), bus.nodes)
    refuse_powered(up(Drives()), bus.nodes)

    def watched(state: NmtState | None) -> Any:
        states = [NmtState.PRE_OPERATIONAL, None]
        states[place] = state
        return SimpleNamespace(watches=[SimpleNamespace(state=each) for each in states])

    for state in (NmtState.PRE_OPERATIONAL, NmtState.STOPPED, None):
        refuse_led(up(Drives()), watched(state), bus)
        with pytest.raises(DriveError, match=who + "has power, though nobody sends SYNC"):
            refuse_led(up(Drives(powered=name)), watched(state), bus)
    with pytest.raises(DriveError, match=who + "is operational, though nobody sends SYNC"):
        refuse_led(up(Drives()), watched(NmtState.OPERATIONAL), bus)


def test_every_temperature_that_can_be_read_is_taken() -> None:
    taken: list[tuple[str, float]] = []
    polls = [
        SimpleNamespace(take=lambda value, name=name: taken.append((name, value))) for name in NAMES
    ]
    read_temperatures(up(Drives()), cast(Any, SimpleNamespace(polls=polls)), config())
    assert taken == [("knee", 41.0)]


# --- what a bus can carry --------------------------------------------------------------------


def test_an_encoder_shows_no_count_that_its_object_does_not_hold() -> None:
    signed = Mapped(0x2064, 0, DataType.INTEGER16)
    unsigned = Mapped(0x2064, 0, DataType.UNSIGNED16)
    for entry, low, high in ((signed, -(1 << 15), (1 << 15) - 1), (unsigned, 0, (1 << 16) - 1)):
        for first, last in ((low, low + 4095), (high - 4095, high)):
            units = AxisUnits(counts_per_rev=4096, bits=16, modulus_counts=4096, lowest_count=first)
            check_encoder("hip", "link", units, entry)
            assert units.lowest + units.modulus - 1 == last
    for entry, first in ((signed, (1 << 15) - 4095), (unsigned, -1)):
        units = AxisUnits(counts_per_rev=4096, bits=16, modulus_counts=4096, lowest_count=first)
        with pytest.raises(ConfigError, match=f"link shows {first} to {first + 4095} counts"):
            check_encoder("hip", "link", units, entry)


def test_the_last_answer_of_either_channel_may_be_too_late() -> None:
    plain = config(tpdo_deadline_us=700, reply_delay_us=250)
    torque = Mapped(0x6077, 0, DataType.INTEGER16)
    more = replace(plain.nodes[0].tpdos[0], number=2, objects=(torque,))
    full = replace(plain.nodes[0], tpdos=(*plain.nodes[0].tpdos, more))
    rest = plain.nodes[1]
    for order in ((0, 1), (1, 0)):
        nodes = (replace(full, channel="a"), replace(rest, channel="b"))
        bus = replace(plain, nodes=tuple(nodes[place] for place in order))
        late = {one.channel: one.answers_us for one in exchanges(bus)}
        assert late["a"] > late["b"]
        deadline = int((late["a"] + late["b"]) / 2)
        with pytest.raises(ConfigError, match=f"the last answer on a may come {late['a']:.0f} us"):
            check_exchange(replace(bus, tpdo_deadline_us=deadline))
        check_exchange(replace(bus, tpdo_deadline_us=int(late["a"]) + 1))


def test_a_deadline_can_be_raised_as_far_as_the_period_goes() -> None:
    bus = config(period_us=1000)
    raised = "raise it to {:.0f}, or map fewer objects"
    for answers_us, commands_us, way in (
        (900.0, 1000.0, raised.format(901.0)),
        (998.9, 1000.0, raised.format(999.9)),
        (999.0, 1000.0, "map fewer objects in fewer PDOs"),
        (900.0, 1000.1, "map fewer objects in fewer PDOs"),
    ):
        one = Exchange(channel=None, answers_us=answers_us, commands_us=commands_us)
        assert _way(bus, one).startswith(way)


# --- SYNC as a drive receives it -------------------------------------------------------------


class Received:
    """A drive's reception of SYNC: what it latches, samples and reports, in order."""

    def __init__(self, overflow: int) -> None:
        self.done: list[Any] = []
        note = self.done.append
        pdos = SimpleNamespace(
            at_sync=lambda: note("sample") or ["frame"], latch=lambda: note("latch")
        )
        axis = SimpleNamespace(sync=lambda fresh, now_ns: note(("target", fresh, now_ns)))
        connection = SimpleNamespace(report=lambda code, now_ns: note((code, now_ns)))
        values = {(0x1019, 0): overflow}
        self.reception = Reception(
            values, cast(Any, axis), cast(Any, pdos), cast(Any, connection), 5
        )


@pytest.mark.parametrize("overflow", [0, 1, 240])
def test_a_sync_is_as_long_as_1019h_says(overflow: int) -> None:
    wanted = 1 if overflow else 0
    for length in (0, 1, 2):
        it = Received(overflow)
        assert it.reception.is_sync(bytes(length), 7) is (length == wanted)
        assert it.done == ([] if length == wanted else [(SYNC_LENGTH, 7)])


def test_a_target_is_new_once() -> None:
    it = Received(0)
    it.reception.fresh = True
    assert it.reception.sync(5) == ["frame"]
    assert it.done == ["sample", "latch", ("target", True, 5)]
    assert not it.reception.fresh
    it.done.clear()
    it.reception.sync(6)
    assert it.done == ["sample", "latch", ("target", False, 6)]
