"""The batched reference of hops takes scipy's steps, finds scipy's events, and sees faults."""

import math
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

pytest.importorskip("heyoka")

from dense_hop import DenseHop  # pyright: ignore[reportMissingImports]
from dense_rules import Rules  # pyright: ignore[reportMissingImports]
from random_hops import random_case  # pyright: ignore[reportMissingImports]
from reference.dop853 import (  # pyright: ignore[reportMissingImports]
    Accuracy,
    Dense,
    attempt,
    dense,
)
from reference.events import first_events  # pyright: ignore[reportMissingImports]
from reference.hops import Hops, Story  # pyright: ignore[reportMissingImports]
from reference.roots import largest, rising_roots  # pyright: ignore[reportMissingImports]
from reference.verdicts import UNITS, difference  # pyright: ignore[reportMissingImports]
from scipy.integrate import DOP853

from legbench.analytic import LegModel

SEEDS = (0, 1, 2, 3)


def cases() -> list[Any]:
    return [random_case(np.random.default_rng(seed)) for seed in SEEDS]


def batch() -> Hops:
    some = cases()
    starts = np.array([case.vector for case in some]).T
    return Hops([case.design for case in some], [case.config for case in some], starts)


@cache
def stories() -> list[Story]:
    return batch().run()


def test_a_step_and_its_interpolant_are_those_of_scipy() -> None:
    lanes = batch().lanes
    step, accuracy = np.array([2e-3, 5e-3, 1e-2, 2e-2]), Accuracy(1e-8, 1e-10)
    tried = attempt(lanes.rates, lanes.y, step, accuracy)
    inside = dense(lanes.rates, lanes.y, step, tried)
    shares = np.array([0.1, 0.7])
    for index in range(len(SEEDS)):
        lane = lanes.take(np.array([index]))
        solver = DOP853(
            lambda _time, y, lane=lane: lane.rates(y[:, np.newaxis])[:, 0],
            0.0,
            lanes.y[:, index],
            1.0,
            first_step=float(step[index]),
            rtol=accuracy.relative,
            atol=accuracy.absolute,
        )
        solver.step()
        assert tried.accepted[index] == (solver.t == step[index])
        if tried.accepted[index]:
            assert np.allclose(tried.reached[:, index], solver.y, rtol=0.0, atol=1e-14)
            assert math.isclose(step[index] * tried.factor[index], solver.h_abs, rel_tol=1e-6)
            wanted = solver.dense_output()(shares * step[index])
            assert np.allclose(inside.looks(shares)[:, :, index], wanted, rtol=0.0, atol=1e-14)
            one = inside.take(np.array([index])).at(shares[:1])
            assert np.allclose(one[:, 0], wanted[:, 0], rtol=0.0, atol=1e-14)
    assert 0 < np.count_nonzero(tried.accepted) < len(SEEDS)


def test_hops_are_those_of_a_scalar_program_on_other_equations() -> None:
    for case, story in zip(cases(), stories(), strict=True):
        rules, start = Rules(case.config, case.design), case.start
        dense_hop = DenseHop(LegModel.of(case.design), rules)
        other = dense_hop.run(start.height, start.speed, *start.angles())
        assert difference(other, story) == ""
        assert story.ending == "apex"
        assert np.max(np.abs(np.subtract(other.apex, story.apex)) / UNITS) < 1e-8


def test_a_batch_is_its_hops_one_by_one() -> None:
    case, story = cases()[1], stories()[1]
    alone = Hops([case.design], [case.config], case.vector[:, np.newaxis]).run()[0]
    assert difference(alone, story) == ""
    assert np.allclose(alone.apex, story.apex, rtol=0.0, atol=1e-12)


def test_roots_and_largest_values_are_found_in_each_bracket() -> None:
    wanted = np.array([0.1, 0.5, 0.9, 1e-6])
    steep = np.array([1.0, 1e3, 1e-3, 1e6])
    roots = rising_roots(
        lambda x: np.arctan(steep * (x - wanted)), np.zeros(4), np.array([0.3, 0.6, 1.0, 1.0])
    )
    assert np.all(np.abs(roots - wanted) < 2e-12)
    places, values = largest(lambda x: 2.0 - (x - wanted) ** 2, np.zeros(4), np.ones(4))
    assert np.all(np.abs(places - wanted) < 1e-7)
    assert np.all(values > 2.0 - 1e-14)


def test_a_level_that_is_crossed_between_two_looks_is_found() -> None:
    lanes = batch().lanes
    size, step = lanes.number.size, np.full(len(SEEDS), 1e-2)
    # The reading rises as x (1 - x) along the step, to 0.25 halfway between its ends.
    terms = np.zeros((7, 4, size))
    terms[1, :2] = lanes.probe / np.sum(lanes.probe**2, axis=0)
    start = np.zeros((4, size))
    start[:2] = -0.5 * terms[1, :2] + [[-0.5], [0.5]]
    level = np.sum(lanes.probe * start[:2], axis=0) + 0.25
    lanes.upper = level - np.array([1e-6, -1e-6, 1e-6, -1e-6])
    lane, what, share = first_events(lanes, Dense(start, terms), step, np.ones(size, dtype=bool))
    assert lane.tolist() == [0, 2]
    assert what.tolist() == [0, 0]
    assert np.allclose(share, 0.5 - 1e-3, rtol=0.0, atol=1e-6)


EVENTS = [("touchdown", 0.1), ("loaded", 0.12), ("touched", 0.17), ("liftoff", 0.4)]


@pytest.mark.parametrize(
    ("events", "ending", "kind"),
    [
        (EVENTS, "apex", ""),
        (EVENTS, "fell", "ending"),
        (EVENTS[:3], "apex", "missed"),
        ([EVENTS[0], *EVENTS[2:]], "apex", "missed"),
        ([*EVENTS, ("touchdown", 0.5)], "apex", "false"),
        ([*EVENTS[:2], ("unloaded", 0.13), *EVENTS[2:]], "apex", "false"),
        ([*EVENTS[:2], ("loaded", 0.1201), *EVENTS[2:]], "apex", "doubled"),
        ([*EVENTS[:3], ("liftoff", 0.40001)], "apex", "late"),
    ],
)
def test_every_kind_of_fault_is_named(
    events: list[tuple[str, float]], ending: str, kind: str
) -> None:
    story = Story(events=EVENTS, ending="apex")
    assert difference(replace(story, events=events, ending=ending), story) == kind
