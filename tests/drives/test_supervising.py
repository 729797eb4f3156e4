"""What ends a run besides motion, each count at both sides of its edge, on either of two drives."""

from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any, cast

import pytest
from drives_rig import LIMITS, config, node

from legbench.drives.master.axis_link import AxisLink
from legbench.drives.master.cycle import Tick
from legbench.drives.master.notices import Notices
from legbench.drives.master.supervisor import Supervisor
from legbench.drives.protocol.cia402 import Goal
from legbench.drives.setup.config import BusConfig
from legbench.errors import PlantFault
from legbench.limits.safety import SafetyLimits

ENABLED, FOLLOWS = 0x0237, 1 << 12


@dataclass
class Watch:
    """A drive whose trouble is written down."""

    found: tuple[str, str] | None = None
    asked: list[tuple[int, int]] = field(default_factory=list)
    well_until_ns: int = 1233

    def trouble(self, now_ns: int, lost_frames: int) -> tuple[str, str] | None:
        self.asked.append((now_ns, lost_frames))
        return self.found


@dataclass
class Scene:
    """A cycle of two drives as a supervisor sees it."""

    bus: BusConfig = field(default_factory=config)
    stranger: int | None = None
    bus_off: bool = False
    bus_error: Exception | None = None
    axes: list[AxisLink] = field(default_factory=lambda: [AxisLink(node(0)), AxisLink(node(1))])
    watches: list[Watch] = field(default_factory=lambda: [Watch(), Watch()])
    notices: Notices = field(default_factory=Notices)
    polls: list[Any] = field(
        default_factory=lambda: [SimpleNamespace(unanswered=0), SimpleNamespace(unanswered=0)]
    )

    def supervisor(self, **limits: float) -> Supervisor:
        values: dict[str, Any] = {name: getattr(LIMITS, name) for name in ("motor_range",)} | limits
        clock = SimpleNamespace(now_ns=lambda: 1234)
        chosen = SafetyLimits(**values)
        return Supervisor(cast(Any, self), self.bus, chosen, cast(Any, clock))


def tick(skipped: int = 0, silent: int = 0) -> Tick:
    return Tick(0, 0, skipped, silent, True)


def cause(act: Any, *args: Any, **kwargs: Any) -> str | None:
    """Cause of the fault that is raised, if one is."""
    try:
        act(*args, **kwargs)
    except PlantFault as fault:
        return fault.cause
    return None


def test_a_controller_off_the_bus_ends_a_run() -> None:
    scene = Scene()
    watched = scene.supervisor()
    assert cause(watched.bus, tick()) is None
    scene.bus_off = True
    with pytest.raises(PlantFault, match="the controller has left the bus") as caught:
        watched.bus(tick())
    assert caught.value.cause == "bus off"


def test_a_second_master_ends_a_run_wherever_it_is_looked_for() -> None:
    for look in ("bus", "alone"):
        scene = Scene()
        watched = scene.supervisor()
        assert cause(watched.check_no_other_master) is None
        scene.stranger = 0x77E
        with pytest.raises(PlantFault, match="somebody else sends 77Eh") as caught:
            watched.bus(tick()) if look == "bus" else watched.check_no_other_master()
        assert caught.value.cause == "second master"


@pytest.mark.parametrize("limit", [1, 3])
def test_overruns_in_a_row_end_a_run_and_silent_ticks_are_none(limit: int) -> None:
    for skips, last in (
        ([1] * limit, limit),
        ([limit], limit),
        ([limit + 4], limit + 4),
    ):
        watched = Scene().supervisor(overrun_cycles=limit)
        for skipped in skips[:-1]:
            assert cause(watched.bus, tick(skipped)) is None
        with pytest.raises(PlantFault, match=rf"^{last} ticks of 1000 us .* limit is {limit};"):
            watched.bus(tick(skips[-1]))
    watched = Scene().supervisor(overrun_cycles=limit)
    for _ in range(10):
        # Left out on purpose, or made good for by a cycle in time.
        assert cause(watched.bus, tick(5, silent=5)) is None
        if limit > 1:
            assert cause(watched.bus, tick(limit - 1)) is None
        assert cause(watched.bus, tick()) is None
    assert cause(watched.bus, tick(limit + 2, silent=2)) == "cycle overruns"


@pytest.mark.parametrize("limit", [1, 3])
def test_commands_not_sent_in_a_row_end_a_run(limit: int) -> None:
    scene = Scene(bus_error=OSError("no buffer"))
    watched = scene.supervisor(lost_frames=limit)
    for _ in range(3):
        for _ in range(limit - 1):
            assert cause(watched.sent, complete=False) is None
        assert cause(watched.sent, complete=True) is None
    for _ in range(limit - 1):
        watched.sent(complete=False)
    words = f"could not be sent for {limit} cycles, the limit is {limit}; no buffer"
    with pytest.raises(PlantFault, match=words) as caught:
        watched.sent(complete=False)
    assert caught.value.cause == "command not sent"


