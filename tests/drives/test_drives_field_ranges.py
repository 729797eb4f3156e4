"""A mapped object holds what its joint and its drive may show, or is refused with the numbers."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from can_rig import BUS, LIMITS, ROOT
from drives_rig import MS, rig
from drives_rig import config as rig_config
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from legbench.cli import main
from legbench.commissioning.status import status
from legbench.design import load_design
from legbench.drives.emulated.build import emulate
from legbench.drives.emulated.bus import LockstepBus
from legbench.drives.master.axis_link import AxisLink
from legbench.drives.master.session import Session
from legbench.drives.master.temperature import TemperaturePoll
from legbench.drives.protocol.datatypes import FORMATS, DataType, pack
from legbench.drives.protocol.pdo import Mapped
from legbench.drives.setup.bus_file import load_bus, load_limits
from legbench.drives.setup.config import LINK_POSITION, BusConfig, NodeConfig, PdoConfig
from legbench.drives.setup.field_ranges import check_field_ranges
from legbench.drives.setup.units import AxisUnits
from legbench.errors import ConfigError
from legbench.limits.safety import SafetyLimits
from legbench.plants import limits_for

angles = st.floats(-2.2, 2.2)


def changed(**changes: Any) -> BusConfig:
    """The bench's bus with another first node."""
    bus = load_bus(BUS)
    return replace(bus, nodes=(replace(bus.nodes[0], **changes), bus.nodes[1]))


def shows(node: NodeConfig, motor: float, link: float) -> float:
    """What a new link makes of both positions, as a drive's encoders show them [rad]."""
    axis = AxisLink(node)
    axis.begin_cycle()
    low, mask = -(1 << node.link_units.bits - 1), (1 << node.link_units.bits) - 1
    short = (node.link_units.to_counts(link) - low & mask) + low
    kind = {16: DataType.INTEGER16, 32: DataType.INTEGER32}[node.link_units.bits]
    data = pack(DataType.UNSIGNED16, 0) + pack(DataType.INTEGER32, node.motor.to_counts(motor))
    assert axis.feed(node.tpdo_id(node.tpdos[0]), data + pack(kind, short))
    return axis.link_pos


@settings(derandomize=True, max_examples=50, deadline=None)
@given(
    units=st.builds(
        AxisUnits,
        counts_per_rev=st.integers(10, 21).map(lambda power: 1 << power),
        offset_counts=st.integers(-30_000, 30_000),
        sign=st.sampled_from([-1, 1]),
        bits=st.just(16),
    ),
    joint=st.tuples(angles, angles).map(sorted),
    motor=angles,
    share=st.floats(0.0, 1.0),
)
def test_a_link_that_is_taken_is_shown_right_or_out_of_its_range(
    units: AxisUnits, joint: list[float], motor: float, share: float
) -> None:
    low, high = joint
    assume(high - low > 1e-3)
    limits = SafetyLimits(joint_range=((low, high), (low, high)))
    bus = load_bus(BUS)
    bus = replace(bus, nodes=tuple(replace(node, link=units) for node in bus.nodes))
    node = bus.nodes[0]
    try:
        check_field_ranges(bus, limits)
    except ConfigError:
        # Refused for a reason: two positions of the joint show the same, for every motor.
        lap = (1 << 16) * units.resolution
        assert low + lap <= high
        assert shows(node, motor, low) == pytest.approx(
            shows(node, motor, low + lap), abs=1.5 * units.resolution
        )
        return
    link = low + share * (high - low)
    seen = shows(node, motor, link)
    near = 1.5 * units.resolution
    assert abs(seen - link) <= near or not low + near <= seen <= high - near


def test_two_million_counts_in_16_bits_are_refused_and_alias(tmp_path: Path) -> None:
    fine = AxisUnits(counts_per_rev=1 << 21, bits=16)
    bus = changed(link=fine)
    words = (
        r"link of 'motor1': 2064h:00 of 16 bits repeats every 0\.1963 rad at 333772 counts/rad, "
        r"but its joint's range \[-1.8, 0.85\] rad is 2\.65 rad wide: map an object of 32 bits"
    )
    with pytest.raises(ConfigError, match=words):
        check_field_ranges(bus, load_limits(LIMITS))
    # A spring of 4 N m/rad that carries 0.6 N m seems to carry -0.19 N m.
    assert 4.0 * (0.0 - shows(bus.nodes[0], 0.0, -0.15)) == pytest.approx(-0.185, abs=1e-3)


def tpdos() -> tuple[PdoConfig, ...]:
    status, motor, _ = load_bus(BUS).nodes[0].tpdos[0].objects
    return (
        PdoConfig(number=1, objects=(status, motor)),
        PdoConfig(number=2, objects=(LINK_POSITION,)),
    )


def test_the_way_out_is_one() -> None:
    link = AxisUnits(counts_per_rev=1 << 21)
    check_field_ranges(
        changed(link=link, link_object=LINK_POSITION, tpdos=tpdos()), load_limits(LIMITS)
    )


