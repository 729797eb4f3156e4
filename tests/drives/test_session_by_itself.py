"""A session by itself: whose log, whose channel, and what an exception on its way is told."""

from types import SimpleNamespace
from typing import Any, cast

import can
import pytest
from drives_rig import config

from legbench.drives.emulated.build import emulate
from legbench.drives.emulated.bus import LockstepBus
from legbench.drives.errors import BusError
from legbench.drives.master.session import Session
from legbench.drives.master.stop_report import StopReport


def emulated() -> Session:
    return Session(LockstepBus("leg", network=emulate(config())), config())


def test_every_link_shows_its_frames_to_the_log() -> None:
    seen: list[object] = []
    log = SimpleNamespace(close=lambda: None, write=lambda _: None)
    with emulated() as it:
        links = [SimpleNamespace(show_frames_to=seen.append) for _ in range(2)]
        it._links.extend(cast(Any, links))
        it.log_to(cast(Any, log))
        assert seen == [it.log, it.log]
        assert it.log is not None


def test_a_channel_has_one_master_but_an_emulated_one_is_its_own() -> None:
    with emulated() as first, emulated() as second:
        first.hold()
        second.hold()
    buses = [can.Bus(interface="virtual", channel="one master") for _ in range(2)]
    with Session(buses[0], config()) as first, Session(buses[1], config()) as second:
        first.hold()
        first.hold()
        assert first._lock.held
        with pytest.raises(BusError, match="has a master"):
            second.hold()


def test_an_exception_on_its_way_is_told_of_every_drive_that_keeps_its_power() -> None:
    reports = [
        StopReport(powered=("hip",), states=("operation enabled",)),
        None,
        StopReport(),
        StopReport(silent=("knee",)),
    ]

    def fail() -> None:
        with emulated() as it:
            for report in reports:
                it.register(cast(Any, SimpleNamespace(stopped=report, close=lambda: None)))
            raise BusError("gone")

    with pytest.raises(BusError, match="gone") as caught:
        fail()
    notes = caught.value.__notes__
    assert [note.split(" ")[1] for note in notes] == ["'hip'", "'knee'"]
    assert notes[0].endswith(
        "keeps its power after the stop (operation enabled): switch its power off"
    )
