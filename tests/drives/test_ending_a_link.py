"""Who is stopped, parked and left alone when a link ends, in every state that it may be in."""

import itertools
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any, cast

import pytest
from drives_rig import config

from legbench.drives.errors import BusError
from legbench.drives.master import link_end, link_opening
from legbench.drives.master.link_end import LinkEnd, StopOnError
from legbench.drives.master.link_opening import LinkOpening
from legbench.drives.master.link_state import LinkState
from legbench.drives.master.link_status import LinkStatus
from legbench.drives.master.stop_report import StopReport
from legbench.errors import PlantFault

CALM, UNSURE = StopReport(), StopReport(silent=("hip",), errors=("no answer",))
MOVING = (LinkState.CYCLIC, LinkState.RUNNING, LinkState.STOPPING)


class Parts:
    """Parts of a link that only note what is asked of them."""

    def __init__(
        self,
        monkeypatch: pytest.MonkeyPatch,
        *,
        state: LinkState = LinkState.RUNNING,
        leads: bool = True,
        stranger: bool | BaseException = False,
        read_only: bool = False,
        report: StopReport = CALM,
        left: StopReport | None = None,
        parking: BaseException | None = None,
    ) -> None:
        self.asked: list[Any] = []
        self.status = LinkStatus(state=state, leads=leads)
        self.read_only, self.config = read_only, config()
        self.stranger = 0x080 if stranger is True else None
        self.channel = SimpleNamespace(release=lambda: self.asked.append("release"))
        self.port, self.cycle = "port", self
        self.bring_up = SimpleNamespace(pre_operational="order")
        self.other = "other"

        def led() -> bool:
            if isinstance(stranger, BaseException):
                raise stranger
            return stranger

        self.led_by_another = led

        def sequence(cycle: Any, hold: Callable[[BaseException], None], cycles_in: Any) -> Any:
            assert (cycle, cycles_in) == (self, self.config.cycles_in)

            def run() -> StopReport:
                self.asked.append(("stop", self.status.state))
                return report

            return SimpleNamespace(run=run)

        def leave(order: Any, port: Any, nodes: Any, stopped: Any, hold: Any) -> StopReport | None:
            assert (order, port, nodes) == ("order", "port", self.config.nodes)
            self.asked.append(("leave", stopped))
            return left

        def park(port: Any, bus: Any, other: Any, powered: Any) -> list[str]:
            assert (port, bus, other) == ("port", self.config, "other")
            self.asked.append(("park", tuple(powered)))
            if parking is not None:
                raise parking
            return ["hip is not parked"]

        monkeypatch.setattr(link_end, "StopSequence", sequence)
        monkeypatch.setattr(link_end, "leave_operational", leave)
        monkeypatch.setattr(link_end, "park", park)

    @property
    def end(self) -> LinkEnd:
        return LinkEnd(cast(Any, self))


STATES = tuple(LinkState)


