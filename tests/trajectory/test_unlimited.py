"""Notes about what no limit holds: only where it is far from ordinary, and only where nothing bounds it."""

import pytest

import minsnap
from minsnap.native.library import core

CORNERS = [[0.0, 0.0, 1.0], [4.0, 0.0, 1.0], [4.0, 3.0, 1.0]]


@pytest.mark.parametrize("corridor", [None, 0.3, minsnap.Room((-9, -9, -9), (9, 9, 9))])
def test_a_hurried_plan_says_its_acceleration(corridor):
    curve = minsnap.plan(CORNERS, total_time=1.5, corridor=corridor)
    found = minsnap.certify(curve)
    assert found.max_acceleration > 2.0 * 9.81 and found.max_speed < 15.0
    note, hasty = curve.report.notes
    assert "the jerk is not limited" in hasty
    assert note == f"the acceleration is not limited and reaches {found.max_acceleration:.4g} m/s²"
    assert minsnap.plan(CORNERS, total_time=8.0, corridor=corridor).report.notes == ()


@pytest.mark.skipif(core().name != "native", reason="plans within limits need the native core")
def test_what_is_limited_is_not_noted():
    loose = minsnap.Limits(speed=40.0, acceleration=60.0, jerk=900.0)
    assert minsnap.plan(CORNERS, limits=loose, pieces=1).report.notes == ()
    bounded = minsnap.Limits(acceleration=60.0, jerk=900.0)
    assert minsnap.plan(CORNERS, limits=bounded, total_time=1.5).report.notes == ()
    (note,) = minsnap.plan([[0, 0, 1], [90, 0, 1]], limits=minsnap.Limits(max_thrust=2.0), pieces=1).report.notes
    assert note.startswith("the speed is not limited and reaches ")


@pytest.mark.skipif(core().name != "native", reason="plans within limits need the native core")
def test_what_the_search_chose_and_what_it_makes_of_the_jerk_are_noted():
    """The shortest plans of several polynomials a leg jump from one acceleration to another: 13,567 m/s^3 unsaid."""
    limits = minsnap.Limits(speed=3.0, acceleration=6.0)
    chosen, one = (minsnap.plan(CORNERS, limits=limits, **pieces) for pieces in ({}, {"pieces": 1}))
    assert chosen.pieces > 1 and chosen.duration < 0.95 * one.duration and one.report.notes == ()
    pieces, jerk = chosen.report.notes
    assert pieces == f"the search chose {chosen.pieces} polynomials a leg; with one the flight takes longer"
    assert jerk.startswith("the jerk is not limited and reaches ")
    assert minsnap.plan(CORNERS, limits=limits, pieces="auto").report.notes == (jerk,)


def test_a_path_far_beyond_its_waypoints_is_noted():
    (*_, note) = minsnap.plan([[0, 0, 1], [1, 0, 1]], durations=[6.0], start={"velocity": (0, 0, 5)}).report.notes
    assert note.startswith("the path goes over 6.8") and "its waypoints over 1 m" in note
