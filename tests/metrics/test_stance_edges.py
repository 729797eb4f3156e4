"""Contact that is nearly long enough, a foot that hardly falls, and rows that are far apart."""

import numpy as np
import pytest
from metrics_runs import clock

from legbench.metrics.stance import loaded_by_contact, without_bounces
from legbench.signals import Bools, Floats


def loaded(time: Floats, contact: Bools, foot: Floats, **minimum: float) -> Bools:
    """Stance under a hip that stays where it is, so that no contact counts as a bounce."""
    return loaded_by_contact(time, contact, foot, np.zeros(len(time)), **minimum)


def flown() -> tuple[Floats, Bools, Floats]:
    """Time, contact and height of a foot that stands, rises, falls and stands, 0.1 s each."""
    time = clock(400)
    contact = (time < 0.1 - 1e-9) | (time > 0.3 - 1e-9)
    foot = np.interp(time, [0.0, 0.1, 0.2, 0.3, 0.4], [0.0, 0.0, 0.05, 0.0, 0.0])
    return time, contact, foot


@pytest.mark.parametrize(("rows", "counts"), [(13, False), (14, False), (16, True), (29, True)])
def test_a_gap_shorter_than_the_minimum_belongs_to_the_stance(rows: int, counts: bool) -> None:
    time, contact, foot = flown()
    gap = contact.copy()
    gap[340 : 340 + rows] = False
    # The foot comes back from above, so that the contact after the gap is a touchdown.
    foot[340 : 340 + rows] = np.linspace(0.01, 0.001, rows)
    np.testing.assert_array_equal(loaded(time, gap, foot), gap if counts else contact)


@pytest.mark.parametrize(("rows", "counts"), [(13, False), (14, False), (16, True), (29, True)])
def test_a_contact_shorter_than_the_minimum_belongs_to_the_flight(rows: int, counts: bool) -> None:
    time, contact, foot = flown()
    touch = contact.copy()
    touch[240 : 240 + rows] = True
    found = loaded(time, touch, foot)
    np.testing.assert_array_equal(found, touch if counts else contact)


def test_the_minimum_may_be_another() -> None:
    time, contact, foot = flown()
    touch = contact.copy()
    touch[220:250] = True
    assert loaded(time, touch, foot, minimum=0.029)[235]
    assert not loaded(time, touch, foot, minimum=0.031)[235]


def test_gaps_are_filled_before_contacts_are_judged() -> None:
    """A chattering touchdown, each contact of which is too short, is one long stance."""
    time, contact, foot = flown()
    chatter = contact.copy()
    chatter[300:360] = np.arange(60) % 20 < 10
    np.testing.assert_array_equal(loaded(time, chatter, foot), contact)


def test_a_level_foot_does_not_land() -> None:
    time, contact, foot = flown()
    touch = contact.copy()
    touch[240:270] = True
    foot[230:270] = 0.01
    np.testing.assert_array_equal(loaded(time, touch, foot), contact)
    foot[230:240] += 1e-9
    np.testing.assert_array_equal(loaded(time, touch, foot), touch)


@pytest.mark.parametrize(("before", "lands"), [(4, False), (5, True), (6, False), (9, False)])
def test_a_foot_falls_if_it_was_higher_five_milliseconds_before(before: int, lands: bool) -> None:
    time, contact, foot = flown()
    touch = contact.copy()
    touch[240:270] = True
    foot[225:270] = 0.01
    foot[240 - before] = 0.011
    found = loaded(time, touch, foot)
    np.testing.assert_array_equal(found, touch if lands else contact)


@pytest.mark.parametrize("lands", [False, True])
def test_rows_further_apart_than_the_look_back_are_compared_with_their_neighbour(
    lands: bool,
) -> None:
    time = np.linspace(0.0, 0.39, 40)
    contact = np.isin(np.arange(40), [*range(10), *range(20, 40)])
    foot = np.where(contact, 0.0, 0.02)
    foot[19] = 0.001 if lands else -0.001
    found = loaded(time, contact, foot)
    np.testing.assert_array_equal(found, contact if lands else contact & (np.arange(40) < 10))


def test_a_run_that_begins_in_contact_has_not_landed_and_stands() -> None:
    time, contact, foot = flown()
    foot[:100] = np.linspace(0.0, 0.001, 100)
    np.testing.assert_array_equal(loaded(time, contact, foot), contact)


def test_a_leg_has_bounced_if_its_hip_only_fell_until_the_row_before_it_is_back() -> None:
    contact = np.ones(12, dtype=np.bool_)
    contact[:2] = contact[5:7] = False
    # Landed in row 2, away in 5 and 6, back in row 7.
    for rises, bounced in ((1, True), (2, False), (4, False), (5, False), (6, True), (7, True)):
        steps = np.full(11, -0.25)
        steps[rises] = 0.25
        hip = np.concatenate([[1.0], 1.0 + np.cumsum(steps)])
        found = without_bounces(contact, hip)
        expected = contact.copy()
        expected[5:7] = bounced
        assert found.tolist() == expected.tolist(), rises
