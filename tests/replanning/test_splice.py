"""The state at a splice and the rest of a flown plan, against the plan itself."""

import numpy as np
import pytest

import minsnap
from minsnap.errors import InputError, TimingError
from minsnap.polynomials.bernstein import split
from minsnap.replanning.splice import divided, ends_at_rest, splice_of
from minsnap.trajectory.trajectory import rest_of

POINTS = np.array([(0, 0, 1), (2, 0.5, 1), (4, 0, 1.2), (6, 1, 1)], dtype=float)


@pytest.mark.parametrize("left", [1e-2, 1e-4, 1e-6])
def test_a_rest_that_begins_shortly_before_a_waypoint_keeps_all_digits_of_its_derivatives(left):
    flown = minsnap.plan(POINTS + 60.0, durations=[1.0, 1.2, 0.8])
    first = splice_of(flown, 0.5, 0.2, 4).rest
    rest = splice_of(first, 0.3 - left - 0.1, 0.1, 4).rest
    assert rest_of(rest)[0] is flown
    t = np.array([0.0, 0.5 * left, left, 0.5, rest.duration])
    at = np.minimum(1.0 - left + t, flown.duration)
    for order in range(4):
        size = 1e-12 * flown.max_norm(order)[0]
        assert rest(t, order) == pytest.approx(flown(at, order), abs=size)
        assert rest.derivative(order)(t) == pytest.approx(flown(at, order), abs=size)
        python = rest._evaluate(np.minimum(t, rest.duration), order)
        assert python == pytest.approx(flown(at, order), abs=size)


@pytest.mark.parametrize("pieces", [1, 2, 3])
@pytest.mark.parametrize("instant", [0.05, 0.7, 1.0, 1.45, 2.0, 2.9])
def test_the_rest_is_the_plan_from_there_with_its_legs(pieces, instant):
    flown = minsnap.plan(POINTS, durations=[1.0, 1.2, 0.8], pieces=pieces, yaw=[0.0, 0.5, 1.0, 1.5])
    splice = splice_of(flown, instant - 0.02, 0.02, 4)
    rest = splice.rest
    assert rest.pieces == pieces
    assert rest.legs == flown.legs - splice.passed
    t = np.linspace(0.0, rest.duration, 57)
    for order in range(3):
        at = np.minimum(splice.instant + t, flown.duration)
        assert rest(t, order) == pytest.approx(flown(at, order), abs=1e-8)
    assert rest.yaw(t) == pytest.approx(flown.yaw(splice.instant + t), abs=1e-12)
    assert rest.leg_breaks[1:] + splice.instant == pytest.approx(flown.leg_breaks[splice.passed + 1 :])
    for order in range(4):
        assert splice.state[order] == pytest.approx(flown(splice.instant, order), abs=1e-12)


def test_after_the_end_of_a_plan_that_rests_there_is_no_rest_but_a_state():
    flown = minsnap.plan(POINTS, durations=[1.0, 1.2, 0.8])
    splice = splice_of(flown, 2.99, 0.05, 4)
    assert splice.over and splice.rest is None
    assert splice.state[0] == pytest.approx(POINTS[-1])
    assert np.abs(splice.state[1:]).max() < 1e-8


def test_parts_of_a_polynomial_are_the_polynomial():
    points = np.random.default_rng(3).normal(size=(8, 3))
    whole = minsnap.Trajectory(points[None], np.ones(1))
    left, right = split(points, 0.3)
    both = minsnap.Trajectory(np.stack((left, right)), np.array([0.3, 0.7]))
    thirds = minsnap.Trajectory(divided(points, 3), np.full(3, 1.0 / 3.0))
    t = np.linspace(0.0, 1.0, 33)
    assert both(t) == pytest.approx(whole(t), abs=1e-13)
    assert thirds(np.minimum(t, thirds.duration)) == pytest.approx(whole(t), abs=1e-13)


def test_rest_at_the_end():
    assert ends_at_rest(minsnap.plan(POINTS, durations=[1.0, 1.2, 0.8]))
    assert not ends_at_rest(minsnap.plan(POINTS, durations=[1.0, 1.2, 0.8], end={"jerk": (1, 0, 0)}))


@pytest.mark.parametrize(
    ("now", "budget", "sentence"),
    [
        (-0.1, 0.02, "now is -0.1 s, before the start of the flown plan"),
        (1.0, 0.0, "the budget is 0.0: it must be a positive number"),
    ],
)
def test_instants_outside_the_plan_are_refused(now, budget, sentence):
    flown = minsnap.plan(POINTS, durations=[1.0, 1.2, 0.8])
    with pytest.raises(TimingError, match=sentence):
        splice_of(flown, now, budget, 4)


def test_a_plan_that_ends_in_motion_has_no_splice_after_its_end():
    flown = minsnap.plan(POINTS, durations=[1.0, 1.2, 0.8], end={"velocity": (1, 0, 0)})
    with pytest.raises(TimingError, match="ends at 3 s, in motion, before the splice at 3.01 s: replan earlier"):
        splice_of(flown, 2.99, 0.02, 4)


@pytest.mark.parametrize(("now", "budget"), [("1", 0.02), (1.0, None), (float("nan"), 0.02), (True, 0.02)])
def test_instants_are_numbers(now, budget):
    flown = minsnap.plan(POINTS, durations=[1.0, 1.2, 0.8])
    with pytest.raises(InputError, match="give a number of seconds"):
        splice_of(flown, now, budget, 4)
    with pytest.raises(InputError, match="a Trajectory is replanned, not a list"):
        splice_of([], 0.0, 0.02, 4)
