"""One compile for every leg and setup: against the interpreted plant, and kept on disk."""

import os
import stat
from pathlib import Path

import numpy as np
import pytest

from legbench.analytic import LegModel, LegState, Regime, standing
from legbench.analytic.smooth import Accuracy
from legbench.control import BangBangConfig, JumpConfig
from legbench.design import load_design
from legbench.design.rig import BOOM_BEND
from legbench.design.setup import Setup, SetupKind
from legbench.experiment import ControllerSettings, Experiment, make_controller, targets_of
from legbench.plant.analytic import AnalyticPlant
from legbench.plant.start import PERIOD, Start

pytest.importorskip("heyoka")

from legbench.analytic import store
from legbench.analytic.taylor import TaylorLeg

MODELS = Path(__file__).parents[2] / "models"
FINE = Accuracy(rtol=1e-13, atol=1e-15, max_step=1e-3)
CASES: list[tuple[SetupKind, ControllerSettings]] = [
    (SetupKind.HFTS, BangBangConfig(z2=1.3, dz2=0.2)),
    (SetupKind.VFTS, BangBangConfig(z2=1.3, dz2=0.2)),
    (SetupKind.FFS, BangBangConfig(z2=1.2, dz2=0.1)),
    (SetupKind.JUMP, JumpConfig(z2=0.65, dz2=0.1)),
]


@pytest.mark.parametrize("name", ["prototype", pytest.param("optimal", marks=pytest.mark.long)])
@pytest.mark.parametrize(("kind", "settings"), CASES, ids=[kind for kind, _ in CASES])
def test_it_moves_as_the_interpreted_plant(
    name: str, kind: SetupKind, settings: ControllerSettings
) -> None:
    design, setup = load_design(MODELS / f"{name}.toml"), Setup(kind=kind)
    targets = targets_of(Experiment(design=design, setup=setup, controller=settings))
    controller = make_controller(settings, targets)
    motor_pos = controller.start_motor_pos
    start = Start(joint_pos=targets.link_at_rest(motor_pos), motor_pos=motor_pos)
    plant = AnalyticPlant(design, setup, start, accuracy=FINE)
    observation = plant.reset()
    controller.reset(observation)
    gravity = 0.0 if kind is SetupKind.HFTS else 9.81
    leg = TaylorLeg(LegModel.of(design, gravity=gravity))
    state, contacts = first_state(leg.model, setup, start), 0
    for cycle in range(1, 1001):
        command = controller.step(observation)
        observation = plant.step(command)
        motor = (float(command.motor_pos[0]), float(command.motor_pos[1]))
        state, happened = leg.advance(state, cycle * PERIOD, motor)
        contacts += len(happened)
        assert np.allclose(state.q, observation.joint_pos, rtol=0.0, atol=1e-9), cycle
    assert np.ptp(motor_pos) > 0.0
    assert contacts == len(plant.transitions)
    assert (contacts > 1) == (kind is SetupKind.JUMP)


def first_state(model: LegModel, setup: Setup, start: Start) -> LegState:
    q = (float(start.joint_pos[0]), float(start.joint_pos[1]))
    if setup.trunk_moves:
        return standing(model, q, pinned=setup.kind is SetupKind.FFS)
    height = 2.0 * model.floating.reach * float(np.cos(BOOM_BEND))
    return LegState(0.0, Regime.HANGING, q, (0.0, 0.0), (0.0, height), (0.0, 0.0))


class Built:
    """Something to keep, and how often it was built."""

    def __init__(self) -> None:
        self.times = 0

    def __call__(self) -> list[int]:
        self.times += 1
        return [1, 2, 3]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv(store.ENVIRONMENT, str(tmp_path / "cache"))
    return tmp_path / "cache"


def test_what_was_built_is_kept(folder: Path) -> None:
    build = Built()
    assert store.kept("one", build) == store.kept("one", build) == [1, 2, 3]
    assert build.times == 1
    store.kept("another", build)
    assert build.times == 2
    assert len(list(folder.iterdir())) == 2
    assert stat.S_IMODE(folder.stat().st_mode) == 0o700


@pytest.mark.parametrize("cut", [0, 5, 40, 60])
def test_a_damaged_file_is_built_anew(folder: Path, cut: int) -> None:
    build = Built()
    store.kept("one", build)
    (path,) = folder.iterdir()
    whole = path.read_bytes()
    changed = whole[:cut] if cut < 60 else whole[:-1] + bytes([whole[-1] ^ 1])
    path.write_bytes(changed)
    assert store.kept("one", build) == [1, 2, 3]
    assert path.read_bytes() == whole
    assert store.kept("one", build) == [1, 2, 3]
    assert build.times == 2


def test_another_machine_builds_its_own(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    build = Built()
    store.kept("one", build)
    monkeypatch.setattr(store, "machine", lambda: "another processor, another version")
    store.kept("one", build)
    assert build.times == len(list(folder.iterdir())) == 2


def test_a_file_that_others_can_write_is_not_believed(folder: Path) -> None:
    build = Built()
    store.kept("one", build)
    folder.chmod(0o777)
    store.kept("one", build)
    assert build.times == 2


def test_a_folder_that_cannot_be_written_is_no_obstacle(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").write_text("no folder", encoding="utf-8")
    for place in (str(tmp_path / "file" / "cache"), "", os.devnull):
        monkeypatch.setenv(store.ENVIRONMENT, place)
        build = Built()
        assert store.kept("one", build) == [1, 2, 3]
        assert build.times == 1


def test_the_cache_lies_where_the_platform_keeps_caches(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv(store.ENVIRONMENT, raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert store.cache_folder() == tmp_path / "legbench"
    monkeypatch.delenv("XDG_CACHE_HOME")
    monkeypatch.setenv("HOME", str(tmp_path))
    assert store.cache_folder() == tmp_path / ".cache" / "legbench"
