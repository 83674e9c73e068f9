"""Contacts: where a further row is put, and how much sooner the exchange ends with it."""

import numpy as np
import pytest
from tasks import many_legs

import minsnap
from minsnap.optimisation.contacts import APART, ONWARD, REACH, Contacts
from minsnap.optimisation.normalised_constraints import Rows


def rows(*places):
    wall, s = (np.array(part) for part in zip(*places, strict=True))
    order = np.zeros(len(s), dtype=int)
    return Rows(wall, wall, s.astype(float), order, np.ones((len(s), 1)), np.ones(len(s)))


def test_a_contact_is_expected_between_the_row_that_presses_and_the_peak():
    contacts = Contacts(rows((3, 0.4), (3, 0.9)), np.array([2.0, 1.0]))
    index, where = contacts.expected(np.array([3, 3]), np.array([0.5, 0.85]))
    assert index.tolist() == [0, 1]
    assert where == pytest.approx([0.5 - (1.0 - ONWARD) * 0.1, 0.85 + (1.0 - ONWARD) * 0.05])


@pytest.mark.parametrize(
    ("wall", "s", "why"),
    [(4, 0.42, "another wall"), (3, 0.4 + 1.1 * REACH, "too far"), (3, 0.4 + 0.5 * APART, "the same place")],
)
def test_none_is_expected(wall, s, why):
    contacts = Contacts(rows((3, 0.4), (9, 0.5)), np.array([2.0, 1.0]))
    assert len(contacts.expected(np.array([wall]), np.array([s]))[0]) == 0, why


def test_rows_that_do_not_press_make_no_contact():
    contacts = Contacts(rows((3, 0.4), (5, 0.5)), np.array([1e-12, 1.0]))
    assert len(contacts.expected(np.array([3]), np.array([0.45]))[0]) == 0
    assert len(Contacts(rows((3, 0.4)), np.zeros(1)).expected(np.array([3]), np.array([0.45]))[0]) == 0


def test_the_end_of_one_wall_is_not_the_start_of_the_next():
    contacts = Contacts(rows((3, 1.0)), np.ones(1))
    assert len(contacts.expected(np.array([4]), np.array([0.0]))[0]) == 0


def test_many_legs_take_hardly_more_rounds_than_few():
    few, many = (minsnap.plan(*many_legs(count)[:2], corridor=many_legs(count)[2]).report for count in (30, 300))
    assert many.rounds <= few.rounds + 4 <= 12


def test_rows_without_effect_are_forgotten():
    points, durations, widths = many_legs(200)
    report = minsnap.plan(points, durations, corridor=widths).report
    assert report.rows < 4 * 200
