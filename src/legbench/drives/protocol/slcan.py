"""Lines of a CAN adapter on a serial line (LAWICEL's ASCII protocol, `slcan`) <-> frames; pure.

The format is that of LAWICEL's manual of the CAN232, except for S7 and S9, which mean what
python-can and newer adapters mean by them.
"""

from legbench.drives.protocol.frame import Frame

OK, REFUSED = b"\r", b"\a"
"""Characters that end an adapter's lines: of accepted and of refused commands."""
BITRATES = dict(
    zip(
        (f"S{digit}" for digit in range(10)),
        (10_000, 20_000, 50_000, 100_000, 125_000, 250_000, 500_000, 750_000, 1_000_000, 83_300),
        strict=True,
    )
)
BTR_CLOCK = 8_000_000
"""Clock of the bit timing of an SJA1000, half its crystal's frequency, for the command `s` [Hz]."""
STANDARD, EXTENDED = 3, 8
"""Number of hexadecimal digits of a standard and of an extended identifier."""


def format_frame(frame: Frame) -> bytes:
    """A frame as an adapter shows it: `t`, `T`, `r` or `R`, identifier, length, data."""
    letter = "r" if frame.remote else "t"
    width = EXTENDED if frame.extended else STANDARD
    letter = letter.upper() if frame.extended else letter
    data = "" if frame.remote else frame.data.hex().upper()
    return f"{letter}{frame.cob_id:0{width}X}{frame.length}{data}\r".encode()


def parse_frame(line: str) -> Frame | None:
    """The frame of a line without its end; none if it is none."""
    letter = line[:1]
    if letter == "" or letter not in "tTrR":
        return None
    width = EXTENDED if letter in "TR" else STANDARD
    head, length, data = line[1 : 1 + width], line[1 + width : 2 + width], line[2 + width :]
    remote = letter in "rR"
    try:
        cob_id, count, content = int(head, 16), int(length), bytes.fromhex(data)
    except ValueError:
        return None
    if len(head) != width or count > 8 or len(data) != (0 if remote else 2 * count):
        return None
    if cob_id >= 1 << (29 if width == EXTENDED else 11):
        return None
    dlc = count if remote else 0
    return Frame(cob_id, content, remote, width == EXTENDED, dlc=dlc)


def bitrate_of_registers(text: str) -> int | None:
    """Bitrate of the registers BTR0 and BTR1 of an SJA1000 [bit/s]; none if they are none."""
    try:
        btr0, btr1 = bytes.fromhex(text)
    except ValueError:
        return None
    quanta = 3 + (btr1 & 0xF) + (btr1 >> 4 & 0x7)
    return round(BTR_CLOCK / ((1 + (btr0 & 0x3F)) * quanta))