@pytest.mark.parametrize("state", STATES)
@pytest.mark.parametrize(
    ("read_only", "leads", "stranger"), list(itertools.product((False, True), repeat=3))
)
def test_a_stop_reaches_drives_that_move_and_are_no_other_masters(
    state: LinkState,
    read_only: bool,
    leads: bool,
    stranger: bool,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    it = Parts(monkeypatch, state=state, read_only=read_only, leads=leads, stranger=stranger)
    it.end.stop()
    if state not in MOVING:
        assert (it.asked, it.status.state) == ([], state)
        return
    stops = not read_only and (leads or not stranger)
    assert it.asked == ([("stop", LinkState.STOPPING)] if stops else [])
    assert it.status.state is LinkState.STOPPED
    assert it.status.stopped == (CALM if stops else None)


def test_a_stop_that_is_not_verified_is_repeated(monkeypatch: pytest.MonkeyPatch) -> None:
    it = Parts(monkeypatch, report=UNSURE)
    end = it.end
    for count in (1, 2):
        end.stop()
        assert it.status.state is LinkState.STOPPING
        assert it.asked == [("stop", LinkState.STOPPING)] * count
    assert it.status.stopped == UNSURE


def test_the_first_fault_is_kept_and_every_fault_stops(monkeypatch: pytest.MonkeyPatch) -> None:
    it = Parts(monkeypatch, report=UNSURE)
    end = it.end
    first, second = PlantFault("sway", "it sways"), PlantFault("second master", "080h")
    for fault in (first, second):
        end.end(fault)
        assert it.status.fault is first
    assert len(it.asked) == 2


def test_an_error_in_a_cycle_stops_and_a_plain_end_does_not(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    it = Parts(monkeypatch)
    block = StopOnError(it.end)
    with block:
        assert it.asked == []
    assert it.asked == []
    with pytest.raises(ValueError, match="wrong"), block:
        raise ValueError("wrong")
    assert (it.asked, it.status.fault) == ([("stop", LinkState.STOPPING)], None)
    it = Parts(monkeypatch)
    fault = PlantFault("sway", "it sways")
    with pytest.raises(PlantFault), StopOnError(it.end):
        raise fault
    assert (it.asked, it.status.fault) == ([("stop", LinkState.STOPPING)], fault)


@pytest.mark.parametrize("state", STATES)
@pytest.mark.parametrize(
    ("read_only", "leads", "stranger", "listening"),
    list(itertools.product((False, True), repeat=4)),
)
def test_who_is_parked_and_who_is_left_alone(
    state: LinkState,
    read_only: bool,
    leads: bool,
    stranger: bool,
    listening: bool,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    it = Parts(monkeypatch, state=state, read_only=read_only, leads=leads, stranger=stranger)
    it.status.listening = listening
    end = it.end
    end.close()
    if state is LinkState.NEW:
        assert (it.asked, it.status.state) == ([], state)
        return
    stops = state in MOVING and not read_only and (leads or not stranger)
    looked = listening or state is LinkState.CONFIGURED
    leaves = not (stranger and not leads) and not (read_only and looked)
    parks = not read_only and not stranger
    wanted: list[Any] = [("stop", LinkState.STOPPING)] if stops else []
    wanted += [("leave", CALM if stops else None)] if leaves else []
    wanted += [("park", ())] if parks else []
    assert it.asked == [*wanted, "release"]
    assert it.status.not_parked == (["hip is not parked"] if parks else [])
    assert it.status.state is LinkState.STOPPED
    # A second time does nothing.
    end.close()
    assert len(it.asked) == len(wanted) + 1


def test_a_stop_over_sdo_at_the_end_is_told_with_the_first_one(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    it = Parts(monkeypatch, report=UNSURE, left=StopReport(powered=("knee",), states=("0237h",)))
    it.end.close()
    assert it.status.stopped is not None
    assert (it.status.stopped.powered, it.status.stopped.errors) == (("knee",), ("no answer",))
    # A drive that has kept its power is not parked; the stop is not verified.
    assert ("park", ("knee",)) in it.asked
    assert it.status.state is LinkState.STOPPING
    it = Parts(monkeypatch, report=UNSURE, left=CALM)
    it.end.close()
    assert it.status.state is LinkState.STOPPED


@pytest.mark.parametrize("error", [BusError("gone"), KeyboardInterrupt()])
def test_whatever_a_driver_raises_the_stop_goes_on_and_the_channel_is_released(
    error: BaseException, monkeypatch: pytest.MonkeyPatch
) -> None:
    it = Parts(monkeypatch, parking=error)
    held = pytest.raises(KeyboardInterrupt) if isinstance(error, KeyboardInterrupt) else None
    _close(it, held)
    assert it.status.not_parked == [f"the drives are not parked: {error!r}"]
    assert it.asked[-1] == "release"
    # Where it cannot be heard whether another master leads, what is known decides.
    for known in (None, 0x080):
        it = Parts(monkeypatch, leads=False, stranger=error)
        it.stranger = known
        _close(it, held and pytest.raises(KeyboardInterrupt))
        assert (("stop", LinkState.STOPPING) in it.asked) is (known is None)
        assert it.asked[-1] == "release"


def _close(it: Parts, held: Any) -> None:
    """Close a link; a ^C that was held back is raised at the end."""
    if held is None:
        it.end.close()
        return
    with held:
        it.end.close()


# --- its beginning ---------------------------------------------------------------------------


class Opening:
    """Parts of a link that is to be opened."""

    def __init__(
        self,
        monkeypatch: pytest.MonkeyPatch,
        *,
        read_only: bool = False,
        hears: bool = False,
        trouble: str = "",
    ) -> None:
        self.asked: list[Any] = []
        self.status, self.read_only = LinkStatus(), read_only
        self.config = config()
        self.limits = SimpleNamespace(command_speed=20.0)

        def note(name: str, answer: Any = None) -> Any:
            def call(*given: Any, **named: Any) -> Any:
                self.asked.append(name)
                if name == trouble:
                    raise BusError(name)
                return answer

            return call

        self.channel = SimpleNamespace(take=note("take"), release=note("release"))
        self.timebase = SimpleNamespace(now_ns=lambda: 7)
        self.port: Any = SimpleNamespace(timebase=self.timebase, listener=None, may_send=None)
        self.until_ns = 0

        def hears_sync(until_ns: int) -> bool:
            self.until_ns = until_ns
            return hears

        watches = [SimpleNamespace(expects_heartbeat=None) for _ in (0, 1)]
        self.cycle = SimpleNamespace(watches=watches, hears_sync=hears_sync)
        self.start_up = SimpleNamespace(listening=None)
        detector = SimpleNamespace(disarm=note("disarm"))
        self.bring_up = SimpleNamespace(
            detector=detector,
            listen=note("listen"),
            identify=note("identify"),
            refuse_differences=note("compare", {"hip": "of hip", "knee": "of knee"}),
        )
        self.supervisor = SimpleNamespace(check_no_other_master=note("other master"))
        for name in ("check_master_watch", "check_homed", "refuse_led", "read_temperatures"):
            monkeypatch.setattr(link_opening, name, note(name))
        outcomes = {"hip": "of hip", "knee": "of knee"}
        monkeypatch.setattr(link_opening, "prepare_to_move", note("prepare", outcomes))
        monkeypatch.setattr(link_opening, "unprotected", lambda found: tuple(found))
        monkeypatch.setattr(link_opening, "tells_heartbeat", lambda outcome: f"told {outcome}")
        monkeypatch.setattr(link_opening, "may_pace", lambda master: f"pace {master}")
        monkeypatch.setattr(link_opening, "may_read", "read")

    @property
    def opening(self) -> LinkOpening:
        return LinkOpening(cast(Any, self))


LEADING = ["check_master_watch", "take", "prepare", "read_temperatures"]
PACING = [
    *("take", "listen", "identify", "check_homed", "compare", "refuse_led", "other master"),
    "read_temperatures",
]
LISTENING = ["disarm", "identify", "check_homed", "compare", "read_temperatures"]


@pytest.mark.parametrize(
    ("read_only", "hears", "asked", "sends"),
    [
        (False, False, LEADING, None),
        (True, False, PACING, "pace 126"),
        (True, True, LISTENING, "read"),
    ],
)
def test_a_link_opens_by_itself_beside_a_master_or_without_one(
    read_only: bool,
    hears: bool,
    asked: list[str],
    sends: str | None,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    it = Opening(monkeypatch, read_only=read_only, hears=hears)
    opening = it.opening
    opening.show_frames_to(cast(Any, "log"))
    assert it.port.listener is None
    opening.run()
    assert it.asked == asked
    assert it.status.state is LinkState.CONFIGURED
    assert it.status.unprotected == ("hip", "knee")
    beats = [watch.expects_heartbeat for watch in it.cycle.watches]
    assert beats == ["told of hip", "told of knee"]
    # Frames are shown from when the drives are configured.
    assert (it.port.listener, it.port.may_send) == ("log", sends)
    assert (it.status.listening, it.start_up.listening) == (hears, hears if read_only else None)
    assert it.until_ns == (100_000_007 if read_only else 0)
    # What is open is left as it is; a listener is shown frames at once.
    opening.run()
    assert it.asked == asked
    opening.show_frames_to(cast(Any, "other"))
    assert it.port.listener == "other"


@pytest.mark.parametrize("trouble", ["take", "prepare", "read_temperatures"])
def test_a_link_that_does_not_open_gives_its_channel_back(
    trouble: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    it = Opening(monkeypatch, trouble=trouble)
    opening = it.opening
    opening.show_frames_to(cast(Any, "log"))
    with pytest.raises(BusError, match=trouble):
        opening.run()
    assert it.asked == [*LEADING[: LEADING.index(trouble) + 1], "release"]
    assert (it.status.state, it.port.listener) == (LinkState.NEW, None)


def test_a_link_that_shows_frames_to_nobody_opens_all_the_same(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    it = Opening(monkeypatch)
    it.opening.run()
    assert it.port.listener is None
