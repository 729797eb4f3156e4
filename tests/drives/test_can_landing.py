"""How a run on drives ends: on the ground, in every phase of a jump in which its time is over."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from can_rig import BUS, LIMITS, Stage, experiment, stage, staged

from legbench.control import BangBangConfig, JumpConfig, PositionJumpConfig
from legbench.design.setup import Setup, SetupKind
from legbench.drives.emulated.faults import NodeFault, NodeFaultKind
from legbench.drives.protocol.cia402 import DriveState
from legbench.drives.setup.bus_file import load_bus, load_limits
from legbench.experiment import ControllerSettings, Experiment, record
from legbench.limits.safety import SafetyLimits
from legbench.loop import Outcome, StopFlag, run
from legbench.mjcf import Linkage, LinkageKind
from legbench.plant import landing
from legbench.plant.landing import PATIENCE, STILL_RANGE, STILL_TIME, End, StillWatch, land, towards
from legbench.plant.sim import SimPlant
from legbench.plants import CanChoice
from legbench.recording.reader import Recording, load
from legbench.signals import Command, Observation

EMULATED = CanChoice(bus=BUS, interface="legbench")
SPEED = load_bus(BUS).start_speed
SLOW = 0.3
"""No joint of a leg at rest is faster [rad/s]: 0.01 rad at 4 Hz, and what the bars add."""
JUMPS, HARDLY_SWINGS = 3.0, 12.0
"""Damping of the leg that is led to rest, as a multiple of the paper's: it still leaves the ground,
or it swings for 2 s instead of 18 s. That the paper's own leg rests in time has its own test."""
ENABLED, OFF = DriveState.OPERATION_ENABLED, DriveState.SWITCH_ON_DISABLED


def calm(controller: ControllerSettings, calming: float = JUMPS) -> Experiment:
    """The optimal leg with dampers that let it rest soon."""
    usual = experiment(controller)
    first, second = usual.design.damping
    return replace(usual, design=replace(usual.design, damping=(calming * first, calming * second)))


def states(it: Stage) -> list[DriveState]:
    return [drive.axis.power.state for drive in it.network.drives]


def targets(it: Stage, since_ns: int) -> np.ndarray:
    """Targets that were on the wire since then (n, 2) [rad]."""
    found = []
    for cob_id, node in zip((0x201, 0x202), load_bus(BUS).nodes, strict=True):
        counts = [
            int.from_bytes(frame.data[2:6], "little", signed=True)
            for at_ns, frame in it.network.log or []
            if frame.cob_id == cob_id and at_ns > since_ns
        ]
        found.append([node.motor.to_rad(value) for value in counts])
    return np.array(found).T


def stands(it: Stage) -> None:
    """The leg stands in its rest posture, with power, and hardly moves."""
    assert states(it) == [ENABLED] * 2
    data = it.body.data
    assert data.ncon >= 1
    assert np.max(np.abs(data.qvel)) < SLOW
    angles = [drive.axis.motion.angle for drive in it.network.drives]
    np.testing.assert_allclose(angles, it.start.motor_pos, atol=1e-4)


class Marking:
    """Notes the time of the last row, and how high the foot was above the ground then [m]."""

    def __init__(self, stage: Stage) -> None:
        self.stage = stage
        self.now_ns, self.height = 0, 0.0

    def append(
        self, command: Command, observation: Observation, cycle_us: float, late_us: float
    ) -> None:
        self.now_ns = self.stage.network.now_ns
        self.height = float(self.stage.body.data.site("tip").xpos[2])


FLYING = 536
"""Cycles after which the foot is more than 20 mm above the ground."""


