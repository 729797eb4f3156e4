"""What Linux says of a CAN interface before it is opened: whether it is up, and its bitrate."""

import json
import subprocess
from collections.abc import Callable
from pathlib import Path

from legbench.drives.errors import BusError
from legbench.drives.setup.config import BusConfig

SYSTEM = Path("/sys/class/net")
IFF_UP = 1
ASK_S = 5.0
"""Longest that `ip` may take to answer [s]."""
Details = Callable[[str], str]
"""What `ip -json -details link show` prints of an interface."""


def ask_ip(channel: str) -> str:
    """Ask `ip` for an interface; an empty text where there is no `ip`, or it fails."""
    command = ("ip", "-json", "-details", "link", "show", channel)
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=ASK_S, check=False)
    except (OSError, subprocess.TimeoutExpired):
        return ""
    return done.stdout


def bitrate_of(details: str) -> int | None:
    """Bitrate that `ip` reports [bit/s]; none for interfaces without one, such as a vcan."""
    try:
        return int(json.loads(details)[0]["linkinfo"]["info_data"]["bittiming"]["bitrate"])
    except (ValueError, LookupError, TypeError):
        return None


def has_wire(details: str) -> bool:
    """Whether an interface has a bitrate to be set; so it has as long as `ip` tells nothing."""
    try:
        return json.loads(details)[0]["linkinfo"]["info_kind"] == "can"
    except (ValueError, LookupError, TypeError):
        return True


def check_interface(
    config: BusConfig, channel: str, system: Path = SYSTEM, details: Details = ask_ip
) -> None:
    """Refuse a SocketCAN interface that cannot carry this bus; one that is not there passes.

    Raises:
        BusError: it is down, or runs at another bitrate.
    """
    try:
        flags = int((system / channel / "flags").read_text(encoding="ascii"), 16)
    except (OSError, ValueError):
        return
    told = details(channel)
    wire = f" type can bitrate {config.bitrate} restart-ms 100" if has_wire(told) else ""
    up = f"`ip link set {channel} up{wire}`"
    if not flags & IFF_UP:
        raise BusError(f"{channel} is down; bring it up: {up}")
    there = bitrate_of(told)
    if there not in (None, config.bitrate):
        raise BusError(
            f"{channel} runs at {there} bit/s, but {config.bitrate_text}; correct the bus file if "
            f"the drives run at {there} bit/s, else: `ip link set {channel} down`, then {up}"
        )
