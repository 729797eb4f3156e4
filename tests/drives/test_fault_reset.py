"""Fault reset by command: one edge, and only where the cause is gone."""

import pytest
from service_rig import FAULT, MS, SOD, controlwords, opened, states

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
