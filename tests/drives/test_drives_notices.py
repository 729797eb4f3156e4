"""What ends no run and is told all the same: events of a run."""

from pathlib import Path

import pytest
from can_rig import BUS, LIMITS, ROOT
from drives_rig import rig

from legbench.commissioning.fault_table import FaultTrial
from legbench.commissioning.fault_trial import try_fault
from legbench.control import BangBangConfig
from legbench.design import load_design
from legbench.design.setup import Setup, SetupKind
from legbench.drives.emulated.faults import (
    FrameFault,
    FrameFaultKind,
    NodeFault,
    NodeFaultKind,
)
from legbench.drives.protocol.frame import Frame
from legbench.drives.setup.bus_file import load_limits
from legbench.experiment import Experiment, record
from legbench.metrics import summarise
from legbench.plants import AnalyticChoice, SimChoice
from legbench.recording.reader import load


@pytest.mark.parametrize("node_id", [1, 2])
def test_a_warning_is_told_with_its_drive_and_its_first_time(tmp_path: Path, node_id: int) -> None:
    with rig(tmp_path) as it:
        it.link.start()
        it.run(5)
        begun_ns = it.network.now_ns
        it.network.inject(
            NodeFault(
                kind=NodeFaultKind.WARNING,
                node_id=node_id,
                start_ns=begun_ns,
                end_ns=begun_ns + 10_000_000,
            )
        )
        it.run(30)
        name = ("hip", "knee")[node_id - 1]
        told = it.link.cycle.notices.events
        assert list(told) == [f"warning of drive {name}"]
        assert told[f"warning of drive {name}"]["count"] == 10
        assert 0.0 <= told[f"warning of drive {name}"]["first"] - 1e-9 * begun_ns < 3e-3


def test_a_node_that_answers_twice_is_told(tmp_path: Path) -> None:
    with rig(tmp_path) as it:
        it.link.start()
        it.run(5)
        begun_ns = it.network.now_ns
        for delay_us in (10, 400):
            it.network.inject(
                FrameFault(
                    kind=FrameFaultKind.DUPLICATE,
                    cob_id=0x182,
                    start_ns=begun_ns,
                    end_ns=begun_ns + 5_000_000,
                    delay_ns=1000 * delay_us,
                )
            )
        it.run(20)
        event = it.link.cycle.notices.events["node answered twice"]
        assert event["cob_id"] == 0x182
        log = it.network.log or []
        heard = sum(frame.cob_id == 0x182 and at_ns > begun_ns for at_ns, frame in log)
        assert event["count"] == heard - 20 >= 8


@pytest.mark.parametrize(("command", "told"), [(0x2F, True), (0x40, False)])
def test_somebody_else_who_writes_is_told_and_who_reads_is_not(
    tmp_path: Path, command: int, told: bool
) -> None:
    with rig(tmp_path) as it:
        it.link.start()
        other = it.network.attach()
        it.run(5)
        it.network.send(other, Frame(0x602, bytes((command, 0x60, 0x60, 0, 8, 0, 0, 0))))
        it.run(5)
        events = it.link.cycle.notices.events
        assert ("foreign SDO write" in events) == told
        if told:
            event = events["foreign SDO write"]
            assert (event["count"], event["node"], event["object"]) == (1, 2, "6060h:00")


def test_a_quiet_bus_has_nothing_to_tell(tmp_path: Path) -> None:
    with rig(tmp_path) as it:
        it.link.start()
        it.run(50)
        assert it.link.cycle.notices.events == {}


def test_events_of_drives_are_in_the_recording(tmp_path: Path) -> None:
    design = load_design(ROOT / "models" / "optimal.toml")
    fault = NodeFault(kind=NodeFaultKind.WARNING, node_id=1, start_ns=1_000_000_000)
    trial = FaultTrial(name="drive warns", faults=(fault,))
    result = try_fault(trial, BUS, design, tmp_path)
    assert result.status == "complete"
    assert result.cause is None


@pytest.mark.parametrize("kind", [SimChoice, AnalyticChoice])
def test_a_run_beyond_the_limits_says_that_it_ran_something_else(
    tmp_path: Path, kind: type[SimChoice | AnalyticChoice]
) -> None:
    chosen = Experiment(
        design=load_design(ROOT / "models" / "optimal.toml"),
        controller=BangBangConfig(z2=1.8, dz2=0.2),
        setup=Setup(kind=SetupKind.HFTS),
        duration=0.6,
        plant=kind(limits=load_limits(LIMITS)),
    )
    recording = load(record(chosen, tmp_path).path)
    (event,) = [event for event in recording.events if event["name"] == "limited"]
    assert event["first"] == pytest.approx(0.1)
    assert min(event["clamped"]) > 50
    assert event["of"] == 600
    summary = summarise(recording)
    # The last command is seen in no row.
    assert summary.limited_cycles in (event["cycles"], event["cycles"] - 1)
    assert summary.limited_max == pytest.approx(event["worst"])
    assert summary.limited_max[0] > 0.2
