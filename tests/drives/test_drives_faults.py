"""Every fault, injected in mid-motion: found, both drives stopped, nothing beyond the limits."""

import math
from pathlib import Path
from typing import Any

import pytest
from drives_rig import MS, START, Rig, rig

from legbench.drives.emulated.faults import (
    Babble,
    Fault,
    FrameFault,
    FrameFaultKind,
    NodeFault,
    NodeFaultKind,
)
from legbench.drives.protocol.cia402 import Controlword, DriveState
from legbench.errors import PlantFault

OE = DriveState.OPERATION_ENABLED
POWERED = (OE, DriveState.QUICK_STOP_ACTIVE, DriveState.FAULT_REACTION_ACTIVE)
AFTER = 40
"""Cycles of motion before a fault strikes."""


def wave(cycle: int) -> tuple[float, float]:
    """A motion that is fast enough to hurt."""
    return START[0] + 0.2 * math.sin(0.05 * cycle), START[1] - 0.2 * math.sin(0.05 * cycle)


def move_until_fault(it: Rig, cycles: int = 400) -> tuple[PlantFault, int]:
    for cycle in range(cycles):
        try:
            it.link.command(wave(cycle))
            it.link.exchange()
        except PlantFault as error:
            return error, cycle
    pytest.fail("not detected")


def strike(it: Rig, **what: Any) -> None:
    start_ns = it.network.now_ns + AFTER * MS
    kind = what["kind"]
    it.network.inject(
        NodeFault(start_ns=start_ns, **what)
        if isinstance(kind, NodeFaultKind)
        else FrameFault(start_ns=start_ns, **what)
    )


NODE, FRAME = NodeFaultKind, FrameFaultKind
CASES = [
    ({"kind": FRAME.DROP, "cob_id": 0x181}, "process data lost", 4),
    ({"kind": FRAME.DROP, "cob_id": 0x080}, "process data lost", 4),
    ({"kind": FRAME.DROP, "cob_id": None}, "process data lost", 4),
    ({"kind": FRAME.WRONG_LENGTH, "cob_id": 0x182, "length": 7}, "process data lost", 4),
    ({"kind": FRAME.DELAY, "cob_id": 0x181, "delay_ns": 400_000}, "process data lost", 4),
    ({"kind": FRAME.BAD_BITS, "cob_id": 0x201}, "bus off", 4),
    ({"kind": FRAME.BAD_BITS, "cob_id": 0x181}, "process data lost", 5),
    ({"kind": FRAME.DROP, "cob_id": 0x202}, "drive emergency", 7),
    ({"kind": FRAME.WRONG_LENGTH, "cob_id": 0x202, "length": 5}, "drive emergency", 3),
    ({"kind": FRAME.DROP, "cob_id": 0x77E}, "drive emergency", 45),
    ({"kind": NODE.HEARTBEAT_LOSS, "node_id": 2}, "heartbeat lost", 85),
    ({"kind": NODE.UNDER_VOLTAGE, "node_id": 1}, "drive emergency", 3),
    ({"kind": NODE.OVER_TEMPERATURE, "node_id": 2}, "drive emergency", 3),
    ({"kind": NODE.RESET, "node_id": 1}, "process data lost", 5),
    ({"kind": NODE.BUS_OFF, "node_id": 1}, "process data lost", 5),
    ({"kind": NODE.SILENT, "node_id": 2}, "process data lost", 5),
]


@pytest.mark.parametrize(("what", "cause", "within"), CASES)
def test_every_fault_is_found_in_time_and_both_drives_stop(
    tmp_path: Path, what: dict[str, object], cause: str, within: int
) -> None:
    with rig(tmp_path) as it:
        it.link.start()
        strike(it, **what)
        error, cycle = move_until_fault(it)
        assert error.cause == cause
        assert AFTER - 2 <= cycle <= AFTER + within
        it.link.close()
        it.network.advance(it.network.now_ns + 100 * MS)
        assert all(state not in POWERED for state in it.states)
        for drive, (low, high) in zip(it.network.drives, ((-2.0, 1.0), (0.0, 3.0)), strict=True):
            assert low <= drive.axis.motion.angle <= high
        assert it.link.fault is error


