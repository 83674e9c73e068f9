"""Any planner's flight against a course: passages in order, limits used, and the proved least time."""

import json
from dataclasses import replace

import numpy as np
import pytest

import minsnap
from minsnap import Course, Cylinder, Gate, Limits, Stop
from minsnap.cli.app import main
from minsnap.corridors.boxes import Boxes
from minsnap.errors import InputError
from minsnap.paths.missions.course_check import check_course

LIMITS = Limits(speed=4, acceleration=6)
GATE = Gate((5, 1, 1.5), (1, 0.3, 0), 0.8, crossing=1)
STOPS = (Stop((0, 0, 1)), Stop(GATE), Stop((6, 5, 2)), Stop((1, 6, 1.5), ball=0.3), Stop((-2, 3, 1)))
COURSE = Course(STOPS, limits=LIMITS, pieces=1)


@pytest.fixture(scope="module")
def flight():
    return minsnap.plan_mission(COURSE).trajectory


def test_a_plan_passes_every_stop_in_order_and_keeps_the_limits(flight):
    check = check_course(flight, COURSE)
    assert not check.problems and not check.unknown
    assert [passed.stop for passed in check.passages] == [0, 1, 2, 3, 4]
    instants = [passed.instant for passed in check.passages]
    assert instants == pytest.approx(flight.leg_breaks, abs=0.2) and instants == sorted(instants)
    assert max(passed.outside for passed in check.passages) < 1e-6
    assert check.passages[1].clearance >= 0.0 and check.passages[2].clearance is None
    assert check.utilisation == LIMITS.utilisation(flight)


def test_the_bound_is_that_of_the_course_and_verifies(flight):
    check = check_course(flight, COURSE)
    places = [np.array(STOPS[0].place), GATE, *(np.array(stop.place) for stop in STOPS[2:])]
    known = minsnap.least_time(places, LIMITS, waypoint_tolerance=minsnap.Ball([0, 0, 0, 0.3, 0]))
    assert check.bound.verify()
    assert check.bound.seconds == pytest.approx(known.seconds, rel=1e-3)
    assert check.gap == pytest.approx(check.seconds / check.bound.seconds - 1.0) and 0.0 < check.gap < 0.5
    assert "longer at most" in check.sentence


def test_samples_are_taken_as_the_curve_through_them(flight):
    samples = flight.sample(200.0)
    check = check_course(samples, COURSE, resolution=1e-3)
    assert not check.problems
    assert {one.method for one in check.utilisation} == {"sampled"}
    assert check.seconds == pytest.approx(flight.duration, abs=0.01)
    bare = replace(samples, velocity=None, acceleration=None, jerk=None, snap=None)
    assert check_course(bare, COURSE, resolution=1e-2).unknown == ("speed", "acceleration")


def test_a_flight_of_bangs_is_at_the_bound():
    """Full acceleration and full braking over 8 m within 6 m/s^2: 2.3094 s, which no flight beats."""
    half = np.sqrt(8.0 / 6.0)
    cubic = [[0, 0, 4 / 3, 4], [4, 4 + 8 / 3, 8, 8]]
    curve = minsnap.Trajectory(np.array(cubic)[:, :, None] * (1.0, 0.0), [half, half])
    course = Course((Stop((0, 0)), Stop((8, 0))), limits=Limits(acceleration=6.0 * (1 + 1e-12)))
    check = check_course(curve, course)
    assert not check.problems and check.seconds == pytest.approx(2.3094, abs=1e-4)
    assert 0.0 <= check.gap < 1e-4


def test_what_a_flight_misses_is_a_problem_and_gives_the_bound_room(flight):
    moved = minsnap.Trajectory(flight.control_points + (0.0, 0.05, 0.0), flight.durations, pieces=flight.pieces)
    check = check_course(moved, COURSE, resolution=1e-3)
    outside = [passed.outside for passed in check.passages]
    assert [outside[0], outside[4]] == pytest.approx([0.05, 0.05], abs=1e-3) and 0.001 < outside[2] <= 0.05
    assert sum("is missed by" in problem for problem in check.problems) >= 3
    assert check.bound.verify() and check.bound.seconds < check_course(flight, COURSE).bound.seconds


