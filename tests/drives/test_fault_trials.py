"""The trials of faults and of dead parts: what strikes in each, what counts as safe, who waits."""

import signal
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast, final

import numpy as np
import pytest
from can_rig import BUS, MS, ROOT

from legbench.commissioning import dead_part_stage as stage_module
from legbench.commissioning import fault_trial
from legbench.commissioning.broken_plant import Part
from legbench.commissioning.dead_part_stage import Bench, Death, Emulation, _with_encoders, staged
from legbench.commissioning.fault_table import TRIALS, FaultTrial
from legbench.commissioning.fault_trial import Result
from legbench.control import JumpConfig
from legbench.design import load_design
from legbench.drives.emulated.faults import Babble, Fault, FrameFault, NodeFault
from legbench.drives.protocol.cia402 import DriveState
from legbench.drives.setup.bus_file import load_bus
from legbench.experiment import Experiment, start_of
from legbench.loop import Outcome
from legbench.servo import ServoConfig

STRIKE = 1000
"""Half a second into a run, on the clock of the bus [ms]."""
FOREVER = None
# COB-IDs of CiA 301's predefined connection set: SYNC, first PDOs of nodes 1 and 2, heartbeat of
# the master, which is node 7Eh.
SYNC, ANSWER_1, ANSWER_2, COMMAND_1, COMMAND_2, HEARTBEAT = 0x80, 0x181, 0x182, 0x201, 0x202, 0x77E
STRIKES = {
    "answers of a drive dropped": ("dropped", ANSWER_1, FOREVER, 0, 0),
    "answers dropped for 2 cycles": ("dropped", ANSWER_1, 2, 0, 0),
    "SYNC dropped": ("dropped", SYNC, FOREVER, 0, 0),
    "commands of a drive dropped": ("dropped", COMMAND_2, FOREVER, 0, 0),
    "master's heartbeat dropped": ("dropped", HEARTBEAT, FOREVER, 0, 0),
    "cable pulled": ("dropped", None, FOREVER, 0, 0),
    "answers 0.3 ms late": ("delayed", ANSWER_1, FOREVER, 0.3, 0),
    "answers 0.7 ms late": ("delayed", ANSWER_1, FOREVER, 0.7, 0),
    "answers 1 ms late": ("delayed", ANSWER_1, FOREVER, 1.0, 0),
    "answers 2 ms late": ("delayed", ANSWER_2, FOREVER, 2.0, 0),
    "answers of one cycle 1 ms late": ("delayed", ANSWER_1, 1, 1.0, 0),
    "answers doubled": ("duplicated", ANSWER_1, FOREVER, 0.01, 0),
    "answers too short": ("wrong length", ANSWER_2, FOREVER, 0, 7),
    "commands too short": ("wrong length", COMMAND_2, FOREVER, 0, 5),
    "bits of answers flipped": ("corrupted", ANSWER_1, FOREVER, 0, 0),
    "bits of commands flipped": ("corrupted", COMMAND_1, FOREVER, 0, 0),
    "a node babbles, wire full": ("babbles", 1, 100, 0.1),
    "a node babbles, 1 frame/ms": ("babbles", 1, 100, 1.0),
    "drive bus-off": ("BUS_OFF", 1, 0.0),
    "drive restarts": ("RESET", 2, 0.0),
    "drive unplugged": ("SILENT", 2, 0.0),
    "drive's heartbeat lost": ("HEARTBEAT_LOSS", 1, 0.0),
    "under-voltage": ("UNDER_VOLTAGE", 1, 0.0),
    "over-temperature": ("OVER_TEMPERATURE", 2, 0.0),
    "drive warns": ("WARNING", 1, 0.0),
    "jammed motor": ("JAMMED", 1, 0.0),
    "frozen motor encoder": ("MOTOR_FROZEN", 2, 0.0),
    "motor encoder steps 0.1 rad": ("MOTOR_STEP", 1, 0.1),
    "motor encoder drifts 1 rad/s": ("MOTOR_DRIFT", 2, 1.0),
    "frozen link encoder": ("LINK_FROZEN", 1, 0.0),
    "link encoder steps 0.1 rad": ("LINK_STEP", 2, 0.1),
    "link encoder drifts 1 rad/s": ("LINK_DRIFT", 1, 1.0),
    "process data repeated": ("REPEATING", 2, 0.0),
}


def described(fault: Fault) -> tuple[object, ...]:
    """What a fault does, to whom, for how long after it strikes [ms], and by how much."""
    if isinstance(fault, NodeFault):
        assert fault.start_ns == STRIKE * MS
        return fault.kind.name, fault.node_id, fault.size
    assert fault.start_ns == STRIKE * MS
    lasts = FOREVER if fault.end_ns >= 1 << 61 else fault.end_ns / MS - STRIKE
    if isinstance(fault, Babble):
        return "babbles", fault.cob_id, lasts, fault.every_ns / MS
    assert isinstance(fault, FrameFault)
    return fault.kind.value, fault.cob_id, lasts, fault.delay_ns / MS, fault.length


