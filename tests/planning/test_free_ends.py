"""Ends whose derivatives the plan chooses: the optimum of the programme without those rows, in every kind of plan."""

import numpy as np
import pytest
import qpsolvers

import minsnap
from minsnap import Limits, Search
from minsnap.errors import WaypointError
from minsnap.files.formats.polynomials import read_polynomials, write_polynomials

NAMES = ("velocity", "acceleration", "jerk", "snap", "crackle")
POINTS = np.array([(0, 0, 1), (4, 0, 1), (4, 4, 1.5), (1, 5, 1)], dtype=float)
TIMES = np.array([2.0, 1.5, 2.5])
LIMITS = Limits(speed=3, acceleration=6, jerk=40)
VELOCITY = {"velocity": "free"}


def programme_optimum(points, times, samples=0, **asked):
    """Return the least cost of the textbook's programme, whose rows are made apart from those of a plan."""
    found = minsnap.build_qp(points, times, samples=samples, **asked)
    inequalities = (found.G, found.h) if samples else (None, None)
    problem = qpsolvers.Problem(found.P, found.q, *inequalities, found.A, found.b)
    solution = qpsolvers.solve_problem(problem, solver="clarabel", tol_gap_rel=1e-11, tol_feas=1e-11)
    return solution.obj


@pytest.mark.parametrize("degree", [5, 7, 9])
@pytest.mark.parametrize("count", [1, 2])
@pytest.mark.parametrize("where", ["start", "end"])
def test_a_free_end_has_the_cost_of_the_programme_without_its_rows(degree, count, where):
    free = dict.fromkeys(NAMES[:count], "free")
    curve = minsnap.plan(POINTS, TIMES, degree=degree, **{where: free})
    assert curve.cost() == pytest.approx(programme_optimum(POINTS, TIMES, degree=degree, **{where: free}), rel=1e-6)


@pytest.mark.parametrize("degree", [3, 5, 7, 9, 11])
def test_what_is_free_has_its_natural_condition(degree):
    """Where derivative q of an end is free, derivative 2k - 1 - q is zero there: the cost has no slope in it."""
    half = (degree + 1) // 2
    for order in range(1, half):
        curve = minsnap.plan(POINTS, TIMES, degree=degree, end={NAMES[order - 1]: "free"})
        size = curve.max_norm(degree - order)[0]
        assert np.abs(curve(curve.duration, degree - order)).max() < 1e-6 * size
        assert np.abs(curve(curve.duration, order)).max() > 1e-3
        others = [curve(curve.duration, other) for other in range(1, half) if other != order]
        assert not others or np.abs(others).max() < 1e-9


def test_more_pieces_and_more_continuity_change_nothing_of_a_free_optimum():
    curve = minsnap.plan(POINTS, TIMES, end=VELOCITY)
    for other in ({"pieces": 3}, {"continuity": 5}):
        assert minsnap.plan(POINTS, TIMES, end=VELOCITY, **other).cost() == pytest.approx(curve.cost(), rel=1e-6)


def test_a_corridor_holds_and_costs_what_a_finely_sampled_programme_does():
    curve = minsnap.plan(POINTS, TIMES, corridor=0.2, end=VELOCITY)
    assert minsnap.certify(curve, POINTS, corridor=0.2).ok
    sampled = programme_optimum(POINTS, TIMES, 200, corridor=0.2, end=VELOCITY)
    assert sampled * (1.0 - 1e-6) <= curve.cost() <= sampled * (1.0 + 2e-3)
    assert curve.cost() < minsnap.plan(POINTS, TIMES, corridor=0.2).cost()


@pytest.mark.parametrize("asked", [{}, {"corridor": 0.2}])
def test_a_total_is_split_with_the_end_free(asked):
    """No change of two legs' shares costs less: the split is the least."""
    best = minsnap.plan(POINTS, total_time=6.0, end=VELOCITY, **asked)
    times = np.diff(best.leg_breaks)
    for leg in range(len(times)):
        for share in (-0.01, 0.01):
            other = times.copy()
            other[leg] += share
            other *= 6.0 / other.sum()
            assert minsnap.plan(POINTS, other, end=VELOCITY, **asked).cost() >= best.cost() * (1.0 - 1e-6)


@pytest.mark.parametrize("pieces", [1, 3])
def test_the_shortest_time_is_below_that_of_every_velocity_at_the_end(pieces):
    free = minsnap.plan(POINTS, limits=LIMITS, end=VELOCITY, pieces=pieces)
    assert minsnap.certify(free, POINTS, limits=LIMITS).ok
    chosen = free(free.duration, 1)
    assert np.linalg.norm(chosen) > 2.0
    tried = [minsnap.plan(POINTS, limits=LIMITS, end={"velocity": f * chosen}, pieces=pieces) for f in (0.0, 0.5, 0.99)]
    assert [one.duration for one in tried] == sorted((one.duration for one in tried), reverse=True)
    assert free.duration <= tried[-1].duration * (1.0 + 1e-3)
    assert free.duration < 0.97 * tried[0].duration


