"""What is counted without ending a run: every statusword, every SDO request of a stranger."""

from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any, cast

import can
import pytest
from drives_rig import MS, node

from legbench.drives.errors import DriveError
from legbench.drives.master.axis_link import AxisLink
from legbench.drives.master.enabling import enable
from legbench.drives.master.link_parts import LinkParts
from legbench.drives.master.link_state import LinkState
from legbench.drives.master.link_status import LinkStatus
from legbench.drives.master.notices import Notices
from legbench.drives.master.stop_report import StopReport
from legbench.drives.master.tick import Tick
from legbench.drives.master.ticks import Ticks
from legbench.drives.protocol.cia402 import Goal
from legbench.errors import PlantFault

WARNING, LIMIT = 1 << 7, 1 << 11
"""Bits 7 and 11 of 6041h (CiA 402-2, table 29)."""


def axes(*words: int, fresh: tuple[bool, bool] = (True, True)) -> list[AxisLink]:
    found = [AxisLink(node(place)) for place in (0, 1)]
    for axis, word, new in zip(found, words, fresh, strict=True):
        axis.statusword, axis.fresh = word, new
    return found


def test_a_warning_and_an_internal_limit_of_either_drive_are_counted() -> None:
    names = ("hip", "knee")
    for words in ((0x0237 | WARNING, 0x0237), (0x0237, 0x0237 | LIMIT), (WARNING | LIMIT, LIMIT)):
        notices = Notices()
        for cycle in range(3):
            notices.statuswords(axes(*words), (5 + cycle) * MS)
        wanted = {}
        for name, word in zip(names, words, strict=True):
            for kind, bit in (("warning", WARNING), ("internal limit", LIMIT)):
                if word & bit:
                    first = pytest.approx(0.005)
                    wanted[f"{kind} of drive {name}"] = dict(count=3, first=first, statusword=word)
        assert notices.events == wanted


def test_every_other_bit_and_words_of_an_earlier_cycle_are_no_notice() -> None:
    quiet = 0xFFFF & ~(WARNING | LIMIT)
    notices = Notices()
    notices.statuswords(axes(quiet, quiet), MS)
    notices.statuswords(axes(0xFFFF, 0xFFFF, fresh=(False, False)), MS)
    assert notices.events == {}
    notices.statuswords(axes(0xFFFF, 0xFFFF, fresh=(False, True)), MS)
    assert set(notices.events) == {"warning of drive knee", "internal limit of drive knee"}


def test_the_detail_of_the_first_is_kept_and_all_are_counted() -> None:
    notices = Notices()
    for number in range(3):
        notices.note("thing", (2 + number) * MS, number=number)
    assert notices.events == {"thing": {"count": 3, "first": pytest.approx(0.002), "number": 0}}
    message = can.Message(arbitration_id=0x182, data=b"", is_extended_id=False)
    notices.answered_twice(message, 7 * MS)
    assert notices.events["node answered twice"] == {
        "count": 1,
        "first": pytest.approx(0.007),
        "cob_id": 0x182,
    }


def test_requests_that_write_are_told_from_those_that_read() -> None:
    # Client command specifiers (CiA 301, 7.2.4.3): 0 download segment, 1 initiate download,
    # 6 block download; 2 and 3 upload, 4 abort, 5 block upload, 7 reserved.
    for specifier in range(8):
        for low in (0, 0x1F):
            notices = Notices()
            data = bytes((specifier << 5 | low, 0x40, 0x60, 0x02)) + bytes(4)
            notices.sdo_request(can.Message(arbitration_id=0x602, data=data), 2, 9 * MS)
            told = {"count": 1, "first": pytest.approx(0.009), "node": 2, "object": "6040h:02"}
            assert notices.events == ({"foreign SDO write": told} if specifier in (0, 1, 6) else {})
    notices = Notices()
    notices.sdo_request(can.Message(arbitration_id=0x602, data=bytes(7)), 2, MS)
    assert notices.events == {}


# --- the status of a link --------------------------------------------------------------------


def test_a_new_link_has_done_nothing() -> None:
    status = LinkStatus()
    assert (status.state, status.fault, status.stopped) == (LinkState.NEW, None, None)
    assert (status.not_parked, status.listening, status.leads) == ([], False, False)
    assert status.unprotected == ()


def test_a_stop_is_joined_with_the_one_before_and_counts_once_it_is_verified() -> None:
    status = LinkStatus(state=LinkState.STOPPING)
    failed = StopReport(powered=("hip",), silent=(), errors=("no answer",))
    status.note(failed)
    assert (status.stopped, status.state) == (failed.after(None), LinkState.STOPPING)
    done = StopReport(powered=(), silent=(), errors=())
    status.note(done)
    assert (status.stopped, status.state) == (done.after(failed), LinkState.STOPPED)
    assert status.stopped is not None
    assert "no answer" in str(status.stopped.errors)


