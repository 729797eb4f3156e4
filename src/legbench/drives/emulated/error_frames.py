"""Error frames with which a controller reports to its master, as SocketCAN forms them."""

from legbench.drives.protocol.frame import Frame

ERROR_FRAME = Frame(0x88, bytes(8), error=True)
"""Report of a bus error: protocol violation."""
BUS_OFF_FRAME = Frame(0x40, bytes(8), error=True)
"""Report that the own controller has left the bus."""
OVERFLOW_FRAME = Frame(0x04, b"\0\1" + bytes(6), error=True)
"""Report that the receive buffer of the own controller has overflowed."""
