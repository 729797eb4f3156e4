"""The loop closed on the desk: a leg behind emulated drives is driven, recorded and identified.

Its hidden parameters are found, and the identified design predicts a hop that no fit has seen.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from twins import HIDDEN, PROTOTYPE, driven

from legbench.control import JumpConfig, PositionJumpConfig
from legbench.design.setup import SetupKind
from legbench.design.toml import load_design
from legbench.errors import ConfigError
from legbench.identify import design_text, identify, parse_free, repeat, task_of, written_back
from legbench.identify.base import LegParameters
from legbench.identify.parameters import INDEX
from legbench.identify.trial import bars_of
from legbench.imperfections import Imperfections


@pytest.mark.long
def test_a_twin_behind_emulated_drives_is_identified_and_its_hop_predicted(
    tmp_path: Path,
) -> None:
    step = PositionJumpConfig(z2=1.0, dz2=0.3, delay=0.05)
    runs = [driven(step, SetupKind.VFTS, 0.7), driven(step, SetupKind.FFS, 0.7)]
    task = task_of(runs, free=parse_free(["nine"]), starts=1)
    outcome = identify(task)
    assert outcome.trusted, outcome.reasons
    truth = LegParameters.of(HIDDEN.leg_of(PROTOTYPE), bars=bars_of(runs[0])).values
    for each in outcome.estimates:
        share = {"k": 5e-4, "d": 2e-3, "s": 2e-3}.get(each.name[0], 5e-3)
        assert each.value == pytest.approx(truth[INDEX[each.name]], rel=share)
    design = written_back(PROTOTYPE, outcome, task.bars)
    (tmp_path / "identified.toml").write_text(design_text(design, outcome))
    identified = load_design(tmp_path / "identified.toml")
    recorded = driven(JumpConfig(), SetupKind.JUMP, 2.6)
    hop = repeat(recorded, identified)
    assert hop.good, hop.text
    assert not repeat(recorded, PROTOTYPE).good


def test_an_answer_that_a_drive_owes_is_no_reading() -> None:
    """An answer is taken away, as a lost frame takes it: the row repeats the one before."""
    step = PositionJumpConfig(z2=1.0, dz2=0.3, delay=0.05)
    # What is held is right: nothing else is tried in order to explain what is left.
    stiff = Imperfections(stiffness_error=HIDDEN.stiffness_error)
    run = driven(step, SetupKind.VFTS, 0.3, stiff)
    columns = {name: values.copy() for name, values in run.columns.items()}
    row = int(np.argmax(np.abs(columns["joint_vel_1"])))
    for name in ("motor_pos_1", "joint_pos_1", "joint_vel_1"):
        columns[name][row] = columns[name][row - 1]
    lost = replace(run, columns=columns)
    free = parse_free(["springs", "dampers"])
    asked = [task_of([each], free=free, starts=1) for each in (run, lost)]
    whole, lossy = (each.trials[0] for each in asked)
    assert set(lossy.left_out) == {*whole.left_out, row}
    np.testing.assert_allclose(lossy.joint_pos[row], whole.joint_pos[row], atol=3e-4)
    found = [identify(each) for each in asked]
    assert found[1].left_out == (len(lossy.left_out),)
    for one, other in zip(found[0].estimates, found[1].estimates, strict=True):
        assert one.value == pytest.approx(other.value, abs=0.5 * one.error)
    assert found[1].residuals[0].rms == pytest.approx(found[0].residuals[0].rms, rel=0.05)


def test_only_a_hop_is_repeated() -> None:
    step = driven(PositionJumpConfig(), SetupKind.FFS, 0.06)
    with pytest.raises(ConfigError, match="is in setup 'ffs'; only a hop is repeated"):
        repeat(step, PROTOTYPE)