@pytest.mark.parametrize("place", [0, 1])
def test_trouble_of_either_drive_ends_a_run_with_what_the_bus_said(place: int) -> None:
    for error in (None, OSError("no buffer")):
        scene = Scene(bus_error=error)
        watched = scene.supervisor(lost_frames=7)
        assert cause(watched.drives) is None
        assert [watch.asked for watch in scene.watches] == [[(1234, 7)]] * 2
        scene.watches[1 - place].well_until_ns = 1234
        assert cause(watched.drives) is None
        assert [len(watch.asked) for watch in scene.watches] == [2 - place, 1 + place]
        scene.watches[place].found = ("drive emergency", "it hurts")
        with pytest.raises(PlantFault) as caught:
            watched.drives()
        assert caught.value.cause == "drive emergency"
        assert str(caught.value) == "it hurts" + ("" if error is None else "; no buffer")


@pytest.mark.parametrize("place", [0, 1])
def test_a_temperature_that_is_not_reported_three_times_ends_a_run_that_limits_it(
    place: int,
) -> None:
    name = ("hip", "knee")[place]
    scene = Scene()
    watched = scene.supervisor(temperature=60.0)
    for unanswered in (0, 1, 2):
        scene.polls[place].unanswered = unanswered
        assert cause(watched.drives) is None
    for unanswered in (3, 4):
        scene.polls[place].unanswered = unanswered
        words = rf"drive '{name}' \(node {place + 1}\) .* temperature for {unanswered} requests"
        with pytest.raises(PlantFault, match=words) as caught:
            watched.drives()
        assert caught.value.cause == "temperature"
    assert cause(scene.supervisor().drives) is None


def enabled(scene: Scene) -> None:
    """Both drives have been led to operation enabled, and follow."""
    for axis in scene.axes:
        axis.machine.seek(Goal.ENABLED)
        axis.statusword, axis.fresh = ENABLED | FOLLOWS, True
        for _ in range(3):
            axis.machine.step(axis.statusword)


@pytest.mark.parametrize("place", [0, 1])
def test_a_drive_that_left_operation_enabled_ends_a_run_at_once(place: int) -> None:
    name = ("hip", "knee")[place]
    scene = Scene()
    enabled(scene)
    watched = scene.supervisor()
    assert cause(watched.states, 0) is None
    scene.axes[place].statusword = 0x0250
    # What it showed before its frame was lost says nothing of this cycle.
    scene.axes[place].fresh = False
    assert cause(watched.states, 0) is None
    scene.axes[place].fresh = True
    words = rf"'{name}' \(node {place + 1}\) left operation enabled: 0250h: switch on disabled"
    with pytest.raises(PlantFault, match=words) as caught:
        watched.states(0)
    assert caught.value.cause == "drive not enabled"


@pytest.mark.parametrize("place", [0, 1])
@pytest.mark.parametrize("bit", [7, 11])
def test_a_warning_is_noted_with_its_time_though_the_run_ends_with_it(place: int, bit: int) -> None:
    scene = Scene()
    enabled(scene)
    watched = scene.supervisor(following_cycles=1)
    watched.states(5)
    assert scene.notices.events == {}
    scene.axes[place].statusword = ENABLED | 1 << bit
    assert cause(watched.states, 2_000_000_000) is None
    assert cause(watched.states, 3_000_000_000) == "command ignored"
    ((name, event),) = scene.notices.events.items()
    assert name.endswith(("hip", "knee")[place])
    assert (event["count"], event["first"]) == (2, 2.0)


@pytest.mark.parametrize("place", [0, 1])
def test_a_drive_without_data_hides_nothing_of_the_other_one(place: int) -> None:
    for shown, limit, found in ((0x0250, 5, "drive not enabled"), (ENABLED, 1, "command ignored")):
        scene = Scene()
        enabled(scene)
        watched = scene.supervisor(following_cycles=limit)
        scene.axes[1 - place].fresh = False
        scene.axes[place].statusword = shown
        told = [cause(watched.states, 0) for _ in range(2)]
        assert told == ([found] * 2 if shown != ENABLED else [None, found])


@pytest.mark.parametrize("place", [0, 1])
@pytest.mark.parametrize("limit", [1, 4])
def test_a_drive_that_ignores_its_target_longer_than_allowed_ends_a_run(
    place: int, limit: int
) -> None:
    scene = Scene()
    enabled(scene)
    watched = scene.supervisor(following_cycles=limit)
    for _ in range(3):
        scene.axes[place].statusword = ENABLED
        for _ in range(limit):
            assert cause(watched.states, 0) is None
        # One cycle in which it follows, and the count begins anew.
        scene.axes[place].statusword = ENABLED | FOLLOWS
        assert cause(watched.states, 0) is None
    scene.axes[place].statusword = ENABLED
    for _ in range(limit):
        watched.states(0)
    with pytest.raises(PlantFault, match="does not follow its target: ") as caught:
        watched.states(0)
    assert caught.value.cause == "command ignored"
    shown = ["0237h", "0237h"]
    shown[1 - place] = "1237h"
    assert [part[:5] for part in str(caught.value).split(": ", 1)[1].split("; ")] == shown
