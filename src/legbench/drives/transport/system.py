"""What a bus to real drives, or to another process, needs of the operating system."""

import select
import socket

from legbench.drives.errors import BusError


def require_linux(purpose: str) -> None:
    """Refuse what this operating system cannot do.

    Args:
        purpose: what is wanted, as the beginning of a sentence.

    Raises:
        BusError: the system lacks AF_UNIX sockets or poll(2).
    """
    if "AF_UNIX" not in vars(socket) or "poll" not in vars(select):
        raise BusError(
            f"{purpose} needs AF_UNIX sockets and poll(2), which this system lacks: use Linux, or "
            "--interface legbench, the emulated leg within this process"
        )