def test_every_kind_of_fault_is_told(flight):
    other = check_course(flight, COURSE.changed(limits=Limits(speed=3, acceleration=6)))
    assert any("exceeds the course's speed" in problem for problem in other.problems)
    backwards = check_course(flight.reversed(), COURSE.changed(stops=STOPS[::-1]))
    assert any("the wrong way" in problem for problem in backwards.problems)
    skipped = check_course(flight, COURSE.changed(stops=(*STOPS[:2], Stop((9, 9, 3)), *STOPS[2:])))
    assert any("stop 2 is missed" in problem for problem in skipped.problems)
    swapped = check_course(flight, COURSE.changed(stops=(STOPS[0], STOPS[2], STOPS[1], *STOPS[3:])))
    assert any("is missed" in problem for problem in swapped.problems)
    place = flight(1.0)
    met = check_course(flight, COURSE.changed(avoid=(Cylinder(place[:2], 0.3),)))
    assert any("inside obstacle 0" in problem for problem in met.problems)
    left = check_course(flight, COURSE.changed(tube=0.01))
    assert any("leaves the tube" in problem for problem in left.problems)
    assert "the obstacles" in met.bound.left_out


def test_too_fast_a_flight_is_shorter_than_any_within_the_limits(flight):
    check = check_course(flight.stretched(0.5), COURSE)
    assert check.gap < 0.0 and "shorter" in check.sentence and check.problems


def test_laps_are_flown_from_the_place_where_they_end():
    stops = tuple(Stop(point, ball=0.2) for point in ((0, 0, 1), (4, 0, 1.3), (3, 3, 1)))
    course = Course((*stops, stops[0]), closed=True, laps=2, limits=LIMITS, pieces=1)
    assert len(course.stops) == 3, "a first stop that is written again is the same one, ball and all"
    lap = minsnap.plan_mission(course).trajectory
    check = check_course(lap, course)
    assert not check.problems and [passed.stop for passed in check.passages] == [0, 1, 2, 0, 1, 2, 0]
    assert check.seconds == pytest.approx(lap.duration) and check.bound.verify() and check.gap > 0.0


def test_a_straight_gate_is_missed_by_the_most_of_its_places(flight):
    course = COURSE.changed(stops=(STOPS[0], Stop(GATE, straight=1.0), *STOPS[2:]))
    assert any("stop 1 is missed" in problem for problem in check_course(flight, course).problems)
    straight = minsnap.plan_mission(course).trajectory
    assert not check_course(straight, course).problems


def test_courses_that_cannot_be_checked_are_refused(flight):
    boxes = Course(
        (), boxes=Boxes([(0, 0, 0)], [(4, 4, 3)]), start={"position": (1, 1, 1)}, end={"position": (3, 3, 1)}
    )
    for course, words in (
        (boxes, "boxes and no stops"),
        (COURSE.changed(stops=(*STOPS[:2], Stop((6, 5, 2), hold=1.0), *STOPS[3:])), "holds"),
        (Course((Stop((0, 0)), Stop((1, 0)))), "3 coordinates, and the course 2"),
    ):
        with pytest.raises(InputError, match=words):
            check_course(flight, course)


def run(*words):
    with pytest.raises(SystemExit) as ended:
        main([str(word) for word in words])
    return ended.value.code or 0


def test_the_command_prints_the_gap_and_json_holds_it(tmp_path, capsys):
    course, plan, rows = tmp_path / "course.yaml", tmp_path / "plan.json", tmp_path / "rows.csv"
    course.write_text("waypoints: [[0, 0, 1], [4, 0, 1], [4, 4, 1]]\nlimits: {speed: 3, acceleration: 6}\npieces: 1\n")
    assert run("plan", course, "-o", plan) == 0 and run("plan", course, "-o", rows) == 0
    capsys.readouterr()
    for file in (plan, rows):
        assert run("check", file, "--course", course) == 0
        out = capsys.readouterr().out
        assert "against the course" in out and "proved in exact arithmetic" in out and "longer at most" in out
    assert run("check", plan, "--course", course, "--json") == 0
    figures = json.loads(capsys.readouterr().out)["course"]
    assert figures["verified"] and figures["gap"] > 0.0 and len(figures["passages"]) == 3
    course.write_text(course.read_text().replace("[4, 4, 1]", "[4, 5, 1]"))
    assert run("check", plan, "--course", course) == 1
    assert "stop 2 is missed by 1 m" in capsys.readouterr().out
    assert run("check", plan, "--course", tmp_path / "none.yaml") == 2