def test_each_trial_strikes_what_its_name_says() -> None:
    assert {t.name: described(*t.faults) for t in TRIALS if t.faults} == STRIKES
    others = {t.name: (t.gone, t.interrupted, t.viewer) for t in TRIALS if not t.faults}
    assert others == {
        "master killed or frozen": (True, False, False),
        "^C": (False, True, False),
        "the viewer hangs": (False, False, True),
    }
    assert not any(t.gone or t.interrupted or t.viewer for t in TRIALS if t.faults)


@pytest.mark.parametrize("state", DriveState)
def test_a_result_is_safe_without_power_beyond_no_limit_and_complete(state: DriveState) -> None:
    # CiA 402: a motor may have torque in these states, and in no other.
    powered = state.name in ("OPERATION_ENABLED", "QUICK_STOP_ACTIVE", "FAULT_REACTION_ACTIVE")
    well = Result(
        name="",
        status="fault",
        cause=None,
        cycles=1,
        drives=(DriveState.SWITCH_ON_DISABLED, state),
        excess=0.0,
        intact=True,
        lost_cycles=0,
        run=Path(),
    )
    assert well.safe is not powered
    assert replace(well, drives=well.drives[::-1]).safe is not powered
    assert not replace(well, excess=1e-9).safe
    assert not replace(well, intact=False).safe


@final
class Slowing:
    """A bus whose two drives lose their power at times of its clock [ms]."""

    def __init__(self, *ends_ms: int) -> None:
        self.now_ns, self._ends_ms = 7 * MS, ends_ms

    def advance(self, until_ns: int) -> None:
        self.now_ns = until_ns

    @property
    def drives(self) -> list[Any]:
        states = [
            DriveState.FAULT if self.now_ns >= end * MS else DriveState.OPERATION_ENABLED
            for end in self._ends_ms
        ]
        return [
            SimpleNamespace(axis=SimpleNamespace(power=SimpleNamespace(state=s))) for s in states
        ]


@pytest.mark.parametrize(
    ("ends", "found"),
    [((0, 0), 8), ((20, 30), 30), ((30, 20), 30), ((20, 900), 207), ((900, 900), 207)],
)
def test_drives_are_waited_for_until_the_last_one_has_no_power_200_ms_at_most(
    ends: tuple[int, int], found: int
) -> None:
    assert fault_trial._wait_for_drives(cast(Any, Slowing(*ends))) == found * MS


# --- one trial -------------------------------------------------------------------------------


@final
class Beside:
    """A view beside a run, with a process that does not exist."""

    pid = 4_000_000

    def __init__(self, told: list[object]) -> None:
        self._told = told

    def stop(self) -> None:
        self._told.append("stopped")


