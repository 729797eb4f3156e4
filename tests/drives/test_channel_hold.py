"""The share of one link in a lock that a session holds as well."""

from pathlib import Path

from legbench.drives.master.channel_hold import ChannelHold
from legbench.drives.transport.lock import ChannelLock


def test_a_hold_gives_back_what_it_has_taken_and_nothing_else(tmp_path: Path) -> None:
    lock = ChannelLock("leg", tmp_path)
    lock.acquire()  # The session's.
    hold = ChannelHold(lock)
    hold.release()
    assert lock.held
    for _ in range(2):
        hold.take()
        hold.release()
        hold.release()
        assert lock.held
    lock.release()
    assert not lock.held
    hold.take()
    assert lock.held
    hold.release()
    assert not lock.held
