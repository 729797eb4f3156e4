"""Leads random drives that differ from the standard: each runs, or is refused in one line.

    python scripts/odd_drives.py --count 2000 --seed 7

A drive that is led holds its whole configuration, stands where it is commanded and stops; one that
is refused has never had power while something of it was missing. Exit status 1 if one does neither.
"""

import argparse
import random
import re
import sys
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from odd_drive_draw import Drawn, draw, ordinary

from legbench.drives.emulated.build import emulate
from legbench.drives.emulated.bus import LockstepBus
from legbench.drives.emulated.drive import EmulatedDrive
from legbench.drives.master.link import Link
from legbench.drives.protocol.cia402 import DriveState
from legbench.drives.setup.checks import check_together
from legbench.drives.setup.config import BusConfig
from legbench.drives.setup.encoders import Side
from legbench.drives.transport.lock import ChannelLock
from legbench.errors import LegbenchError
from legbench.limits.safety import SafetyLimits

START = (-0.4, 0.5)
"""Motor positions at power-on [rad]."""
FAR = 0.25
"""Way of every motor [rad]."""
SETTLING = 60
"""Cycles for which a target that has been reached is held; a slow drive lags by 20."""
STIFFNESS = (4.0, 4.0)
LIMITS = SafetyLimits(
    motor_range=((-1.1, 0.8), (-0.8, 1.1)),
    joint_range=((-1.8, 0.85), (-0.85, 1.8)),
    command_speed=20.0,
    spring_torque=4.0,
    following_error=0.3,
    temperature=75.0,
)
OBJECT = re.compile(r"[0-9A-F]{4}h|0x[0-9A-F]{4}|\b[a-z]+_[a-z_]+\b")
"""Object, error code or key that a message names."""
WAYS = re.compile(
    r"\b(give|raise|lower|leave|map|correct|choose|waive|zero|look at|have the drive|remove)\b"
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Trial:
    """How one pair of drives went."""

    drives: tuple[Drawn, ...]
    refused: str | None
    """Message of the refusal, none if they ran."""
    wrong: tuple[str, ...]
    """What should not have been."""


def trial(drives: Sequence[Drawn]) -> Trial:
    """Lead two drives: enable, move, stop; or be refused."""
    wrong: list[str] = []
    refused: str | None = None
    try:
        _run(drives, wrong)
    except LegbenchError as error:
        refused = str(error)
        if "\n" in refused or not OBJECT.search(refused) or not WAYS.search(refused):
            wrong.append(f"no object or no way out: {refused}")
    return Trial(drives=tuple(drives), refused=refused, wrong=tuple(wrong))


def _run(drives: Sequence[Drawn], wrong: list[str]) -> None:
    nodes = tuple(drive.node for drive in drives)
    bus_config = BusConfig(nodes=nodes, period_us=2000, sdo_timeout_ms=20, waive=("spring watch",))
    check_together(bus_config, LIMITS)
    network = emulate(bus_config, [drive.behaviour for drive in drives], body_period_ns=1_000_000)
    watched = [
        _Watch(drive, drawn, wrong) for drive, drawn in zip(network.drives, drives, strict=True)
    ]
    tick = network._tick

    def looking() -> None:
        tick()
        for watch in watched:
            watch.look()

    network._tick = looking
    with LockstepBus("odd", network=network) as bus:
        lock = ChannelLock.private("odd")
        link = Link(bus, bus_config, LIMITS, stiffness=STIFFNESS, lock=lock)
        try:
            _lead(link, network.drives, drives, wrong)
        finally:
            link.close()
    wrong += [
        f"{drawn.node.name} keeps its power"
        for drive, drawn in zip(network.drives, drives, strict=True)
        if drive.axis.power.state is DriveState.OPERATION_ENABLED
    ]


def _lead(
    link: Link, emulated: Sequence[EmulatedDrive], drives: Sequence[Drawn], wrong: list[str]
) -> None:
    link.start()
    wrong += [
        f"led in mode {drive._values[0x6061, 0]}"
        for drive in emulated
        if drive._values[0x6061, 0] != 8
    ]
    there = [pos + (FAR if place else -FAR) for place, pos in enumerate(START)]
    sample = link.move_to(there, 2.0)
    for _ in range(SETTLING):
        link.command(there)
        sample = link.exchange()
    for place, (drive, drawn) in enumerate(zip(emulated, drives, strict=True)):
        node, units = drawn.node, drawn.node.motor
        angle = drive.axis.motion.angle
        close = 0.02 if node.side is Side.LINK else 1.1 * units.resolution + 1e-9
        if abs(angle - there[place]) > close:
            wrong.append(f"{node.name} is at {angle:.6f}, commanded was {there[place]:.6f} rad")
        shown = sample.link_pos[place] if node.side is Side.LINK else sample.motor_pos[place]
        if abs(shown - angle) > close:
            wrong.append(f"{node.name} shows {shown:.6f} rad at {angle:.6f} rad")
        known = {
            "motor_pos": sample.motor_pos,
            "joint_pos": sample.link_pos,
            "spring_torque": sample.spring_torque,
        }
        wrong += [
            f"{node.name} knows no {name}"
            for name in node.knows
            if known[name][place] != known[name][place]
        ]
        if node.temperature_object and abs((sample.temperature[place] or 0.0) - 25.0) > 1.0:
            wrong.append(f"{node.name} is at {sample.temperature[place]} deg C")


class _Watch:
    """Looks whether a drive with power holds what it has to."""

    def __init__(self, drive: EmulatedDrive, drawn: Drawn, wrong: list[str]) -> None:
        self._drive, self._drawn, self._wrong = drive, drawn, wrong
        self._done = False

    def look(self) -> None:
        """Look once, when the drive has become enabled."""
        drive = self._drive
        if self._done or drive.axis.power.state is not DriveState.OPERATION_ENABLED:
            return
        self._done = True
        values, node = drive._values, self._drawn.node
        span = values[0x60C2, 1] * 10.0 ** values[0x60C2, 2]
        told = 0x60C2 not in self._drawn.behaviour.lacks
        says: list[tuple[str, Any, Any]] = [
            ("offset of the position", values[0x60B0, 0], 0),
            ("polarity", values[0x607E, 0], 0),
            ("mode asked for", values[0x6060, 0], 8),
            ("interpolation", span if told else 0.002, 0.002),
            ("commands", sorted(drive._pdos.rpdos), sorted(map(node.rpdo_id, node.rpdos))),
            (
                "answers",
                sorted(pdo.cob_id for pdo in drive._pdos.tpdos),
                sorted(map(node.tpdo_id, node.tpdos)),
            ),
            ("types", {pdo.kind for pdo in drive._pdos.rpdos.values()} <= set(range(241)), True),
        ]
        for what, there, wanted in says:
            if there != wanted and not (isinstance(there, float) and abs(there - wanted) < 1e-9):
                self._wrong.append(f"enabled with {what} {there}, wanted {wanted}")


def pair(chance: random.Random) -> tuple[Drawn, Drawn]:
    """Draw two drives, one of which may be ordinary."""
    first, second = draw(chance, 0, START[0]), draw(chance, 1, START[1])
    return (first, second if chance.random() < 0.5 else ordinary(1, START[1]))


def main() -> int:
    """Run trials and print what went wrong."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--refusals", action="store_true", help="print every refusal")
    given = parser.parse_args()
    chance = random.Random(given.seed)
    ran, failed, why = 0, 0, Counter[str]()
    for number in range(given.count):
        found = trial(pair(chance))
        ran += found.refused is None
        if found.refused is not None:
            why[re.sub(r"\d+", "#", found.refused)[:70]] += 1
            if given.refusals:
                print(f"{number}: {found.refused}")
        for text in found.wrong:
            failed += 1
            print(f"WRONG {number}: {text}")
            print("   " + "\n   ".join(" | ".join(drive.quirks) for drive in found.drives))
    print(f"{given.count} pairs: {ran} ran, {given.count - ran} refused, {failed} violations")
    for text, count in why.most_common(12):
        print(f"{count:5d}  {text}")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
