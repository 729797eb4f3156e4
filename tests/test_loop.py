import os
import re
import signal
import threading
from collections.abc import Callable
from typing import final

import numpy as np
import pytest

from legbench.clock import AbstractClock, VirtualClock, WallClock
from legbench.control import AbstractController
from legbench.control.jump_rules import JumpPhase
from legbench.errors import PlantFault, RecordingError
from legbench.interrupts import StopFlag, stop_on_interrupt
from legbench.loop import PROGRESS_EVERY, run
from legbench.plant.abstract import AbstractPlant
from legbench.signals import Command, Floats, Observation

PERIOD = 0.001


@final
class Told:
    """Plant, controller, clock and recording that write down who was asked what."""

    def __init__(self, *, fault_at: int | None = None, disk_full_at: int | None = None) -> None:
        self.calls: list[str] = []
        self.rows: list[tuple[float, float, float, float]] = []
        self.fault_at, self.disk_full_at = fault_at, disk_full_at
        self.cycle = 0
        self.late = 0.0
        self.rest: Callable[[Floats, Callable[[], bool]], str | None] | None = None

    def seen(self, applied: float) -> Observation:
        zero = np.zeros(2)
        return Observation(
            time=self.cycle * PERIOD,
            motor_pos=zero,
            joint_pos=zero,
            joint_vel=zero,
            spring_torque=zero,
            applied_pos=np.full(2, applied),
        )

    def append(
        self, command: Command, observation: Observation, cycle_us: float, late_us: float
    ) -> None:
        if self.disk_full_at == len(self.rows):
            raise RecordingError("no room")
        self.calls.append("append")
        self.rows.append((observation.time, float(command.motor_pos[0]), cycle_us, late_us))


@final
class ToldPlant(AbstractPlant):
    def __init__(self, told: Told) -> None:
        self.period, self.told = PERIOD, told

    def reset(self) -> Observation:
        self.told.calls.append("plant.reset")
        self.told.cycle = 0
        return self.told.seen(0.0)

    def step(self, command: Command) -> Observation:
        self.told.calls.append("plant.step")
        self.told.cycle += 1
        if self.told.cycle == self.told.fault_at:
            raise PlantFault("broken spring", "the spring broke; buy another one")
        return self.told.seen(float(command.motor_pos[0]))

    def rest(self, motor_pos: Floats, interrupted: Callable[[], bool]) -> str | None:
        self.told.calls.append("plant.rest")
        if self.told.rest is None:
            return None
        return self.told.rest(motor_pos, interrupted)

    def close(self) -> None:
        self.told.calls.append("plant.close")


@final
class ToldController(AbstractController):
    def __init__(self, told: Told) -> None:
        self.told = told

    @property
    def start_motor_pos(self) -> Floats:
        return np.zeros(2)

    def reset(self, observation: Observation) -> None:
        self.told.calls.append("controller.reset")

    def step(self, observation: Observation) -> Command:
        self.told.calls.append("controller.step")
        return Command.holding(np.full(2, observation.time + 1.0))


@final
class ToldClock(AbstractClock):
    def __init__(self, told: Told) -> None:
        self.told = told

    def start(self) -> None:
        self.told.calls.append("clock.start")

    def wait(self, cycle: int) -> float:
        self.told.calls.append(f"clock.wait {cycle}")
        return self.told.late


def test_who_is_asked_when() -> None:
    told = Told()
    outcome = run(ToldPlant(told), ToldController(told), 3, clock=ToldClock(told), sink=told)
    cycle = ["controller.step", "append", "plant.step"]
    assert told.calls == [
        *("plant.reset", "controller.reset", "clock.start"),
        *("clock.wait 0", *cycle, "clock.wait 1", *cycle, "clock.wait 2", *cycle),
        "plant.rest",
    ]
    assert (outcome.status, outcome.cause, outcome.message) == ("complete", None, None)
    assert outcome.cycles == 3


