"""Recording of the runs that are replayed."""

from pathlib import Path

from legbench.control import ControllerSettings
from legbench.design import LegDesign
from legbench.design.setup import Setup
from legbench.experiment import Experiment, record
from legbench.plant.landing import End
from legbench.plant.opening import PlantSettings
from legbench.plants import CanChoice
from legbench.recording.reader import Recording, load

BUS = Path(__file__).parents[2] / "hardware" / "leg.toml"


def run_of(
    folder: Path,
    design: LegDesign,
    controller: ControllerSettings,
    plant: PlantSettings,
    duration: float,
) -> Recording:
    chosen = Experiment(
        design=design,
        controller=controller,
        setup=Setup(kind=type(controller).usual_setup),
        plant=plant,
        duration=duration,
    )
    finished = record(chosen, folder)
    assert finished.outcome.status == "complete", finished.outcome
    return load(finished.path)


def emulated() -> CanChoice:
    return CanChoice(bus=BUS, interface="legbench", end=End.STOP)
