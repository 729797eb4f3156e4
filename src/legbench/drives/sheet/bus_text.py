"""Text of a bus file for the drives of a data sheet, every guess in it marked; pure."""

import json
import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

from legbench.drives.protocol.datatypes import FORMATS, range_of
from legbench.drives.protocol.objects import Key
from legbench.drives.protocol.pdo import Mapped
from legbench.drives.setup.bus_file import format_object
from legbench.drives.setup.config import POSITION_ACTUAL, TARGET_POSITION
from legbench.drives.setup.taken import QUICK_STOP_OPTION, RAMPS
from legbench.drives.sheet.data_sheet import DataSheet
from legbench.drives.sheet.propose import Proposal
from legbench.limits.upper_ends import MASTER_WATCH, QUICK_STOP_RAMP, SPRING_WATCH

MARK = "MEASURE"
"""Word in the comment of every line whose value is a guess."""
COUNTS_PER_REV, GEAR = 65536, 6.0
"""Encoder and gear of the emulated leg, which stand until somebody has measured [counts], [-]."""
PER_RAD = COUNTS_PER_REV * GEAR / (2.0 * math.pi)
"""Counts of that encoder for one radian of the motor [counts/rad]."""
TORQUE_SCALE = 0.01
"""Torque at the joint of one count of the emulated drive's torque [N m]."""
WINDOW_RAD, TORQUE_PERMILLE, RAMP = 0.4, 800, 20_000.0
"""Following error window [rad], torque limit [permille of rated], quick stop [rad/s2]."""
LEAST_RAMP = 4_000.0
"""Gentlest ramp on which a motor stops within 0.2 rad from 40 rad/s, the speed of commands
[rad/s2]; a drive whose ramp ends below it in counts/s2 measures it in a unit of its own."""
SOFT_LIMITS = ((-1.2, 1.0), (-1.0, 1.2))
"""Ranges of the motors of a leg with two drives, as the leg's own limits have them [rad]."""


def bus_text(
    proposal: Proposal,
    node_ids: Sequence[int],
    waive: Sequence[str] = (),
    *,
    period_us: int = 1000,
) -> str:
    """Return the text of a bus file; every line whose value is a guess has the mark."""
    sheet = proposal.sheet
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
        f"bitrate = {_bitrate(sheet):_}",
        f"period_us = {period_us}",
        f"reply_delay_us = 250  # {MARK}: from SYNC to the first answer, by the drive manual",
        "master_id = 126",
        "heartbeat_ms = 20",
        "master_heartbeat_ms = 10",
        "start_speed = 0.5",
        *_waived(waive),
    ]
    for place, node_id in enumerate(node_ids):
        lines += _node(proposal, place, node_id)
    return "\n".join(lines) + "\n"


def _bitrate(sheet: DataSheet) -> int:
    """Highest bitrate of the device; that of the emulated leg where it tells none [bit/s]."""
    return max(sheet.bitrates, default=1_000_000)


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
    if sheet.has((0x1018, 2)):
        yield f"product = 0x{sheet.product or 0:08X}" + ("" if sheet.product else f"  # {MARK}")
    if sheet.has((0x1018, 4)):
        yield f"# serial = 0  # {MARK}: two drives of a kind are told apart by it alone"
    else:
        yield "# No serial number: the drive tells none, so look at the labels before each run."
    yield from _objects(proposal)
    if proposal.temperature is not None:
        entry = format_object(proposal.temperature)
        yield f'# temperature_object = "{entry}"  # {MARK}: its scale and its place'
        yield f"# temperature_scale = 1.0  # {MARK} [deg C a count]"
    if place < len(SOFT_LIMITS) and _limits_itself(proposal):
        low, high = SOFT_LIMITS[place]
        yield f"soft_limits = [{low}, {high}]  # {MARK}: of the motor, in the drive itself [rad]"
    yield from _axes(proposal, place)
    yield from _parameters(sheet)
    yield from _pdos(proposal)


def _limits_itself(proposal: Proposal) -> bool:
    """Whether the drive takes limits of its range on both sides of 0, as far as these go."""
    sheet, keys = proposal.sheet, ((0x607D, 1), (0x607D, 2))
    if range_of(proposal.motor.kind)[0] == 0 or not all(_holds(sheet, key, 0) for key in keys):
        return False
    ends = [end * PER_RAD for limits in SOFT_LIMITS for end in limits]
    taken = [sheet.limits.get(key, range_of(sheet.objects[key].kind)) for key in keys]
    return all(low <= min(ends) and max(ends) <= high for low, high in taken)