def test_a_row_is_what_was_seen_and_what_was_commanded_from_it() -> None:
    told = Told()
    told.late = 0.000_25
    run(ToldPlant(told), ToldController(told), 4, clock=ToldClock(told), sink=told)
    assert [row[0] for row in told.rows] == [k * PERIOD for k in range(4)]
    assert [row[1] for row in told.rows] == [1.0 + k * PERIOD for k in range(4)]
    assert told.rows[0][2] == 0.0
    assert all(row[2] > 0.0 for row in told.rows[1:])
    assert [row[3] for row in told.rows] == pytest.approx([250.0] * 4)


def test_the_first_fault_ends_the_run_and_keeps_every_row() -> None:
    told = Told(fault_at=5)
    outcome = run(ToldPlant(told), ToldController(told), 100, sink=told)
    assert (outcome.status, outcome.cause) == ("fault", "broken spring")
    assert outcome.message == "the spring broke; buy another one"
    assert outcome.cycles == 5
    assert [row[0] for row in told.rows] == [k * PERIOD for k in range(5)]


def test_a_fault_of_the_recording_goes_through() -> None:
    told = Told(disk_full_at=3)
    with pytest.raises(RecordingError, match="no room"):
        run(ToldPlant(told), ToldController(told), 100, sink=told)
    assert told.cycle == 3


def test_the_stop_flag_ends_the_run_before_the_next_cycle() -> None:
    told, stop = Told(), StopFlag()

    @final
    class Impatient(AbstractClock):
        def start(self) -> None:
            """Nothing."""

        def wait(self, cycle: int) -> float:
            if cycle == 6:
                stop.set()
            return 0.0

    plant, controller = ToldPlant(told), ToldController(told)
    outcome = run(plant, controller, 100, clock=Impatient(), sink=told, stop=stop)
    assert (outcome.status, outcome.cause) == ("interrupted", None)
    assert outcome.cycles == len(told.rows) == 7
    stopped = run(plant, controller, 100, sink=told, stop=stop)
    assert (stopped.status, stopped.cycles) == ("interrupted", 0)


