from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from legbench.design import LegDesign, load_design
from legbench.design.dependent import design_of
from legbench.design.requirements import PAPER
from legbench.mjcf import BuildOptions
from legbench.synthesis import reduced_model
from legbench.synthesis.model_check import ModelCheck, check_model

MODELS = Path(__file__).parents[2] / "models"
MATCHED = design_of(PAPER, np.array([0.95, 0.4837, 0.15, 0.5, 0.15, 1 / 16, 0.5]))


def largest(check: ModelCheck, condition: str) -> float:
    return max(row.coupling for row in check.rows if row.condition == condition)


def test_generated_model_of_a_matched_leg_is_decoupled() -> None:
    check = check_model(MATCHED)
    assert check.coupling < 1e-9
    assert check.agrees
    low, high = MATCHED.limits.knee
    reach = 2.0 * MATCHED.shank.length
    assert check.longest == pytest.approx(reach * np.cos(0.5 * low))
    assert check.shortest == pytest.approx(reach * np.cos(0.5 * high))


@pytest.mark.parametrize("name", ["table2", "prototype"])
def test_generator_and_algebra_agree_on_unmatched_legs(name: str) -> None:
    check = check_model(load_design(MODELS / f"{name}.toml"))
    assert check.agrees
    assert check.coupling > 1e-3


def mistuned(what: str) -> LegDesign:
    match what:
        case "inertia":
            return replace(MATCHED, thigh=replace(MATCHED.thigh, inertia=5e-4))
        case "elastic":
            return replace(MATCHED, stiffness=(3.0, 3.2))
        case _:
            return replace(MATCHED, damping=(0.01, 0.02))


@pytest.mark.parametrize("what", ["inertia", "elastic", "damping"])
def test_what_is_mistuned_shows_and_nothing_else(what: str) -> None:
    check = check_model(mistuned(what))
    assert check.agrees
    assert largest(check, what) > 1e-3
    unaffected = {"elastic", "damping", "gravity"} - {what}
    assert all(largest(check, other) < 1e-9 for other in unaffected)


def test_a_generator_that_leaves_the_algebra_is_caught(monkeypatch: pytest.MonkeyPatch) -> None:
    build = reduced_model.build_spec

    def heavier(design: LegDesign, options: BuildOptions) -> object:
        spec = build(design, options)
        spec.body("foot").mass *= 1.001
        return spec

    monkeypatch.setattr(reduced_model, "build_spec", heavier)
    check = check_model(MATCHED)
    assert not check.agrees
    assert check.coupling > 1e-6
