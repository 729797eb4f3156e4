"""A controller of one's own: found, checked, run on every plant and in a batch."""

import sys
from dataclasses import dataclass, replace
from importlib.metadata import EntryPoint
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest

from legbench import guests
from legbench.control import CONTROLLERS, JumpConfig, LegTargets, make_controller
from legbench.design import LegDesign
from legbench.design.setup import Setup, SetupKind
from legbench.design.statics import Support
from legbench.errors import ConfigError, PlantFault
from legbench.experiment import Experiment, record
from legbench.guests import GuestError, module_of_file
from legbench.loop import run
from legbench.metrics import summarise
from legbench.mjcf import BuildOptions, Linkage, LinkageKind
from legbench.plant.batch import BatchPlant
from legbench.plant.landing import End
from legbench.plant.sim import SimPlant
from legbench.plant.start import Start
from legbench.plants import AnalyticChoice, CanChoice, PlantSettings, SimChoice
from legbench.recording.reader import load

GUESTS = Path(__file__).parent / "guests"
HARDWARE = Path(__file__).parents[2] / "hardware"
SINE = f"{GUESTS / 'sine.py'}:Sine"
FIXED = Setup(kind=SetupKind.FFS)


def own(design: LegDesign, **choices: Any) -> Experiment:
    guest = CONTROLLERS.find(SINE)()
    simple = Linkage(kind=LinkageKind.REDUCED)
    return Experiment(
        design=design, controller=guest, setup=FIXED, linkage=simple, duration=1.5, **choices
    )


@pytest.mark.parametrize(
    "plant",
    [
        SimChoice(),
        AnalyticChoice(),
        CanChoice(bus=HARDWARE / "leg.toml", interface="legbench", end=End.STOP),
    ],
    ids=lambda plant: plant.kind,
)
def test_a_law_of_25_lines_is_run_and_rated_on_every_plant(
    plant: PlantSettings, prototype: LegDesign, tmp_path: Path
) -> None:
    lines = (GUESTS / "sine.py").read_text(encoding="utf-8").splitlines()
    assert sum(bool(line.strip()) for line in lines) <= 25
    found = load(record(own(prototype, plant=plant), tmp_path).path)
    assert found.complete
    ratings = summarise(found).rating_periods
    assert len(ratings) >= 2
    assert min(ratings) > 0.99
    assert (found.path / "controller_sine.py").read_bytes() == (GUESTS / "sine.py").read_bytes()
    assert set(found["phase"]) == {1}


def test_the_same_law_drives_a_batch_leg_by_leg(prototype: LegDesign) -> None:
    stiff = replace(prototype, stiffness=(2.6, 2.6))
    designs, settings = [prototype, stiff, prototype], CONTROLLERS.find(SINE)()
    targets = LegTargets(designs=designs, support=Support.FOOT)
    together = make_controller(settings, targets)
    motor_pos = together.start_motor_pos
    start = Start(joint_pos=targets.link_at_rest(motor_pos), motor_pos=motor_pos)
    singles = [make_controller(settings, one) for one in targets.each()]
    with BatchPlant(designs, BuildOptions(setup=FIXED), start, threads=1) as plant:
        seen = plant.reset()
        together.reset(seen)
        for cycle in range(200):
            command = together.step(seen)
            assert command.motor_pos.shape == (3, 2)
            assert command.phase.tolist() == [1, 1, 1]
            assert command.signals is not None
            expected = 0.1 * np.sin(2.0 * np.pi * 2.0 * cycle * 1e-3)
            np.testing.assert_allclose(command.signals, np.full((3, 1), expected), atol=1e-12)
            for row, single in enumerate(singles):
                alone = single.step(replace(seen, truth=None))
                assert np.array_equal(alone.motor_pos, command.motor_pos[row])
            seen = plant.step(command)
        assert run(plant, together, 50).status == "complete"