def _objects(proposal: Proposal) -> Iterator[str]:
    """Yield the objects of positions and torque, where they are not the usual ones."""
    known = proposal.sheet.objects.get(proposal.motor.key)
    told = proposal.motor if known is None else replace(proposal.motor, kind=known.kind)
    if proposal.motor != POSITION_ACTUAL or proposal.motor != told:
        # It has the target's sign where the data sheet tells two.
        doubt = "" if proposal.motor == told else f"  # {MARK}: its sign; the data sheet says "
        said = doubt and format_object(told).split()[1]
        yield f'motor_object = "{format_object(proposal.motor)}"{doubt}{said}'
    if proposal.target != TARGET_POSITION:
        yield f'target_object = "{format_object(proposal.target)}"'
    if proposal.link is not None:
        others = [format_object(entry) for entry in proposal.links if entry != proposal.link]
        more = f"; else {', '.join(others)}" if others else ""
        link = format_object(proposal.link)
        yield f'link_object = "{link}"  # {MARK}: whether it is the link\'s{more}'
        return
    yield "# One encoder, at the motor: name a second one, if there is one, as link_object."
    if proposal.torque is not None:
        yield f'torque_object = "{format_object(proposal.torque)}"'
        yield f"torque_scale = {TORQUE_SCALE}  # {MARK}: torque at the joint of one count [N m]"


def _axes(proposal: Proposal, place: int) -> Iterator[str]:
    sign = -1 if place % 2 else 1
    axes = [("motor", GEAR, proposal.motor)]
    if proposal.link is not None:
        axes.append(("link", 1.0, proposal.link))
    for axis, gear, entry in axes:
        yield ""
        yield f"[node.{axis}]"
        yield f"counts_per_rev = {COUNTS_PER_REV}  # {MARK}: counts a turn of the encoder's shaft"
        yield f"gear = {gear}  # {MARK}: turns of that shaft for one turn of the {axis}"
        yield f"sign = {sign}  # {MARK}: 1 if counts grow forward"
        unsigned = range_of(entry.kind)[0] == 0
        quarter = 1 << entry.bits - 2 if unsigned else 0
        yield f"offset_counts = {quarter}  # {MARK}: legbench drives zero"
        yield f"bits = {entry.bits}"
        if unsigned:
            yield "lowest_count = 0  # an unsigned object"


def _parameters(sheet: DataSheet) -> Iterator[str]:
    ramps = RAMPS if _brakes_on_either(sheet) else RAMPS[:1]
    ramp = next((key for key in ramps if _holds(sheet, key, LEAST_RAMP * PER_RAD)), None)
    wanted: list[tuple[Key | None, float, str]] = [
        ((0x6065, 0), WINDOW_RAD * PER_RAD, f"following error window [counts]: {WINDOW_RAD} rad"),
        ((0x6066, 0), 10, "for so long [ms]"),
        ((0x6072, 0), TORQUE_PERMILLE, "max torque [permille of rated]"),
        (ramp, RAMP * PER_RAD, f"quick stop: {RAMP:g} rad/s2, in the drive's own unit"),
    ]
    lines = [
        f'"{format_object(_named(sheet, key))}" = {_within(sheet, key, value)}  # {MARK}: {words}'
        for key, value, words in wanted
        if key is not None and _holds(sheet, key, 0)
    ]
    if lines:
        yield ""
        yield "[node.parameters]"
        yield from lines


def _brakes_on_either(sheet: DataSheet) -> bool:
    """Whether a quick stop brakes on 6084h where that is wanted: by 605Ah = 1, or 5."""
    return sheet.writable(QUICK_STOP_OPTION) or sheet.default(QUICK_STOP_OPTION, 0) in (1, 5)


def _holds(sheet: DataSheet, key: Key, least: float) -> bool:
    """Whether an object can be written a whole number of at least a value."""
    entry = sheet.objects.get(key)
    if entry is None or entry.kind not in FORMATS or not sheet.writable(key):
        return False
    return sheet.limits.get(key, range_of(entry.kind))[1] >= least


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
            if words == "rpdo":
                yield f"deadline_ms = {pdo.deadline_ms}"


def waivers_for(proposal: Proposal, *, watched: bool, braked: bool) -> tuple[str, ...]:
    """Names of the protections that drives have to do without.

    Args:
        proposal: encoders of the drives.
        watched: a means of every drive stops it when its master is gone.
        braked: every drive takes the ramp of a quick stop.
    """
    sprung = proposal.link is not None or proposal.torque is not None
    names = ((MASTER_WATCH, watched), (QUICK_STOP_RAMP, braked), (SPRING_WATCH, sprung))
    return tuple(name for name, has in names if not has)


def marked_lines(text: str) -> tuple[int, ...]:
    """Numbers of the lines of a bus file that are still to be measured."""
    return tuple(
        number for number, line in enumerate(text.splitlines(), start=1) if f"# {MARK}" in line
    )
