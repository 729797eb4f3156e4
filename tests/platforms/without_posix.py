"""Program that runs command lines of legbench with everything hidden that only POSIX systems have.

Its argument is a JSON list of command lines, in which RUN is the first run in `runs`; it prints the
list of their exit statuses on stderr.
"""

import asyncio
import concurrent.futures
import json
import mmap
import multiprocessing.popen_spawn_posix
import os
import select
import signal
import socket
import subprocess
import sys
import tempfile
from pathlib import Path
from types import ModuleType

# The standard library has its own way on other systems, so it keeps what it has loaded.
KEPT = (asyncio, concurrent.futures, multiprocessing, subprocess, tempfile)
MODULES = ("fcntl", "termios", "tty", "pty", "resource", "pwd", "grp", "curses", "syslog")
NAMES: dict[ModuleType, tuple[str, ...]] = {
    mmap: ("MAP_SHARED", "MAP_POPULATE"),
    os: (
        *("O_NONBLOCK", "O_NOCTTY", "O_CLOEXEC", "O_DIRECTORY", "O_NOFOLLOW", "memfd_create"),
        *("MFD_CLOEXEC", "posix_fallocate", "fork", "getuid", "geteuid", "getgid", "fchmod"),
        *("sched_setscheduler", "sched_getaffinity", "sched_setaffinity", "sched_param"),
        *("SCHED_FIFO", "SCHED_OTHER", "SCHED_RESET_ON_FORK", "statvfs", "mkfifo"),
        *("killpg", "setsid", "getpgid", "WNOHANG", "sched_yield"),
    ),
    select: ("poll", "epoll"),
    signal: ("SIGHUP", "SIGKILL", "SIGALRM", "SIGSTOP", "SIGCONT", "pthread_sigmask"),
    socket: ("AF_UNIX", "SOCK_SEQPACKET", "send_fds", "recv_fds", "socketpair", "CMSG_LEN"),
}


def hide() -> None:
    """Take away what other systems do not have."""
    for name in MODULES:
        sys.modules[name] = None  # pyrefly: ignore[unsupported-operation]
    for module, names in NAMES.items():
        for name in names:
            if name in vars(module):
                delattr(module, name)


if __name__ == "__main__":
    hide()
    from legbench.cli import main

    statuses = []
    for words in json.loads(sys.argv[1]):
        run = str(min(Path("runs").glob("*"), default=""))
        statuses.append(main([run if word == "RUN" else word for word in words]))
    sys.stderr.write(f"{json.dumps(statuses)}\n")
