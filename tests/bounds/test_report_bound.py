"""What a report says of the least time: a bound and a gap where the plan chose its time, found when asked for."""

import pickle
from dataclasses import replace

import pytest

import minsnap
from minsnap import Ball, Cylinder, Gate, Limits, least_time

POINTS = [(0, 0, 1), (4, 1, 1), (5, 4, 2), (0, 5, 1)]
QUICK = Limits(speed=3.0, acceleration=6.0)


@pytest.mark.parametrize(
    "asked",
    [
        {},
        {"waypoint_tolerance": Ball(0.3)},
        {"start": {"velocity": (1, 0, 0)}, "end": {"velocity": (-1, 1, 0)}},
        {"pieces": 1},
    ],
)
def test_the_bound_is_that_of_the_question(asked):
    report = minsnap.plan(POINTS, limits=QUICK, **asked).report
    bound = least_time(POINTS, QUICK, **{name: value for name, value in asked.items() if name != "pieces"})
    assert report.lower_bound == bound.seconds
    assert report.least.bound.verify()
    assert 0.0 <= report.gap == report.duration / bound.seconds - 1.0


def test_laps_and_gates_have_a_bound():
    lap = [*POINTS, POINTS[0]]
    report = minsnap.plan(lap, limits=QUICK, closed=True).report
    assert report.lower_bound == least_time(lap, QUICK, closed=True).seconds
    gates = [POINTS[0], Gate((4, 1, 1), (1, 1, 0), 1.0), POINTS[2]]
    report = minsnap.plan(gates, limits=QUICK).report
    assert report.lower_bound == least_time(gates, QUICK).seconds


def test_it_is_found_when_it_is_first_asked_for():
    report = minsnap.plan(POINTS, limits=QUICK).report
    assert "bound" not in vars(report.least)
    assert report.gap > 0.0
    assert "bound" in vars(report.least)


@pytest.mark.parametrize(
    "asked",
    [
        {"durations": [3, 3, 3]},
        {"durations": [3, 3, 3], "limits": QUICK},
        {"total_time": 12.0, "limits": QUICK},
        {"limits": QUICK, "search": minsnap.Search(time_weight=100.0)},
    ],
)
def test_a_time_that_was_given_has_no_bound(asked):
    report = minsnap.plan(POINTS, **asked).report
    assert report.lower_bound is report.gap is report.nearness is None


def test_a_start_outside_of_the_limits_has_no_bound():
    """The flight need not keep them on the way back."""
    report = minsnap.plan(POINTS, limits=QUICK, start={"velocity": (3.5, 0, 0)}).report
    assert report.limits_from > 0.0
    assert report.lower_bound is None


def test_a_sentence_says_what_is_left_out():
    report = minsnap.plan(POINTS, limits=QUICK).report
    assert report.nearness == f"at most {100 * report.gap:.2f} % longer than any flight within these limits"
    assert ("flight time", report.nearness) in report.facts()
    limits = Limits(speed=3.0, acceleration=6.0, jerk=40.0)
    room = minsnap.Room((-9, -9, 0), (9, 9, 9))
    inside = {"corridor": [1.5, room], "avoid": [Cylinder((2.2, 2.6), 0.2)]}
    report = minsnap.plan(POINTS, limits=limits, **inside, pins={1: {"velocity": (1, 1, 0)}}).report
    left = "jerk away from hover, the corridor, the room, the obstacles and the pins on the way left out"
    assert report.nearness.endswith(left)


@pytest.mark.slow
def test_a_total_below_the_bound_is_refused_with_its_proof():
    """Moves along lines prove less; a gate counts as the box around it."""
    places = [POINTS[0], Gate((4, 1, 1), (1, 1, 0), 0.5), *POINTS[2:]]
    least = least_time(places, QUICK).seconds
    with pytest.raises(minsnap.InfeasibleError, match="every flight takes") as refused:
        minsnap.plan(places, total_time=0.97 * least, limits=QUICK, pieces=3)
    proof = pickle.loads(pickle.dumps(refused.value)).contradiction
    assert refused.value.verify() and proof.verify()
    assert 0.97 * least < proof.least <= least
    assert not replace(proof, total=proof.least * (1.0 + 1e-9)).verify()
    assert not replace(proof, bound=replace(proof.bound, seconds=2.0 * least)).verify()


def test_a_report_that_was_copied_says_the_same():
    traj = minsnap.plan(POINTS, limits=QUICK)
    assert pickle.loads(pickle.dumps(traj)).report.gap == traj.report.gap
