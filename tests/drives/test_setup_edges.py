"""Edges of what a bus file may say, and of the session that uses it."""

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import pytest
from drives_rig import config, node

from legbench.drives.emulated.build import emulate
from legbench.drives.emulated.bus import LockstepBus
from legbench.drives.master import session as session_module
from legbench.drives.master.session import Session
from legbench.drives.master.stop_report import DriveLeader, StopReport
from legbench.drives.protocol.datatypes import DataType
from legbench.drives.protocol.frame import Frame
from legbench.drives.protocol.pdo import Mapped
from legbench.drives.setup import eds, field_ranges, needs, pdos, stopping
from legbench.drives.setup.config import BusConfig, Identity
from legbench.drives.setup.configuration import configuration
from legbench.drives.setup.field_ranges import _check_lap, check_field_ranges
from legbench.drives.setup.file_edit import edited
from legbench.drives.setup.homed import HomedCondition
from legbench.drives.setup.master_watch import check_master_watch, means_of
from legbench.drives.setup.outcome import cycle_count, held_by
from legbench.drives.setup.parameters import Parameter, check_parameter
from legbench.drives.setup.pdos import packed
from legbench.drives.setup.units import AxisUnits
from legbench.drives.transport import unix_packet
from legbench.drives.transport.timebase import SystemTime
from legbench.drives.transport.unix_packet import Controller
from legbench.errors import ConfigError
from legbench.reading import UnreadableError


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_motor_stays_within_half_a_lap_of_angle_0_on_either_side(side: float) -> None:
    units = AxisUnits(counts_per_rev=4096, modulus_counts=4096)
    single = replace(node(0), motor=units)
    # Half a turn, less the 0.2 rad that a motor may reach beyond its range.
    end = math.pi - 0.2
    for gap, fits in ((1e-9, True), (-1e-9, False)):
        far = side * (end - gap)
        motor = (min(far, 0.0), max(far, 0.0))
        if fits:
            _check_lap(single, motor)
            continue
        words = r"repeats every 6\.283 rad, .* beyond 3\.142 rad from angle 0"
        with pytest.raises(ConfigError, match=words):
            _check_lap(single, motor)


def test_a_home_is_shown_by_bits_of_its_object_and_by_no_others() -> None:
    word = Mapped(0x6041, 0, DataType.UNSIGNED16)
    for mask, value in ((0xFFFF, 0xFFFF), (0xFFFF, None), (1, 0), (0x8000, 0x8000), (3, 2)):
        home = HomedCondition(object=word, mask=mask, value=value)
        assert home.wanted == (mask if value is None else value)
        assert home.met(home.wanted | 0xFFFF & ~mask)
        assert not home.met(home.wanted ^ mask)
    for mask in (0, -1, 0x10000):
        with pytest.raises(ConfigError, match="16 bits, so it must be 1 to 0xffff"):
            HomedCondition(object=word, mask=mask)
    for value in (-1, 4, 0x10000):
        with pytest.raises(ConfigError, match="no bits outside of mask, 0x3"):
            HomedCondition(object=word, mask=3, value=value)


def test_a_table_on_the_way_to_a_value_is_added() -> None:
    text = "# of the leg\n[node]\nid = 1\n"
    changed = edited(text, {("node", "motor", "offset_counts"): 5, ("limits", "speed"): 2.5})
    assert changed.startswith(text.rstrip("\n"))
    assert "[node.motor]" in changed
    assert "offset_counts = 5" in changed
    assert "[limits]\nspeed = 2.5" in changed
    for place in (("node", 0, "id"), ("node", "id", "x"), ("more", 0, "id")):
        with pytest.raises(UnreadableError, match="there is no "):
            edited(text, {place: 1})


@pytest.mark.parametrize("name", ["vendor", "product", "serial", "revision"])
def test_every_part_of_an_identity_has_32_bits(name: str) -> None:
    for value in (0, (1 << 32) - 1):
        given: dict[str, int] = {"vendor": 1, name: value}
        assert getattr(Identity(**given), name) == value
    for value in (-1, 1 << 32):
        given = {"vendor": 1, name: value}
        with pytest.raises(ConfigError, match=f"{name} is {value}; it must be 0 to"):
            Identity(**given)


