"""Setpoints that learn from flight to flight: the error falls on the courses that were flown on PX4."""

from dataclasses import replace

import numpy as np
import pytest

import minsnap
from minsnap.errors import InputError
from minsnap.files.consistency import check_samples
from minsnap.flight import CascadeController, compare, simulate
from minsnap.flight.tracking.tuning import LearningSettings, learned
from minsnap.trajectory.samples import Samples
from minsnap.vehicle import Quadrotor

CORNERS = [(0, 0, 2), (8, 0, 2), (8, 4, 2), (0, 4, 2), (0, 0, 2)]
COURSES = {
    "rectangle": lambda: minsnap.plan(CORNERS, corridor=0.3, total_time=12.0),
    "circle": lambda: minsnap.circle(radius=3.0, period=6.0),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", COURSES)
def test_three_flights_take_off_four_fifths(name):
    plan = COURSES[name]().sample(20.0)
    sent, errors, delay = plan, [], None
    for _ in range(3):
        flown = simulate(Quadrotor.px4_sih(), CascadeController(), sent, setpoint_delay=0.1).samples
        found = compare(plan, flown)
        delay = found.delay if delay is None else delay
        errors.append(found.rmse_3d)
        sent = learned(plan, sent, flown, delay)
    assert errors[0] > errors[1] > errors[2] and errors[2] < 0.2 * errors[0]
    report = check_samples(sent)
    assert report.ok and report.starts_at_rest and report.ends_at_rest


@pytest.mark.parametrize(("first", "last"), [(3.0, 7.0), (3.0, 99.0), (-1.0, 3.0)])
def test_nothing_is_learned_where_samples_are_missing(first, last):
    """A straight line across the gap, or the last place for all that came after it, was corrected as if flown."""
    plan = COURSES["circle"]().sample(20.0)
    seen = (plan.t < first) | (plan.t > last)
    flown = Samples(plan.t[seen], plan.position[seen])
    assert np.abs(learned(plan, plan, flown, 0.0).position - plan.position).max() < 1e-9


def test_one_wrong_position_makes_no_step_in_the_setpoints():
    """One of 1e30 m, a flipped bit of a log, moved two seconds of them by 2 m, from one to the next."""
    plan = COURSES["circle"]().sample(20.0)
    place = plan.position.copy()
    place[60] = 1e30
    moved = learned(plan, plan, Samples(plan.t, place), 0.3).position - plan.position
    assert np.linalg.norm(np.diff(moved, axis=0), axis=1).max() < 0.1


def test_a_flight_without_error_changes_nothing_and_a_large_one_is_bounded():
    plan = COURSES["circle"]().sample(20.0)
    same = learned(plan, plan, Samples(plan.t, plan.position, plan.velocity), 0.3)
    np.testing.assert_allclose(same.position, plan.position, atol=1e-12)
    far = learned(plan, plan, Samples(plan.t, plan.position + [9.0, 0.0, 0.0]), 0.3)
    assert np.linalg.norm(far.position - plan.position, axis=1).max() == pytest.approx(2.0)
    np.testing.assert_array_equal(far.position[[0, -1]], plan.position[[0, -1]])


def test_what_cannot_be_learned_from_is_refused():
    plan = COURSES["circle"]().sample(20.0)
    with pytest.raises(InputError, match="other instants"):
        learned(plan, COURSES["circle"]().sample(10.0), plan, 0.3)
    with pytest.raises(InputError, match="needs velocity"):
        learned(replace(plan, acceleration=None), plan, plan, 0.3)
    with pytest.raises(InputError, match="the delay is -1"):
        learned(plan, plan, plan, -1.0)
    with pytest.raises(InputError, match="gain is 0"):
        LearningSettings(gain=0.0)
    with pytest.raises(InputError, match="cutoff is 'low'"):
        LearningSettings(cutoff="low")