# --- what laws do wrong ----------------------------------------------------------------------


def wrong(design: LegDesign, way: str, out: Path) -> Path:
    settings = CONTROLLERS.find(f"{GUESTS / 'wrong.py'}:Wrong")(way=way)
    record(Experiment(design=design, controller=settings, setup=FIXED, duration=0.1), out)
    (found,) = out.iterdir()
    return found


@pytest.mark.parametrize(
    ("way", "words"),
    [
        ("nothing", "step returned None; it must return a Command"),
        ("shape", r"motor_pos has shape \(3,\); one leg needs \(2,\)"),
        ("text", "motor_pos is 'north'; it must be 2 numbers"),
        ("phase", r"phase is array\(300\); the controller declares 0 \(hold\)"),
        ("float phase", r"phase is array\(0\.5\); the controller declares 0 \(hold\)"),
        ("signals", r"signals are given, but describe\(\) declares none"),
    ],
)
def test_a_wrong_command_ends_the_run_before_its_row(
    way: str, words: str, prototype: LegDesign, tmp_path: Path
) -> None:
    targets = LegTargets(designs=prototype, support=Support.FOOT)
    settings = CONTROLLERS.find(f"{GUESTS / 'wrong.py'}:Wrong")(way=way)
    controller = make_controller(settings, targets)
    start = Start(
        joint_pos=targets.link_at_rest(controller.start_motor_pos),
        motor_pos=controller.start_motor_pos,
    )
    plant = SimPlant(prototype, BuildOptions(setup=FIXED), start)
    seen = plant.reset()
    controller.reset(seen)
    for _ in range(19):
        seen = plant.step(controller.step(seen))
    with pytest.raises(PlantFault, match=words) as caught:
        controller.step(seen)
    assert caught.value.cause == "controller failed"


def test_a_list_is_as_good_as_an_array(prototype: LegDesign, tmp_path: Path) -> None:
    found = load(wrong(prototype, "list", tmp_path))
    assert found.complete
    assert len(found.time) == 100


def test_a_law_cannot_alter_what_is_recorded(prototype: LegDesign) -> None:
    targets = LegTargets(designs=prototype, support=Support.FOOT)
    settings = CONTROLLERS.find(f"{GUESTS / 'wrong.py'}:Wrong")(way="write")
    controller = make_controller(settings, targets)
    motor_pos = controller.start_motor_pos
    start = Start(joint_pos=targets.link_at_rest(motor_pos), motor_pos=motor_pos)
    seen = SimPlant(prototype, BuildOptions(setup=FIXED), start).reset()
    before = seen.joint_pos.copy()
    for _ in range(19):
        controller.step(seen)
    with pytest.raises(ValueError, match="read-only"):
        controller.step(seen)
    assert np.array_equal(seen.joint_pos, before)


# --- how they are found ----------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "words"),
    [
        (
            "Plain",
            r"lacks @dataclass\(frozen=True, kw_only=True\), usual_setup: .*, build",
        ),
        ("NoBuild", r"is no controller: it lacks build\(targets\) -> AbstractController, describe"),
        ("Thief", "calls itself 'jump', which is built in; give it a kind of its own"),
        ("function", "is no controller: it is function, no class"),
        ("Nobody", "has no class 'Nobody'; it has Plain, NoBuild, Thief"),
    ],
)
def test_a_class_that_is_no_controller_says_what_is_missing(name: str, words: str) -> None:
    with pytest.raises(ConfigError, match=words):
        CONTROLLERS.find(f"{GUESTS / 'impostors.py'}:{name}")


def test_an_impostor_is_refused_in_python_too(prototype: LegDesign) -> None:
    impostors = module_of_file(GUESTS / "impostors.py")
    with pytest.raises(ConfigError, match="NoBuild is no controller: it lacks build"):
        Experiment(design=prototype, controller=impostors.NoBuild())
    with pytest.raises(ConfigError, match="calls itself 'jump'"):
        Experiment(design=prototype, controller=impostors.Thief())


