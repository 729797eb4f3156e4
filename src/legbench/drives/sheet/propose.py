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
from legbench.drives.sheet.candidates import link_candidates, temperature_candidates
from legbench.drives.sheet.data_sheet import DataSheet
from legbench.drives.sheet.mapping import choose
from legbench.errors import ConfigError

ONE_ENCODER = "none"
"""Word that stands for no second encoder, where an object is asked for."""
TORQUE = (0x6077, 0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Proposal:
    """What of a data sheet goes into a bus file."""

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
    links = link_candidates(sheet)
    shown = link if isinstance(link, Mapped) else None
    if link is None and links:
        shown = links[0]
    if shown is not None and not sheet.has(shown.key):
        raise ConfigError(f"{sheet.name}: {shown} is missing; name another object with --link")
    motor, target = _typed(sheet, POSITION_ACTUAL), _typed(sheet, TARGET_POSITION)
    second = shown or _torque(sheet)
    answers = (STATUSWORD, motor) if second is None else (STATUSWORD, motor, second)
    temperatures = temperature_candidates(sheet)
    return Proposal(
        sheet=sheet,
        eds=eds,
        rpdos=_carried(sheet, (CONTROLWORD, target), commands=True),
        tpdos=_carried(sheet, answers, commands=False),
        motor=motor,
        target=target,
        link=shown,
        links=links,
        torque=_torque(sheet) if shown is None else None,
        temperature=temperatures[0] if temperatures else None,
    )


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
    numbers, words = sheet.pdos(commands=commands), "RPDOs" if commands else "TPDOs"
    raise ConfigError(
        f"{sheet.name}: its {len(numbers)} {words} cannot carry "
        f"{', '.join(map(str, needed))} at every SYNC: they are fixed otherwise, or too few; name "
        f"another link object with --link, or --link {ONE_ENCODER}, or map them with the maker's "
        "tool"
    )