@pytest.mark.parametrize(
    ("units", "held"),
    [
        (AxisUnits(counts_per_rev=1 << 30, gear=10.0), "-2147483648 to 2147483647"),
        (AxisUnits(counts_per_rev=1 << 16, offset_counts=(1 << 31) - 5), "2147483647"),
    ],
)
def test_a_motor_beyond_its_object_is_refused(units: AxisUnits, held: str) -> None:
    words = rf"motor of 'motor1': its range \[-1.1, 0.8\] rad .* counts, but position .*{held}"
    with pytest.raises(ConfigError, match=words):
        check_field_ranges(changed(motor=units, soft_limits=None), load_limits(LIMITS))


KINDS = [kind for kind in FORMATS if kind is not DataType.BOOLEAN]


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.name)
@pytest.mark.parametrize("scale", [0.01, 0.1, 1.0])
def test_a_temperature_is_taken_where_its_object_reaches_the_limit(
    kind: DataType, scale: float
) -> None:
    ends = {"b": 127, "h": 32767, "i": 2147483647, "q": 2**63 - 1, "B": 255, "H": 65535}
    highest = ends.get(FORMATS[kind], 2**32 - 1) * scale
    bus = changed(temperature_object=Mapped(0x2070, 0, kind), temperature_scale=scale)
    limits = load_limits(LIMITS)
    if highest > limits.temperature:
        check_field_ranges(bus, limits)
        return
    with pytest.raises(ConfigError, match=rf"ends at {highest:g} deg C .* the limit is 75 deg C"):
        check_field_ranges(bus, limits)


def test_what_is_not_limited_needs_no_range() -> None:
    bus = changed(temperature_object=Mapped(0x2070, 0, DataType.INTEGER8))
    check_field_ranges(bus, SafetyLimits())


@pytest.mark.parametrize(("scale", "celsius"), [(0.1, 25.0), (1.0, 250.0), (0.25, 62.5)])
def test_the_scale_of_a_temperature_is_the_files(
    scale: float, celsius: float, tmp_path: Path
) -> None:
    heat = Mapped(0x2070, 0, DataType.INTEGER16)
    base = rig_config()
    nodes = tuple(
        replace(one, temperature_object=heat, temperature_scale=scale) for one in base.nodes
    )
    with rig(tmp_path, bus_config=replace(base, nodes=nodes)) as it:
        sample = it.link.start()
        assert sample.temperature == (celsius, celsius)
    bus = replace(base, nodes=nodes)
    network = emulate(bus)
    network.advance(20 * MS)
    with Session(LockstepBus("it", network=network), bus) as session:
        assert [entry.temperature for entry in status(session)] == [celsius] * 2
    poll = TemperaturePoll(nodes[0])
    poll.take(-40)
    assert poll.celsius == -40 * scale


def test_the_shipped_files_fit_every_shipped_leg() -> None:
    for name in ("optimal", "table2", "prototype"):
        limits = limits_for(LIMITS, load_design(ROOT / "models" / f"{name}.toml"))
        check_field_ranges(load_bus(BUS), limits)


def one_turn_in_16_bits(text: str) -> str:
    return text.replace("counts_per_rev = 65536\nsign = 1", "counts_per_rev = 2097152\nsign = 1", 1)


def eight_bits(text: str) -> str:
    return text.replace('"2070:00 i16"', '"2070:00 i8"', 1)


def deaf(text: str) -> str:
    rpdo = '\n[[node.rpdo]]\nnumber = 1\nobjects = ["6040:00 u16", "607A:00 i32"]\n'
    text = text.replace("master_heartbeat_ms = 10", "master_heartbeat_ms = 20_000")
    return text.replace("\n[node.parameters]", rpdo + "deadline_ms = 0\n\n[node.parameters]")


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (one_turn_in_16_bits, "link of 'motor1': 2064h:00 of 16 bits repeats"),
        (eight_bits, "temperature of 'motor1': 2070h:00 of 8 bits ends at 12.7 deg C"),
        (deaf, "drive 'motor1' would not stand within 100 ms of its master's death"),
    ],
)
@pytest.mark.parametrize(
    "command",
    [
        ["drives", "budget"],
        ["drives", "jog", "--node", "motor1"],
        ["run", "jump", "--plant", "can", "--duration", "0.1"],
    ],
    ids=lambda command: command[-1],
)
def test_files_that_do_not_fit_end_in_one_line(
    command: list[str],
    change: Callable[[str], str],
    words: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    text = BUS.read_text(encoding="utf-8")
    assert change(text) != text
    (tmp_path / "leg.toml").write_text(change(text), encoding="utf-8")
    (tmp_path / "limits.toml").write_bytes(LIMITS.read_bytes())
    monkeypatch.chdir(tmp_path)
    design = ["--design", str(ROOT / "models" / "optimal.toml")]
    status = main([*command, "--bus", "leg.toml", "--interface", "legbench", *design])
    told = capsys.readouterr().err
    assert status != 0
    assert told.startswith(f"legbench: {words}")
    assert len(told.splitlines()) == 1
    assert not (tmp_path / "runs").exists()
