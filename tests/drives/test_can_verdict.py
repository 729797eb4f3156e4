"""A run whose answers are gone for ever never ends complete, whatever its limits file waives."""

import re
from pathlib import Path

import pytest
from can_rig import BUS, LIMITS, MS, experiment

from legbench.control import JumpConfig
from legbench.drives.emulated.faults import FrameFault, FrameFaultKind
from legbench.experiment import Experiment, record
from legbench.plant.landing import End
from legbench.plants import EMULATED, CanChoice
from legbench.recording.events import read_events
from legbench.recording.manifest import read_manifest

GONE_NS = 1000 * MS
"""On the bus's time, about half a second into the run."""


OTHERS = ("following_error", "standing", "sway")
"""Limits that would find a drive without answers, too, and sooner than 50 cycles."""


def silent_run(folder: Path, limits: str) -> Experiment:
    """A jump whose second drive answers no more from the middle on."""
    (folder / "leg.toml").write_bytes(BUS.read_bytes())
    (folder / "limits.toml").write_text(limits, encoding="utf-8")
    gone = FrameFault(kind=FrameFaultKind.DROP, cob_id=0x182, start_ns=GONE_NS)
    chosen = experiment(JumpConfig(), duration=0.9)
    plant = CanChoice(bus=folder / "leg.toml", interface=EMULATED, end=End.STOP, faults=(gone,))
    return Experiment(
        design=chosen.design,
        controller=chosen.controller,
        setup=chosen.setup,
        duration=chosen.duration,
        plant=plant,
    )


@pytest.mark.parametrize(
    ("lost_frames", "waive", "words"),
    [
        (3, "", "sent no process data for 3 cycles, the limit is 3"),
        (50, "", r"sent no process data for 5[01] cycles, the limit is 50"),
        (
            5000,
            'waive = ["lost_frames"]\n',
            r"had not answered for the last \d{3} cycles when the run ended, the limit is 50",
        ),
    ],
)
def test_answers_that_are_gone_for_ever_are_a_fault(
    lost_frames: int, waive: str, words: str, tmp_path: Path
) -> None:
    text = LIMITS.read_text(encoding="utf-8")
    assert "lost_frames = 3 " in text
    text = text.replace("lost_frames = 3 ", f"lost_frames = {lost_frames} ") + waive
    text = re.sub(rf"^({'|'.join(OTHERS)}) = .*\n", "", text, flags=re.MULTILINE)
    finished = record(silent_run(tmp_path, text), tmp_path / "runs")
    outcome = finished.outcome
    assert (outcome.status, outcome.cause) == ("fault", "process data lost")
    assert outcome.message is not None
    assert re.search(words, outcome.message)
    manifest = read_manifest(finished.path)
    assert manifest is not None
    assert (manifest["status"], manifest["cause"]) == ("fault", "process data lost")
    told = [event for event in read_events(finished.path)[0] if event["name"] == "waived"]
    assert len(told) == (1 if waive else 0)