@dataclass
class Ticking:
    """The parts that a tick asks, in their order."""

    listening: bool
    asked: list[str] = field(default_factory=list[str])

    def parts(self) -> LinkParts:
        def answering(name: str, skipped: int) -> Any:
            def answer() -> Tick:
                self.asked.append(name)
                return Tick(MS, 0, skipped, 0, True)

            return answer

        note = self.asked.append
        supervisor = SimpleNamespace(
            check_no_other_master=lambda: note("other master"),
            bus=lambda tick: note(f"bus {tick.skipped}"),
            drives=lambda: note("drives"),
        )
        cycle = SimpleNamespace(
            follow=answering("follow", 3),
            tick=answering("tick", 2),
            sync=lambda: note("sync"),
            answers=answering("answers", 2),
        )
        status = LinkStatus(listening=self.listening)
        return cast(Any, SimpleNamespace(cycle=cycle, supervisor=supervisor, status=status))


@pytest.mark.parametrize(
    ("listening", "ways", "skipped"),
    [(False, ("tick", "sync work answers"), 2), (True, ("follow", "follow"), 3)],
)
def test_a_tick_is_its_own_or_the_masters_and_is_watched(
    listening: bool, ways: tuple[str, str], skipped: int
) -> None:
    it = Ticking(listening)
    ticks = Ticks(it.parts(), lambda: it.asked.append("work"))
    assert (ticks.last, ticks.skipped_total) == (Tick(0, 0, 0, 0, False), 0)
    assert ticks.settling() == ticks.last == Tick(MS, 0, skipped, 0, True)
    assert it.asked == [ways[0], "other master"]
    assert ticks.skipped_total == skipped
    it.asked.clear()
    assert ticks.watched() == ticks.last
    assert it.asked == [*ways[1].split(), f"bus {skipped}", "drives"]
    assert ticks.skipped_total == 2 * skipped


def test_what_the_drives_answer_is_taken_though_the_work_meanwhile_raises() -> None:
    it, found = Ticking(False), PlantFault("joint encoder", "it contradicts its springs")

    def work() -> None:
        raise found

    ticks = Ticks(it.parts(), work)
    with pytest.raises(PlantFault) as caught:
        ticks.watched()
    assert caught.value is found
    assert it.asked == ["sync", "answers"]
    assert (ticks.last, ticks.skipped_total) == (Tick(MS, 0, 2, 0, True), 2)


def test_a_fault_found_meanwhile_is_the_first_one_though_the_answers_are_interrupted() -> None:
    found, before = PlantFault("joint encoder", "it contradicts"), PlantFault("sway", "it sways")

    def work() -> None:
        raise found

    def interrupted() -> Tick:
        raise KeyboardInterrupt

    for first, kept in ((None, found), (before, before)):
        parts = Ticking(False).parts()
        cast(Any, parts.cycle).answers = interrupted
        parts.status.fault = first
        with pytest.raises(KeyboardInterrupt):
            Ticks(parts, work).watched()
        assert parts.status.fault is kept


# --- enabling --------------------------------------------------------------------------------


class Enabling:
    """Parts of a link, some of whose drives are in fault until they are reset."""

    def __init__(self, faulted: int, *, heals: bool) -> None:
        self.asked: list[Any] = []
        self.faults = [SimpleNamespace(node=node(place)) for place in range(faulted)]
        self.status = LinkStatus(state=LinkState.CYCLIC)

        def seek(goal: Goal, axes: list[Any], tick: Any, words: str) -> None:
            self.asked.append(("seek", goal, len(axes), words))
            if heals:
                self.faults.clear()

        note = self.asked.append
        self.start_up = SimpleNamespace(
            seek=seek, faulted=lambda: list(self.faults), enable=lambda tick: note("enable")
        )
        self.bring_up = SimpleNamespace(error_text=lambda node: f"3220h of {node.name}")
        self.motion = SimpleNamespace(
            sample=lambda tick: ("sample", tick),
            check=lambda sample: note(("check", sample)),
            begin=lambda: note(("begin", self.status.state)),
            led_pos=(0.25, 0.5),
        )
        self.guard = SimpleNamespace(check_start=lambda at: note(("stands at", at)))

    def run(self, *, clear_faults: bool) -> None:
        ticks = SimpleNamespace(watched=None, last="tick")
        enable(
            cast(Any, self),
            cast(Any, ticks),
            cast(Any, self.motion),
            cast(Any, self.guard),
            clear_faults=clear_faults,
        )


ENABLED = [
    ("check", ("sample", "tick")),
    ("stands at", (0.25, 0.5)),
    "enable",
    ("begin", LinkState.CYCLIC),
]
RESET = ("seek", Goal.FAULT_RESET, 2, "leave its fault, whose cause still stands")


@pytest.mark.parametrize("clear_faults", [False, True])
def test_drives_are_looked_at_before_they_are_enabled_and_led_from_then_on(
    clear_faults: bool,
) -> None:
    it = Enabling(2 if clear_faults else 0, heals=True)
    it.run(clear_faults=clear_faults)
    assert it.asked == [*([RESET] if clear_faults else []), *ENABLED]
    assert (it.status.leads, it.status.state) == (True, LinkState.RUNNING)


@pytest.mark.parametrize("clear_faults", [False, True])
def test_a_drive_in_fault_is_not_enabled_but_is_this_links_to_stop(clear_faults: bool) -> None:
    it = Enabling(2, heals=False)
    words = r"'hip' \(node 1\) is in fault: 3220h of hip; .*drives reset --node hip"
    with pytest.raises(DriveError, match=words):
        it.run(clear_faults=clear_faults)
    assert it.asked == ([RESET] if clear_faults else [])
    assert (it.status.leads, it.status.state) == (True, LinkState.CYCLIC)
