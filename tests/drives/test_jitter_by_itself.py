"""What `jitter` counts and records, from a link and a clock that are set by hand."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from drives_rig import MS, config

from legbench.commissioning import jitter
from legbench.commissioning.jitter import QUANTILES, Timing, measure_link
from legbench.drives.master.sample import Sample

BEGAN_NS = 500 * MS
LATE_US = (0.0, 99.9, 100.0, 100.1, 250.0)
"""Lateness of each SYNC; a tenth of the period is 100 us."""
PASSED = (0.002, 0.0015, 0.003, 0.001, 0.004)
"""Time of each cycle on the clock of this computer [s]."""


@dataclass
class Looking:
    """A link that skips a tick before each cycle and leaves one out on purpose before the last."""

    skipped_total: int = 7
    cycle: Any = field(default_factory=lambda: SimpleNamespace(silent_total=2))
    looks: int = 0
    now_ns: int = 0

    def look(self) -> Sample:
        place = self.looks
        self.looks += 1
        self.skipped_total += 1
        self.cycle.silent_total += place == len(LATE_US) - 1
        seen_ns = BEGAN_NS + 2 * MS * place
        self.now_ns = seen_ns + 100_000 * (place + 1)
        return Sample(
            time_ns=seen_ns,
            late_ns=round(1e3 * LATE_US[place]),
            skipped=1,
            motor_pos=(0.1 * place, -0.1 * place),
            link_pos=(0.2, 0.3 * place),
            spring_torque=(1.0, 2.0 * place),
            applied_pos=(),
            statusword=(0x40, 0x40),
            fresh=(True, place != 3),
            temperature=(None, None),
        )


def clock() -> Iterator[float]:
    now = 100.0
    yield now
    for passed in PASSED:
        now += passed
        yield now


@pytest.mark.parametrize("recorded", [False, True])
def test_every_cycle_is_measured_counted_and_recorded(
    recorded: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    link, rows, now = Looking(), list[tuple[Any, ...]](), clock()
    monkeypatch.setattr(jitter, "time", SimpleNamespace(perf_counter=lambda: next(now)))
    timebase = SimpleNamespace(now_ns=lambda: link.now_ns)
    session = cast(Any, SimpleNamespace(timebase=timebase, config=config()))
    writer = SimpleNamespace(append=lambda *row: rows.append(row)) if recorded else None
    found = measure_link(session, cast(Any, link), len(LATE_US), cast(Any, writer), BEGAN_NS)
    np.testing.assert_allclose(found.late_us, LATE_US)
    np.testing.assert_allclose(found.exchange_us, [100.0, 200.0, 300.0, 400.0, 500.0])
    # Five ticks were skipped, one of them on purpose; later than a tenth of a period came two.
    assert found.counts() == {"skipped": 4, "late": 2, "silent": 1, "lost": 1}
    assert len(rows) == (5 if recorded else 0)
    for place, (command, seen, cycle_us, late_us) in enumerate(rows):
        assert seen.time == pytest.approx(0.002 * place, abs=1e-12)
        assert (cycle_us, late_us) == pytest.approx((1e6 * PASSED[place], LATE_US[place]))
        # Nothing is commanded: what is recorded as command is where the motors are.
        for pair in (seen.motor_pos, seen.applied_pos, command.motor_pos):
            np.testing.assert_allclose(pair, (0.1 * place, -0.1 * place))
        np.testing.assert_allclose(seen.joint_pos, (0.2, 0.3 * place))
        np.testing.assert_allclose(seen.spring_torque, (1.0, 2.0 * place))
        np.testing.assert_array_equal(seen.joint_vel, (0.0, 0.0))


def test_a_table_has_the_quantiles_of_both_times() -> None:
    late, exchange = np.arange(1001.0), 2.0 * np.arange(1001.0)[::-1]
    timing = Timing(late_us=late, exchange_us=exchange, skipped=1, silent=2, late=3, lost=4)
    wanted = {"p50": 500.0, "p90": 900.0, "p99": 990.0, "p99_9": 999.0, "max": 1000.0}
    assert list(QUANTILES) == list(wanted)
    table = timing.table()
    assert table["late_us"] == pytest.approx(wanted)
    assert table["exchange_us"] == pytest.approx({key: 2 * at for key, at in wanted.items()})
    assert timing.counts() == {"skipped": 1, "late": 3, "silent": 2, "lost": 4}


@pytest.mark.parametrize("error", [None, "No space left on device"])
def test_a_log_that_failed_is_an_event_of_the_measurement(error: str | None) -> None:
    events: list[tuple[Any, ...]] = []

    class Log:
        """A log of a run."""

        def __init__(self) -> None:
            self.error: str | None = None
            self.closed = 0

        def write(self, line: bytes) -> None: ...

        def close(self) -> None:
            self.closed += 1
            self.error = error

    log = Log()
    writer = SimpleNamespace(
        log=lambda name: log,
        event=lambda time, name, **detail: events.append((time, name, detail)),
    )
    session = cast(Any, SimpleNamespace(channel="can0"))
    with jitter._bus_log(session, cast(Any, writer)) as shown:
        assert shown is not None
        assert (log.closed, events) == (0, [])
    assert log.closed == 1
    assert events == ([] if error is None else [(0.0, jitter.LOG_FAILED, {"error": error})])
    with jitter._bus_log(session, None) as shown:
        assert shown is None
