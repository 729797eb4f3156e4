"""Draws drives that differ from the standard, each with the bus file that somebody wrote for it."""

import random
from dataclasses import dataclass, field, replace
from typing import Any

from legbench.drives.emulated.behaviour import Behaviour
from legbench.drives.protocol.datatypes import DataType, range_of
from legbench.drives.protocol.objects import Key
from legbench.drives.protocol.pdo import Mapped
from legbench.drives.protocol.sdo import Abort
from legbench.drives.protocol.sdo_server import SdoAnswers
from legbench.drives.setup.config import Identity, NodeConfig
from legbench.drives.setup.encoders import Side
from legbench.drives.setup.parameters import Parameter
from legbench.drives.setup.pdos import CONTROLWORD, STATUSWORD, packed
from legbench.drives.setup.quirks import ModeShown
from legbench.drives.setup.units import AxisUnits

T = DataType
OBJECTS_OF = ("motor_object", "target_object", "link", "link_object", "torque_object")
"""Fields of a node that say what its process data carries."""
OPTIONAL: tuple[Key | int, ...] = (
    0x603F, 0x6085, (0x1018, 2), (0x1018, 3), (0x1018, 4), 0x1006, 0x1016, 0x1017, 0x1029, 0x6007,
    0x605A, 0x605B, 0x605C, 0x605D, 0x605E, 0x6065, 0x6066, 0x6072, 0x607D, 0x607E, 0x60B0, 0x60B1,
    0x60B2, 0x60C2, (0x1400, 5), (0x1400, 3), 0x1005,
)  # fmt: skip
"""Objects that drives are known to lack."""
ABSENT = (Abort.NO_OBJECT, Abort.GENERAL, Abort.UNSUPPORTED_ACCESS)
POSITIONS = (T.INTEGER16, T.UNSIGNED16, T.INTEGER32, T.UNSIGNED32, T.INTEGER64, T.UNSIGNED64)
TEMPERATURES = (T.INTEGER8, T.UNSIGNED8, T.INTEGER16, T.UNSIGNED16, T.INTEGER32, T.REAL32)
INTERPOLATES: tuple[tuple[Key, int], ...] = (((0x60C2, 1), 1), ((0x60C2, 2), -3))
"""What a drive without 60C2h works with: the period of the bench."""
BRAKING = 20_000.0
"""Deceleration of a quick stop [rad/s2]; objects of 32 bits hold less of very fine encoders."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Drawn:
    """A drive, and what the bus file says of it."""

    node: NodeConfig
    behaviour: Behaviour
    quirks: tuple[str, ...] = field(default=())
    """What is odd about it, in words."""


def ordinary(place: int, start: float) -> Drawn:
    """A drive that keeps to the standard, at a motor position [rad]."""
    units = AxisUnits(counts_per_rev=1 << 16, gear=6.0, sign=1 - 2 * place, offset_counts=777)
    node = NodeConfig(
        name=("motor1", "motor2")[place],
        node_id=place + 1,
        identity=Identity(vendor=0x123, product=0x402),
        motor=units,
        link=AxisUnits(counts_per_rev=1 << 16, offset_counts=-55, bits=16),
        parameters=(_ramp(0x6085, units),),
    )
    return Drawn(node=node, behaviour=Behaviour(start_pos=start, seed=place))


def _ramp(index: int, units: AxisUnits) -> Parameter:
    value = min(round(BRAKING * abs(units.counts_per_rad)), (1 << 32) - 1)
    return Parameter(index=index, sub=0, kind=T.UNSIGNED32, value=value)


def draw(chance: random.Random, place: int, start: float) -> Drawn:
    """Draw a drive with any number of quirks, at a motor position [rad]."""
    drawn = ordinary(place, start)
    for quirk in (lacking, answering, showing, warning, encoding, warm, mapping, one_encoder):
        if chance.random() < 0.4:
            drawn = quirk(chance, drawn)
    return drawn


def lacking(chance: random.Random, drawn: Drawn) -> Drawn:
    """Let it lack objects, and say so in one way or another."""
    lacks = frozenset(chance.sample(OPTIONAL, chance.randint(1, 5)))
    node, how = drawn.node, drawn.behaviour
    defaults = INTERPOLATES if chance.random() < 0.8 else ()
    how = replace(how, lacks=lacks, lacking=chance.choice(ABSENT), defaults=defaults)
    if 0x1016 in lacks and chance.random() < 0.5:
        node = replace(node, heartbeat_consumer=False)
    if 0x6085 in lacks and chance.random() < 0.5:
        node = replace(node, parameters=(_ramp(0x6084, node.motor),))
    names = ", ".join(
        f"{key:04X}" if isinstance(key, int) else f"{key[0]:04X}:{key[1]:02X}"
        for key in sorted(lacks, key=str)
    )
    return _with(drawn, node, how, f"lacks {names} ({how.lacking.name})")


def answering(chance: random.Random, drawn: Drawn) -> Drawn:
    """Let it answer with four bytes, or without a size."""
    answers = chance.choice((SdoAnswers.FOUR_BYTES, SdoAnswers.UNSIZED))
    how = replace(drawn.behaviour, sdo_answers=answers)
    return _with(drawn, drawn.node, how, f"answers {answers.value}")


def showing(chance: random.Random, drawn: Drawn) -> Drawn:
    """Let it show its mode late, or only with power; now and then the bus file does not say so."""
    told = chance.random() < 0.8
    lag_us = chance.choice((2000, 900_000, 4_000_000))
    needs_power, follows = chance.random() < 0.5, chance.random() < 0.5
    how = replace(
        drawn.behaviour, mode_lag_us=lag_us, mode_needs_power=needs_power, follows_bit=follows
    )
    quirks = drawn.node.quirks
    if told:
        shown = ModeShown.ENABLED if needs_power else ModeShown.CONFIGURED
        quirks = replace(quirks, mode_patience_ms=6000, mode_shown=shown, follows_bit=follows)
    words = (
        f"mode {'with power ' if needs_power else ''}after {lag_us} us, bit 12 {follows}, {told}"
    )
    return _with(drawn, replace(drawn.node, quirks=quirks), how, words)


def warning(chance: random.Random, drawn: Drawn) -> Drawn:
    """Let it warn of nothing; now and then the bus file does not list it."""
    codes = (0xFF01, 0x5112)
    listed = codes if chance.random() < 0.8 else ()
    node = replace(drawn.node, quirks=replace(drawn.node.quirks, warnings=listed))
    return _with(drawn, node, replace(drawn.behaviour, warnings=codes), f"warns, {bool(listed)}")


def encoding(chance: random.Random, drawn: Drawn) -> Drawn:
    """Give it encoders of other lengths and moduli, wrapping anywhere."""
    node = drawn.node
    motor, kind = _encoder(chance, node.motor)
    changes: dict[str, Any] = {
        "motor": motor,
        "parameters": tuple(_ramp(one.index, motor) for one in node.parameters),
        "motor_object": Mapped(0x6064, 0, kind),
        "target_object": Mapped(0x607A, 0, kind),
    }
    words = f"motor {kind.name} modulus {motor.modulus} from {motor.lowest}"
    if node.link is not None:
        link, kind = _encoder(chance, node.link)
        changes |= {"link": link, "link_object": Mapped(0x3000, 7, kind)}
        words += f", link {kind.name} modulus {link.modulus} from {link.lowest}"
    return _with(drawn, _changed(node, **changes), drawn.behaviour, words)


def _encoder(chance: random.Random, units: AxisUnits) -> tuple[AxisUnits, DataType]:
    """Draw an encoder of 12 to 32 bits a turn, single-turn or multi-turn."""
    kind = chance.choice(POSITIONS)
    low, high = range_of(kind)
    bits = (high - low + 1).bit_length() - 1
    fine = min(chance.randint(12, 32), bits, 31)
    single = chance.random() < 0.5 and bits < 64
    # Without a modulus of its own it repeats with its object.
    modulus = chance.choice((1 << fine, (1 << fine) - 96)) if single else None
    lowest = low
    if modulus is not None:
        anywhere = (low, 0, 1000, -(modulus // 2))
        lowest = chance.choice([one for one in anywhere if low <= one <= high - modulus + 1])
    gear = 1.0 if single or fine > 26 else units.gear
    per_rev = modulus or 1 << (min(fine, 12) if bits == 16 else fine)
    offset = 500
    if modulus is not None:
        offset = chance.randrange(modulus)
    elif low == 0 and bits > 16:
        offset = 1 << 29
    return (
        replace(
            units,
            counts_per_rev=per_rev,
            gear=gear,
            bits=bits,
            modulus_counts=modulus,
            lowest_count=lowest,
            offset_counts=offset,
        ),
        kind,
    )


def warm(chance: random.Random, drawn: Drawn) -> Drawn:
    """Let it tell its temperature in some type."""
    kind = chance.choice(TEMPERATURES)
    scale = 1.0 if kind in (T.INTEGER8, T.UNSIGNED8, T.REAL32) else chance.choice((1.0, 0.1))
    heat = Mapped(0x3100, 1, kind)
    node = replace(drawn.node, temperature_object=heat, temperature_scale=scale)
    return _with(drawn, node, drawn.behaviour, f"temperature {kind.name} of {scale:g}")


def mapping(chance: random.Random, drawn: Drawn) -> Drawn:
    """Give it fewer or more than four PDOs each way, mapped for good or not."""
    rpdos, tpdos, fixed = chance.randint(1, 7), chance.randint(1, 7), chance.random() < 0.5
    how = replace(drawn.behaviour, rpdos=rpdos, tpdos=tpdos, fixed_mapping=fixed)
    return _with(drawn, drawn.node, how, f"{rpdos} RPDOs, {tpdos} TPDOs, fixed {fixed}")


def one_encoder(chance: random.Random, drawn: Drawn) -> Drawn:
    """Leave it one encoder, with or without a torque."""
    torque = Mapped(0x6077, 0, T.INTEGER16) if chance.random() < 0.5 else None
    side = chance.choice((Side.MOTOR, Side.LINK))
    node = _changed(drawn.node, link=None, side=side, torque_object=torque, torque_scale=0.01)
    return _with(drawn, node, drawn.behaviour, f"one encoder, at the {side}, torque {torque}")


def _changed(node: NodeConfig, **changes: Any) -> NodeConfig:
    """A node with other objects, and process data that carries them."""
    there = {name: getattr(node, name) for name in OBJECTS_OF} | changes
    answers = [STATUSWORD, there["motor_object"]]
    answers += [] if there["link"] is None else [there["link_object"]]
    answers += [there["torque_object"]] if there["torque_object"] else []
    rpdos = packed((CONTROLWORD, there["target_object"]), deadline_ms=20)
    return replace(node, **changes, rpdos=rpdos, tpdos=packed(answers))


def _with(drawn: Drawn, node: NodeConfig, how: Behaviour, words: str) -> Drawn:
    return Drawn(node=node, behaviour=how, quirks=(*drawn.quirks, words))
