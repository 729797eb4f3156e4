"""The share that one link has in the lock of its channel."""

from typing import final

from legbench.drives.transport.lock import ChannelLock


@final
class ChannelHold:
    """Hold of one link on the lock of its channel, which a session may hold as well."""

    def __init__(self, lock: ChannelLock) -> None:
        """Prepare to hold a lock, which is not taken yet."""
        self._lock = lock
        self._holds = False

    def take(self) -> None:
        """Take the lock; raises BusError if the channel has another master."""
        self._lock.acquire()
        self._holds = True

    def release(self) -> None:
        """Give the lock back if this hold has taken it; a second call does nothing."""
        if self._holds:
            self._holds = False
            self._lock.release()
