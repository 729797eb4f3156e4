"""Files that come with the package are found from any folder, and never taken for a user's own."""

from pathlib import Path

import pytest

from legbench import Experiment, JumpConfig, load_design
from legbench.cli import main
from legbench.cli.run_chosen import chosen_by
from legbench.drives.setup.bus_file import load_bus
from legbench.errors import ConfigError, DesignError
from legbench.experiment.files import load_experiment
from legbench.plants import CanChoice
from legbench.shipped import locate, shipped_designs, shipped_root


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def test_designs_are_known_by_name_and_path() -> None:
    assert {"optimal", "prototype", "table2"} <= set(shipped_designs())
    assert load_design("prototype") == load_design("models/prototype.toml")


def test_a_file_that_is_there_is_the_one_that_is_meant(tmp_path: Path) -> None:
    own = tmp_path / "prototype"
    own.write_text("name = 'mine'\n")
    assert locate(Path("prototype")) == Path("prototype")
    with pytest.raises(DesignError, match="trunk"):
        load_design("prototype")


@pytest.mark.parametrize("path", ["else/prototype", "prototype.toml", "models/../x.toml", "nobody"])
def test_other_paths_stay_what_they_are(path: str) -> None:
    assert locate(Path(path)) == Path(path)


def test_a_design_that_is_nowhere_is_told_with_those_that_are_here() -> None:
    with pytest.raises(DesignError, match=r"nobody: no such design file.*optimal, prototype"):
        load_design("nobody")


def test_an_experiment_names_a_design_that_comes_with_the_package(tmp_path: Path) -> None:
    path = tmp_path / "own" / "hop.toml"
    path.parent.mkdir()
    path.write_text("design = 'prototype'\n[controller]\nkind = 'jump'\n")
    expected = Experiment(design=load_design("prototype"), controller=JumpConfig())
    assert load_experiment(path) == expected


def test_emulated_drives_take_the_package_s_bus_file_and_real_ones_do_not() -> None:
    assert CanChoice(interface="legbench").bus_file == shipped_root() / "hardware" / "leg.toml"
    real = CanChoice(interface="socketcan", channel="can0")
    with pytest.raises(ConfigError, match=r"no such file; files to begin with are in"):
        load_bus(real.bus_file)


def test_limits_beside_a_bus_file_of_one_s_own_are_not_the_package_s(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    own = tmp_path / "hardware" / "mine.toml"
    own.parent.mkdir()
    own.write_bytes((shipped_root() / "hardware" / "leg.toml").read_bytes())
    words = ["run", "jump", "--plant", "can", "--interface", "legbench", "--bus", str(own)]
    assert main(words) == 2
    assert "limits.toml: no such file" in capsys.readouterr().err


def test_a_design_by_name_replaces_that_of_a_file_in_another_folder(tmp_path: Path) -> None:
    path = tmp_path / "own" / "hop.toml"
    path.parent.mkdir()
    path.write_text("design = 'prototype'\n[controller]\nkind = 'jump'\n")
    chosen = chosen_by([str(path), "--design", "optimal"])
    assert chosen.experiment.design == load_design("optimal")