@pytest.mark.parametrize(
    ("phase", "cycles"),
    [
        ("pushing", 150),
        ("released", 500),
        ("flying", FLYING),
        pytest.param("folding", 620, marks=pytest.mark.long),
    ],
)
def test_a_jump_ends_on_the_ground_whenever_its_time_is_over(phase: str, cycles: int) -> None:
    """In each phase, motors move slowly, and power goes when the foot stands and joints rest."""
    with stage(calm(JumpConfig())) as it:
        last = Marking(it)
        outcome = run(it.plant, it.controller, cycles, sink=last)
        assert (outcome.status, outcome.message, outcome.cycles) == ("complete", None, cycles)
        assert (last.height > 0.02) == (phase == "flying")
        assert it.plant.landing is not None
        assert it.plant.landing.rested
        assert it.plant.landing.duration < PATIENCE
        stands(it)
        moves = targets(it, last.now_ns + 2_000_000)
        assert np.max(np.abs(np.diff(moves, axis=0))) / 1e-3 <= SPEED * 1.05
        it.plant.close()
        assert states(it) == [OFF] * 2


def airborne(it: Stage) -> int:
    """Jump until the foot is 20 mm above the ground; cycles that it took."""
    seen = it.plant.reset()
    it.controller.reset(seen)
    for cycle in range(2000):
        seen = it.plant.step(it.controller.step(seen))
        if it.body.data.site("tip").xpos[2] > 0.02:
            return cycle
    raise AssertionError("the leg did not jump")


def test_a_run_that_is_to_stop_stops_in_mid_flight(tmp_path: Path) -> None:
    choice = replace(EMULATED, end=End.STOP)
    chosen = replace(calm(JumpConfig()), plant=choice, duration=1e-3 * FLYING)
    seen = load(record(chosen, tmp_path).path)
    assert seen.complete
    assert seen.manifest["plant"]["bus"]["end"] == "stop"
    assert [event["name"] for event in seen.events] == ["limited", "bus", "end"]


@pytest.mark.long
def test_the_rows_are_the_same_whether_a_run_rests_or_stops(tmp_path: Path) -> None:
    chosen = calm(JumpConfig())
    with stage(chosen) as it:
        cycles = airborne(it)
    chosen = replace(chosen, duration=(cycles + 1) * 1e-3)
    ends: dict[str, Recording] = {}
    for end in End:
        choice = replace(EMULATED, end=end)
        finished = record(replace(chosen, plant=choice), tmp_path / str(end))
        seen = load(finished.path)
        ends[end] = seen
        assert seen.complete
        assert seen.manifest["plant"]["bus"]["end"] == end
        names = [event["name"] for event in seen.events]
        after = ["rest", "bus", "end"] if end is End.REST else ["bus", "end"]
        assert names == ["limited", *after]
    # The rows are the same; what came after them is in the bus log and in one event.
    for name in ("command_pos", "joint_pos", "spring_torque", "phase", "t"):
        np.testing.assert_array_equal(ends["rest"][name], ends["stop"][name])
    (event,) = [event for event in ends["rest"].events if event["name"] == "rest"]
    assert event["rested"] is True
    assert event["interrupted"] is False
    lines = {
        end: len((seen.path / "bus.log").read_text().splitlines()) for end, seen in ends.items()
    }
    assert lines["rest"] - lines["stop"] > 5 * 1000 * (event["duration"] - 0.2)


@pytest.mark.parametrize("kind", [SetupKind.HFTS, SetupKind.VFTS, SetupKind.FFS])
@pytest.mark.parametrize(
    "config", [PositionJumpConfig(), pytest.param(BangBangConfig(), marks=pytest.mark.long)]
)
def test_a_leg_that_is_held_ends_in_its_rest_posture(
    kind: SetupKind, config: ControllerSettings
) -> None:
    with stage(replace(calm(config, HARDLY_SWINGS), setup=Setup(kind=kind))) as it:
        outcome = run(it.plant, it.controller, 310)
        assert outcome.status == "complete"
        assert it.plant.landing is not None
        angles = [drive.axis.motion.angle for drive in it.network.drives]
        np.testing.assert_allclose(angles, it.start.motor_pos, atol=1e-4)
        assert it.plant.landing.rested
        assert it.plant.landing.swing <= STILL_RANGE
        assert np.max(np.abs(it.body.data.qvel)) < SLOW
        assert outcome.message is None


