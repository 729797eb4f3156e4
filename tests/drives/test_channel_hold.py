"""The share of one link in a lock that a session holds as well."""

from pathlib import Path

import pytest

from legbench.drives.errors import BusError
from legbench.drives.master.channel_hold import ChannelHold
from legbench.drives.transport import lock as lock_module
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


def test_a_lock_that_excludes_a_second_master_needs_linux_and_a_private_one_does_not(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(what: str) -> None:
        raise BusError(f"{what} needs Linux")

    monkeypatch.setattr(lock_module, "require_linux", refuse)
    private = ChannelLock.private("leg")
    private.acquire()
    assert private.held
    private.release()
    lock = ChannelLock("leg", tmp_path)
    with pytest.raises(BusError, match="locking a channel against a second master needs Linux"):
        lock.acquire()
    assert not lock.held
