"""A motor or an encoder that dies in mid-run is found; a healthy leg is left alone."""

from pathlib import Path

import pytest
from can_rig import BUS

from legbench.commissioning.broken_plant import Part
from legbench.commissioning.dead_part_stage import CONTROLLERS, Bench, Death, Emulation
from legbench.commissioning.dead_parts import try_dead_part, watch_healthy
from legbench.design import load_design
from legbench.servo import ServoConfig

BENCH = Bench(
    design=load_design(Path(BUS).parents[1] / "models" / "optimal.toml"), bus_file=Path(BUS)
)
CAUSES = {
    Part.JAMMED: {"following error"},
    Part.MOTOR_FROZEN: {"following error"},
    Part.MOTOR_STEP: {"following error"},
    Part.MOTOR_DRIFT: {"following error"},
    Part.LINK_FROZEN: {"joint encoder", "sway"},
    Part.REPEATING: {"joint encoder", "sway", "following error"},
    Part.LINK_STEP: {"joint speed"},
    Part.LINK_DRIFT: {"sway"},
}


@pytest.mark.parametrize("part", Part)
@pytest.mark.parametrize(
    ("emulation", "controller", "drive", "onset", "servo"),
    [
        (Emulation.CAN, "jump", 1, 0.537, ServoConfig(bandwidth=30.0)),
        (Emulation.SIM, "bang-bang", 0, 0.622, ServoConfig(bandwidth=15.0, encoder_counts=4096)),
        (Emulation.ANALYTIC, "jump", 1, 0.704, ServoConfig(delay_cycles=2)),
    ],
)
def test_a_part_that_dies_is_found_in_time(
    emulation: Emulation, controller: str, part: Part, drive: int, onset: float, servo: ServoConfig
) -> None:
    death = Death(part=part, drive=drive, onset=onset)
    found = try_dead_part(BENCH, emulation, controller, death, servo)
    assert found.within(part), found
    assert found.cause in CAUSES[part]


@pytest.mark.parametrize("controller", CONTROLLERS)
@pytest.mark.parametrize(
    ("emulation", "servo"),
    [
        (Emulation.SIM, ServoConfig(bandwidth=15.0, encoder_counts=4096)),
        (Emulation.CAN, ServoConfig(bandwidth=15.0, encoder_counts=4096)),
        (Emulation.ANALYTIC, ServoConfig(encoder_counts=1 << 20)),
    ],
)
def test_a_healthy_leg_is_left_alone(
    emulation: Emulation, controller: str, servo: ServoConfig
) -> None:
    assert watch_healthy(BENCH, emulation, controller, servo, 1.5) is None
