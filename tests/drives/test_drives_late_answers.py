"""An answer that is late never passes for new, whatever it says and however late it is."""

import random
import struct
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import can
import pytest
from drives_rig import LIMITS, MS, START, Rig, config, rig

from legbench.drives.emulated.behaviour import Behaviour
from legbench.drives.emulated.faults import FrameFault, FrameFaultKind
from legbench.drives.protocol.cia402 import DriveState
from legbench.drives.protocol.frame import Frame
from legbench.errors import PlantFault

KNEE = 0x182
WITHIN = 4
"""Cycles from the first late answer to the stop."""
FASTEST, SLOWEST = 240_000, 770_000
"""Of an answer that is not late; the slowest waits for the wire twice, because it is sent again."""
TAKE_UP = 250_000
"""A delay below this may still end before the deadline [ns]."""


def snapshots(it: Rig) -> Callable[[], int]:
    """What the knee drive showed at the last SYNC, from inside the drive."""
    drive, seen = it.network.drives[1], []
    original = drive._pdos.sample

    def sample(pdo) -> bytes:
        seen.append(drive._values[0x6064, 0])
        return original(pdo)

    drive._pdos.sample = sample
    return lambda: seen[-1]


def sway(it: Rig, cycles: int, look: Callable[[int], None]) -> None:
    """Move all the time, so that an old position is another one."""
    for cycle in range(cycles):
        it.link.command((START[0], START[1] - 0.001 * (cycle % 400)))
        it.link.exchange()
        look(cycle)


@pytest.mark.parametrize("delay_ns", range(TAKE_UP, 6 * MS, 150_000))
def test_answers_that_lag_stop_the_leg_and_never_count(tmp_path: Path, delay_ns: int) -> None:
    with rig(tmp_path) as it:
        it.link.start()
        now_at_sync = snapshots(it)
        start_ns = it.network.now_ns // MS * MS + 50 * MS
        it.network.inject(
            FrameFault(kind=FrameFaultKind.DELAY, cob_id=KNEE, start_ns=start_ns, delay_ns=delay_ns)
        )
        late = 0

        def look(_cycle: int) -> None:
            nonlocal late
            axis = it.link.cycle.axes[1]
            late += axis.fresh and axis.motor_counts != now_at_sync()

        words = r"sent no process data for [34] cycles, the limit is 3"
        with pytest.raises(PlantFault, match=words):
            sway(it, 400, look)
        stopped_ns = next(at_ns for at_ns, _, word in it.words() if word == 0x02)
        missing_from = 0 if delay_ns > 600_000 else 20
        assert stopped_ns - start_ns < (WITHIN + missing_from) * MS
        # Between two and 2.65 ms after its SYNC it can pass once, in the cycle before the stop.
        assert late <= (2 * MS - SLOWEST < delay_ns < 2 * MS + 650_000 - FASTEST)
        assert it.states == [DriveState.SWITCH_ON_DISABLED] * 2


