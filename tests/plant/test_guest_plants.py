"""A plant of one's own: found like a controller, opened, run, recorded, run again."""

from pathlib import Path

import numpy as np
import pytest

from legbench.control import BangBangConfig
from legbench.design import LegDesign
from legbench.design.setup import Setup, SetupKind
from legbench.errors import ConfigError
from legbench.experiment import Experiment, record
from legbench.imperfections import Imperfections
from legbench.plants import PLANTS, SimChoice
from legbench.recording.reader import load

STILL = f"{Path(__file__).parent / 'guests' / 'still.py'}:Still"


def test_a_plant_from_a_file_is_run_recorded_and_run_again(
    prototype: LegDesign, tmp_path: Path
) -> None:
    chosen = Experiment(
        design=prototype,
        controller=BangBangConfig(),
        setup=Setup(kind=SetupKind.FFS),
        plant=PLANTS.find(STILL)(lag=0.25),
        duration=0.3,
    )
    found = load(record(chosen, tmp_path / "first").path)
    assert found.complete
    assert found.manifest["experiment"]["plant"] == {
        "kind": "plant_still.py:Still",
        "settings": {"lag": 0.25},
    }
    again = Experiment.from_run(found.path)
    assert type(again.plant) is not type(chosen.plant)
    second = load(record(again, tmp_path / "second").path)
    assert np.array_equal(found["joint_pos"], second["joint_pos"])


def test_a_plant_that_knows_no_imperfections_is_not_run_without_them(
    prototype: LegDesign, tmp_path: Path
) -> None:
    chosen = Experiment(
        design=prototype,
        controller=BangBangConfig(),
        setup=Setup(kind=SetupKind.FFS),
        plant=PLANTS.find(STILL)(),
        imperfections=Imperfections(link_zero=(0.01, 0.0)),
        duration=0.1,
    )
    with pytest.raises(ConfigError, match="plant 'still' knows no imperfections: leave them out"):
        record(chosen, tmp_path)
    assert not list(tmp_path.iterdir())


def test_the_plants_that_come_along() -> None:
    assert PLANTS.names() == ("sim", "analytic", "can")
    assert PLANTS.find("sim") is SimChoice
    with pytest.raises(ConfigError, match="no plant 'horse'; there are sim, analytic, can, or a"):
        PLANTS.find("horse")


def test_a_class_that_opens_nothing_is_no_plant() -> None:
    with pytest.raises(ConfigError, match=r"StillPlant is no plant: it lacks .*kind.*, open\(leg"):
        PLANTS.find(STILL.replace(":Still", ":StillPlant"))
