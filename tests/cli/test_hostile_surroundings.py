"""Outputs that take nothing, texts in other encodings, paths that are no text: one clear line."""

import os
import subprocess
import sys
from pathlib import Path

import mujoco
import numpy as np
import pytest

from legbench import load_design
from legbench.cli import main
from legbench.errors import DesignError
from legbench.mjcf.messages import silence
from legbench.shipped import shipped_root


def refused(capsys: pytest.CaptureFixture[str], *words: str) -> str:
    """The one line that a command is refused with."""
    assert main(list(words)) == 2
    told = capsys.readouterr()
    assert told.out == ""
    assert told.err.count("\n") == 1
    return told.err


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs a device that is always full")
def test_a_full_standard_output_is_told_in_a_line() -> None:
    with open("/dev/full", "w") as full:
        done = subprocess.run(
            [sys.executable, "-m", "legbench", "drives", "budget"],
            stdout=full,
            stderr=subprocess.PIPE,
            text=True,
            check=False,
        )
    assert done.returncode == 1
    assert done.stderr == (
        "legbench: the output cannot be written: No space left on device; make room, or send it "
        "on\n"
    )


@pytest.mark.parametrize(
    ("encoding", "name"), [("utf-8-sig", "UTF-8"), ("utf-16", "UTF-16"), ("utf-32", "UTF-32")]
)
def test_byte_order_marks_are_named(tmp_path: Path, encoding: str, name: str) -> None:
    text = (shipped_root() / "models" / "optimal.toml").read_text(encoding="utf-8")
    path = tmp_path / "leg.toml"
    path.write_text(text, encoding=encoding)
    with pytest.raises(DesignError, match=f"byte order mark of {name}; save it as UTF-8 without"):
        load_design(path)


@pytest.mark.parametrize("words", [("--out", ""), ("--out=",), ("--duration", "0.1", "")])
def test_empty_words_are_refused(capsys: pytest.CaptureFixture[str], words: tuple[str]) -> None:
    assert "is empty; give it a value" in refused(capsys, "run", "jump", *words)


def test_paths_that_are_no_text_are_refused(capsys: pytest.CaptureFixture[str]) -> None:
    word = os.fsdecode(b"runs\xff")
    assert r"b'runs\xff' is no UTF-8 text" in refused(capsys, "run", "jump", "--out", word)


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("jump", "--encoder-counts", "3"), "one count would be 2.1 rad"),
        (("bang-bang", "--boom-radius", "0.01"), "shorter than the stretched leg, 0.266 m"),
    ],
)
def test_settings_that_no_leg_can_have_are_refused_before_the_run(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, words: tuple[str, ...], told: str
) -> None:
    line = ["run", *words, "--out", str(tmp_path / "runs")]
    assert main(line) in (1, 2)
    assert told in capsys.readouterr().err
    assert not (tmp_path / "runs").exists()


def test_a_search_that_was_too_short_says_so(capsys: pytest.CaptureFixture[str]) -> None:
    told = refused(capsys, "design", "--evaluations", "20")
    assert "none of the 20 legs that were tried" in told
    assert "--evaluations" in told


def test_a_simulation_that_diverges_leaves_no_log_of_mujoco(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    silence()
    model = mujoco.MjModel.from_xml_string(
        "<mujoco><worldbody><body><freejoint/><geom size='1'/></body></worldbody></mujoco>"
    )
    data = mujoco.MjData(model)
    data.qpos[0] = np.nan
    mujoco.mj_step(model, data)
    assert data.warning[mujoco.mjtWarning.mjWARN_BADQPOS].number == 1
    assert "WARNING" not in capfd.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_a_handler_of_somebody_else_is_kept() -> None:
    before = mujoco.get_mju_user_warning()
    told: list[str] = []
    try:
        mujoco.set_mju_user_warning(told.append)
        handler = mujoco.get_mju_user_warning()
        silence()
        assert mujoco.get_mju_user_warning() == handler
    finally:
        mujoco.set_mju_user_warning(before)


def test_a_model_on_a_boom_that_is_too_short_is_refused(
    capsys: pytest.CaptureFixture[str],
) -> None:
    told = refused(capsys, "model", "--setup", "ffs", "--boom-radius", "0.01")
    assert "shorter than the stretched leg, 0.266 m" in told