@pytest.mark.parametrize("seed", range(5))
def test_single_late_answers_are_bridged_and_never_count(tmp_path: Path, seed: int) -> None:
    chance = random.Random(seed)
    with rig(tmp_path) as it:
        it.link.start()
        now_at_sync = snapshots(it)
        at_ns = it.network.now_ns // MS * MS + 10 * MS
        for _ in range(20):
            it.network.inject(
                FrameFault(
                    kind=FrameFaultKind.DELAY,
                    cob_id=KNEE,
                    start_ns=at_ns,
                    end_ns=at_ns + MS,
                    delay_ns=chance.randrange(MS // 10, 6 * MS // 5),
                )
            )
            at_ns += chance.randrange(10, 30) * MS

        def look(_cycle: int) -> None:
            axis = it.link.cycle.axes[1]
            assert not axis.fresh or axis.motor_counts == now_at_sync()

        sway(it, 600, look)
        assert it.link.cycle.watches[1].lost_total >= 10
        assert it.link.cycle.watches[0].lost_total == 0


@pytest.mark.parametrize("delay_us", [(0, 0), (50, 250), (200, 250)])
@pytest.mark.parametrize("seed", range(3))
def test_the_jitter_of_answers_is_no_alarm(
    tmp_path: Path, delay_us: tuple[int, int], seed: int
) -> None:
    how = [Behaviour(start_pos=pos, seed=seed, reply_delay_us=delay_us) for pos in START]
    with rig(tmp_path, behaviours=how) as it:
        it.link.start()
        now_at_sync = snapshots(it)

        def look(_cycle: int) -> None:
            assert it.link.cycle.axes[1].motor_counts == now_at_sync()

        sway(it, 700, look)
        assert (it.link.cycle.silent_total, it.link.cycle.late_frames) == (0, 0)


def test_a_stop_waits_for_no_late_answer(tmp_path: Path) -> None:
    with rig(tmp_path, bus_config=config(), limits=LIMITS) as it:
        it.link.start()
        it.run(5)
        start_ns = it.network.now_ns // MS * MS + MS
        it.network.inject(FrameFault(kind=FrameFaultKind.DROP, cob_id=KNEE, start_ns=start_ns))
        it.run(1)
        assert it.link.cycle._owed == {KNEE}
        before = it.network.now_ns
        it.link.stop()
        syncs = [at for at, frame in it.network.log or [] if frame.cob_id == 0x080 and at > before]
        assert syncs[0] // MS == before // MS + 1
        assert it.link.cycle.silent_total == 0


def test_a_late_answer_behind_a_frame_of_others_is_found_too(tmp_path: Path) -> None:
    with rig(tmp_path) as it:
        it.link.start()
        it.run(5)
        other = it.network.attach()
        it.network.advance(it.network.now_ns // MS * MS + 700_000)
        old = it.link.cycle.axes[1].motor_counts + 5000
        for frame in (
            Frame(0x1234567, b"x", extended=True),
            Frame(0x123, remote=True),
            Frame(KNEE, struct.pack("<Hih", 0x1237, old, 0)),
        ):
            it.network.send(other, frame)
        it.link.exchange()
        assert it.link.cycle.late_frames == 1
        assert it.link.cycle.axes[1].motor_counts != old


def test_silent_ticks_neither_follow_each_other_nor_stretch_the_heartbeat(tmp_path: Path) -> None:
    with rig(tmp_path, limits=replace(LIMITS, lost_frames=1000, waive=("lost_frames",))) as it:
        it.link.start()
        start_ns = it.network.now_ns // MS * MS + MS
        it.network.inject(FrameFault(kind=FrameFaultKind.DROP, cob_id=KNEE, start_ns=start_ns))
        it.run(200)
        assert it.link.cycle.silent_total > 190

        def gaps(cob_id: int) -> list[int]:
            log = it.network.log or []
            times = [at for at, frame in log if frame.cob_id == cob_id and at > start_ns]
            return [after - before for before, after in pairwise(times)]

        assert max(gaps(0x080)) < 2.1 * MS
        assert max(gaps(0x202)) < 2.1 * MS  # its deadline in the drive is 20 ms (1400h:05)
        beat_ns = it.config.master_heartbeat_ms * MS
        assert max(gaps(0x700 + it.config.master_id)) < beat_ns + 2.1 * MS


def test_what_could_not_be_read_before_sync_never_counts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with rig(tmp_path) as it:
        it.link.start()
        it.run(5)
        receive, failures = it.bus.recv, ["Network is down"]

        def recv(timeout: float | None = None) -> can.Message | None:
            if failures:
                raise can.CanOperationError(failures.pop())
            return receive(timeout)

        monkeypatch.setattr(it.bus, "recv", recv)
        old = it.link.cycle.axes[1].motor_counts + 5000
        it.bus.inject(Frame(KNEE, struct.pack("<Hih", 0x1237, old, 0)))
        it.link.exchange()
        assert it.link.cycle.late_frames == 1
        assert it.link.cycle.axes[1].motor_counts != old


def test_a_flood_holds_up_no_stop(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Frames of somebody else that never end, each read in 0.1 ms."""
    with rig(tmp_path) as it:
        it.link.start()
        it.run(5)
        time, asked = it.bus.timebase, 0

        def recv(timeout: float | None = None) -> can.Message | None:
            nonlocal asked
            asked += 1
            assert asked < 1000
            time.wait_until(time.now_ns() + MS // 10)
            return can.Message(arbitration_id=0x7A0, is_extended_id=False)

        with monkeypatch.context() as flooded:
            flooded.setattr(it.bus, "recv", recv)
            with pytest.raises(PlantFault) as caught:
                it.run(20)
        assert caught.value.cause in ("bus error", "process data lost", "cycle overruns")
        it.link.close()
        assert DriveState.OPERATION_ENABLED not in it.states
