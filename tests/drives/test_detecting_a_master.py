"""Frames that only a master sends, of either drive, one by one; all others say nothing."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import can
import pytest
from drives_rig import MS, config, node

from legbench.drives.master.master_detector import MasterDetector
from legbench.drives.setup.config import CONTROLWORD, TARGET_POSITION, PdoConfig
from legbench.errors import PlantFault

SPLIT = (
    PdoConfig(number=1, objects=(CONTROLWORD,)),
    PdoConfig(number=2, objects=(TARGET_POSITION,)),
)
BUS = config(nodes=(node(0), replace(node(1), rpdos=SPLIT)), master_id=126)
ONLY_A_MASTERS = {
    0x000: "NMT order",
    0x080: "SYNC",
    0x7E5: "LSS request",
    0x77E: "heartbeat of master 126",
    0x601: "SDO request to 'hip'",
    0x602: "SDO request to 'knee'",
    0x201: "RPDO1 of 'hip'",
    0x202: "RPDO1 of 'knee'",
    0x302: "RPDO2 of 'knee'",
}
"""Predefined connection set (CiA 301, table 38) of nodes 1 and 2, and of master 126."""


def frame(cob_id: int, **how: Any) -> can.Message:
    return can.Message(arbitration_id=cob_id, data=b"\x05", is_extended_id=False, **how)


class Waiting:
    """A port with frames that wait, each of which takes 0.1 ms to be read."""

    def __init__(self, *messages: can.Message) -> None:
        self.messages = list(messages)
        self.time_ns = 0
        self.timebase = SimpleNamespace(now_ns=lambda: self.time_ns)

    def foreign(self, message: can.Message) -> bool:
        return message.is_rx

    def take(self) -> can.Message | None:
        if not self.messages:
            return None
        self.time_ns += MS // 10
        return self.messages.pop(0)


def detector(*messages: can.Message) -> MasterDetector:
    return MasterDetector(cast(Any, Waiting(*messages)), BUS)


def test_every_identifier_is_a_masters_or_says_nothing() -> None:
    for cob_id in range(1 << 11):
        it = detector()
        name = ONLY_A_MASTERS.get(cob_id)
        if name is None:
            it.check_frame(frame(cob_id))
            assert it.stranger is None
        else:
            with pytest.raises(PlantFault, match=rf"sends {cob_id:03X}h \({name}\), which only"):
                it.check_frame(frame(cob_id))
            assert it.stranger == cob_id
        # Heartbeats of nodes 1 to 127 are noted, unless they are the drives'.
        noted = {cob_id - 0x700} if 0x703 <= cob_id <= 0x77F else set()
        assert it.heard_nodes == noted
        # Error frames and those that this computer sent itself are nobody's.
        for other in (frame(cob_id, is_error_frame=True), frame(cob_id, is_rx=False)):
            silent = detector()
            silent.check_frame(other)
            assert (silent.stranger, silent.heard_nodes) == (None, set())


def test_who_leads_the_drives_hears_of_the_first_stranger_and_goes_on() -> None:
    it = detector()
    it.disarm()
    for cob_id in (0x181, 0x302, 0x080):
        it.check_frame(frame(cob_id))
    assert it.stranger == 0x302


@pytest.mark.parametrize("place", [0, 1])
def test_a_drive_that_watches_for_a_living_node_has_a_master(place: int) -> None:
    who = BUS.nodes[place]
    it = detector()
    it.check_consumer(who, 5 << 16 | 30)
    it.check_frame(frame(0x705))
    assert it.heard_nodes == {5}
    for consumer in (0, 5 << 16, 6 << 16 | 30, 4 << 16 | 30):
        it.check_consumer(who, consumer)
    assert it.stranger is None
    # Bits above the node id are reserved (CiA 301, 7.5.2.16).
    for consumer in (5 << 16 | 30, 5 << 16 | 1, 1 << 24 | 5 << 16 | 30):
        said = rf"705h \(the heartbeat that '{who.name}' watches for\)"
        with pytest.raises(PlantFault, match=said):
            it.check_consumer(who, consumer)
    assert it.stranger == 0x705


def test_frames_that_come_faster_than_they_are_read_are_taken_for_a_period() -> None:
    wanted = [frame(0x181) for _ in range(30)]
    it = detector(*wanted)
    # The eleventh is the first that ends later than one period of 1 ms.
    assert list(it.poll_frames()) == wanted[:11]
    assert list(it.poll_frames()) == wanted[11:22]
    assert list(it.poll_frames()) == wanted[22:]
    assert list(it.poll_frames()) == []


def test_what_a_master_sends_ends_the_look_before_it_is_passed_on() -> None:
    frames = detector(frame(0x181), frame(0x080), frame(0x182)).poll_frames()
    assert next(frames).arbitration_id == 0x181
    with pytest.raises(PlantFault, match="080h"):
        next(frames)