@pytest.mark.parametrize("viewer", [True, False])
def test_a_view_is_opened_where_one_is_tried_and_is_ended_and_set_going_again(
    viewer: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    told: list[object] = []

    def start_view(run: Path) -> Beside:
        told.append(run)
        return Beside(told)

    def run(*given: Any) -> str:
        told.append(type(given[-1]).__name__)
        return "outcome"

    monkeypatch.setattr(fault_trial, "_run", run)
    monkeypatch.setattr(fault_trial.os, "kill", lambda *how: told.append(how))
    opened, chosen, writer = cast(Any, (None, None, SimpleNamespace(path=Path("run"))))
    trial = FaultTrial(name="", viewer=viewer)
    assert fault_trial._viewed(trial, opened, chosen, writer, start_view) == "outcome"
    going = (Beside.pid, signal.SIGCONT)
    assert told == ([Path("run"), "Beside", "stopped", going] if viewer else ["NoneType"])
    told.clear()
    fault_trial._viewed(trial, opened, chosen, writer, None)
    assert told == ["NoneType"]


@pytest.mark.parametrize(
    ("how", "stops", "status"),
    [
        ({}, False, "complete"),
        ({"gone": True}, True, "interrupted"),
        ({"interrupted": True}, True, "complete"),
    ],
)
@pytest.mark.parametrize("viewed", [True, False])
def test_what_has_to_happen_in_mid_run_happens_from_the_strike_on(
    how: dict[str, bool], stops: bool, status: str, viewed: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    network = SimpleNamespace(now_ns=0)
    told: list[object] = []

    def run(
        _plant: object, _law: object, cycles: int, *, stop: Any, progress: Any, **_: Any
    ) -> Any:
        assert cycles == 650
        for now_ms in (999, 1000, 1001):
            network.now_ns = now_ms * MS
            progress(0, 0)
            told.append(stop.is_set)
        return Outcome(status="complete", cause=None, message=None, cycles=3, wall_time=0.0)

    monkeypatch.setattr(fault_trial, "run", run)
    monkeypatch.setattr(fault_trial, "_network", lambda _: network)
    monkeypatch.setattr(fault_trial, "make_controller", lambda *_: None)
    monkeypatch.setattr(fault_trial, "targets_of", lambda _: None)
    monkeypatch.setattr(fault_trial.os, "kill", lambda *given: told.append(given))
    opened: Any = SimpleNamespace(plant=None)
    view = cast(Any, Beside(told) if viewed else None)
    chosen: Any = SimpleNamespace(controller=None)
    trial = replace(FaultTrial(name=""), **cast(Any, how))
    outcome = fault_trial._run(trial, opened, chosen, cast(Any, None), view)
    assert outcome.status == status
    frozen = [(Beside.pid, signal.SIGSTOP)] * viewed
    assert told == [False, *frozen, stops, *frozen, stops]


# --- dead parts ------------------------------------------------------------------------------

DESIGN = load_design(ROOT / "models" / "optimal.toml")


@pytest.mark.parametrize(("counts", "link"), [(4096, 4096), (65536, 65536), (1 << 20, 65536)])
def test_both_encoders_have_the_counts_of_the_servo_and_those_of_links_16_bits(
    counts: int, link: int
) -> None:
    config = load_bus(BUS)
    alone = replace(config, nodes=(config.nodes[0], replace(config.nodes[1], link=None)))
    first, second = _with_encoders(alone, ServoConfig(encoder_counts=counts)).nodes
    for node in (first, second):
        assert (node.motor.counts_per_rev, node.motor.gear, node.parameters) == (counts, 1.0, ())
    assert first.link is not None
    assert first.link.counts_per_rev == link
    assert second.link is None
    assert _with_encoders(config, ServoConfig(bandwidth=30.0)) == config


def test_a_leg_leans_with_both_joints_and_motors_and_may_sway_as_far_as_a_file_may_say() -> None:
    chosen = Experiment(design=DESIGN, controller=JumpConfig())
    upright = start_of(chosen)
    bench = Bench(design=DESIGN, bus_file=BUS)
    for lean in (0.0, 0.08):
        start = (replace(bench, lean=lean) if lean else bench).start(chosen)
        np.testing.assert_allclose(start.joint_pos, upright.joint_pos + lean)
        np.testing.assert_allclose(start.motor_pos, upright.motor_pos + lean)
    assert replace(bench, lean=0.08).limits.sway == 0.5
    assert bench.limits.sway < 0.5


@pytest.mark.parametrize("drive", [0, 1])
def test_a_part_contradicts_by_the_larger_of_what_both_encoders_show_and_what_is(
    drive: int,
) -> None:
    bench = Bench(design=DESIGN, bus_file=BUS)
    for part in (Part.LINK_DRIFT, Part.JAMMED, None):
        death = None if part is None else Death(part=part, drive=drive, onset=1.0)
        with staged(bench, Emulation.CAN, "jump", ServoConfig(), death) as stage:
            plant = cast(Any, stage.plant)
            assert stage.contradiction() == 0.0
            motions = [each.axis.motion for each in plant.session.bus.network.drives]
            for motor, link, larger in ((0.25, 0.125, 0.25), (-0.125, -0.5, 0.5)):
                motors, links = [motion.angle for motion in motions], [0.0, 0.0]
                motors[drive] += motor
                links[drive] += link
                plant.sample = SimpleNamespace(motor_pos=motors, link_pos=links)
                off = larger if part is Part.LINK_DRIFT else 0.0
                assert stage.contradiction() == pytest.approx(off, abs=1e-9)
            # A jammed motor is where its drive does not want it.
            motions[drive].demand -= 0.5 * abs(motions[drive]._units.counts_per_rad)
            off = {Part.LINK_DRIFT: 0.5, Part.JAMMED: 0.5, None: 0.0}[part]
            assert stage.contradiction() == pytest.approx(off, abs=1e-9)
            plant.sample = None


def test_a_healthy_stage_kills_nothing_and_contradicts_nothing() -> None:
    bench = Bench(design=DESIGN, bus_file=BUS)
    with staged(bench, Emulation.ANALYTIC, "jump", ServoConfig(), None) as stage:
        stage.kill()
        assert stage.contradiction() == 0.0


@pytest.mark.parametrize(
    ("emulation", "kind"), [(Emulation.SIM, "SimPlant"), (Emulation.ANALYTIC, "AnalyticPlant")]
)
def test_each_emulation_is_a_plant_of_its_own_behind_the_limits(
    emulation: Emulation, kind: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    made: list[str] = []
    monkeypatch.setattr(stage_module, kind, lambda *_: made.append(kind) or nullcontext())
    monkeypatch.setattr(
        stage_module, "open_limited", lambda plant, *_: SimpleNamespace(plant=plant)
    )
    with staged(Bench(design=DESIGN, bus_file=BUS), emulation, "jump", ServoConfig(), None):
        assert made == [kind]