@pytest.mark.parametrize("place", [0, 1])
def test_either_drive_that_would_go_on_without_its_master_is_named(place: int) -> None:
    nodes = list(config().nodes)
    nodes[place] = replace(
        nodes[place],
        heartbeat_consumer=False,
        rpdos=tuple(replace(pdo, deadline_ms=0) for pdo in nodes[place].rpdos),
    )
    bus = config(nodes=tuple(nodes))
    words = rf"drive '{nodes[place].name}' would not stand within 100 ms .*: it has no means"
    with pytest.raises(ConfigError, match=words):
        check_master_watch(bus)
    # A deadline helps where commands are sent, and a faster heartbeat where it is watched.
    watching = [replace(node, heartbeat_consumer=True) for node in nodes]
    deaf = {entry.key: entry.value for entry in configuration(bus, nodes[place])}
    for commands, chosen, ways in (
        (
            True,
            bus,
            "both with 6007h; give its RPDO a deadline_ms, or heartbeat_consumer = true, or",
        ),
        (False, bus, "that is 1016h with 6007h; heartbeat_consumer = true, or waive = "),
        (False, replace(bus, nodes=tuple(watching)), "that is 1016h with 6007h; waive = "),
    ):
        with pytest.raises(ConfigError, match=ways):
            check_master_watch(chosen, commands=commands, held={nodes[place].name: deaf})
    check_master_watch(replace(bus, waive=("master watch",)))
    check_master_watch(config())
    # One that is not known to hold anything is not looked at.
    other = nodes[1 - place]
    told = {entry.key: entry.value for entry in configuration(bus, other)}
    check_master_watch(bus, held={other.name: told})
    with pytest.raises(ConfigError, match=words):
        check_master_watch(bus, held={other.name: told, nodes[place].name: {}})
    with pytest.raises(ConfigError, match=words):
        check_master_watch(bus, held={nodes[place].name: {}})


@pytest.mark.parametrize(
    "led", [Mapped(0x6040, 0, DataType.UNSIGNED16), Mapped(0x607A, 0, DataType.INTEGER32)], ids=str
)
def test_a_deadline_of_either_object_of_a_command_is_a_means(led: Mapped) -> None:
    there = config()
    objects = (led, Mapped(0x6071, 0, DataType.INTEGER16))
    drive = replace(there.nodes[0])
    object.__setattr__(drive, "rpdos", (SimpleNamespace(number=2, objects=objects),))
    told = {entry.key: entry.value for entry in configuration(there, there.nodes[0])}
    told = {**told, (0x1016, 1): 0, (0x1401, 5): 7}
    (means,) = means_of(there, drive, held=told)
    assert (means.name, means.time_ms) == (
        "deadline of RPDO2 1401h:05",
        7 + 1e-3 * there.period_us,
    )


def test_what_a_drive_holds_is_what_was_read_else_what_it_took() -> None:
    def one(sub: int, there: int | None, *, agrees: bool) -> Any:
        parameter = Parameter(index=0x6085, sub=sub, kind=DataType.UNSIGNED32, value=100 + sub)
        return SimpleNamespace(parameter=parameter, there=there, agrees=agrees)

    outcomes = (
        one(1, None, agrees=True),
        one(2, None, agrees=False),
        one(3, 7, agrees=False),
        one(4, 8, agrees=True),
    )
    assert held_by(outcomes) == {(0x6085, 1): 101, (0x6085, 3): 7, (0x6085, 4): 8}


def test_a_drive_may_be_up_to_as_slow_as_the_table_says_and_never_off() -> None:
    assert not needs._time(100, 0)
    assert needs._time(100, 1)
    assert needs._time(0, 0) is False
    assert (0x6065, 0) in needs.TABLE
    assert (0x6065, 1) not in needs.TABLE


def test_a_bus_has_two_encoders_only_where_every_drive_has_and_waits_200_ms() -> None:
    there = config()
    assert BusConfig.__dataclass_fields__["sdo_timeout_ms"].default == 200
    one, two = SimpleNamespace(link=None), SimpleNamespace(link=there.nodes[0].motor)
    lone = SimpleNamespace(nodes=(two, one))
    getter = cast("Any", BusConfig.two_encoders).fget
    assert not getter(lone)
    assert getter(SimpleNamespace(nodes=(two, two)))


# --- a session -------------------------------------------------------------------------------


class Surroundings:
    """A bus, a lock, a log and leaders of a session, which note what is done with them."""

    channel, channel_info = "can7", "socketcan can7"

    def __init__(self, *, shutdown: BaseException | None = None) -> None:
        self.asked: list[str] = []
        self._shutdown = shutdown
        self.held = False

    def shutdown(self) -> None:
        self.asked.append("shutdown")
        if self._shutdown is not None:
            raise self._shutdown

    def acquire(self) -> None:
        self.asked.append("acquire")
        self.held = True

    def release(self) -> None:
        self.asked.append("release")

    def session(self) -> Session:
        return Session(cast(Any, self), config(), cast(Any, self), lock=cast(Any, self))

    def leader(
        self, name: str, stopped: StopReport | None = None, error: BaseException | None = None
    ) -> DriveLeader:
        def close() -> None:
            self.asked.append(f"close {name}")
            if error is not None:
                raise error

        return cast(Any, SimpleNamespace(close=close, stopped=stopped))