@pytest.mark.parametrize(("what", "cause", "within"), CASES)
def test_no_drive_is_left_alone(
    tmp_path: Path, what: dict[str, object], cause: str, within: int
) -> None:
    """Quick stop of both is tried in the cycle of the detection, whatever else has failed."""
    with rig(tmp_path) as it:
        it.link.start()
        strike(it, **what)
        move_until_fault(it)
        first: dict[int, int] = {}
        for at_ns, sender, word in it.words():
            if word in (Controlword.QUICK_STOP, Controlword.DISABLE_VOLTAGE) and at_ns > 330 * MS:
                first.setdefault(sender, at_ns)
        if cause != "bus off" and what["kind"] is not FRAME.DROP:
            assert set(first) == {1, 2}
            assert abs(first[1] - first[2]) < MS


def test_a_duplicated_frame_does_no_harm(tmp_path: Path) -> None:
    with rig(tmp_path) as it:
        it.link.start()
        for cob_id in (0x181, 0x202, 0x701):
            strike(it, kind=FrameFaultKind.DUPLICATE, cob_id=cob_id, delay_ns=30_000)
        for cycle in range(200):
            it.link.command(wave(cycle))
            it.link.exchange()
        assert it.states == [OE, OE]


def test_a_babbling_node_is_found(tmp_path: Path) -> None:
    with rig(tmp_path) as it:
        it.link.start()
        start_ns = it.network.now_ns + AFTER * MS
        fault: Fault = Babble(
            cob_id=0x001, start_ns=start_ns, end_ns=start_ns + 50 * MS, every_ns=100_000
        )
        it.network.inject(fault)
        error, _ = move_until_fault(it)
        assert error.cause == "process data lost"
        it.network.advance(it.network.now_ns + 200 * MS)
        assert all(state not in POWERED for state in it.states)


@pytest.mark.parametrize("silence_ms", [60])
def test_a_frozen_or_killed_master_stops_the_drives(tmp_path: Path, silence_ms: int) -> None:
    with rig(tmp_path) as it:
        it.link.start()
        for cycle in range(AFTER):
            it.link.command(wave(cycle))
            it.link.exchange()
        assert it.states == [OE, OE]
        held = it.angles
        it.network.advance(it.network.now_ns + silence_ms * MS)
        assert all(state not in POWERED for state in it.states)
        # SIGCONT: the master finds out at its next step, and does not chase the lost time.
        it.link.command(wave(AFTER))
        with pytest.raises(PlantFault, match="missed in a row"):
            it.link.exchange()
        assert it.angles == pytest.approx(held, abs=0.02)


def test_bus_off_of_the_master_is_named(tmp_path: Path) -> None:
    with rig(tmp_path) as it:
        it.link.start()
        strike(it, kind=FrameFaultKind.BAD_BITS, cob_id=0x080)
        error, _ = move_until_fault(it)
        assert error.cause == "bus off"
        assert "left the bus" in str(error)
        it.network.advance(it.network.now_ns + 100 * MS)
        assert all(state not in POWERED for state in it.states)


def test_a_single_broken_frame_is_sent_again(tmp_path: Path) -> None:
    with rig(tmp_path) as it:
        it.link.start()
        now_ns = it.network.now_ns
        for cob_id in (0x080, 0x181, 0x202):
            it.network.inject(
                FrameFault(
                    kind=FrameFaultKind.BAD_BITS,
                    cob_id=cob_id,
                    start_ns=now_ns + AFTER * MS,
                    end_ns=now_ns + AFTER * MS + 800_000,
                )
            )
        for cycle in range(150):
            it.link.command(wave(cycle))
            it.link.exchange()
        assert it.link.cycle.error_frames > 0
        assert it.states == [OE, OE]


def test_a_stale_answer_never_passes_for_a_new_one(tmp_path: Path) -> None:
    with rig(tmp_path) as it:
        it.link.start()
        now_ns = it.network.now_ns // MS * MS
        it.network.inject(
            FrameFault(
                kind=FrameFaultKind.DELAY,
                cob_id=0x181,
                delay_ns=400_000,
                start_ns=now_ns + 10 * MS,
                end_ns=now_ns + 11 * MS,
            )
        )
        fresh = []
        for cycle in range(30):
            it.link.command(wave(cycle))
            fresh.append(it.link.exchange().fresh[0])
        assert fresh.count(False) == 1
        assert it.link.cycle.late_frames == 1