def test_a_straight_leg_ends_at_the_speed_limit():
    """Rest to full speed and on: 0.5 s for 0.75 m within 6 m/s^2, then 3.25 m at 3 m/s."""
    curve = minsnap.plan([(0, 0), (4, 0)], limits=Limits(speed=3, acceleration=6), end=VELOCITY)
    assert 0.5 + 3.25 / 3 <= curve.duration <= 1.005 * (0.5 + 3.25 / 3)
    both = minsnap.plan([(0, 0), (4, 0)], limits=Limits(speed=3, acceleration=6), start=VELOCITY, end=VELOCITY)
    assert 4 / 3 <= both.duration <= 1.005 * 4 / 3


@pytest.mark.parametrize(
    "asked",
    [
        {"total_time": 7.0, "limits": LIMITS},
        {"durations": TIMES * 1.5, "limits": LIMITS},
        {"search": Search(time_weight=100.0)},
        {"search": Search(time_weight=1000.0), "limits": LIMITS},
        {"limits": LIMITS, "waypoint_tolerance": 0.1, "corridor": 0.3, "pieces": 1},
        {"limits": LIMITS, "avoid": [minsnap.Cylinder((2, 0.1), 0.3)]},
        {"limits": LIMITS, "continuity": 4, "degree": 9, "pieces": 1},
        {"limits": Limits(speed=3, max_thrust=1.5, tilt=0.5, body_rate=4), "yaw": "velocity"},
    ],
)
def test_free_ends_go_with_every_kind_of_plan(asked):
    curve, rest = (minsnap.plan(POINTS, **asked, **end) for end in ({"end": VELOCITY}, {}))
    limits, tolerance = asked.get("limits"), asked.get("waypoint_tolerance", 0.0)
    assert minsnap.certify(curve, POINTS, limits=limits, tolerance=tolerance, corridor=asked.get("corridor")).ok
    assert np.linalg.norm(curve(curve.duration, 1)) > 0.3
    least = "duration" if limits is not None and not {"total_time", "durations", "search"} & set(asked) else "cost"
    assert least == "cost" or curve.duration < rest.duration


def test_no_bound_of_the_time_is_known_of_a_free_velocity():
    curve = minsnap.plan(POINTS, limits=LIMITS, end=VELOCITY, pieces=1)
    assert curve.report.lower_bound is None and curve.report.gap is None
    assert minsnap.least_time(POINTS, LIMITS, end=VELOCITY).reason == "the velocity at an end is free"
    assert minsnap.least_time(POINTS, LIMITS, end={"acceleration": "free"}).seconds > 3.0


def test_a_free_end_of_a_course_is_planned_written_and_checked(tmp_path):
    file, plan = tmp_path / "course.yaml", tmp_path / "run.plan.json"
    file.write_text(
        "waypoints: [[0, 0, 1], [4, 0, 1], [4, 4, 1.5]]\nend: {velocity: free}\nlimits: {speed: 3, acceleration: 6}\n"
    )
    mission = minsnap.plan_mission(minsnap.read_course(file))
    assert np.linalg.norm(mission.trajectory(mission.trajectory.duration, 1)) > 2.0
    assert not mission.pins
    write_polynomials(mission.trajectory, plan, limits=mission.limits, pins=mission.pins)
    assert read_polynomials(plan).certified()[0]
    file.write_text(file.read_text().replace("free", "fre"))
    with pytest.raises(minsnap.MinsnapError, match="end: velocity"):
        minsnap.read_course(file)


def test_free_ends_are_refused_where_they_cannot_be():
    with pytest.raises(WaypointError, match="the velocity of end is 'fre': give 3 finite numbers or 'free'"):
        minsnap.plan(POINTS, TIMES, end={"velocity": "fre"})
    with pytest.raises(WaypointError, match="give 3 finite numbers$"):
        minsnap.plan(POINTS, TIMES, pins={1: VELOCITY})
    with pytest.raises(WaypointError, match="end pins 'speed'"):
        minsnap.plan(POINTS, TIMES, end={"speed": "free"})
    with pytest.raises(WaypointError, match="position of end"):
        minsnap.plan(POINTS, TIMES, end={"position": "free"})
    with pytest.raises(WaypointError, match="leaves a derivative free"):
        minsnap.plan_many([POINTS], [TIMES], end=VELOCITY)
    every = dict.fromkeys(NAMES[:3], "free")
    with pytest.raises(WaypointError, match="many curves cost nothing"):
        minsnap.plan(POINTS[:3], TIMES[:2], start=every, end=every)
    assert minsnap.plan(POINTS, TIMES, start=every, end=every).cost() == pytest.approx(0.0, abs=1e-9)
