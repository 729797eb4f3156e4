"""What learning from a data sheet asks of the parts that judge it, and which words it heeds."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from legbench.commissioning import learn
from legbench.drives.errors import DriveError
from legbench.drives.setup.bus_numbers import RUN_PERIODS_US
from legbench.errors import ConfigError

HERE = Path()
PROPOSAL: Any = SimpleNamespace(sheet="sheet")


class Judges:
    """The parts that judge a bus; which periods carry all frames, and which the drives take."""

    def __init__(self, patch: pytest.MonkeyPatch, carry: set[int], take: set[int]) -> None:
        self.asked: list[int] = []
        self.carry, self.take = carry, take
        patch.setattr(learn, "waivers_for", lambda *_given, **_told: ())
        patch.setattr(learn, "bus_text", lambda *_given, period_us: period_us)
        patch.setattr(
            learn, "_parsed", lambda text, _folder: SimpleNamespace(period=text, nodes=("a", "b"))
        )
        patch.setattr(learn, "check_budget", self.check_budget)
        patch.setattr(learn, "assess", self.assess)

    def check_budget(self, bus: Any) -> None:
        self.asked.append(bus.period)
        if bus.period not in self.carry:
            raise ConfigError(f"too short: {bus.period}")

    def assess(self, _sheet: object, bus: Any, node: str) -> Any:
        refused = node == "b" and bus.period not in self.take
        return SimpleNamespace(problems=("refused",) if refused else ())


def test_a_bus_that_no_period_carries_is_refused_at_the_last(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    judges = Judges(monkeypatch, set(), set())
    with pytest.raises(ConfigError, match=f"too short: {RUN_PERIODS_US[-1]}$"):
        learn._period_us(PROPOSAL, (1, 2), HERE)
    assert judges.asked == list(RUN_PERIODS_US)


def test_the_period_is_the_shortest_that_all_drives_take_else_the_shortest_that_carries(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    first, second, *others = RUN_PERIODS_US
    for carry, take, chosen, looks in (
        ({first, second}, {first}, first, 1),
        ({second, *others}, {second}, second, 2),
        ({first, *others}, {others[0]}, others[0], 3),
        ({first}, set[int](), first, len(RUN_PERIODS_US)),
        ({second, others[-1]}, set[int](), second, len(RUN_PERIODS_US)),
    ):
        with monkeypatch.context() as patch:
            judges = Judges(patch, carry, take)
            assert learn._period_us(PROPOSAL, (1, 2), HERE) == chosen
            assert judges.asked == list(RUN_PERIODS_US[:looks])


@pytest.mark.parametrize(
    ("found", "watched", "braked"),
    [
        ((("means", "ramp"), ("means", "ramp")), True, True),
        ((("means", "ramp"), ("", "other")), False, False),
        ((("", "other"), ("means", "ramp")), False, False),
        ((("means", "other"), ("means", "ramp")), True, False),
    ],
)
def test_what_a_bus_waives_is_what_not_every_drive_has(
    monkeypatch: pytest.MonkeyPatch,
    found: tuple[tuple[str, str], ...],
    watched: bool,
    braked: bool,
) -> None:
    told: list[tuple[bool, bool]] = []
    ids: list[object] = []
    nodes = [SimpleNamespace(name=str(place)) for place in range(2)]
    bus = SimpleNamespace(nodes=nodes)
    answers = {
        node.name: SimpleNamespace(
            means=means,
            outcomes=(SimpleNamespace(parameter=SimpleNamespace(key=key)),),
            node=node.name,
            problems=("unfit",),
        )
        for node, (means, key) in zip(nodes, found, strict=True)
    }

    def waivers_for(_proposal: object, *, watched: bool, braked: bool) -> tuple[str, ...]:
        told.append((watched, braked))
        return ()

    def propose(*_given: object) -> Any:
        return PROPOSAL

    def period(_proposal: object, chosen: object, _folder: Path) -> int:
        ids.append(chosen)
        return 2000

    monkeypatch.setattr(learn, "load_sheet", lambda _path: "sheet")
    monkeypatch.setattr(learn, "propose", propose)
    monkeypatch.setattr(learn, "_period_us", period)
    monkeypatch.setattr(learn, "waivers_for", waivers_for)
    monkeypatch.setattr(learn, "bus_text", lambda *_given, period_us: str(period_us))
    monkeypatch.setattr(learn, "_parsed", lambda _text, _folder: bus)
    monkeypatch.setattr(learn, "assess", lambda _sheet, _bus, node: answers[node.name])
    monkeypatch.setattr(learn, "quick_stop_ramp", lambda _node: "ramp")
    learned = learn.learn(Path("it.eds"), Path("leg.toml"))
    assert told == [(False, False), (watched, braked)]
    assert ids == [(1, 2)]
    assert learned.problems == ("'0', '1': unfit",)


@pytest.mark.parametrize("fit", [True, False])
def test_what_drives_take_is_asked_of_those_that_are_fit(
    monkeypatch: pytest.MonkeyPatch, fit: bool
) -> None:
    asked: list[object] = []

    def check_taken(_bus: object, outcomes: object) -> None:
        asked.append(outcomes)
        raise DriveError("not taken")

    one = SimpleNamespace(node="a", problems=() if fit else ("unfit",), outcomes="outcomes")
    monkeypatch.setattr(learn, "assess", lambda *_given: one)
    monkeypatch.setattr(learn, "check_taken", check_taken)
    bus: Any = SimpleNamespace(nodes=(SimpleNamespace(name="a"),))
    judged = learn._judged(bus, {"a": PROPOSAL}, "")
    assert judged.problems == (("not taken",) if fit else ("'a': unfit",))
    assert asked == ([{"a": "outcomes"}] if fit else [])


def test_only_a_drive_with_a_data_sheet_is_judged_by_one(monkeypatch: pytest.MonkeyPatch) -> None:
    sheet = Path("it.eds")
    nodes = (SimpleNamespace(name="a", eds=None), SimpleNamespace(name="b", eds=sheet))
    bus: Any = SimpleNamespace(nodes=nodes)
    problems = SimpleNamespace(node="b", problems=("unfit", "too slow"))
    monkeypatch.setattr(learn, "load_sheet", lambda path: f"sheet of {path}")
    monkeypatch.setattr(learn, "assess", lambda _sheet, _bus, _node: problems)
    monkeypatch.setattr(learn, "predict", lambda found, _bus, node: (found, node.name))
    monkeypatch.setattr(learn, "held_by", lambda outcomes: ("held", *outcomes))
    monkeypatch.setattr(learn, "means_of", lambda _bus, node, *, speed, held: (speed, held))
    assert learn.problems_of(bus) == ("'b': unfit", "'b': too slow")
    assert learn.known_means(bus, speed=3.0) == {
        "a": (3.0, None),
        "b": (3.0, ("held", "sheet of it.eds", "b")),
    }
