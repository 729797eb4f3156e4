"""Purpose of every object of a drive's configuration, and what a drive without it lacks; pure.

One table decides for all who write, compare or judge: whether cyclic synchronous position mode
needs an object, whether a protection needs it that another one can replace, or whether it is merely
wanted.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import Enum

from legbench.drives.protocol.frame import COB_INVALID, COB_NO_REMOTE
from legbench.drives.protocol.objects import Key
from legbench.drives.setup.parameters import Parameter

Agrees = Callable[[int, int], bool]
"""Whether a value that a drive holds does what a wanted one does: wanted, held."""
RPDOS, TPDOS = range(0x1400, 0x1600), range(0x1800, 0x1A00)
"""Indices of the communication objects of process data (CiA 301, 7.5.2.33 and 7.5.2.37)."""
MAPPINGS = (range(0x1600, 0x1800), range(0x1A00, 0x1C00))
LAST_SYNCHRONOUS = 240
"""Highest transmission type of an RPDO that acts at the next SYNC (CiA 301, table 72)."""
SLOWEST = 2
"""Factor by which a drive may stretch a time that it rounds; a watch waits for three periods."""
ROUNDED = 1.1
"""Factor by which a drive may weaken a limit that it rounds."""
BY_THE_MAKER = "set it with the maker's tool, and store it"
"""Way out where a drive keeps a value that is another than the one of this table."""
NEAR_COUNTS = 16
"""Furthest that a drive may move a position that it rounds [counts]."""


def _same(wanted: int, there: int) -> bool:
    return wanted == there


class Need(Enum):
    """Reasons for which an object is written."""

    REQUIRED = "required"
    """Cyclic synchronous position mode, or the bus file itself, asks for it."""
    PROTECTION = "protection"
    """Object of a protection; without it another one protects the drive, or nothing does."""
    OPTIONAL = "optional"
    """Object that is useful, but protects nothing."""


@dataclass(frozen=True, slots=True, kw_only=True)
class NeedRow:
    """Entry of the table: what an object is for, and what a drive without it leaves to others."""

    need: Need
    purpose: str
    """Purpose of the object, which completes the sentence "not there: ..."."""
    instead: str = ""
    """Replacement on a drive without the object; empty where nothing is lost."""
    may_lack: bool = False
    """Whether a required object may be missing: what the standard says of a drive without it is
    what is wanted. A value that is there has to agree all the same."""
    agrees: Agrees = _same
    way: str = ""
    """Way out where the drive keeps another value; by default `BY_THE_MAKER`."""
    fallbacks: Mapping[int, tuple[int, ...]] = field(default_factory=dict)
    """Wanted value -> values to try in turn where the drive refuses it."""

    @property
    def loss(self) -> str:
        """Description of what is lost without the object, and of what takes its place."""
        lost = "not protected by " if self.need is Need.PROTECTION else "without "
        instead = f"; instead: {self.instead}" if self.instead else ""
        return f"{lost}{self.purpose}{instead}"


def _cob(wanted: int, there: int) -> bool:
    """Compare valid bit and identifier; whether remote frames are answered does not matter."""
    return not (wanted ^ there) & ~COB_NO_REMOTE


def _off(_wanted: int, there: int) -> bool:
    return bool(there & COB_INVALID)


def _sync(wanted: int, there: int) -> bool:
    """Compare the identifier and that the drive is no producer; bit 31 means nothing here."""
    return not (wanted ^ there) & ~COB_INVALID


def _time(wanted: int, there: int) -> bool:
    return 0 < there <= SLOWEST * wanted


def _watched(wanted: int, there: int) -> bool:
    """Compare node id and time of a heartbeat consumer (1016h)."""
    return wanted >> 16 == there >> 16 and _time(wanted & 0xFFFF, there & 0xFFFF)


def _at_most(wanted: int, there: int) -> bool:
    return 0 < there <= ROUNDED * wanted


def _at_least(wanted: int, there: int) -> bool:
    return ROUNDED * there >= wanted


def _near(wanted: int, there: int) -> bool:
    return abs(there - wanted) <= NEAR_COUNTS


def _positive(_wanted: int, there: int) -> bool:
    return there > 0


def _latched(_wanted: int, there: int) -> bool:
    return 0 <= there <= LAST_SYNCHRONOUS


def _stops(_wanted: int, there: int) -> bool:
    """Accept quick stop and fault signal (6007h): the reaction to a fault brakes as well."""
    return there in (1, 3)


def _brakes(wanted: int, there: int) -> bool:
    """Accept the same ramp, whatever state follows, and the fastest stop that a drive can make.

    Option codes 5 to 8 of 605Ah brake as 1 to 4 do, and stay in quick stop active. 3 and 4 brake at
    the limit of current and voltage.
    """
    return there in (wanted, wanted + 4, 3, 4, 7, 8)


_REQUIRED, _PROTECTION, _OPTIONAL = Need.REQUIRED, Need.PROTECTION, Need.OPTIONAL
_OFFSET = NeedRow(
    need=_REQUIRED, purpose="an offset of every target, which must be 0", may_lack=True
)
_RAMP = NeedRow(
    need=_PROTECTION,
    purpose="the ramp of a quick stop",
    instead="the deceleration that its maker has set, with which the way of a stop is not known",
    agrees=_at_least,
)
_SOFT = NeedRow(
    need=_PROTECTION,
    purpose="the drive's own limit of its range",
    instead="motor_range of the limits file, in the master",
    agrees=_near,
)
_CYCLE = NeedRow(
    need=_REQUIRED,
    purpose="the time over which a drive interpolates, which must be that of SYNC",
    instead="the time that its maker has set; it must be that of SYNC",
    may_lack=True,
    way="give that time as period_us (a shorter period carries fewer objects: learn --link none), "
    f"or {BY_THE_MAKER}",
)
_LIMP = "the drive's own choice, which may be no torque at all; no stop from here asks for it"
TABLE: Mapping[Key, NeedRow] = {
    (0x1005, 0): NeedRow(
        need=_REQUIRED,
        purpose="SYNC from the master, with identifier 80h",
        may_lack=True,
        agrees=_sync,
    ),
    (0x1006, 0): NeedRow(
        need=_PROTECTION,
        purpose="the drive's watch over SYNC",
        instead="its watch over the master's heartbeat or over its commands",
    ),
    (0x1016, 1): NeedRow(
        need=_PROTECTION,
        purpose="the drive's watch over the master's heartbeat",
        instead="the deadline of its commands (140xh:05)",
        agrees=_watched,
    ),
    (0x1017, 0): NeedRow(
        need=_PROTECTION,
        purpose="the drive's own heartbeat",
        instead="its process data, due after every SYNC",
        agrees=_time,
    ),
    (0x1029, 1): NeedRow(
        need=_OPTIONAL,
        purpose="leaving operational after a communication error",
        instead="the standard's default, which is the same",
    ),
    (0x6007, 0): NeedRow(
        need=_PROTECTION,
        purpose="a quick stop where the connection is lost",
        instead="what its maker has set: whether the drive stops then is not known",
        agrees=_stops,
        fallbacks={3: (1,)},
    ),
    (0x605A, 0): NeedRow(
        need=_REQUIRED,
        purpose="braking by quick stop, by 2 on the ramp 6085h or by 1 on 6084h of the bus file",
        instead="the standard's default, 2",
        may_lack=True,
        agrees=_brakes,
        fallbacks={2: (6,), 1: (5,)},
    ),
    (0x605B, 0): NeedRow(need=_OPTIONAL, purpose="braking at shutdown", instead=_LIMP),
    (0x605C, 0): NeedRow(need=_OPTIONAL, purpose="braking when disabled", instead=_LIMP),
    (0x605D, 0): NeedRow(
        need=_OPTIONAL,
        purpose="braking by halt on the quick-stop ramp",
        instead=_LIMP,
        agrees=_positive,
        fallbacks={2: (1,)},
    ),
    (0x605E, 0): NeedRow(
        need=_PROTECTION,
        purpose="braking on a fault",
        instead="the drive's own choice: a motor may coast after a fault",
        agrees=_positive,
        fallbacks={2: (1,)},
    ),
    (0x6060, 0): NeedRow(
        need=_REQUIRED,
        purpose="the choice of cyclic synchronous position mode",
        instead="the mode that it is in, by 6061h",
        may_lack=True,
        way=f"{BY_THE_MAKER}, or take another drive",
    ),
    (0x6065, 0): NeedRow(
        need=_PROTECTION,
        purpose="the drive's own following error window",
        instead="following_error of the limits file, in the master",
        agrees=_at_most,
    ),
    (0x6066, 0): NeedRow(
        need=_OPTIONAL,
        purpose="the delay of the following error",
        instead="the delay that its maker has set",
    ),
    (0x6072, 0): NeedRow(
        need=_PROTECTION,
        purpose="the limit of torque",
        instead="the current limit that its maker has set",
        agrees=_at_most,
    ),
    (0x607D, 1): _SOFT,
    (0x607D, 2): _SOFT,
    (0x607E, 0): NeedRow(need=_REQUIRED, purpose="the polarity, which must be 0", may_lack=True),
    (0x6084, 0): _RAMP,
    (0x6085, 0): _RAMP,
    (0x60B0, 0): _OFFSET,
    (0x60B1, 0): _OFFSET,
    (0x60B2, 0): _OFFSET,
    (0x60C2, 1): _CYCLE,
    (0x60C2, 2): _CYCLE,
}
"""Every object that is written to a drive, but process data and those of the bus file alone."""
_ASKED = NeedRow(
    need=_REQUIRED, purpose="the bus file asks for it: correct it there, or leave it out"
)
_MAPPING = NeedRow(
    need=_REQUIRED,
    purpose="process data: a drive whose mapping is fixed needs a bus file that maps the same",
)
DEADLINE = NeedRow(
    need=_PROTECTION,
    purpose="the deadline of its commands",
    instead="its watch over the master's heartbeat (1016h)",
    agrees=_time,
)
_USED = NeedRow(need=_REQUIRED, purpose="process data, switched on", agrees=_cob)
_SPARE_RPDO = NeedRow(
    need=_OPTIONAL,
    purpose="switching off commands that nobody sends",
    may_lack=True,
    agrees=_off,
)
_SPARE_TPDO = NeedRow(
    need=_REQUIRED,
    purpose="switching off process data that nobody asked for: name it in the bus file instead",
    may_lack=True,
    agrees=_off,
)
_COMMAND_TYPE = NeedRow(need=_REQUIRED, purpose="commands that act at SYNC", agrees=_latched)
_ANSWER_TYPE = NeedRow(need=_REQUIRED, purpose="an answer to every SYNC")


def row_of(parameter: Parameter) -> NeedRow:
    """Return the entry of the table for an object, process data and a bus file's own included."""
    index, sub = parameter.key
    known = TABLE.get(parameter.key)
    if known is not None:
        return known
    if any(index in mappings for mappings in MAPPINGS):
        return _MAPPING
    command = index in RPDOS
    if not (command or index in TPDOS):
        return _ASKED
    if sub == 1:
        if not parameter.value & COB_INVALID:
            return _USED
        return _SPARE_RPDO if command else _SPARE_TPDO
    if sub == 2:
        return _COMMAND_TYPE if command else _ANSWER_TYPE
    return DEADLINE if command else _ASKED
