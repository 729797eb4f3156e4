"""The states of a link, which tell what may be asked of it."""

from enum import Enum, auto


class LinkState(Enum):
    """States of a link, from new to stopped."""

    NEW = auto()
    CONFIGURED = auto()
    """Identity is checked, configuration written and read back; nothing moves."""
    CYCLIC = auto()
    """Process data is exchanged, targets follow the motors."""
    RUNNING = auto()
    """All drives are in operation enabled, commands are taken."""
    STOPPING = auto()
    """Drives have been told to stop, and not every one has been seen without power yet."""
    STOPPED = auto()
    """Every drive has been seen without power; or this link never led one."""