def test_a_file_that_does_not_import_shows_its_own_lines() -> None:
    with pytest.raises(GuestError) as caught:
        CONTROLLERS.find(f"{GUESTS / 'broken.py'}:Mine")
    head, first, *rest = str(caught.value).splitlines()
    assert head.endswith("broken.py does not import:")
    assert f'"{GUESTS / "broken.py"}"' in first
    assert "importlib" not in "".join(rest)
    assert rest[-1] == "AttributeError: module 'legbench.signals' has no attribute 'no_such_name'"
    assert len(rest) < 10


def test_a_syntax_error_and_a_missing_file_are_named(tmp_path: Path) -> None:
    path = tmp_path / "odd.py"
    path.write_text("def half(:\n")
    with pytest.raises(GuestError, match=r"odd.py does not import:\n(.*\n)*SyntaxError"):
        CONTROLLERS.find(f"{path}:Mine")
    with pytest.raises(ConfigError, match=r"nowhere\.py: cannot be read: No such file"):
        CONTROLLERS.find(f"{tmp_path / 'nowhere.py'}:Mine")
    with pytest.raises(ConfigError, match="no controller 'walk'; there are jump, bang-bang, pos"):
        CONTROLLERS.find("walk")


def test_two_files_of_one_name_are_two_controllers(tmp_path: Path) -> None:
    text = (GUESTS / "sine.py").read_text(encoding="utf-8")
    kinds = []
    for folder, freq in (("one", "2.0"), ("two", "5.0")):
        path = tmp_path / folder / "sine.py"
        path.parent.mkdir()
        path.write_text(text.replace("freq: float = 2.0", f"freq: float = {freq}"))
        kinds.append(CONTROLLERS.find(f"{path}:Sine"))
    assert [kind().freq for kind in kinds] == [2.0, 5.0]
    assert kinds[0].__module__ != kinds[1].__module__
    assert CONTROLLERS.find(f"{tmp_path / 'one' / 'sine.py'}:Sine") is kinds[0]


def test_a_broken_package_fails_only_when_it_is_asked_for(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    (tmp_path / "walking.py").write_text("raise RuntimeError('half installed')\n")
    (tmp_path / "swinging.py").write_text((GUESTS / "sine.py").read_text(encoding="utf-8"))
    monkeypatch.syspath_prepend(tmp_path)
    installed = [
        EntryPoint(name="walk", value="walking:Walk", group=CONTROLLERS.group),
        EntryPoint(name="sine", value="swinging:Sine", group=CONTROLLERS.group),
    ]
    monkeypatch.setattr(guests, "entry_points", lambda group: installed)
    assert CONTROLLERS.names() == ("jump", "bang-bang", "position-jump", "chirp", "walk", "sine")
    assert CONTROLLERS.find("sine").kind == "sine"
    assert CONTROLLERS.find("jump") is JumpConfig
    with pytest.raises(GuestError, match=r"'walk'.*does not import:\n") as caught:
        CONTROLLERS.find("walk")
    assert str(caught.value).endswith("RuntimeError: half installed")
    assert CONTROLLERS.reference(CONTROLLERS.find("sine")) == "swinging:Sine"
    assert CONTROLLERS.find("swinging:Sine") is CONTROLLERS.find("sine")
    for name in ("walking", "swinging"):
        sys.modules.pop(name, None)


@dataclass(frozen=True, kw_only=True)
class Nowhere:
    kind: ClassVar[str] = "nowhere"


def test_a_class_without_a_file_cannot_be_found_again(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Nowhere, "__module__", "__main__")
    monkeypatch.delattr(sys.modules["__main__"], "__file__", raising=False)
    with pytest.raises(ConfigError, match="'nowhere' has no file that another process could find"):
        CONTROLLERS.reference(Nowhere)
