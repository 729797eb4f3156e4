"""Which identifiers process data may have (CiA 301, 7.3.5: restricted CAN-IDs); pure."""

from collections.abc import Mapping

from legbench.drives.protocol.frame import describe_id
from legbench.errors import ConfigError

FREE = ((0x181, 0x57F), (0x680, 0x6DF))
"""Lowest and highest identifier of each range that CiA 301 leaves to process data."""


def check_cob_id(cob_id: int) -> None:
    """Refuse the identifier of a PDO that belongs to another service, or to none.

    Raises:
        ConfigError: it is NMT's, SYNC's, an EMCY's, TIME's, an SDO's, a heartbeat's, reserved, or
            has more than 11 bits.
    """
    if any(low <= cob_id <= high for low, high in FREE):
        return
    text = f"{cob_id:03X}h" if cob_id >= 0 else str(cob_id)
    if 0 <= cob_id <= 0x7FF:
        told = describe_id(cob_id)
        owner = f"is {told}" if not told.startswith("id ") else "is reserved by CiA 301"
    else:
        owner = "has no 11 bits"
    ranges = " or ".join(f"{low:03X}h to {high:03X}h" for low, high in FREE)
    raise ConfigError(f"cob_id {text} {owner}; process data may have {ranges}")


def check_distinct(users: Mapping[str, int]) -> None:
    """Refuse two PDOs of a bus that share an identifier: both senders would win arbitration.

    Args:
        users: what sends or takes a frame -> its identifier.

    Raises:
        ConfigError: two share one; both are named.
    """
    first: dict[int, str] = {}
    for user, cob_id in users.items():
        if cob_id in first:
            raise ConfigError(
                f"{first[cob_id]} and {user} share a COB-ID, {cob_id:03X}h; give one of them "
                "another 'cob_id'"
            )
        first[cob_id] = user
