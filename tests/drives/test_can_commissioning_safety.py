"""Small motions end at rest, whatever ends them: silence, errors, signals; virtual time."""

import re
import shutil
import signal
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import can
import pytest
from can_rig import BUS, LIMITS, MS, ROOT

from legbench.cli import main
from legbench.commissioning.home import Homed, home
from legbench.commissioning.jog import jog
from legbench.drives.emulated.behaviour import Behaviour
from legbench.drives.emulated.build import emulate
from legbench.drives.emulated.bus import LockstepBus
from legbench.drives.emulated.network import Network
from legbench.drives.errors import BusError, DriveError
from legbench.drives.master.session import Session
from legbench.drives.protocol.cia402 import POWERED, DriveState
from legbench.drives.protocol.datatypes import DataType
from legbench.drives.protocol.frame import HEARTBEAT_BASE, SDO_REQUEST_BASE
from legbench.drives.setup.bus_file import load_bus, load_limits
from legbench.drives.setup.config import BusConfig, Parameter
from legbench.drives.setup.configuration import configuration
from legbench.errors import ConfigError
from legbench.limits.safety import SafetyLimits
from legbench.plant import can_open

STIFFNESS = (4.0, 5.0)
STOP = 1.0
"""Mechanical end of either motor, both ways [rad]."""
SPEED_COUNTS = 60_000
"""Of a search [counts/s]: 0.96 rad/s."""
UNDER_WAY = 0.1
"""A search has moved so far when it is disturbed [rad]."""
RUN_ON = 0.05
"""Longest way of a motor whose master is gone: 30 ms of watchdog, then the ramp [rad]."""
SEARCH = -3
"""Against the lower stop, no index pulse."""
SENDERS = {name: getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP")}


class Gone(BaseException):
    """The process is no more: nothing that cleans up may send another frame."""


def searching_bus() -> BusConfig:
    """The bench's, with a speed for searches."""
    bench = load_bus(BUS)
    speeds = tuple(
        Parameter(index=0x6099, sub=sub, kind=DataType.UNSIGNED32, value=SPEED_COUNTS)
        for sub in (1, 2)
    )
    return replace(
        bench,
        nodes=tuple(replace(node, parameters=node.parameters + speeds) for node in bench.nodes),
    )


def opened(
    config: BusConfig | None = None, starts: tuple[float, float] = (0.0, 0.0)
) -> tuple[Session, Network]:
    chosen = config or searching_bus()
    behaviours = [Behaviour(start_pos=pos, hard_stop=(-STOP, STOP)) for pos in starts]
    network = emulate(chosen, behaviours, keep_log=True)
    return Session(LockstepBus("leg", network=network), chosen), network


def angle(network: Network, place: int = 0) -> float:
    return network.drives[place].axis.motion.angle


def states(network: Network) -> list[DriveState]:
    return [drive.axis.power.state for drive in network.drives]


def words(network: Network, node_id: int) -> list[int]:
    """Controlwords that a drive was told, by SDO or by process data."""
    found = []
    for _, frame in network.log or []:
        data = frame.data
        if frame.cob_id == 0x200 + node_id:
            found.append(int.from_bytes(data[:2], "little"))
        elif frame.cob_id == SDO_REQUEST_BASE + node_id and data[:4] == b"\x2b\x40\x60\x00":
            found.append(int.from_bytes(data[4:6], "little"))
    return found


def disturb(
    monkeypatch: pytest.MonkeyPatch, when: Callable[[Network], bool], act: Callable[[], None]
) -> None:
    """Do something at every frame that is sent once a condition has been met."""
    real, met = LockstepBus.send, False

    def send(self: LockstepBus, msg: can.Message, timeout: float | None = None) -> None:
        nonlocal met
        met = met or when(self.network)
        if met:
            act()
        real(self, msg, timeout)

    monkeypatch.setattr(LockstepBus, "send", send)


def under_way(network: Network) -> bool:
    return abs(angle(network)) > UNDER_WAY


def homed(session: Session, method: int = SEARCH, timeout: float = 20.0) -> Homed:
    return home(session, session.config.nodes[0], method, timeout=timeout)


# --- homing ----------------------------------------------------------------------------------


def test_a_search_finds_the_stop_with_the_whole_configuration_in_the_drive() -> None:
    session, network = opened()
    with session:
        assert homed(session).after_counts == 0
        node = session.config.nodes[0]
        assert angle(network) == pytest.approx(-STOP, abs=1e-6)
        assert session.bring_up().differences(node) == []
        watchdog = next(
            entry for entry in configuration(session.config, node) if entry.index == 0x1016
        )
        assert session.bring_up().sdo(node).get_int(0x1016, 1, DataType.UNSIGNED32) == (
            watchdog.value
        )
    assert not set(states(network)) & set(POWERED)


def test_the_heartbeat_is_never_late_while_the_drive_has_power() -> None:
    session, network = opened()
    with session:
        homed(session)
    beat = HEARTBEAT_BASE + session.config.master_id
    times = [at_ns for at_ns, frame in network.log or [] if frame.cob_id == beat]
    gaps = [after - before for before, after in pairwise(times)]
    assert max(gaps) <= MS * session.config.master_heartbeat_ms
    assert len(times) > 100


def test_a_drive_stops_by_itself_when_the_master_dies_in_mid_search(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    session, network = opened()

    def die() -> None:
        raise Gone

    disturb(monkeypatch, under_way, die)
    with pytest.raises(Gone):
        homed(session)
    assert states(network)[0] is DriveState.OPERATION_ENABLED
    there = angle(network)
    network.advance(network.now_ns + 200 * MS)
    assert not set(states(network)) & set(POWERED)
    assert abs(angle(network) - there) < RUN_ON
    monkeypatch.undo()
    session.close()


def test_a_search_that_takes_too_long_ends_by_quick_stop() -> None:
    session, network = opened()
    with session, pytest.raises(DriveError, match=r"has not ended within 0\.3 s"):
        homed(session, timeout=0.3)
    assert_led_out(network)


@pytest.mark.parametrize("error", [BusError, KeyboardInterrupt])
def test_a_search_ends_by_quick_stop_on_any_exception(
    error: type[BaseException], monkeypatch: pytest.MonkeyPatch
) -> None:
    session, network = opened()
    raised = False

    def fail() -> None:
        nonlocal raised
        if not raised:
            raised = True
            raise error

    disturb(monkeypatch, under_way, fail)
    with session, pytest.raises(error):
        homed(session)
    assert raised
    assert_led_out(network)


def assert_led_out(network: Network) -> None:
    """The first word after the search is quick stop, and the motor stood long before its end."""
    told = words(network, 1)
    assert told[told.index(0x1F) + 1 :][:1] == [0x02]
    assert not set(states(network)) & set(POWERED)
    assert UNDER_WAY < abs(angle(network)) < STOP - RUN_ON


def test_a_search_whose_drive_answers_no_more_is_stopped_by_its_watchdog(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    session, network = opened()
    real = LockstepBus.send

    def send(self: LockstepBus, msg: can.Message, timeout: float | None = None) -> None:
        """Requests are lost, the rest is not."""
        lost = under_way(network) and msg.arbitration_id == SDO_REQUEST_BASE + 1
        if not lost:
            real(self, msg, timeout)

    monkeypatch.setattr(LockstepBus, "send", send)
    with session, pytest.raises(DriveError, match="does not answer"):
        homed(session)
    assert not set(states(network)) & set(POWERED)
    assert abs(angle(network)) < UNDER_WAY + RUN_ON


@pytest.mark.parametrize(
    ("key", "said"), [((0x6065, 0), "6065"), ((0x6072, 0), "6072"), ((0x6085, 0), "6085")]
)
def test_a_search_needs_its_bounds_in_the_bus_file(key: tuple[int, int], said: str) -> None:
    full = searching_bus()
    bare = replace(
        full,
        nodes=tuple(
            replace(node, parameters=tuple(one for one in node.parameters if one.key != key))
            for node in full.nodes
        ),
    )
    session, network = opened(bare)
    with session, pytest.raises(ConfigError, match=said):
        homed(session)
    assert words(network, 1) == []


def test_a_search_that_is_too_fast_is_refused() -> None:
    full = searching_bus()
    fast = Parameter(index=0x6099, sub=1, kind=DataType.UNSIGNED32, value=10 * SPEED_COUNTS)
    nodes = tuple(replace(node, parameters=(*node.parameters, fast)) for node in full.nodes)
    session, network = opened(replace(full, nodes=nodes))
    with session, pytest.raises(ConfigError, match="the limit is 1 rad/s"):
        homed(session)
    assert words(network, 1) == []


@pytest.mark.parametrize(("sub", "what"), [(1, "a switch or stop"), (2, "zero")])
def test_a_search_without_a_speed_is_refused_as_it_would_never_end(sub: int, what: str) -> None:
    full = searching_bus()
    none = Parameter(index=0x6099, sub=sub, kind=DataType.UNSIGNED32, value=0)
    nodes = tuple(replace(node, parameters=(*node.parameters, none)) for node in full.nodes)
    session, network = opened(replace(full, nodes=nodes))
    with session, pytest.raises(ConfigError, match=f"has no speed to search {what} .*6099:0{sub}"):
        homed(session, method=17)
    assert words(network, 1) == []


@pytest.mark.parametrize("method", [0, 38, 99, -129])
def test_a_method_that_no_drive_has_is_refused_before_anything_is_sent(method: int) -> None:
    session, network = opened()
    with session, pytest.raises(ConfigError, match=f"method is {method}; .* 1 to 37, .* -128 to"):
        homed(session, method=method)
    assert not [frame for _, frame in network.log or [] if frame.cob_id > 0x600]


def test_a_method_that_this_drive_lacks_is_told_without_power() -> None:
    session, network = opened()
    with session, pytest.raises(DriveError, match=r"does not take homing method 36.*06090030h"):
        homed(session, method=36)
    assert words(network, 1) == []


def test_a_leg_can_be_jogged_after_homing() -> None:
    session, network = opened(starts=(0.0, 0.4))
    with session:
        homed(session, method=37)
    with Session(LockstepBus("leg", network=network), session.config) as session:
        jogged = jogged_by(session, 0.05)
    assert jogged == pytest.approx((0.05, 0.0), abs=1e-3)


# --- signals ---------------------------------------------------------------------------------


@pytest.mark.parametrize("name", SENDERS)
@pytest.mark.parametrize(
    "action",
    [
        ("jog", "--node", "motor1", "--by", "0.3", "--speed", "0.5"),
        ("home", "--node", "motor1", "--method", str(SEARCH)),
    ],
    ids=["jog", "home"],
)
def test_a_signal_stops_all_drives_before_the_command_ends(
    name: str,
    action: tuple[str, ...],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
) -> None:
    made: list[Network] = []

    def the_bench(config: BusConfig, _idle: object, *, configured: bool) -> Network:
        assert not configured
        stops = (-STOP, STOP)
        behaviours = [Behaviour(start_pos=start, hard_stop=stops) for start in (0.0, 0.9 * STOP)]
        made.append(emulate(config, behaviours, keep_log=True))
        return made[0]

    def send_signal() -> None:
        """At every frame from now on: a second one must not end the stop."""
        signal.raise_signal(SENDERS[name])

    monkeypatch.setattr(can_open, "emulate", the_bench)
    disturb(monkeypatch, under_way, send_signal)
    before = {number: signal.getsignal(number) for number in SENDERS.values()}
    status = main(["drives", *action, *bench(tmp_path)])
    assert status == 130
    assert capfd.readouterr().err == "legbench: interrupted\n"
    assert {number: signal.getsignal(number) for number in SENDERS.values()} == before
    (network,) = made
    assert not set(states(network)) & set(POWERED)
    assert UNDER_WAY < abs(angle(network)) < UNDER_WAY + RUN_ON
    told = words(network, 1)
    last_enabled = max(place for place, word in enumerate(told) if word & 0x0F == 0x0F)
    assert told[last_enabled + 1] == 0x02


def bench(folder: Path) -> tuple[str, ...]:
    """Flags of an emulated leg whose bus file has a speed for searches."""
    text = BUS.read_text(encoding="utf-8")
    speed = f'"6099:01 u32" = {SPEED_COUNTS}\n'
    changed = re.sub(r'"6099:01 u32" = .*\n', speed, text)
    assert changed.count(speed) == 2
    (folder / "leg.toml").write_text(changed, encoding="utf-8")
    shutil.copy(LIMITS, folder / "limits.toml")
    design = str(ROOT / "models" / "optimal.toml")
    bus = str(folder / "leg.toml")
    return ("--bus", bus, "--interface", "legbench", "--design", design)


# --- jogging ---------------------------------------------------------------------------------


def jogged_by(session: Session, by: float, limits: SafetyLimits | None = None) -> tuple[float, ...]:
    """How far each motor went."""
    chosen = limits or load_limits(LIMITS)
    done = jog(session, chosen, STIFFNESS, "motor1", by=by, speed=0.5, back=False)
    return tuple(b - a for a, b in zip(done.before_pos, done.after_pos, strict=True))


@pytest.mark.parametrize(
    ("starts", "said"),
    [
        ((0.0, -0.9), r"'motor2' stands at -0\.900 rad, the limits are \[-0\.8, 1\.1\] rad"),
        ((0.85, 0.0), r"'motor1' stands at 0\.850 rad, the limits are \[-1\.1, 0\.8\] rad"),
    ],
)
def test_a_jog_is_refused_while_any_motor_is_outside_its_range(
    starts: tuple[float, float], said: str
) -> None:
    session, network = opened(starts=starts)
    with session, pytest.raises(ConfigError, match=said):
        jogged_by(session, -0.1)
    assert [words(network, node) for node in (1, 2)] == [[], []]


@pytest.mark.parametrize(
    ("starts", "by", "said"),
    [
        (
            (0.0, 0.1),
            -0.1,
            r"the motors stand with q2 - q1 at 0\.100 rad, the limits are \[0\.2, 3\]",
        ),
        ((0.0, 0.4), 0.3, r"would take q2 - q1, the knee, from 0\.400 to 0\.100 rad"),
    ],
)
def test_a_jog_does_not_lead_the_knee_into_its_stop(
    starts: tuple[float, float], by: float, said: str
) -> None:
    session, network = opened(starts=starts)
    with session, pytest.raises(ConfigError, match=said):
        jogged_by(session, by)
    assert [words(network, node) for node in (1, 2)] == [[], []]


@pytest.mark.parametrize(
    "name",
    [
        *("command_speed", "command_step", "spring_torque", "following_error"),
        *("joint_speed", "standing", "sway"),
        *("motor_range", "joint_range"),
    ],
)
def test_a_jog_is_refused_without_complete_limits(name: str) -> None:
    limits = replace(load_limits(LIMITS), **{name: getattr(SafetyLimits(), name)})
    session, network = opened()
    with session, pytest.raises(ConfigError, match=name):
        jogged_by(session, 0.1, limits)
    assert network.log == []


def test_a_jog_is_refused_when_a_quick_stop_runs_on_too_far() -> None:
    session, network = opened()
    fast = replace(load_limits(LIMITS), command_speed=200.0)
    with session, pytest.raises(ConfigError, match=r"on its quick-stop ramp \(6085h\)"):
        jogged_by(session, 0.1, fast)
    assert network.log == []
