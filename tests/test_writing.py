"""Files for the user are whole or as they were, and their failure is one line of ours."""

import errno
import os
from collections.abc import Callable
from pathlib import Path

import pytest

from legbench.cli.output import write_json
from legbench.control import JumpConfig
from legbench.design import LegDesign, load_design, save_design
from legbench.design.requirements import PAPER, load_requirements, save_requirements
from legbench.errors import ConfigError, RecordingError
from legbench.experiment import Experiment, load_experiment, save_experiment
from legbench.viz.drafts import draft_of
from legbench.writing import reason, save_whole

Save = Callable[[LegDesign, Path], None]
SAVERS: dict[str, Save] = {
    "design": save_design,
    "requirements": lambda _, path: save_requirements(PAPER, path),
    "experiment": lambda leg, path: save_experiment(
        Experiment(design=leg, controller=JumpConfig()), path
    ),
    "json": lambda _, path: write_json(path, {"answer": 42}),
    "text": lambda _, path: save_whole(path, "text"),
}
EVERY = pytest.mark.parametrize("save", SAVERS.values(), ids=list(SAVERS))


def full(_descriptor: int) -> None:
    """What a disk that fills up says when the file is to reach it."""
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


@EVERY
def test_a_folder_is_made_and_nothing_else_is_left(
    save: Save, table2: LegDesign, tmp_path: Path
) -> None:
    path = tmp_path / "a" / "b" / "file"
    save(table2, path)
    assert [each.name for each in path.parent.iterdir()] == ["file"]
    assert path.stat().st_size > 3


@EVERY
def test_a_disk_that_is_full_leaves_the_older_file(
    save: Save, table2: LegDesign, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "file"
    path.write_text("older")
    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(ConfigError) as caught:
        save(table2, path)
    assert str(caught.value) == (
        f"cannot write {path}: No space left on device [ENOSPC]; name a file that you can write"
    )
    assert path.read_text() == "older"
    assert list(tmp_path.iterdir()) == [path]


@EVERY
def test_a_place_that_is_a_folder_or_below_a_file_is_named(
    save: Save, table2: LegDesign, tmp_path: Path
) -> None:
    (tmp_path / "file").write_text("here")
    for place, why in ((tmp_path, "EISDIR|ENOTEMPTY|EBUSY"), (tmp_path / "file" / "x", "EEXIST")):
        with pytest.raises(ConfigError, match=rf"^cannot write {place}: .*\[({why})\]; name"):
            save(table2, place)
    assert [each.name for each in tmp_path.iterdir()] == ["file"]


def test_what_is_saved_is_what_is_loaded(table2: LegDesign, tmp_path: Path) -> None:
    path = tmp_path / "leg.toml"
    save_design(table2, path)
    assert load_design(path) == table2
    save_requirements(PAPER, path)
    assert load_requirements(path) == PAPER
    experiment = Experiment(design=table2, controller=JumpConfig(dz2=0.11))
    save_experiment(experiment, path)
    assert load_experiment(path) == experiment


def test_a_link_in_the_way_of_the_draft_is_not_written_through(
    table2: LegDesign, tmp_path: Path
) -> None:
    victim = tmp_path / "victim"
    victim.write_text("untouched")
    (tmp_path / ".leg.toml.draft").symlink_to(victim)
    save_design(table2, tmp_path / "leg.toml")
    assert victim.read_text() == "untouched"
    assert load_design(tmp_path / "leg.toml") == table2


def test_a_figure_makes_its_folder_and_says_what_failed(tmp_path: Path) -> None:
    path = tmp_path / "new" / "figure.png"
    with draft_of(path) as draft:
        draft.write_bytes(b"pixels")
    assert path.read_bytes() == b"pixels"
    with (
        pytest.raises(RecordingError, match=r"^cannot write .*figure.png: .* \[ENOSPC\]$"),
        draft_of(path) as draft,
    ):
        full(0)
    assert path.read_bytes() == b"pixels"
    assert list(path.parent.iterdir()) == [path]


def test_a_reason_has_the_name_of_its_number() -> None:
    assert reason(OSError(errno.EROFS, "x")) == "Read-only file system [EROFS]"
    assert reason(OSError("no number")) == "no number"
    assert reason(ValueError("a value")) == "a value"
