"""When a trial counts a dead part as contradicted, found in time or missed, on a scripted stage."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any, cast

import pytest

from legbench.commissioning import dead_parts
from legbench.commissioning.broken_plant import Part
from legbench.commissioning.dead_part_stage import Death, Emulation
from legbench.commissioning.dead_parts import TrialOutcome, try_dead_part, watch_healthy
from legbench.errors import PlantFault
from legbench.servo import ServoConfig

PERIOD = 0.01
ONSET = 0.05
"""The part dies in cycle 5."""


@dataclass
class Stage:
    """A plant that ends in a cycle, and a part that differs from healthy ones as time goes on."""

    ends: int | None = None
    shows: dict[int, float] = field(default_factory=dict[int, float])
    """Cycle -> difference after it [rad]; before the first of them none."""
    cycles: int = 0
    killed_at: list[int] = field(default_factory=list[int])
    began: list[Any] = field(default_factory=list[Any])

    def __post_init__(self) -> None:
        self.plant = SimpleNamespace(period=PERIOD, reset=lambda: "first", step=self._step)
        self.controller = SimpleNamespace(reset=self.began.append, step=lambda seen: ("for", seen))

    def _step(self, command: Any) -> Any:
        cycle = self.cycles
        assert command == ("for", "first" if cycle == 0 else SimpleNamespace(time=cycle * PERIOD))
        if cycle == self.ends:
            raise PlantFault("following error", "it does not follow")
        self.cycles += 1
        return SimpleNamespace(time=self.cycles * PERIOD)

    def kill(self) -> None:
        self.killed_at.append(self.cycles)

    def contradiction(self) -> float:
        return max((size for at, size in self.shows.items() if at <= self.cycles - 1), default=0.0)


def tried(stage: Stage, part: Part, monkeypatch: pytest.MonkeyPatch) -> TrialOutcome:
    @contextmanager
    def staged(*given: Any) -> Iterator[Stage]:
        assert given[-1].part is part
        yield stage

    monkeypatch.setattr(dead_parts, "staged", staged)
    bench = cast(Any, None)
    found = try_dead_part(
        bench, Emulation.SIM, "jump", Death(part=part, drive=1, onset=ONSET), ServoConfig()
    )
    assert stage.began == ["first"]
    return found


JAMMED, STEP, DRIFT = Part.JAMMED, Part.MOTOR_STEP, Part.LINK_DRIFT


@pytest.mark.parametrize(
    ("ends", "shows", "time", "excited"),
    [
        # Contradicted in cycle 8, found in cycle 12.
        (12, {8: 0.031}, 0.04, True),
        # As much as may be without being one, and twice that before the part died.
        (12, {8: 0.03}, 0.0, False),
        (12, {3: 0.06}, 0.07, True),
        # In the very cycle in which it died.
        (12, {5: 0.031}, 0.07, True),
        (12, {}, 0.0, False),
        (5, {}, 0.0, False),
    ],
)
def test_time_runs_from_the_contradiction_to_the_end(
    ends: int, shows: dict[int, float], time: float, excited: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    stage = Stage(ends, shows)
    found = tried(stage, JAMMED, monkeypatch)
    assert stage.killed_at == [5]
    assert (found.cause, found.excited) == ("following error", excited)
    assert found.time == pytest.approx(time)
    assert found.since_death == pytest.approx((ends - 5) * PERIOD)


@pytest.mark.parametrize("part", [STEP, DRIFT])
def test_steps_and_drifts_contradict_from_the_moment_on_in_which_they_begin(
    part: Part, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = tried(Stage(9), part, monkeypatch)
    assert (found.time, found.excited) == (pytest.approx(0.04), True)


@pytest.mark.parametrize(("shows", "excited"), [({}, False), ({100: 0.04}, True)])
def test_a_part_that_is_not_found_within_1500_ms_is_missed(
    shows: dict[int, float], excited: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    stage = Stage(None, shows)
    found = tried(stage, JAMMED, monkeypatch)
    assert found == TrialOutcome(cause=None, time=None, since_death=None, excited=excited)
    assert stage.cycles == 5 + 150


def test_a_run_that_ends_before_the_part_dies_is_no_trial(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(PlantFault, match="it does not follow"):
        tried(Stage(4), JAMMED, monkeypatch)


def test_a_part_is_found_in_time_within_50_ms_and_a_drift_within_150() -> None:
    for part, bound in ((JAMMED, 0.05), (STEP, 0.05), (DRIFT, 0.15)):
        for time, found in ((bound, True), (bound + 1e-9, False), (0.0, True)):
            outcome = TrialOutcome(cause="sway", time=time, since_death=time, excited=True)
            assert outcome.within(part) is found
    for excited in (False, True):
        missed = TrialOutcome(cause=None, time=None, since_death=None, excited=excited)
        assert missed.within(JAMMED) is not excited


@pytest.mark.parametrize(("ends", "said"), [(7, "following error at 0.070 s: it"), (None, None)])
def test_a_healthy_leg_runs_its_time_or_says_what_ended_it(
    ends: int | None, said: str | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    stage = Stage(ends)

    @contextmanager
    def staged(*given: Any) -> Iterator[Stage]:
        assert given[-1] is None
        yield stage

    monkeypatch.setattr(dead_parts, "staged", staged)
    found = watch_healthy(cast(Any, None), Emulation.CAN, "jump", ServoConfig(), 0.2)
    assert str(found).startswith(str(said))
    assert stage.cycles == (20 if ends is None else ends)
    assert stage.began == ["first"]
    assert stage.killed_at == []
