"""Parts of an emulated drive, each by itself: heartbeats, emergencies, encoders, what waits."""

from types import SimpleNamespace
from typing import Any, cast

import pytest
from drives_rig import MS, node

from legbench.drives.emulated import warmth
from legbench.drives.emulated.emergencies import EmergencyOutlet
from legbench.drives.emulated.heartbeats import HeartbeatConsumer, HeartbeatProducer
from legbench.drives.emulated.homing_methods import Until
from legbench.drives.emulated.send_queue import NEVER_NS, SendQueue
from legbench.drives.emulated.sensors import Encoder, SensorFault, Sensors
from legbench.drives.emulated.station import Station
from legbench.drives.emulated.switches import Switches
from legbench.drives.emulated.warmth import TENTHS, show_temperature
from legbench.drives.protocol.datatypes import DataType
from legbench.drives.protocol.frame import Frame
from legbench.drives.protocol.objects import Key
from legbench.drives.protocol.pdo import Mapped

OPERATIONAL = b"\x05"

# --- heartbeats ------------------------------------------------------------------------------


def consumer(*words: int) -> HeartbeatConsumer:
    return HeartbeatConsumer({(0x1016, sub): word for sub, word in enumerate(words, start=1)})


@pytest.mark.parametrize("sub", [0, 1])
def test_a_node_of_either_entry_is_watched_from_the_start_or_from_its_first_heartbeat(
    sub: int,
) -> None:
    words = [0, 0]
    words[sub] = 126 << 16 | 30
    for begins in (False, True):
        watch = consumer(*words)
        assert not watch.lost(10**12)
        if begins:
            watch.start(1000 * MS)
        else:
            assert watch.take(126, OPERATIONAL, 1000 * MS)
        assert not watch.lost(1030 * MS)
        assert watch.lost(1030 * MS + 1)
        # Others, and what is no heartbeat, put nothing off; a start changes no watch.
        assert not watch.take(125, OPERATIONAL, 1020 * MS)
        assert not watch.take(126, b"\x06", 1020 * MS)
        watch.start(1020 * MS)
        assert watch.lost(1030 * MS + 1)
        assert watch.take(126, OPERATIONAL, 1020 * MS)
        assert not watch.lost(1050 * MS)
        assert watch.lost(1050 * MS + 1)
        watch.clear()
        assert not watch.lost(10**12)


def test_both_nodes_that_are_watched_must_be_heard() -> None:
    watch = consumer(126 << 16 | 30, 5 << 16 | 100)
    watch.start(0)
    assert not watch.lost(30 * MS)
    watch.take(126, OPERATIONAL, 80 * MS)
    assert not watch.lost(100 * MS)
    assert watch.lost(100 * MS + 1)
    watch.take(5, OPERATIONAL, 100 * MS)
    assert watch.lost(110 * MS + 1)


def test_heartbeats_are_produced_on_a_grid_that_goes_on_while_they_are_mute() -> None:
    beat = HeartbeatProducer()
    assert (beat.since_ns, beat.mute) == (0, False)
    assert not beat.due(0, 10**12)
    assert not beat.due(20, 19)
    assert beat.due(20, 20)
    assert (beat.since_ns, beat.due(20, 39)) == (20, False)
    beat.mute = True
    assert not beat.due(20, 41)
    assert beat.since_ns == 41
    beat.mute = False
    assert not beat.due(20, 60)
    assert beat.due(20, 61)


# --- emergencies -----------------------------------------------------------------------------


def test_emergencies_leave_their_inhibit_time_between_them() -> None:
    values: dict[Key, int] = {(0x1015, 0): 25}
    outlet = EmergencyOutlet(values)
    frames = [Frame(0x81, bytes([number])) for number in range(4)]
    outlet.put(None, 0)
    assert outlet.take() == []
    for frame in frames[:3]:
        outlet.put(frame, 5 * MS)
    # 25 times 100 us, from each to the next.
    wanted = [(5 * MS, frames[0]), (7_500_000, frames[1]), (10 * MS, frames[2])]
    assert outlet.take() == wanted
    assert outlet.take() == []
    outlet.put(frames[3], 20 * MS)
    assert outlet.take() == [(20 * MS, frames[3])]


def test_emergencies_of_a_mute_drive_are_sent_later_or_forgotten() -> None:
    outlet = EmergencyOutlet({(0x1015, 0): 10})
    frame = Frame(0x81)
    outlet.mute()
    outlet.put(frame, MS)
    assert outlet.take() == []
    outlet.unmute(7 * MS)
    assert outlet.take() == [(7 * MS, frame)]
    outlet.put(frame, 7 * MS)
    outlet.mute()
    outlet.put(frame, 8 * MS)
    outlet.clear()
    outlet.unmute(9 * MS)
    assert outlet.take() == []
    # After power-on nothing inhibits.
    outlet.put(frame, 7 * MS)
    assert outlet.take() == [(7 * MS, frame)]


# --- what waits for the wire -----------------------------------------------------------------


