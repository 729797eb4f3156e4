"""Choice of process data and encoders for the drives of a data sheet; pure."""

from collections.abc import Sequence
from dataclasses import dataclass

from legbench.drives.protocol.datatypes import FORMATS
from legbench.drives.protocol.pdo import Mapped
from legbench.drives.setup.config import (
    CONTROLWORD,
    POSITION_ACTUAL,
    STATUSWORD,
    TARGET_POSITION,
    PdoConfig,
)
from legbench.drives.sheet.assess import unfit
from legbench.drives.sheet.candidates import link_candidates, temperature_candidates
from legbench.drives.sheet.data_sheet import DataSheet
from legbench.drives.sheet.mapping import choose, obstacles
from legbench.errors import ConfigError

ONE_ENCODER = "none"
"""Word that stands for no second encoder, where an object is asked for."""
TORQUE = (0x6077, 0)
OWN = {POSITION_ACTUAL.key: "motor's own position", TORQUE: "drive's torque"}
"""Objects that no link's position is shown by."""
LEAST = 2
"""Fewest objects that a drive takes, and answers, in every cycle."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Proposal:
    """Proposal for a bus file, from a data sheet."""

    sheet: DataSheet
    eds: str
    """Path of the data sheet, relative to the bus file."""
    rpdos: tuple[PdoConfig, ...]
    tpdos: tuple[PdoConfig, ...]
    motor: Mapped
    """Position actual value, in the type that the drive has."""
    target: Mapped
    link: Mapped | None
    """Object that shows the position of the link; none on a drive with one encoder."""
    links: tuple[Mapped, ...]
    """All objects that may show the position of the link."""
    torque: Mapped | None
    """Torque that stands for that of the spring on a drive with one encoder."""
    temperature: Mapped | None


def propose(sheet: DataSheet, eds: str, link: Mapped | str | None = None) -> Proposal:
    """Choose process data and encoders for the drives of a data sheet.

    Args:
        sheet: the drive.
        eds: path of its file, relative to the bus file.
        link: object that shows the position of the link, or `ONE_ENCODER` for none; by default the
            likeliest one, or none where no object looks like it.

    Raises:
        ConfigError: the drive cannot carry the process data of a leg; the message names the object.
    """
    links, torque = link_candidates(sheet), _torque(sheet)
    if isinstance(link, Mapped):
        if not sheet.has(link.key):
            raise ConfigError(f"{sheet.name}: {link} is missing; name another object with --link")
        if link.key in OWN:
            raise ConfigError(
                f"{sheet.name}: {link} is the {OWN[link.key]}; name another object with --link"
            )
        seconds: tuple[Mapped | None, ...] = (link,)
    else:
        # A drive that cannot send a second position is one with one encoder.
        seconds = (*(links if link is None else ()), *((torque,) if torque else ()), None)
    motor, target = _typed(sheet, POSITION_ACTUAL), _typed(sheet, TARGET_POSITION)
    if motor.bits != target.bits:
        raise ConfigError(
            f"{sheet.name}: {motor} has {motor.bits} bits, {target} has {target.bits}: both need "
            "the same length; another drive, or a data sheet that is right"
        )
    # The same bits on the wire; a sheet that tells two signs is wrong in one.
    motor = Mapped(*motor.key, target.kind)
    rpdos = _carried(sheet, (CONTROLWORD, target), commands=True)
    second, tpdos = _answers(sheet, (STATUSWORD, motor), seconds)
    temperatures = temperature_candidates(sheet)
    return Proposal(
        sheet=sheet,
        eds=eds,
        rpdos=rpdos,
        tpdos=tpdos,
        motor=motor,
        target=target,
        link=None if second == torque else second,
        links=links,
        torque=None if second != torque else torque,
        temperature=temperatures[0] if temperatures else None,
    )


def _answers(
    sheet: DataSheet, always: tuple[Mapped, ...], seconds: Sequence[Mapped | None]
) -> tuple[Mapped | None, tuple[PdoConfig, ...]]:
    """Return the first second object that can be sent with the others, and the TPDOs for it.

    Raises:
        ConfigError: none can.
    """
    for second in seconds:
        needed = always if second is None else (*always, second)
        chosen = choose(sheet, needed, commands=False)
        if chosen is not None:
            return second, chosen
    last = seconds[-1]
    return last, _carried(sheet, always if last is None else (*always, last), commands=False)


def _typed(sheet: DataSheet, usual: Mapped) -> Mapped:
    """Return an object in the type that the drive has, if that is a whole number."""
    known = sheet.objects.get(usual.key)
    return usual if known is None or known.kind not in FORMATS else Mapped(*usual.key, known.kind)


def _torque(sheet: DataSheet) -> Mapped | None:
    known = sheet.objects.get(TORQUE)
    if known is None or not known.mappable or known.kind not in FORMATS:
        return None
    return Mapped(*TORQUE, known.kind)


def _carried(
    sheet: DataSheet, needed: Sequence[Mapped], *, commands: bool
) -> tuple[PdoConfig, ...]:
    """Return the PDOs that carry some objects; raises ConfigError where none do."""
    chosen = choose(sheet, needed, commands=commands)
    if chosen is not None:
        return chosen
    reasons = unfit(sheet)
    if reasons:
        raise ConfigError(f"{sheet.name}: {reasons[0]}")
    words = "RPDO" if commands else "TPDO"
    told = "; ".join(obstacles(sheet, commands=commands)) or f"it has no {words}"
    fewer = f"--link {ONE_ENCODER} needs fewer, or " if len(needed) > LEAST else ""
    raise ConfigError(
        f"{sheet.name}: its {words}s cannot carry {', '.join(map(str, needed))} at every SYNC "
        f"({told}); {fewer}map them with the maker's tool and take its DCF, or take another drive"
    )