def test_a_session_stops_its_drives_then_shuts_the_bus_then_gives_the_channel_back() -> None:
    it = Surroundings()
    session = it.session()
    for _ in range(2):
        session.hold()
    assert it.asked == ["acquire"]
    report = StopReport(silent=("hip",))
    session.register(it.leader("first", report))
    session.register(it.leader("second"))
    session.log = cast(Any, SimpleNamespace(close=lambda: it.asked.append("log")))
    assert session.stopped == (report,)
    for _ in range(2):
        session.close()
    assert it.asked[1:] == ["close first", "close second", "shutdown", "release", "log"]


@pytest.mark.parametrize("error", [ValueError("garbled"), KeyboardInterrupt()])
def test_nothing_that_is_raised_keeps_a_session_from_its_end(error: BaseException) -> None:
    for where in ("leader", "bus"):
        it = Surroundings(shutdown=error if where == "bus" else None)
        session = it.session()
        session.register(it.leader("first", error=error if where == "leader" else None))
        session.register(it.leader("second"))
        session.log = cast(Any, SimpleNamespace(close=lambda it=it: it.asked.append("log")))
        if isinstance(error, KeyboardInterrupt):
            with pytest.raises(KeyboardInterrupt):
                session.close()
        else:
            session.close()
        assert it.asked == ["close first", "close second", "shutdown", "release", "log"]


def test_an_error_on_its_way_says_which_drive_keeps_its_power() -> None:
    it = Surroundings()
    session = it.session()
    session.register(it.leader("first", StopReport(silent=("hip",))))
    with pytest.raises(ValueError, match="wrong") as caught, session:
        raise ValueError("wrong")
    assert any("'hip' no longer answers" in note for note in caught.value.__notes__)
    assert it.asked == ["close first", "shutdown", "release"]


