"""One master a channel, on a computer that several people use."""

import errno
import os
import signal
import socket
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from drives_rig import LIMITS, STIFFNESS, config

from legbench.drives.emulated.build import emulate
from legbench.drives.emulated.bus import LockstepBus
from legbench.drives.errors import BusError
from legbench.drives.master.session import Session
from legbench.drives.transport.lock import ASKED_AT_MOST, LONGEST_ADDRESS, ChannelLock

NOBODY = 65534
HOLDER = (
    "import os, sys; from pathlib import Path;"
    "from legbench.drives.transport.lock import ChannelLock;"
    "os.umask(0o077);"
    "lock = ChannelLock(sys.argv[1], Path(sys.argv[2]));"
    "len(sys.argv) > 3 and os.seteuid(int(sys.argv[3]));"
    "lock.acquire(); print('held', flush=True); sys.stdin.read()"
)


@contextmanager
def held_elsewhere(
    name: str, folder: Path, *, user: int | None = None
) -> Iterator[subprocess.Popen[str]]:
    """A process that holds a lock, of another user if need be, until the block ends."""
    arguments = [name, str(folder), *([] if user is None else [str(user)])]
    with subprocess.Popen(
        [sys.executable, "-c", HOLDER, *arguments],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as process:
        assert process.stdout is not None
        assert process.stdin is not None
        assert process.stdout.readline() == "held\n"
        yield process
        process.stdin.close()
        process.wait(60)


def test_a_lock_touches_no_file_that_somebody_planted(tmp_path: Path) -> None:
    """A symbolic link is not followed, a FIFO not opened, a directory and a file are left alone."""
    precious = tmp_path / "precious"
    precious.write_text("not to be truncated\n")
    lock = ChannelLock("bus", tmp_path)
    plants = [tmp_path / name for name in ("legbench-bus.lock", "bus", "legbench bus")]
    ways: list[Callable[[Path], object]] = [
        lambda path: path.symlink_to(precious),
        os.mkfifo,
        Path.mkdir,
        lambda path: path.write_text("12345\n"),
    ]
    for plant in ways:
        for path in plants:
            plant(path)
        before = sorted((path.name, path.lstat().st_mtime_ns) for path in tmp_path.iterdir())
        lock.acquire()
        with pytest.raises(BusError, match=f"already has a master, process {os.getpid()};"):
            ChannelLock("bus", tmp_path).acquire()
        lock.release()
        after = sorted((path.name, path.lstat().st_mtime_ns) for path in tmp_path.iterdir())
        assert after == before
        for path in plants:
            path.rmdir() if path.is_dir() else path.unlink()
    assert precious.read_text() == "not to be truncated\n"


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can be two users")
@pytest.mark.parametrize("user", [0, NOBODY])
def test_root_and_others_share_a_lock(user: int, tmp_path: Path) -> None:
    """Each is refused while the other holds it, and gets it afterwards, whatever the umask."""
    mine = NOBODY if user == 0 else 0
    lock = ChannelLock("bus", tmp_path)
    with held_elsewhere("bus", tmp_path, user=user) as process:
        os.seteuid(mine)
        try:
            with pytest.raises(BusError, match=f"has a master, process {process.pid};"):
                lock.acquire()
        finally:
            os.seteuid(0)
    os.seteuid(mine)
    try:
        lock.acquire()
        lock.release()
    finally:
        os.seteuid(0)


def test_a_killed_holder_leaves_nothing_behind(tmp_path: Path) -> None:
    lock = ChannelLock("bus", tmp_path)
    with held_elsewhere("bus", tmp_path) as process:
        process.send_signal(signal.SIGKILL)
        process.wait(60)
        lock.acquire()
    assert lock.held
    lock.release()


def test_a_frozen_holder_still_holds_and_is_named(tmp_path: Path) -> None:
    lock = ChannelLock("bus", tmp_path)
    with held_elsewhere("bus", tmp_path) as process:
        process.send_signal(signal.SIGSTOP)
        try:
            for _ in range(3):
                with pytest.raises(BusError, match=f"process {process.pid};"):
                    lock.acquire()
        finally:
            process.send_signal(signal.SIGCONT)


def test_a_holder_that_was_asked_too_often_is_unknown(tmp_path: Path) -> None:
    lock, other = ChannelLock("bus", tmp_path), ChannelLock("bus", tmp_path)
    lock.acquire()
    for _ in range(ASKED_AT_MOST + 1):
        with pytest.raises(BusError, match="already has a master"):
            other.acquire()
    with pytest.raises(BusError, match="process unknown;"):
        other.acquire()
    lock.release()
    other.acquire()
    other.release()


def test_long_names_are_told_apart(tmp_path: Path) -> None:
    names = [f"slcan /dev/{'x' * 200}{end}" for end in "ab"]
    locks = [ChannelLock(name, tmp_path) for name in names]
    for lock in locks:
        assert len(lock.address) == 1 + LONGEST_ADDRESS
        lock.acquire()
    with pytest.raises(BusError, match="already has a master"):
        ChannelLock(names[0], tmp_path).acquire()
    for lock in locks:
        lock.release()


def test_a_computer_without_such_names_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_arguments: object) -> None:
        raise PermissionError(errno.EPERM, os.strerror(errno.EPERM))

    class Walled(socket.socket):
        bind = refuse

    monkeypatch.setattr(socket, "socket", Walled)
    with pytest.raises(BusError, match=r"cannot lock bus: Operation not permitted"):
        ChannelLock("bus", tmp_path).acquire()


def test_an_emulated_bus_of_this_process_binds_no_name() -> None:
    names = Path("/proc/net/unix")
    with LockstepBus("mine", network=emulate(config())) as bus:
        mine = f"legbench {bus.channel_info}"
        with Session(bus, config()) as session:
            session.hold()
            with session.link(LIMITS, STIFFNESS) as link:
                link.start()
                assert mine not in names.read_text()
        public = ChannelLock(str(bus.channel_info))
        public.acquire()
        assert mine in names.read_text()
        public.release()
        assert mine not in names.read_text()


def test_a_lock_is_the_same_from_everywhere(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = ChannelLock.of_channel("socketcan", "can0").address
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.chdir(tmp_path)
    assert ChannelLock.of_channel("socketcan", "can0").address == before
