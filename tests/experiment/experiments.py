"""Experiments of every kind, and how to change a file."""

from pathlib import Path

from legbench.control import BangBangConfig, ControllerSettings, JumpConfig, PositionJumpConfig
from legbench.design import load_design
from legbench.design.setup import Setup, SetupKind
from legbench.drives.emulated.faults import (
    Babble,
    FrameFault,
    FrameFaultKind,
    NodeFault,
    NodeFaultKind,
)
from legbench.drives.setup.bus_file import load_limits
from legbench.experiment import Conventions, Experiment
from legbench.guests import module_of_file
from legbench.plant.landing import End
from legbench.plants import AnalyticChoice, CanChoice, PlantSettings, SimChoice

ROOT = Path(__file__).parents[2]
HARDWARE = ROOT / "hardware"
PROTOTYPE = load_design(ROOT / "models" / "prototype.toml")
LIMITS = load_limits(HARDWARE / "limits.toml")
GUESTS = ROOT / "tests" / "control" / "guests"
SINE = GUESTS / "sine.py"
STILL = ROOT / "tests" / "plant" / "guests" / "still.py"

CONTROLLERS: dict[str, ControllerSettings] = {
    "jump": JumpConfig(dz2=0.1),
    "bang-bang": BangBangConfig(three_levels=True),
    "position-jump": PositionJumpConfig(z2=0.9),
    "sine": module_of_file(SINE).Sine(freq=3.0),
}
PLANTS: dict[str, PlantSettings] = {
    "sim": SimChoice(),
    "limited": SimChoice(limits=LIMITS),
    "analytic": AnalyticChoice(),
    "can": CanChoice(
        end=End.STOP,
        bus=HARDWARE / "leg.toml",
        interface="legbench",
        faults=(
            FrameFault(kind=FrameFaultKind.DROP, cob_id=0x181, start_ns=1, end_ns=2),
            NodeFault(kind=NodeFaultKind.RESET, node_id=2, start_ns=1 << 60),
            Babble(cob_id=1, start_ns=1 << 60, end_ns=1 << 61, every_ns=5, data=b"\x00\xff"),
        ),
    ),
    "still": module_of_file(STILL).Still(lag=0.25),
}


def experiment(controller: str, plant: str, duration: float = 0.15) -> Experiment:
    settings = CONTROLLERS[controller]
    return Experiment(
        design=PROTOTYPE,
        controller=settings,
        setup=Setup(kind=SetupKind(settings.usual_setup)),
        plant=PLANTS[plant],
        conventions=Conventions(rating_reference="equilibrium"),
        duration=duration,
        seed=7,
    )