@pytest.mark.parametrize("logs", ["before", "after", "never"])
def test_a_link_is_closed_with_its_session_and_shows_its_frames_to_the_log(
    logs: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    it, shown, made = Surroundings(), list[Any](), list[dict[str, Any]]()

    def link_of(bus: Any, config: BusConfig, limits: Any, **how: Any) -> Any:
        made.append({"bus": bus, "config": config, "limits": limits, **how})
        link: Any = it.leader("link")
        link.show_frames_to = shown.append
        return link

    monkeypatch.setattr(session_module, "Link", link_of)
    session = it.session()
    log: Any = SimpleNamespace(close=lambda: it.asked.append("log"), write=None)
    if logs == "before":
        session.log_to(log)
    limits: Any = "limits"
    session.link(limits, (4.0, 5.0), read_only=True)
    if logs == "after":
        session.log_to(log)
    assert shown == ([] if logs == "never" else [session.log])
    wanted = {"bus": it, "config": session.config, "limits": "limits", "stiffness": (4.0, 5.0)}
    wanted |= {"timebase": it, "read_only": True, "lock": it, "momentum": None}
    assert made == [wanted]
    session.close()
    assert it.asked[:3] == ["close link", "shutdown", "release"]


def test_a_session_names_its_channel_and_asks_no_system_in_virtual_time() -> None:
    it = Surroundings()
    session = it.session()
    assert (session.channel, session.virtual) == ("can7", False)
    network = emulate(config())
    virtual = Session(LockstepBus("leg", network=network), config())
    assert virtual.virtual
    assert virtual.request_realtime() is None
    virtual.close()


@pytest.mark.parametrize("spin_us", [0, 100])
def test_a_system_that_grants_it_is_waited_for_awake(
    spin_us: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[Any] = []
    monkeypatch.setattr(
        session_module, "ask", lambda cpu: asked.append(cpu) or SimpleNamespace(spin_us=spin_us)
    )
    session = Surroundings().session()
    granted: Any = session.request_realtime(3)
    assert (asked, granted.spin_us) == ([3], spin_us)
    assert isinstance(session.timebase, SystemTime)
    assert session.timebase._spin_ns == 1000 * spin_us


@pytest.mark.parametrize(
    ("value", "index", "there", "count"),
    [
        (1, -3, -3, 1),
        (1, -3, -4, 10),
        (10, -4, -3, 1),
        (1, -3, -2, None),
        (255, -3, -3, 255),
        (26, -3, -4, None),
        (25, -3, -4, 250),
        (15, -4, -3, None),
        (1, -3, -6, None),
    ],
)
def test_a_cycle_is_said_at_another_power_of_ten_where_one_to_255_say_it(
    value: int, index: int, there: int, count: int | None
) -> None:
    assert cycle_count(value, index, there) == count


def test_mappings_are_those_objects_that_the_standard_numbers_so() -> None:
    # CiA 301, 7.5.2.35 and .38: 512 each way.
    for index in (0x1600, 0x17FF, 0x1A00, 0x1BFF):
        assert any(index in mappings for mappings in needs.MAPPINGS)
    for index in (0x15FF, 0x1800, 0x19FF, 0x1C00):
        assert not any(index in mappings for mappings in needs.MAPPINGS)
    assert (range(0x1400, 0x1600), range(0x1800, 0x1A00)) == (needs.RPDOS, needs.TPDOS)


def printed_objection(index: int, value: int) -> str | None:
    """Why an object of 16 bits is none that a bus file may give, from the manual of the file."""
    written = {
        *(0x1005, 0x1006, 0x1016, 0x1017, 0x1029, 0x6007, 0x6040, 0x605A, 0x6060),
        *(0x607A, 0x60B0, 0x60C2),
    }
    if index in written or 0x1400 <= index < 0x1C00:
        return "is written by itself"
    if index in (0x1010, 0x1011):
        return "would wear out the drive's memory"
    if index in (0x1012, 0x1014) or 0x1200 <= index < 0x1300:
        return "moves a service of CiA 301"
    if index == 0x607D:
        return "would not move with offset_counts"
    if 0x605B <= index <= 0x605E and value <= 0:
        return "which lets the leg drop: give 1 to 4"
    return None


def test_every_object_is_one_that_a_bus_file_may_give_or_is_refused_for_its_reason() -> None:
    for index in (*range(0x1000, 0x1D00), *range(0x6000, 0x6100)):
        for value in (-1, 0, 1):
            parameter = Parameter(index=index, sub=0, kind=DataType.INTEGER16, value=value)
            said = printed_objection(index, value)
            if said is None:
                check_parameter("hip", parameter)
            else:
                with pytest.raises(ConfigError, match=f"^node 'hip': parameter .*{said}"):
                    check_parameter("hip", parameter)


def test_a_parameter_is_a_number_that_its_type_holds() -> None:
    for kind, low, high in (
        (DataType.INTEGER8, -128, 127),
        (DataType.UNSIGNED32, 0, (1 << 32) - 1),
    ):
        for value, fits in ((low, True), (high, True), (low - 1, False), (high + 1, False)):
            parameter = Parameter(index=0x6085, sub=0, kind=kind, value=value)
            if fits:
                check_parameter("hip", parameter)
            else:
                words = f"is {value}, but its type {kind.name} holds {low} to {high}"
                with pytest.raises(ConfigError, match=words):
                    check_parameter("hip", parameter)
    text = Parameter(index=0x6085, sub=0, kind=DataType.VISIBLE_STRING, value=0)
    with pytest.raises(ConfigError, match="VISIBLE_STRING is no number"):
        check_parameter("hip", text)
    window = Parameter(index=0x6065, sub=0, kind=DataType.UNSIGNED32, value=0xFFFFFFFF)
    with pytest.raises(ConfigError, match="switches the following error off"):
        check_parameter("hip", window)
    check_parameter("hip", replace(window, value=0xFFFFFFFE))


# --- ends of what is refused -----------------------------------------------------------------


def stops(value: int, counts_per_rad: float = 100.0) -> Any:
    ramp = Parameter(index=0x6085, sub=0, kind=DataType.UNSIGNED32, value=value)
    motor = SimpleNamespace(counts_per_rad=counts_per_rad)
    return SimpleNamespace(name="hip", parameters=(ramp,), motor=motor, quick_stop_ramp=None)


def test_a_way_of_exactly_the_longest_is_let_through(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(stopping, "quick_stop_ramp", lambda _node: (0x6085, 0))
    assert stopping.LONGEST_WAY == 0.2
    assert stopping.stopping_way(stops(1), 2.0) == 200.0
    with pytest.raises(ConfigError, match="has no quick-stop ramp"):
        stopping.stopping_way(stops(0), 2.0)
    limits: Any = SimpleNamespace(command_speed=2.0)
    for value, fits in ((1000, True), (999, False)):
        bus: Any = SimpleNamespace(waive=(), nodes=(stops(value),))
        if fits:
            assert stopping.stopping_way(stops(value), 2.0) == 0.2
            stopping.check_stopping(bus, limits)
        else:
            with pytest.raises(ConfigError, match=r"needs 0\.2 rad to stop from 2 rad/s"):
                stopping.check_stopping(bus, limits)


def test_a_range_that_ends_at_the_last_count_or_at_half_a_lap() -> None:
    slack = field_ranges.SLACK
    drive: Any = SimpleNamespace(
        name="hip",
        motor_object="6064h",
        motor=SimpleNamespace(
            modulus_counts=None,
            lowest=-100,
            modulus=201,
            bits=8,
            lap=4.0,
            to_counts=lambda end: end,
        ),
    )
    for low, high, fits in ((-100, 100, True), (-101, 100, False), (-100, 101, False)):
        drive.motor.to_counts = lambda end, low=low, high=high: low if end < 0 else high
        if fits:
            field_ranges._check_motor(drive, (-1.0, 1.0))
        else:
            with pytest.raises(ConfigError, match=f"are {low} to {high} counts"):
                field_ranges._check_motor(drive, (-1.0, 1.0))
    drive.motor.lap = 2.0 * (1.0 + slack)
    for half in (-1.0, 1.0):
        with pytest.raises(ConfigError, match="from angle 0"):
            field_ranges._check_lap(drive, (min(half, 0.0), max(half, 0.0)))
    field_ranges._check_lap(drive, (-0.999, 0.999))


@pytest.mark.parametrize("places", [1, 3])
def test_every_drive_has_its_ranges(places: int) -> None:
    there = config()
    free = (-math.inf, math.inf)
    limits: Any = SimpleNamespace(
        motor_range=(free,) * places, joint_range=(free,) * places, temperature=math.inf
    )
    with pytest.raises(ValueError, match="zip"):
        check_field_ranges(there, limits)


@pytest.mark.parametrize("controller", [0, 1, 2])
def test_a_packet_notes_the_controller_beside_what_is_its_own(controller: int) -> None:
    for own in (False, True):
        packet = unix_packet.pack_frame(Frame(0x181, b"\1"), Controller(controller), own=own)
        assert packet[unix_packet.NOTE] == 2 * controller + own
        assert unix_packet.controller_of(packet) == controller
        assert unix_packet.is_own(packet) is own
    assert (Controller.ACTIVE, Controller.PASSIVE, Controller.BUS_OFF) == (0, 1, 2)


def test_a_process_data_object_by_default_and_its_deadline() -> None:
    assert (pdos.RPDO.number, pdos.RPDO.deadline_ms, pdos.RPDO.cob_id) == (1, 20, None)
    assert (pdos.TPDO.number, pdos.TPDO.deadline_ms, pdos.TPDO.cob_id) == (1, 0, None)
    assert Mapped(0x2064, 0, DataType.INTEGER16) == pdos.LINK_POSITION_SHORT
    for deadline_ms, fits in ((0, True), (65535, True), (-1, False), (65536, False)):
        if fits:
            assert replace(pdos.RPDO, deadline_ms=deadline_ms).deadline_ms == deadline_ms
        else:
            with pytest.raises(ConfigError, match="deadline_ms"):
                replace(pdos.RPDO, deadline_ms=deadline_ms)


def test_objects_are_packed_into_frames_of_eight_bytes() -> None:
    word, byte = Mapped(0x6041, 0, DataType.UNSIGNED16), Mapped(0x6061, 0, DataType.INTEGER8)
    assert [list(pdo.objects) for pdo in packed((word,) * 4)] == [[word] * 4]
    assert [list(pdo.objects) for pdo in packed((*(word,) * 4, byte))] == [[word] * 4, [byte]]


def test_a_data_sheet_says_0_for_what_an_identity_leaves_open() -> None:
    there = config()
    drive = replace(there.nodes[0], identity=Identity(vendor=7))
    text = eds.dcf_text(replace(there, nodes=(drive, *there.nodes[1:])), drive)
    lines = [line.strip().replace(" ", "") for line in text.splitlines()]
    numbers = [line.partition("=") for line in lines if line.startswith(("Product", "Revision"))]
    found = {name: int(value, 0) for name, _, value in numbers if name.endswith("Number")}
    assert found == {"ProductNumber": 0, "RevisionNumber": 0}
    assert (eds.MANUFACTURER.start, eds.MANUFACTURER.stop) == (0x2000, 0x6000)
