"""The neighbourhood of a periodic hop in which every hop brings the leg nearer."""

from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from legbench.control import JumpConfig
from legbench.design import load_design
from legbench.modes.fixed_point import UNITS
from legbench.signals import Floats

pytest.importorskip("heyoka")

from brute_basins import random_task

from legbench.modes.attraction import Attraction, attraction_of
from legbench.modes.basin import BasinTask, Fate, attraction_in, fate_of
from legbench.modes.hop import Apex

PROTOTYPE = load_design(Path(__file__).parents[2] / "models" / "prototype.toml")
CENTRE = np.zeros(6)
TURN = 0.6 * np.eye(6) + 0.1 * np.diag(np.ones(5), 1)
"""Derivative of a map that shears while it shrinks."""
NEAR, HOPS = 0.05, 25


def tamed(x: Floats) -> Floats:
    return TURN @ x


def wild_beyond(length: float) -> Attraction | None:
    def follow(x: Floats) -> Floats:
        return tamed(x) if np.linalg.norm(x) < length else 1.05 * x

    return attraction_of(follow, TURN, CENTRE, NEAR, 60)


def test_the_distance_covers_every_coordinate_and_shrinks_by_its_rate() -> None:
    found = attraction_of(tamed, TURN, CENTRE, NEAR, 60)
    assert found is not None
    random = np.random.default_rng(1)
    for x in random.normal(size=(200, 6)):
        length = found.distance(x * UNITS)
        assert np.max(np.abs(x)) <= length
        assert found.distance(TURN @ x * UNITS) <= found.rate * length
        hops = found.hops_to(NEAR, length)
        assert found.distance(np.linalg.matrix_power(TURN, hops) @ x * UNITS) <= NEAR


def test_a_map_that_goes_wrong_far_away_is_relied_on_nearby_only() -> None:
    far, middle, close = (wild_beyond(length) for length in (100.0, 2.0, 0.2))
    assert far is not None
    assert middle is not None
    assert middle.radius < far.radius
    assert close is None


def test_a_hop_that_repels_or_attracts_too_slowly_has_none() -> None:
    for slope in (1.01 * np.eye(6), 0.97 * np.eye(6)):
        assert attraction_of(lambda x, by=slope: by @ x, slope, CENTRE, NEAR, HOPS) is None


@pytest.fixture(scope="module")
def asked() -> BasinTask:
    return random_task(PROTOTYPE, 3, 6)


def test_a_leg_that_is_attracted_returns(asked: BasinTask, monkeypatch: pytest.MonkeyPatch) -> None:
    found = attraction_in(asked)
    assert found is not None
    assert found.radius >= 1.0
    (leg, drive), random = asked.tools(), np.random.default_rng(2)
    hops, told = Counter[bool](), Counter[Fate]()
    restart = drive.restart
    monkeypatch.setattr(drive, "restart", lambda: (hops.update([early]), restart()))
    for away in random.uniform(-4.0, 4.0, (15, 6)):
        start = Apex.of(asked.centre.vector() + away * UNITS)
        early = True
        fate = fate_of(leg, drive, asked, start, found)
        early = False
        assert fate is fate_of(leg, drive, asked, start)
        told.update([fate])
    assert told[Fate.RETURNS] > 8
    assert 2 * hops[True] < hops[False]


def test_motors_that_are_held_promise_nothing(asked: BasinTask) -> None:
    assert attraction_in(replace(asked, jump=None, motor=(-0.456, 0.456))) is None
    assert attraction_in(replace(asked, jump=JumpConfig(z2=0.5))) is None