def test_of_frames_that_are_ready_the_lowest_identifier_goes_first() -> None:
    queue = SendQueue()
    first, second, third = (cast(Any, name) for name in ("first", "second", "third"))
    assert queue.earliest_ns == NEVER_NS
    assert queue.put(first, 100, Frame(0x182)) == 1
    assert queue.put(second, 50, Frame(0x183)) == 2
    assert queue.put(third, 100, Frame(0x181)) == 3
    assert queue.put(first, 100, Frame(0x181, b"x")) == 4
    assert queue.earliest_ns == 50
    assert queue.pop(99).frame == Frame(0x183)
    assert queue.earliest_ns == 100
    # Of two with one identifier, the one that was handed over before.
    winner = queue.pop(100)
    assert (winner.frame, winner.sender) == (Frame(0x181), third)
    queue.put_back(winner, 120)
    assert queue.pop(110).frame == Frame(0x181, b"x")
    assert queue.pop(120) == winner._replace(ready_ns=120)
    queue.put(second, 0, Frame(0x100))
    queue.drop(first)
    assert queue.pop(200).sender is second
    assert queue.earliest_ns == NEVER_NS


def test_a_master_sends_in_its_own_order() -> None:
    queue = SendQueue()
    master, drive = Station(64, 1_000_000), cast(Any, "drive")
    queue.put(master, 10, Frame(0x602))
    queue.put(master, 0, Frame(0x080))
    queue.put(drive, 0, Frame(0x700))
    # Its SYNC waits for its request, once that is ready; a drive's frame waits for neither.
    assert queue.pop(10).frame == Frame(0x602)
    assert queue.pop(10).frame == Frame(0x080)
    assert queue.pop(10).frame == Frame(0x700)
    queue.put(master, 20, Frame(0x602))
    queue.put(master, 0, Frame(0x080))
    assert queue.pop(15).frame == Frame(0x080)


# --- encoders --------------------------------------------------------------------------------


def test_an_encoder_freezes_steps_or_drifts_and_heals() -> None:
    encoder = Encoder(1000.0)
    assert encoder.show(7) == 7
    encoder.disturb(0.0104)
    assert encoder.show(7) == 17
    encoder.fail(SensorFault.STEP, 0.5)
    assert encoder.show(7) == 17
    for _ in range(2):
        encoder.tick(MS)
        assert encoder.show(7) == 517
    encoder.disturb(0.0)
    encoder.fail(SensorFault.DRIFT, -2.0)
    assert encoder.show(7) == 7
    for step in (1, 2):
        encoder.tick(10 * MS)
        assert encoder.show(7) == 7 - 20 * step
    encoder.fail(SensorFault.FROZEN)
    assert encoder.show(900) == -33
    encoder.tick(MS)
    assert encoder.show(901) == -33
    encoder.fail(None)
    assert encoder.show(901) == 901


def test_a_drift_of_one_radian_a_second_is_one_after_a_second() -> None:
    encoder = Encoder(1e9)
    encoder.fail(SensorFault.DRIFT, 1.0)
    encoder.tick(1000 * MS)
    assert encoder.show(0) == 10**9


def test_both_encoders_have_their_own_resolution_and_fault() -> None:
    for place in (0, 1):
        here = node(place)
        sensors = Sensors(here)
        sensors.motor.fail(SensorFault.DRIFT, 0.5)
        sensors.link.fail(SensorFault.DRIFT, 0.25)
        sensors.tick(1000 * MS)
        assert sensors.motor.show(0) == round(0.5 * here.motor.counts_per_rad)
        assert sensors.link.show(0) == round(0.25 * here.link_units.counts_per_rad)


@pytest.mark.parametrize(
    ("entry", "scale", "shown"),
    [(None, 0.5, 250.0), (TENTHS, 0.5, 250.0), (Mapped(0x2071, 0, DataType.INTEGER8), 0.5, 50.0)],
)
def test_a_temperature_is_shown_in_the_unit_of_its_object(
    entry: Mapped | None, scale: float, shown: float
) -> None:
    assert (warmth.WARM, warmth.HOT) == (25.0, 90.0)
    told: list[tuple[bool, Key, float]] = []
    for there in (True, False):
        store: Any = SimpleNamespace(
            entry=lambda key, there=there: there or None,
            show=lambda key, value, there=there: told.append((there, key, value)),
        )
        drive: Any = SimpleNamespace(temperature_object=entry, temperature_scale=scale)
        for key in ((0x2070, 0), None):
            show_temperature(store, cast(Any, SimpleNamespace(temperature=key)), drive, 25.0)
    assert told == [(True, (0x2070, 0), pytest.approx(shown))]


def test_a_controller_is_active_and_hears_others_alone() -> None:
    station = Station(3, 500_000)
    assert (station.tx_queue, station.bitrate) == (3, 500_000)
    assert (station.listen_only, station.echo) == (False, False)
    assert (station.waiting, station.unread, len(station.received)) == (0, 0, 0)


def test_a_home_switch_is_active_from_one_end_to_the_other() -> None:
    switches: Any = Switches.__new__(Switches)
    switches._limits, switches._home = (-5.0, 30.0), (10.0, 20.0)
    for travel, home in ((9.5, False), (10.0, True), (15.0, True), (20.0, True), (20.5, False)):
        assert switches.active(Until.HOME, travel) is home
    assert switches.active(Until.NEGATIVE_LIMIT, -5.0)
    assert not switches.active(Until.NEGATIVE_LIMIT, -4.5)
    assert switches.active(Until.POSITIVE_LIMIT, 30.0)
    assert not switches.active(Until.POSITIVE_LIMIT, 29.5)
    switches._home = None
    assert not switches.active(Until.HOME, 15.0)
