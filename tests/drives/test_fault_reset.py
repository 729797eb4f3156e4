"""Fault reset by command: one edge, and only where the cause is gone."""

from typing import Any

import pytest
from service_rig import BENCH, FAULT, MS, SOD, controlwords, opened, states

from legbench.commissioning import reset as reset_module
from legbench.commissioning.reset import reset
from legbench.drives.emulated.drive import OVER_TEMPERATURE, UNDER_VOLTAGE, EmulatedDrive
from legbench.drives.protocol.cia402 import DriveState


def test_one_rising_edge_resets_a_fault_whose_cause_is_gone() -> None:
    session, network = opened()
    network.drives[0].trip(UNDER_VOLTAGE, network.now_ns)
    network.drives[0].clear_trip(UNDER_VOLTAGE)
    with session:
        done = reset(session, session.config.nodes)
    assert [(one.node, one.in_fault) for one in done] == [("motor1", False), ("motor2", False)]
    assert done[0].error == "3220h under-voltage"
    assert done[0].before.startswith("0208h: fault")
    assert "switch on disabled" in done[0].after
    assert done[1].error == ""
    assert states(network) == [SOD, SOD]
    # Bit 7 rises once, after it has been low, and falls again; the other drive is told nothing.
    assert controlwords(network, 1) == [0x00, 0x80, 0x00]
    assert controlwords(network, 2) == []


def test_a_fault_whose_cause_is_there_stays_and_is_reset_once_only() -> None:
    session, network = opened()
    network.drives[1].trip(OVER_TEMPERATURE, network.now_ns)
    with session:
        done = reset(session, session.config.nodes)
    assert [one.in_fault for one in done] == [False, True]
    assert done[1].error == "4310h drive over-temperature"
    assert states(network) == [SOD, FAULT]
    assert controlwords(network, 2).count(0x80) == 1


def test_a_fault_that_comes_back_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    session, network = opened()
    drive = network.drives[0]
    drive.trip(UNDER_VOLTAGE, network.now_ns)
    drive.clear_trip(UNDER_VOLTAGE)
    real = EmulatedDrive.tick
    left: list[int] = []

    def tick(self: EmulatedDrive, now_ns: int) -> float:
        """The drive is well for 50 ms, then finds its supply too low again."""
        if self is drive and self.axis.power.state is SOD:
            left.append(now_ns)
            if now_ns - left[0] > 50 * MS:
                self.trip(UNDER_VOLTAGE, now_ns)
        return real(self, now_ns)

    monkeypatch.setattr(EmulatedDrive, "tick", tick)
    with session:
        done = reset(session, session.config.nodes[:1])
    assert left
    assert done[0].in_fault
    assert controlwords(network, 1) == [0x00, 0x80, 0x00]


def test_a_drive_with_power_is_stopped_before_another_one_is_reset() -> None:
    session, network = opened()
    network.drives[0].trip(UNDER_VOLTAGE, network.now_ns)
    network.drives[0].clear_trip(UNDER_VOLTAGE)
    network.drives[1].axis.power.state = DriveState.OPERATION_ENABLED
    with session:
        reset(session, session.config.nodes)
    assert states(network) == [SOD, SOD]


class Clocked:
    """A session, its drives and their time: each statusword is shown from its time on [ms]."""

    def __init__(self, shown: dict[int, int]) -> None:
        self.shown, self.at_ns = shown, 0
        self.timebase = self
        self.puts: list[tuple[float, int, int]] = []

    def now_ns(self) -> int:
        return self.at_ns

    def wait_until(self, at_ns: int) -> None:
        self.at_ns = max(self.at_ns, at_ns)

    def sdo(self, _node: object) -> "Clocked":
        return self

    def put(self, index: int, sub: int, _kind: object, value: int) -> None:
        assert sub == 0
        self.puts.append((self.at_ns / MS, index, value))

    def get_int(self, index: int, sub: int, _kind: object) -> int:
        assert (index, sub) == (0x6041, 0)
        return self.shown[max(begin for begin in self.shown if begin <= self.at_ns / MS)]


@pytest.mark.parametrize(
    ("shown", "back_ms", "end_ms", "word"),
    [
        ({0: 0x0208, 15: 0x0240}, 20, 220, 0x0240),  # Gone: watched for 200 ms.
        ({0: 0x0208, 501: 0x0240}, 505, 705, 0x0240),  # Seen within 5 ms.
        ({0: 0x021F, 501: 0x0240}, 505, 705, 0x0240),  # Its reaction is a fault, too.
        ({0: 0x0208}, 1020, 1020, 0x0208),  # Waited for one second, no longer.
        ({0: 0x0208, 15: 0x0240, 151: 0x0208}, 20, 155, 0x0208),  # It comes back.
        ({0: 0x0208, 15: 0x0240, 151: 0x021F}, 20, 155, 0x021F),
    ],
)
def test_the_bit_is_low_then_high_for_10_ms_and_the_drive_is_watched(
    shown: dict[int, int], back_ms: int, end_ms: int, word: int
) -> None:
    it: Any = Clocked(shown)
    assert reset_module._edge(it, it, BENCH.nodes[0]) == word
    # Bit 7 of the controlword rises once (CiA 402-2, transition 15).
    assert it.puts == [(0, 0x6040, 0x00), (10, 0x6040, 0x80), (back_ms, 0x6040, 0x00)]
    assert it.at_ns == end_ms * MS
