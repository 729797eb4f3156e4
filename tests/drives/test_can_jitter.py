"""`jitter` on a machine that is bad, with a recording and without."""

import itertools
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from can_rig import BUS, LateTime

from legbench.commissioning.jitter import Timing, measure_link
from legbench.drives.emulated.build import emulate
from legbench.drives.emulated.bus import LockstepBus
from legbench.drives.emulated.faults import FrameFault, FrameFaultKind
from legbench.drives.emulated.network import Network
from legbench.drives.errors import DriveError
from legbench.drives.master.session import Session
from legbench.drives.setup.bus_file import load_bus
from legbench.limits.safety import SafetyLimits
from legbench.recording.reader import load
from legbench.recording.writer import RunWriter

STIFFNESS = (4.0, 5.0)
CYCLES = 100
TPDO = 0x181


@contextmanager
def looking() -> Iterator[tuple[Session, LateTime, Network]]:
    bus = load_bus(BUS)
    network = emulate(bus, configured=True)
    time = LateTime(network)
    with Session(LockstepBus("leg", network=network), bus, time) as session:
        yield session, time, network


def spoilt(session: Session, writer: RunWriter | None, spoil: Callable[[], None]) -> Timing:
    """Measure; something goes wrong as soon as the link has started."""
    with session.link(SafetyLimits(), STIFFNESS, read_only=True) as link:
        began_ns = link.start().time_ns
        spoil()
        return measure_link(session, link, CYCLES, writer, began_ns)


def test_a_machine_that_misses_ticks_is_measured_not_refused(tmp_path: Path) -> None:
    """Two ticks in a row are missed after each that is kept; a run ends at the third."""
    with looking() as (session, time, _), RunWriter.create(tmp_path, {}) as writer:

        def stall() -> None:
            time.late_ns = itertools.repeat(2_200_000)

        found = spoilt(session, writer, stall)
    # Late by 2.2 ms at the first, and from then on by 2.2 ms after a grid that was skipped to.
    assert found.counts() == {"skipped": 198, "late": 100, "silent": 0, "lost": 0}
    np.testing.assert_allclose(found.late_us, 2200.0)
    rows = load(writer.path)
    assert len(rows.time) == CYCLES
    np.testing.assert_allclose(np.diff(rows.time), 3e-3, rtol=0, atol=1e-9)
    np.testing.assert_allclose(rows["late_us"], 2200.0)


def test_a_drive_that_has_fallen_silent_is_counted(tmp_path: Path) -> None:
    with looking() as (session, _, network):

        def cut() -> None:
            kind = FrameFaultKind.DROP
            network.inject(FrameFault(kind=kind, cob_id=TPDO, start_ns=network.now_ns))

        found = spoilt(session, None, cut)
    assert found.lost == CYCLES
    assert found.skipped == 0
    assert found.silent == CYCLES - 1
    assert found.late == 0
    assert set(found.table()) == {"late_us", "exchange_us"}


def test_only_a_link_that_looks_goes_without_limits() -> None:
    with looking() as (session, _, _):
        link = session.link(SafetyLimits(), STIFFNESS)
        link.start()
        with pytest.raises(DriveError, match="limits have to watch it: use exchange"):
            link.look()
        link.exchange()
        link.close()
