import numpy as np
import pytest

from legbench.plant.observe import JointLayout, branch_fault, branch_fault_mask

BARS = JointLayout(hip=2, knee=3, ankle=4, crank=6)
REDUCED = JointLayout(hip=0, knee=1, ankle=2, crank=None)


@pytest.mark.parametrize(
    ("hip", "knee", "ankle", "crank", "cause"),
    [
        (-0.6, 1.2, -1.2, 0.6, None),
        (-0.6, 0.021, -0.021, -0.579, None),
        (-0.6, 0.019, -0.019, -0.581, "leg straightened through"),
        (-0.6, -0.3, 0.3, -0.9, "leg straightened through"),
        (-0.6, np.pi, -np.pi, -0.6 + np.pi, "leg folded through"),
        (-0.6, 1.2, -1.1, 0.6, "foot loop crossed"),
        (-0.6, 1.2, -1.2, 0.7, "thigh loop crossed"),
        (-0.6, np.nan, -1.2, 0.6, "simulation diverged"),
        (1e9, 1.2, -1.2, 0.6, "simulation diverged"),
    ],
)
def test_each_fault_has_its_name(
    hip: float, knee: float, ankle: float, crank: float, cause: str | None
) -> None:
    qpos = np.array([0.0, 0.2, hip, knee, ankle, 0.0, crank, 0.0])
    assert branch_fault(BARS, qpos) == cause
    without = branch_fault(REDUCED, np.array([hip, knee, ankle]))
    assert without == (None if cause == "thigh loop crossed" else cause)


@pytest.mark.parametrize("layout", [BARS, REDUCED], ids=["bars", "reduced"])
def test_the_batch_marks_exactly_the_legs_that_have_a_name(layout: JointLayout) -> None:
    rng = np.random.default_rng(3)
    knee = rng.uniform(-0.1, np.pi + 0.1, 4000)
    hip = rng.uniform(-2.0, 1.0, 4000)
    qpos = rng.normal(0.0, 0.3, (4000, 8))
    qpos[:, layout.hip], qpos[:, layout.knee] = hip, knee
    qpos[:, layout.ankle] = -knee + rng.choice([0.0, 0.04, 0.06], 4000)
    if layout.crank is not None:
        qpos[:, layout.crank] = hip + knee + rng.choice([0.0, -0.04, -0.06], 4000)
    qpos[::97, 1] = np.nan
    qpos[::101, 0] = -1e5
    mask = branch_fault_mask(layout, qpos)
    names = [branch_fault(layout, row) for row in qpos]
    assert mask.tolist() == [name is not None for name in names]
    assert 0 < np.count_nonzero(mask) < len(mask)