@pytest.mark.parametrize("cycles", [PROGRESS_EVERY, 3 * PROGRESS_EVERY, 2 * PROGRESS_EVERY + 7, 3])
def test_progress_is_told_now_and_then_and_at_the_end(cycles: int) -> None:
    told, heard = Told(), []
    run(
        ToldPlant(told),
        ToldController(told),
        cycles,
        progress=lambda done, total: heard.append((done, total)),
    )
    assert heard[-1] == (cycles, cycles)
    assert len(heard) == len(set(heard)) == -(-cycles // PROGRESS_EVERY)
    assert {total for _, total in heard} == {cycles}


def test_virtual_time_never_waits_and_is_never_late() -> None:
    clock = VirtualClock()
    clock.start()
    assert [clock.wait(cycle) for cycle in (0, 1, 1000)] == [0.0, 0.0, 0.0]


@final
class FakeTime:
    """Time that only passes when somebody sleeps, or works."""

    def __init__(self, oversleep: float = 0.0) -> None:
        self.now, self.oversleep = 100.0, oversleep
        self.slept: list[float] = []

    def read(self) -> float:
        return self.now

    def sleep(self, duration: float) -> None:
        self.slept.append(duration)
        self.now += duration + self.oversleep


def test_deadlines_are_absolute() -> None:
    """A late cycle does not shift those after it."""
    fake = FakeTime()
    clock = WallClock(PERIOD, now=fake.read, sleep=fake.sleep)
    clock.start()
    assert clock.wait(0) == 0.0
    fake.now += 0.0004
    assert clock.wait(1) == pytest.approx(0.0, abs=1e-12)
    assert fake.slept == [pytest.approx(0.0006)]
    fake.now += 0.0025
    assert clock.wait(2) == pytest.approx(0.0015)
    assert clock.wait(3) == pytest.approx(0.0005)
    assert len(fake.slept) == 1
    assert clock.wait(4) == pytest.approx(0.0, abs=1e-12)
    assert fake.now == pytest.approx(100.0 + 4 * PERIOD)


def test_sleeping_too_long_is_being_late() -> None:
    fake = FakeTime(oversleep=0.00007)
    clock = WallClock(PERIOD, now=fake.read, sleep=fake.sleep)
    clock.start()
    assert clock.wait(3) == pytest.approx(0.00007)


def test_starting_again_lays_a_new_grid() -> None:
    fake = FakeTime()
    clock = WallClock(PERIOD, now=fake.read, sleep=fake.sleep)
    clock.start()
    fake.now += 5.0
    clock.start()
    assert clock.wait(2) == pytest.approx(0.0, abs=1e-12)
    assert fake.slept == [pytest.approx(2 * PERIOD)]


def test_the_loop_keeps_to_the_wall_clock() -> None:
    fake, told = FakeTime(), Told()
    clock = WallClock(PERIOD, now=fake.read, sleep=fake.sleep)
    run(ToldPlant(told), ToldController(told), 50, clock=clock, sink=told)
    assert fake.now == pytest.approx(100.0 + 49 * PERIOD)
    assert all(row[3] == pytest.approx(0.0, abs=1e-6) for row in told.rows)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_sets_the_flag_and_the_old_handler_comes_back(number: signal.Signals) -> None:
    before = signal.getsignal(number)
    with stop_on_interrupt() as stop:
        assert not stop.is_set
        os.kill(os.getpid(), number)
        assert stop.is_set
    assert signal.getsignal(number) is before


def test_handlers_come_back_after_an_error() -> None:
    before = signal.getsignal(signal.SIGINT)

    def fail() -> None:
        raise RecordingError("no room")

    with pytest.raises(RecordingError), stop_on_interrupt():
        fail()
    assert signal.getsignal(signal.SIGINT) is before


def test_a_thread_gets_a_flag_that_nothing_sets() -> None:
    found: list[bool] = []

    def work() -> None:
        with stop_on_interrupt() as stop:
            found.append(stop.is_set)

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert found == [False]


def test_a_plant_is_closed_at_the_end_of_its_block() -> None:
    told = Told()

    def use(action: Callable[[], object]) -> None:
        with ToldPlant(told):
            action()

    use(lambda: None)
    assert told.calls == ["plant.close"]
    with pytest.raises(ZeroDivisionError):
        use(lambda: 1 // 0)
    assert told.calls == ["plant.close"] * 2


def test_holding_is_resting() -> None:
    assert Command.holding(np.zeros(2)).phase == JumpPhase.REST
    assert Command.holding(np.zeros((4, 2))).phase.tolist() == [JumpPhase.REST] * 4


class Unsafe(AbstractPlant):
    """Tells when it was closed; `what` goes wrong in a cycle, or on the way to the start."""

    period = 0.001

    def __init__(self, what: BaseException, *, at_reset: bool) -> None:
        self._what, self._at_reset = what, at_reset
        self.closed = False

    def reset(self) -> Observation:
        if self._at_reset:
            raise self._what
        return Told().seen(0.0)

    def step(self, command: Command) -> Observation:
        raise self._what

    def rest(self, motor_pos: Floats, interrupted: Callable[[], bool]) -> None:
        raise AssertionError("no run came to its end")

    def close(self) -> None:
        self.closed = True


@pytest.mark.parametrize("at_reset", [True, False])
def test_whatever_goes_wrong_closes_the_plant_first(at_reset: bool) -> None:
    plant = Unsafe(SystemExit(3), at_reset=at_reset)
    with pytest.raises(SystemExit):
        run(plant, ToldController(Told()), 10)
    assert plant.closed


def test_a_plant_that_raises_what_it_should_not_is_a_fault_that_shows_where() -> None:
    plant = Unsafe(ValueError("driver"), at_reset=False)
    outcome = run(plant, ToldController(Told()), 10)
    assert plant.closed
    assert (outcome.status, outcome.cause, outcome.cycles) == ("fault", "plant failed", 1)
    assert outcome.message is not None
    first, second = outcome.message.splitlines()
    assert first == "the plant failed after t = 0.000 s: ValueError: driver"
    assert re.fullmatch(r"  .*test_loop\.py:\d+ in step: raise self\._what", second)


def test_a_plant_that_cannot_be_reset_is_closed_and_named() -> None:
    plant = Unsafe(ValueError("driver"), at_reset=True)
    with pytest.raises(
        PlantFault, match="failed on its way to the start: ValueError: driver"
    ) as it:
        run(plant, ToldController(Told()), 10)
    assert plant.closed
    assert it.value.cause == "plant failed"


def test_a_stop_on_the_way_to_the_start_ends_the_run_there() -> None:
    stop = StopFlag()

    class Slow(AbstractPlant):
        period = 0.001
        closed = False

        def reset(self) -> Observation:
            stop.set()
            raise AssertionError("the stop was not heard")

        def step(self, command: Command) -> Observation:
            raise AssertionError("no cycle may begin")

        def rest(self, motor_pos: Floats, interrupted: Callable[[], bool]) -> None:
            raise AssertionError("no run came to its end")

        def close(self) -> None:
            self.closed = True

    plant = Slow()
    outcome = run(plant, ToldController(Told()), 10, stop=stop)
    assert (outcome.status, outcome.cycles) == ("interrupted", 0)
    assert plant.closed


def test_a_run_that_has_lasted_its_time_ends_at_the_first_posture_and_adds_no_row() -> None:
    told = Told()
    postures: list[list[float]] = []

    def rest(motor_pos: Floats, interrupted: Callable[[], bool]) -> str:
        assert not interrupted()
        postures.append(motor_pos.tolist())
        return "it swung"

    told.rest = rest
    outcome = run(ToldPlant(told), ToldController(told), 3, sink=told)
    assert (outcome.status, outcome.cause, outcome.message) == ("complete", None, "it swung")
    assert postures == [[0.0, 0.0]]
    assert (outcome.cycles, len(told.rows)) == (3, 3)


def test_a_fault_on_the_way_to_rest_is_the_runs_and_keeps_its_rows() -> None:
    told = Told()

    def rest(_motor_pos: Floats, _interrupted: Callable[[], bool]) -> None:
        raise PlantFault("spring torque", "spring 1 carries 9 N m")

    told.rest = rest
    outcome = run(ToldPlant(told), ToldController(told), 3, sink=told)
    assert (outcome.status, outcome.cause) == ("fault", "spring torque")
    assert outcome.message == "after its last row, on the way to rest: spring 1 carries 9 N m"
    assert (outcome.cycles, len(told.rows)) == (3, 3)


def test_an_interrupt_on_the_way_to_rest_is_heard_there() -> None:
    told, stop = Told(), StopFlag()

    def rest(_motor_pos: Floats, interrupted: Callable[[], bool]) -> None:
        assert not interrupted()
        stop.set()
        assert interrupted()

    told.rest = rest
    outcome = run(ToldPlant(told), ToldController(told), 3, sink=told, stop=stop)
    assert (outcome.status, outcome.message) == ("interrupted", None)
    assert len(told.rows) == 3


@pytest.mark.parametrize("how", ["fault", "interrupt"])
def test_a_run_that_is_cut_short_is_not_led_to_rest(how: str) -> None:
    told, stop = Told(fault_at=2 if how == "fault" else None), StopFlag()
    if how == "interrupt":
        stop.set()
    run(ToldPlant(told), ToldController(told), 3, sink=told, stop=stop)
    assert "plant.rest" not in told.calls


# --- only the plant, the controller and the user end a run -----------------------------------


class Wrong(AbstractController):
    """Fails in `reset`, or in cycle 3: raises, or returns what is no command."""

    def __init__(self, answer: object, *, at_reset: bool = False) -> None:
        self._answer, self._at_reset, self._cycle = answer, at_reset, 0

    @property
    def start_motor_pos(self) -> Floats:
        return np.zeros(2)

    def reset(self, observation: Observation) -> None:
        if self._at_reset:
            self._fail()

    def step(self, observation: Observation) -> Command:
        self._cycle += 1
        if self._cycle < 4:
            return Command.holding(np.zeros(2))
        if isinstance(self._answer, BaseException):
            self._fail()
        return self._answer  # pyrefly: ignore[bad-return]

    def _fail(self) -> None:
        assert isinstance(self._answer, BaseException)
        raise self._answer


@pytest.mark.parametrize("error", [ZeroDivisionError("by zero"), RecordingError("x"), KeyError(1)])
def test_a_controller_that_raises_ends_the_run_as_a_fault_with_its_own_lines(
    error: Exception,
) -> None:
    told = Told()
    outcome = run(ToldPlant(told), Wrong(error), 10, sink=told)
    assert (outcome.status, outcome.cause, outcome.cycles) == ("fault", "controller failed", 3)
    assert outcome.time == pytest.approx(3 * PERIOD)
    assert [row[0] for row in told.rows] == [k * PERIOD for k in range(3)]
    assert told.calls[-1] == "plant.close"
    assert outcome.message is not None
    first, *lines = outcome.message.splitlines()
    assert first.startswith("the controller failed at t = 0.003 s: ")
    assert first.endswith(f"{type(error).__name__}: {error}")
    assert [re.sub(r".*test_loop\.py:\d+ ", "", line) for line in lines] == [
        "in step: self._fail()",
        "in _fail: raise self._answer",
    ]


def test_a_controller_that_raises_at_its_reset_is_a_fault_before_the_first_row() -> None:
    told = Told()
    outcome = run(ToldPlant(told), Wrong(ValueError("no"), at_reset=True), 10, sink=told)
    assert (outcome.status, outcome.cause, outcome.cycles) == ("fault", "controller failed", 0)
    assert told.rows == []
    assert told.calls == ["plant.reset", "plant.close"]
    assert "in reset: self._fail()" in str(outcome.message)


def command(motor_pos: object, phase: object = 0) -> Command:
    return Command(motor_pos=motor_pos, phase=phase)  # pyrefly: ignore[bad-argument-type]


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (None, "step returned None, not a Command"),
        ((0.0, 0.0), r"step returned \(0.0, 0.0\), not a Command"),
        (command([0.0, 0.0]), r"motor_pos is \[0.0, 0.0\], not an array of float64"),
        (command(np.zeros(2, dtype=np.float32)), "not an array of float64"),
        (command(np.zeros(3)), r"motor_pos has shape \(3,\), not \(2,\) as was seen"),
        (command(np.zeros((1, 2))), r"motor_pos has shape \(1, 2\), not \(2,\)"),
        (
            command(np.array([0.1, np.nan])),
            r"motor_pos is array\(\[0.1, nan\]\); it must be finite",
        ),
        (command(np.array([-np.inf, 0.0])), "it must be finite"),
        (command(np.zeros(2), 1.5), "phase is 1.5, not an integer"),
        (command(np.zeros(2), None), "phase is None, not an integer"),
        (command(np.zeros(2), np.zeros(2, dtype=int)), r"phase has shape \(2,\), not \(\)"),
        (command(np.zeros(2), 300), "phase is 300; it must be 0 to 127"),
        (command(np.zeros(2), -1), "phase is -1; it must be 0 to 127"),
    ],
)
def test_what_is_no_command_ends_the_run_and_names_the_step(answer: object, words: str) -> None:
    told = Told()
    outcome = run(ToldPlant(told), Wrong(answer), 10, sink=told)
    assert (outcome.status, outcome.cause, outcome.cycles) == ("fault", "controller failed", 3)
    assert len(told.rows) == 3
    assert told.calls[-1] == "plant.close"
    assert outcome.message is not None
    assert re.search(words, outcome.message)
    assert re.search(r"\n  .*test_loop\.py:\d+ in step: def step\(", outcome.message)


@pytest.mark.parametrize(
    "phase", [3, JumpPhase.PUSH, np.int64(3), np.array(3), np.array(3, np.int8)]
)
def test_a_phase_may_be_an_integer_of_any_kind(phase: object) -> None:
    outcome = run(ToldPlant(Told()), Wrong(command(np.zeros(2), phase)), 10)
    assert outcome.status == "complete"


@pytest.mark.parametrize("error", [BrokenPipeError(), AttributeError("no write"), OSError(28, "")])
def test_progress_that_fails_is_not_asked_again_and_ends_nothing(error: Exception) -> None:
    told, asked = Told(), []

    def fail(done: int, total: int) -> None:
        asked.append(done)
        raise error

    outcome = run(ToldPlant(told), ToldController(told), 3 * PROGRESS_EVERY, progress=fail)
    assert (outcome.status, outcome.cycles) == ("complete", 3 * PROGRESS_EVERY)
    assert asked == [PROGRESS_EVERY]
