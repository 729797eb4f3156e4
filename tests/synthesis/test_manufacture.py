from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from legbench.design import Segment, load_design
from legbench.design.dependent import design_of
from legbench.design.requirements import PAPER
from legbench.errors import ConfigError
from legbench.synthesis.manufacture import adjust, adjust_leg, manufacture_table

TARGET = design_of(PAPER, np.array([0.95, 0.4837, 0.15, 0.5, 0.15, 1 / 16, 0.5]))
PROTOTYPE = load_design(Path(__file__).parents[2] / "models" / "prototype.toml")


def combined(lumps: list[tuple[float, float, float]]) -> tuple[float, float, float]:
    """Mass, centre of mass and inertia of (mass, position, own inertia) put together."""
    mass = sum(lump[0] for lump in lumps)
    com = sum(lump[0] * lump[1] for lump in lumps) / mass
    inertia = sum(own + part * (at - com) ** 2 for part, at, own in lumps)
    return mass, com, inertia


@settings(derandomize=True, max_examples=40)
@given(st.floats(0.6, 0.99), st.floats(-0.002, 0.002), st.floats(0.3, 1.05))
def test_the_weight_does_what_it_says(light: float, aside: float, slim: float) -> None:
    target = TARGET.thigh
    measured = replace(
        target, mass=light * target.mass, com=target.com + aside, inertia=slim * target.inertia
    )
    weight = adjust("thigh", measured, target)
    lumps = [(lump.mass, lump.position, 0.0) for lump in weight.lumps]
    mass, com, inertia = combined([(measured.mass, measured.com, measured.inertia), *lumps])
    assert mass == pytest.approx(target.mass, rel=1e-12)
    assert com == pytest.approx(target.com, abs=1e-12)
    assert inertia == pytest.approx(weight.inertia_after, rel=1e-9)
    assert weight.inertia_missing == pytest.approx(target.inertia - inertia, abs=1e-15)
    if len(lumps) > 1:
        assert all(-1e-12 <= at <= target.length + 1e-12 for _, at, _ in lumps)
        assert all(part > 0.0 for part, _, _ in lumps)
        _, centre, spread = combined(lumps)
        most = weight.mass * centre * (target.length - centre)
        assert weight.inertia_missing == pytest.approx(
            max(0.0, target.inertia - (inertia - spread) - most), abs=1e-15
        )


def test_a_part_that_is_right_needs_nothing() -> None:
    weight = adjust("shank", TARGET.shank, TARGET.shank)
    assert weight.mass == 0.0
    assert weight.note == ""
    moved = replace(TARGET.shank, com=TARGET.shank.com + 0.001)
    assert "1.00 mm off" in adjust("shank", moved, TARGET.shank).note


def test_a_part_that_is_too_heavy() -> None:
    at = Segment(
        mass=TARGET.foot.mass + 0.001,
        length=TARGET.foot.length,
        com=TARGET.foot.com,
        inertia=TARGET.foot.inertia,
    )
    weight = adjust("foot", at, TARGET.foot)
    assert weight.mass == pytest.approx(-0.001)
    assert weight.position == pytest.approx(TARGET.foot.com)
    assert "too heavy" in weight.note
    beyond = replace(at, com=at.com - 0.003)
    assert "lighten it further" in adjust("foot", beyond, TARGET.foot).note


def test_a_leg_whose_parts_all_reach_their_targets_is_matched() -> None:
    light = replace(
        TARGET,
        thigh=replace(TARGET.thigh, mass=0.9 * TARGET.thigh.mass, inertia=4.3e-4),
        shank=replace(TARGET.shank, mass=0.9 * TARGET.shank.mass, inertia=1.3e-4),
        foot=replace(TARGET.foot, mass=0.9 * TARGET.foot.mass, inertia=6.9e-5),
    )
    adjusted = adjust_leg(light, TARGET)
    assert abs(adjusted.before[2].ratio) < 1e-9
    assert abs(adjusted.before[0].ratio) > 1e-4
    assert all(abs(condition.ratio) < 1e-12 for condition in adjusted.after[1:4])
    missing = sum(
        sign * weight.inertia_missing
        for sign, weight in zip((-1.0, 1.0, -1.0), adjusted.adjustments, strict=True)
    )
    assert adjusted.after[0].residual == pytest.approx(missing, abs=1e-15)


def test_another_leg_is_refused() -> None:
    other = design_of(
        replace(PAPER, relaxed_length=0.3, leg_com=0.08),
        np.array([0.95, 0.4837, 0.15, 0.5, 0.15, 1 / 16, 0.5]),
    )
    with pytest.raises(
        ConfigError, match=r"measured thigh is 64\.0 mm long, the target's 76\.4 mm"
    ):
        adjust_leg(PROTOTYPE, other)


def test_the_table_has_every_parameter_once() -> None:
    rows = manufacture_table(TARGET)
    assert len(rows) == 17
    assert len({row.symbol for row in rows}) == 17
    shown = {row.symbol: row.shown for row in rows}
    assert shown["m_1"] == "207.2 g"
    assert shown["l_2"] == "133.2 mm"
    assert shown["I_3"] == "69.87 kg mm^2"
    assert shown["k_1"] == "3.129 N m/rad"
    assert shown["d_1"] == "0.007300 N m s/rad"
    heavy = {row.symbol: row.shown for row in manufacture_table(replace(TARGET, trunk_mass=24.62))}
    assert heavy["m_t"] == "24.62 kg"
