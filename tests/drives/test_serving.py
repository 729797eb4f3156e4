"""A server of emulated drives by itself: what it serves, what it reports, when it ends."""

from types import SimpleNamespace
from typing import Any, cast

import pytest
from service_rig import BENCH, MS

from legbench.commissioning import emulate
from legbench.drives.emulated.drive import UNDER_VOLTAGE
from legbench.drives.emulated.network import Network

START = (0.25, -0.5)


class Wire:
    """A server whose polls let 1 ms pass."""

    def __init__(self, network: Network) -> None:
        self.network, self.polls, self.closed = network, 0, False

    def __enter__(self) -> "Wire":
        return self

    def __exit__(self, *_: object) -> None:
        self.closed = True

    def poll(self) -> None:
        self.polls += 1
        if self.polls == 20:
            self.network.drives[1].trip(UNDER_VOLTAGE, self.network.now_ns)
        self.network.advance(self.network.now_ns + MS)


def served(
    monkeypatch: pytest.MonkeyPatch, polls: int, *, fails: bool = False, **patience: Any
) -> Any:
    """Drives that were served for some polls, and all that happened."""
    seen = SimpleNamespace(wires=[], ready=[], told=[], asked=[])
    monkeypatch.setattr(emulate, "ask", lambda **kwargs: seen.asked.append(kwargs))

    def now() -> float:
        """A clock that shows 100 s at the beginning, and a second more with every poll."""
        return 100.0 + sum(wire.polls for wire in seen.wires)

    monkeypatch.setattr(emulate, "time", SimpleNamespace(monotonic=now))

    def report(at: float, node: str, state: str) -> None:
        assert at == seen.wires[0].polls
        seen.told.append((seen.wires[0].polls, node, state))
        if fails:
            raise OSError("closed")

    emulate.serve(
        BENCH,
        lambda networks: cast(Any, seen.wires.append(Wire(*networks)) or seen.wires[0]),
        start_pos=START,
        **patience,
        report=report,
        ready=seen.ready.append,
        stop=lambda: seen.wires[0].polls >= polls,
    )
    return seen


def test_every_change_of_a_state_is_reported_once_and_the_end_is_when_it_is_asked_for(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    seen = served(monkeypatch, 40)
    (wire,) = seen.wires
    assert (seen.ready, wire.closed, wire.polls) == ([wire], True, 40)
    # Drives come up 5 ms after power-on; the second one loses its supply.
    assert seen.told[:2] == [
        (1, "motor1", "not ready to switch on"),
        (1, "motor2", "not ready to switch on"),
    ]
    assert [told[1:] for told in seen.told[2:4]] == [
        ("motor1", "switch on disabled"),
        ("motor2", "switch on disabled"),
    ]
    assert seen.told[4:] == [(20, "motor2", "fault")]
    # A master on the same processor goes first: drives have one priority less.
    assert seen.asked == [{"priority": emulate.PRIORITY - 1}]


def test_drives_start_where_they_are_told_reply_at_once_and_are_as_patient(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    (wire,) = served(monkeypatch, 10, patience=7).wires
    behaviours = [drive._behaviour for drive in wire.network.drives]
    assert [how.start_pos for how in behaviours] == list(START)
    assert [how.reply_delay_us for how in behaviours] == [(0, 0), (0, 0)]
    assert [(how.missing_limit, how.sync_loss_periods) for how in behaviours] == [(7, 7)] * 2
    for drive, node, start in zip(wire.network.drives, BENCH.nodes, START, strict=True):
        assert node.motor.to_rad(drive._values[0x6064, 0]) == pytest.approx(start, abs=1e-4)


def test_drives_are_patient_for_five_periods_and_their_leg_moves_every_millisecond(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    (wire,) = served(monkeypatch, 10).wires
    behaviours = [drive._behaviour for drive in wire.network.drives]
    assert [(how.missing_limit, how.sync_loss_periods) for how in behaviours] == [(5, 5)] * 2
    assert wire.network._body_period_ns == MS


def test_every_drive_starts_somewhere(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(globals(), "START", (0.25,))
    with pytest.raises(ValueError, match="zip"):
        served(monkeypatch, 10)


def test_a_report_that_fails_takes_no_drives_from_their_master(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    seen = served(monkeypatch, 40, fails=True)
    assert (len(seen.told), seen.wires[0].polls, seen.wires[0].closed) == (1, 40, True)
