"""A bus file for the drives of a data sheet, with all that is still to be measured marked; pure."""

import json
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from legbench.drives.protocol.datatypes import range_of
from legbench.drives.protocol.objects import Key
from legbench.drives.protocol.pdo import Mapped
from legbench.drives.setup.bus_file import format_object
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
from legbench.limits.upper_ends import MASTER_WATCH, QUICK_STOP_RAMP

MARK = "MEASURE"
"""Word in the comment of every line whose value is a guess."""
COUNTS_PER_REV, GEAR = 65536, 6.0
"""Encoder and gear of the emulated leg, which stand until somebody has measured [counts], [-]."""
ONE_FRAME_DEADLINE_US, TWO_FRAMES_DEADLINE_US = 650, 750
"""Deadline of the answers after SYNC, by the number of TPDOs of a drive; two of 6 and of 4 bytes of
both drives take 420 us of the wire after a reply delay of up to 250 us [us]."""
WINDOW_RAD, TORQUE_PERMILLE, RAMP = 0.4, 800, 20_000.0
"""Following error window [rad], torque limit [permille of rated], quick stop [rad/s2]."""
SOFT_LIMITS = ((-1.2, 1.0), (-1.0, 1.2))
"""Ranges of the motors of a leg with two drives, as the leg's own limits have them [rad]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Proposal:
    """What of a data sheet goes into a bus file."""

    sheet: DataSheet
    eds: str
    """Path of the data sheet, relative to the bus file."""
    rpdos: tuple[PdoConfig, ...]
    tpdos: tuple[PdoConfig, ...]
    link: Mapped
    links: tuple[Mapped, ...]
    """All objects that may show the position of the link."""
    temperature: Mapped | None


def propose(sheet: DataSheet, eds: str, link: Mapped | None = None) -> Proposal:
    """Choose process data and encoders for the drives of a data sheet.

    Args:
        sheet: the drive.
        eds: path of its file, relative to the bus file.
        link: object that shows the position of the link; by default the likeliest one.

    Raises:
        ConfigError: the drive cannot carry the process data of a leg; the message names the object.
    """
    links = link_candidates(sheet)
    shown = link or (links[0] if links else None)
    if shown is None:
        raise ConfigError(
            f"{sheet.name}: no object shows a second position, which is the link's; name one that "
            'does with --link, such as --link "60E4:01 i32"'
        )
    known = sheet.objects.get(shown.key)
    if known is None:
        raise ConfigError(f"{sheet.name}: {shown} is missing; name another object with --link")
    rpdos = choose(sheet, (CONTROLWORD, TARGET_POSITION), commands=True)
    tpdos = choose(sheet, (STATUSWORD, POSITION_ACTUAL, shown), commands=False)
    for chosen, words, what in (
        (rpdos, "RPDOs", f"{CONTROLWORD} and {TARGET_POSITION}"),
        (tpdos, "TPDOs", f"{STATUSWORD}, {POSITION_ACTUAL} and {shown}"),
    ):
        if chosen is None:
            numbers = sheet.pdos(commands=words == "RPDOs")
            raise ConfigError(
                f"{sheet.name}: its {len(numbers)} {words} cannot carry {what} at every SYNC: they "
                "are fixed otherwise, or too few; name another link object with --link, or map "
                "them with the maker's tool"
            )
    temperatures = temperature_candidates(sheet)
    return Proposal(
        sheet=sheet,
        eds=eds,
        rpdos=rpdos or (),
        tpdos=tpdos or (),
        link=shown,
        links=links,
        temperature=temperatures[0] if temperatures else None,
    )


def bus_text(proposal: Proposal, node_ids: Sequence[int], waive: Sequence[str] = ()) -> str:
    """Return the text of a bus file; every line whose value is a guess has the mark."""
    sheet = proposal.sheet
    two = len(proposal.tpdos) > 1
    who = f"{sheet.product_name or sheet.name} of {sheet.vendor_name or 'an unknown maker'}"
    lines = [
        f"# A leg on drives of the kind {who}.",
        f"# Proposed from the data sheet. A line with {MARK} is a guess: measure it, correct it,",
        f"# and take {MARK} out. Serial numbers: `legbench drives scan`; offsets:",
        "# `legbench drives zero`; the rest: the drive manual, and hardware/bring-up.md.",
        "",
        f"eds = {json.dumps(proposal.eds, ensure_ascii=False)}",
        'interface = "socketcan"',
        'channel = "can0"',
        "bitrate = 1_000_000",
        "period_us = 1000",
        f"tpdo_deadline_us = {TWO_FRAMES_DEADLINE_US if two else ONE_FRAME_DEADLINE_US}",
        "master_id = 126",
        "heartbeat_ms = 20",
        "master_heartbeat_ms = 10",
        "start_speed = 0.5",
        *_waived(waive),
    ]
    for place, node_id in enumerate(node_ids):
        lines += _node(proposal, place, node_id)
    return "\n".join(lines) + "\n"


def _waived(waive: Sequence[str]) -> Iterator[str]:
    if waive:
        yield "# These drives lack what these protections need; every run says so. Do without them"
        yield "# only after you have seen what the drives do, by steps 4 and 5 of the bring-up."
        yield f"waive = {json.dumps(list(waive))}"


def _node(proposal: Proposal, place: int, node_id: int) -> Iterator[str]:
    sheet = proposal.sheet
    yield ""
    yield "[[node]]"
    yield f'name = "motor{place + 1}"'
    yield f"id = {node_id}"
    yield f"vendor = 0x{sheet.vendor or 0:08X}" + ("" if sheet.vendor else f"  # {MARK}")
    yield f"product = 0x{sheet.product or 0:08X}" + ("" if sheet.product else f"  # {MARK}")
    if sheet.has((0x1018, 4)):
        yield f"# serial = 0  # {MARK}: two drives of a kind are told apart by it alone"
    else:
        yield "# No serial number: the drive tells none, so look at the labels before each run."
    yield f'link_object = "{format_object(proposal.link)}"' + _other_links(proposal)
    if proposal.temperature is not None:
        entry = format_object(proposal.temperature)
        yield f'# temperature_object = "{entry}"  # {MARK}: its scale and its place'
        yield f"# temperature_scale = 0.1  # {MARK} [deg C a count]"
    if place < len(SOFT_LIMITS) and all(sheet.writable((0x607D, sub)) for sub in (1, 2)):
        low, high = SOFT_LIMITS[place]
        yield f"soft_limits = [{low}, {high}]  # {MARK}: of the motor, in the drive itself [rad]"
    yield from _axes(proposal, place)
    yield from _parameters(sheet)
    yield from _pdos(proposal)


def _other_links(proposal: Proposal) -> str:
    others = [format_object(entry) for entry in proposal.links if entry != proposal.link]
    return f"  # {MARK}: whether it is the link's" + (
        f"; else {', '.join(others)}" if others else ""
    )


def _axes(proposal: Proposal, place: int) -> Iterator[str]:
    sign = -1 if place % 2 else 1
    for axis, gear in (("motor", GEAR), ("link", 1.0)):
        yield ""
        yield f"[node.{axis}]"
        yield f"counts_per_rev = {COUNTS_PER_REV}  # {MARK}: counts a turn of the encoder's shaft"
        yield f"gear = {gear}  # {MARK}: turns of that shaft for one turn of the {axis}"
        yield f"sign = {sign}  # {MARK}: 1 if counts grow forward"
        yield f"offset_counts = 0  # {MARK}: legbench drives zero"
        if axis == "link":
            yield f"bits = {proposal.link.bits}"


def _parameters(sheet: DataSheet) -> Iterator[str]:
    per_rad = COUNTS_PER_REV * GEAR / (2.0 * math.pi)
    ramp = (0x6085, 0) if sheet.writable((0x6085, 0)) else (0x6084, 0)
    wanted: list[tuple[Key, float, str]] = [
        ((0x6065, 0), WINDOW_RAD * per_rad, f"following error window [counts]: {WINDOW_RAD} rad"),
        ((0x6066, 0), 10, "for so long [ms]"),
        ((0x6072, 0), TORQUE_PERMILLE, "max torque [permille of rated]"),
        (ramp, RAMP * per_rad, f"quick stop: {RAMP:g} rad/s2, in the drive's own unit"),
    ]
    lines = [
        f'"{format_object(_named(sheet, key))}" = {_within(sheet, key, value)}  # {MARK}: {words}'
        for key, value, words in wanted
        if sheet.writable(key) and isinstance(sheet.objects[key].default, int)
    ]
    if lines:
        yield ""
        yield "[node.parameters]"
        yield from lines


def _named(sheet: DataSheet, key: Key) -> Mapped:
    return Mapped(*key, sheet.objects[key].kind)


def _within(sheet: DataSheet, key: Key, value: float) -> int:
    """Return the value that an object takes and that comes closest to a wanted one."""
    low, high = range_of(sheet.objects[key].kind)
    least, most = sheet.limits.get(key, (low, high))
    return round(min(max(value, least, low), most, high))


def _pdos(proposal: Proposal) -> Iterator[str]:
    for words, pdos in (("rpdo", proposal.rpdos), ("tpdo", proposal.tpdos)):
        for pdo in pdos:
            objects = ", ".join(json.dumps(format_object(entry)) for entry in pdo.objects)
            yield ""
            yield f"[[node.{words}]]"
            yield f"number = {pdo.number}"
            yield f"objects = [{objects}]"
            if pdo.cob_id is not None:
                yield f"cob_id = 0x{pdo.cob_id:03X}"
            if words == "rpdo":
                yield f"deadline_ms = {pdo.deadline_ms}"


def waivers_for(*, watched: bool, braked: bool) -> tuple[str, ...]:
    """Names of the protections that drives have to do without.

    Args:
        watched: a means of every drive stops it when its master is gone.
        braked: every drive takes the ramp of a quick stop.
    """
    names = ((MASTER_WATCH, watched), (QUICK_STOP_RAMP, braked))
    return tuple(name for name, has in names if not has)


def marked_lines(text: str) -> tuple[int, ...]:
    """Numbers of the lines of a bus file that are still to be measured."""
    return tuple(
        number for number, line in enumerate(text.splitlines(), start=1) if f"# {MARK}" in line
    )