@pytest.mark.long
def test_the_papers_leg_rests_in_time_where_it_swings_longest() -> None:
    """With its foot pinned, in the simulation that also moves the emulated bench."""
    chosen = replace(experiment(PositionJumpConfig()), setup=Setup(kind=SetupKind.FFS))
    controller, start = staged(chosen)
    linkage = Linkage(kind=LinkageKind.REDUCED)
    leg = SimPlant(chosen.design, replace(chosen.options, linkage=linkage), start)
    seen = leg.reset()
    controller.reset(seen)
    command = controller.step(seen)
    for _ in range(310):
        seen = leg.step(command)
        command = controller.step(seen)

    def exchange(wanted: Sequence[float]) -> tuple[Sequence[float], Sequence[float]]:
        return wanted, leg.step(Command.holding(np.array(wanted))).joint_pos.tolist()

    done = land(
        exchange,
        controller.start_motor_pos.tolist(),
        command.motor_pos.tolist(),
        speed=SPEED,
        period=1e-3,
        interrupted=lambda: False,
    )
    assert done.rested
    assert 10.0 < done.duration < 0.75 * PATIENCE


def test_a_leg_that_swings_for_too_long_loses_its_power_and_it_is_told_by_how_much(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(landing, "PATIENCE", 1.0)
    chosen = replace(experiment(PositionJumpConfig()), setup=Setup(kind=SetupKind.FFS))
    with stage(chosen) as it:
        outcome = run(it.plant, it.controller, 310)
        assert outcome.status == "complete"
        done = it.plant.landing
        assert done is not None
        assert not done.rested
        assert done.duration >= 1.0
        assert 0.03 < done.swing < 0.3
        assert outcome.message == (
            f"the leg still swung by {done.swing:.3f} rad after 1 s in its rest posture, one at "
            "rest by less than 0.01 rad; its power went then"
        )


def test_an_interrupt_while_it_lands_takes_the_power_at_once() -> None:
    stop = StopFlag()
    with stage(experiment(JumpConfig())) as it:
        began: list[int] = []
        lead = it.plant._lead

        def counted(motor_pos: object) -> object:
            began.append(it.network.now_ns)
            if len(began) == 50:
                stop.set()
            return lead(motor_pos)  # pyrefly: ignore[bad-argument-type]

        it.plant._lead = counted  # pyrefly: ignore[bad-assignment]
        outcome = run(it.plant, it.controller, 300, stop=stop)
        assert outcome.status == "interrupted"
        assert len(began) == 50
        assert it.plant.landing is not None
        assert it.plant.landing.interrupted
        it.plant.close()
        assert states(it) == [OFF] * 2
        assert it.network.now_ns - began[-1] < 50_000_000


def lands_with(it: Stage, fault: NodeFaultKind) -> Outcome:
    lead = it.plant._lead
    told: list[object] = []

    def failing(motor_pos: object) -> object:
        told.append(motor_pos)
        if len(told) == 50:
            it.network.inject(NodeFault(kind=fault, node_id=1, start_ns=it.network.now_ns))
        return lead(motor_pos)  # pyrefly: ignore[bad-argument-type]

    it.plant._lead = failing  # pyrefly: ignore[bad-assignment]
    return run(it.plant, it.controller, 300)


@pytest.mark.parametrize("fault", [NodeFaultKind.SILENT, NodeFaultKind.UNDER_VOLTAGE])
def test_a_fault_while_it_lands_is_the_runs(fault: NodeFaultKind) -> None:
    with stage(experiment(JumpConfig())) as it:
        outcome = lands_with(it, fault)
        assert outcome.status == "fault"
        assert outcome.cause in ("process data lost", "drive emergency")
        assert outcome.message is not None
        assert outcome.message.startswith("after its last row, on the way to rest: ")
        assert outcome.cycles == 300
        assert states(it)[1] is OFF


def test_limits_act_while_it_lands() -> None:
    """Coming down loads the springs more than taking off did; the limit is named."""
    with stage(experiment(JumpConfig())) as it:
        cycles = airborne(it)
    limits = replace(load_limits(LIMITS), spring_torque=0.9)
    with stage(experiment(JumpConfig()), limits=limits) as it:
        free = run(it.plant, it.controller, cycles)
    assert free.status == "fault"
    assert free.cause == "spring torque"


def test_a_run_that_only_looks_commands_nothing_at_its_end(tmp_path: Path) -> None:
    choice = replace(EMULATED, read_only=True)
    finished = record(replace(experiment(JumpConfig(), 0.1), plant=choice), tmp_path)
    assert finished.outcome.status == "complete"
    assert " 201#" not in (finished.path / "bus.log").read_text()
    assert "rest" not in [event["name"] for event in load(finished.path).events]


# --- the landing itself, without a leg -------------------------------------------------------


def test_the_way_is_as_long_as_it_may_be_and_ends_there() -> None:
    last: tuple[float, ...] = (0.0, 0.5)
    ways: list[tuple[float, ...]] = [last]
    while last != (0.0105, 0.49):
        last = towards((0.0105, 0.49), last, 0.001)
        ways.append(last)
    assert len(ways) == 12
    assert np.max(np.abs(np.diff(ways, axis=0))) == pytest.approx(0.001)


def test_still_is_a_time_within_a_range() -> None:
    watch = StillWatch(1e-3)
    needed = round(STILL_TIME / 1e-3)
    for count in range(needed):
        assert not watch.see((0.0, 0.0049 * (-1) ** count))
    assert watch.see((0.0, 0.0))
    assert not watch.see((2 * STILL_RANGE, 0.0))
    creeping = StillWatch(1e-3)
    speed = 2.1 * STILL_RANGE / STILL_TIME
    assert not any(creeping.see((speed * 1e-3 * count, 0.0)) for count in range(5000))


def test_a_posture_beyond_the_limits_is_led_to_as_far_as_it_goes() -> None:
    limits = SafetyLimits(motor_range=((-0.1, 0.1), (-0.1, 0.1)))
    (low, high), _ = limits.motor_range
    sent: list[Sequence[float]] = []

    def exchange(command: Sequence[float]) -> tuple[Sequence[float], Sequence[float]]:
        applied = tuple(min(max(value, low), high) for value in command)
        sent.append(applied)
        return applied, applied

    done = land(
        exchange, (0.5, 0.05), (0.0, 0.0), speed=0.5, period=1e-3, interrupted=lambda: False
    )
    assert done.rested
    assert done.motor_pos == (0.1, 0.05)
    assert done.duration == pytest.approx(len(sent) * 1e-3)
    assert len(sent) < 1000


@pytest.mark.parametrize("amplitude", [0.004, 0.05])
def test_the_swing_is_half_of_what_the_widest_link_went_through_at_the_end(
    amplitude: float,
) -> None:
    cycles = 0

    def exchange(command: Sequence[float]) -> tuple[Sequence[float], Sequence[float]]:
        nonlocal cycles
        cycles += 1
        # A large motion long before the end does not count.
        early = 1.0 if cycles < 200 else 0.0
        phase = 2.0 * np.pi * 4.0 * 1e-3 * cycles
        return command, (0.5 * amplitude * np.cos(phase), early - amplitude * np.sin(phase))

    done = land(exchange, (0.1, 0.1), (0.1, 0.1), speed=0.5, period=1e-3, interrupted=lambda: False)
    assert done.rested is (amplitude < STILL_RANGE / 2)
    assert done.swing == pytest.approx(amplitude, rel=1e-3)
    assert (done.trouble is None) is done.rested
