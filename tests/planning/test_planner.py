"""The one call: what it takes, what it gives, what it says of itself."""

import inspect
import re
import subprocess
import sys

import numpy as np
import pytest
from oracles.curves import jumps

import minsnap
from minsnap.errors import WaypointError
from minsnap.native.library import core, using

CORNERS = [(0, 0, 1), (8, 0, 1), (8, 4, 1), (0, 4, 1), (0, 0, 1)]
DURATIONS = [4.0, 2.0, 4.0, 2.0]


def test_its_arguments_are_those_of_the_contract_in_that_order():
    names = list(inspect.signature(minsnap.plan).parameters)
    assert names[:12] == [
        "waypoints",
        "durations",
        "total_time",
        "limits",
        "corridor",
        "continuity",
        "degree",
        "yaw",
        "start",
        "end",
        "closed",
        "solver",
    ]
    defaults = {name: p.default for name, p in inspect.signature(minsnap.plan).parameters.items()}
    assert (defaults["degree"], defaults["closed"], defaults["solver"]) == (7, False, "auto")


@pytest.mark.parametrize("make", (list, tuple, np.array, lambda rows: np.array(rows, np.float32)))
def test_waypoints_of_any_kind(make):
    traj = minsnap.plan(make(CORNERS), make(DURATIONS), corridor=0.3)
    assert (traj(traj.breaks) == CORNERS).all()
    assert (traj.legs, traj.dim, traj.degree, traj.duration) == (4, 3, 7, 12.0)


def test_nothing_passed_in_is_changed_or_kept():
    points, durations, width = np.array(CORNERS, float), np.array(DURATIONS), np.full(4, 0.3)
    before = points.copy(), durations.copy(), width.copy()
    traj = minsnap.plan(points, durations, corridor=width)
    for array, copy in zip((points, durations, width), before, strict=True):
        assert (array == copy).all()
    points[:], durations[:] = 0.0, 1.0
    assert (traj(traj.breaks) == CORNERS).all()


@pytest.mark.parametrize("core_name", ("auto", "python"))
@pytest.mark.parametrize("start", (None, {"velocity": (0.3, 0.1, 0.0)}))
def test_durations_are_those_given_to_the_last_bit(start, core_name):
    given = np.array([3.3, 3.7, 2.6, 3.1])
    with using(core_name):
        for corridor in (None, 0.3):
            traj = minsnap.plan(CORNERS, given, corridor=corridor, start=start)
            assert traj.durations.tolist() == given.tolist()


@pytest.mark.parametrize("dim", (1, 2, 3, 4, 7))
def test_any_dimension(dim):
    points = np.random.default_rng(0).normal(size=(5, dim))
    for corridor in (None, 0.2):
        traj = minsnap.plan(points, DURATIONS, corridor=corridor)
        assert (traj(traj.breaks) == points).all()
        assert minsnap.certify(traj, points, corridor).ok


@pytest.mark.parametrize("degree", (3, 5, 7, 9, 11))
def test_every_degree_minimises_its_own_derivative(degree):
    half = (degree + 1) // 2
    costs = {}
    for other in (3, 5, 7, 9, 11):
        if other >= degree:
            traj = minsnap.plan(CORNERS, DURATIONS, degree=other)
            costs[other] = traj.cost(half)
    assert min(costs, key=costs.get) == degree
    assert minsnap.plan(CORNERS, DURATIONS, degree=degree).report.cost == pytest.approx(costs[degree], rel=1e-9)


def test_the_cost_is_by_default_that_of_the_derivative_minimised():
    t, dt = np.linspace(0.0, 12.0, 240_001, retstep=True)
    for degree, order in ((3, 2), (5, 3), (7, 4), (9, 5), (11, 6)):
        traj = minsnap.plan(CORNERS, DURATIONS, degree=degree)
        squares = (traj(t, order) ** 2).sum(axis=1)
        assert traj.cost_order == order
        assert traj.cost() == pytest.approx(squares[:-1].sum() * dt, rel=1e-3)
        assert traj.cost() == pytest.approx(traj.report.cost, rel=1e-9)
    assert traj.elevated(12).cost() == pytest.approx(traj.cost(4))


def test_a_corridor_kept_at_samples_only_is_cheaper_and_leaves_it():
    asked = {"waypoints": CORNERS, "durations": DURATIONS, "corridor": 0.3}
    exact = minsnap.plan(**asked)
    sampled = minsnap.plan(CORNERS, DURATIONS, corridor=minsnap.Sampled(0.3))
    assert (
        sampled.control_points == minsnap.plan(CORNERS, DURATIONS, corridor=minsnap.Sampled(0.3, 20)).control_points
    ).all()
    assert sampled.cost() < exact.cost()
    assert minsnap.certify(exact, CORNERS, 0.3).ok
    assert not minsnap.certify(sampled, CORNERS, 0.3).ok


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ({"split": "distance"}, "search=Search(split="),
        ({"time_weight": 2.0}, "search=Search(time_weight="),
        ({"enforce": "qp"}, "write nothing in its place, since limits hold"),
        ({"time_limit": 2.0}, "search=Search(time_limit="),
        ({"on_interrupt": "return"}, "search=Search(on_interrupt="),
        ({"corridor_method": "sampled"}, "corridor=Sampled("),
        ({"samples": 20}, "corridor=Sampled("),
        ({"certify": False}, "corridor=Sampled("),
        ({"yaw_rate": 1.0}, "yaw=Velocity(yaw_rate="),
        ({"hold_below": 1.0}, "yaw=Velocity(hold_below="),
        ({"dim": 3}, "as many coordinates as their rows"),
        ({"duration": 12.0}, "did you mean durations?"),
        ({"max_speed": 3.0}, "write limits=Limits(speed=3)"),
        ({"time": 12.0}, "write total_time=10"),
        ({"payload": 12.0}, "it takes avoid, closed, continuity, corridor"),
    ],
)
def test_a_name_that_plan_does_not_have_is_answered_with_the_one_that_was_meant(old, new):
    with pytest.raises(TypeError, match=re.escape(new)) as caught:
        minsnap.plan(CORNERS, **{"durations": DURATIONS, **old})
    assert isinstance(caught.value, minsnap.InputError)


def test_no_neighbour_is_cheaper():
    # least cost means that no small change of inner derivatives that keeps the knots lowers it
    traj = minsnap.plan(CORNERS, DURATIONS)
    random = np.random.default_rng(0)
    for knot in (1, 2, 3):
        for name in ("velocity", "acceleration", "jerk"):
            order = ("position", "velocity", "acceleration", "jerk").index(name)
            there = traj(traj.breaks[knot], order)
            moved = there + 1e-3 * random.normal(size=3)
            assert minsnap.plan(CORNERS, DURATIONS, pins={knot: {name: there}}).cost() == pytest.approx(traj.cost())
            assert minsnap.plan(CORNERS, DURATIONS, pins={knot: {name: moved}}).cost() > traj.cost()


def test_by_distance_every_leg_has_the_same_mean_speed():
    traj = minsnap.plan(CORNERS, total_time=9.0, search=minsnap.Search(split="distance"))
    assert traj.durations == pytest.approx([3.0, 1.5, 3.0, 1.5])


def test_the_optimal_split_is_better_than_its_neighbours():
    best = minsnap.plan(CORNERS, total_time=12.0)
    for leg in range(4):
        for change in (-0.05, 0.05):
            durations = best.durations.copy()
            durations[leg] += change
            durations *= 12.0 / durations.sum()
            assert minsnap.plan(CORNERS, durations).cost() > best.cost()


def test_a_start_and_an_end_in_motion():
    start, end = {"velocity": (1, 0.2, 0), "jerk": (0, 0, 0.5)}, {"acceleration": (0, -0.5, 0)}
    traj = minsnap.plan(CORNERS, DURATIONS, start=start, end=end, corridor=0.5)
    assert traj(0.0, 1) == pytest.approx([1, 0.2, 0])
    assert traj(0.0, 2) == pytest.approx([0, 0, 0], abs=1e-9)
    assert traj(0.0, 3) == pytest.approx([0, 0, 0.5], abs=1e-8)
    assert traj(12.0, 1) == pytest.approx([0, 0, 0], abs=1e-9)
    assert traj(12.0, 2) == pytest.approx([0, -0.5, 0], abs=1e-8)
    assert minsnap.certify(traj, CORNERS, 0.5).ok


def test_a_pin_inside_a_corridor():
    traj = minsnap.plan(CORNERS, DURATIONS, corridor=0.3, pins={1: {"velocity": (0.2, 0.2, 0)}, 3: {"jerk": (0, 0, 0)}})
    assert traj(4.0, 1) == pytest.approx([0.2, 0.2, 0], abs=1e-9)
    assert traj(10.0, 3) == pytest.approx([0, 0, 0], abs=1e-8)
    assert minsnap.certify(traj, CORNERS, 0.3).ok
    assert traj.cost() > minsnap.plan(CORNERS, DURATIONS, corridor=0.3).cost()


def test_a_closed_lap_in_a_corridor_is_cheaper_than_one_from_rest():
    lap = minsnap.plan(CORNERS, DURATIONS, corridor=0.3, closed=True)
    assert lap.cost() < minsnap.plan(CORNERS, DURATIONS, corridor=0.3).cost()
    assert np.abs(lap(0.0, 1)).max() > 0.01
    for order in range(4):
        assert (jumps(lap.then(lap), order) <= 1e-9).all()


@pytest.mark.parametrize("pieces", (1, 2, 3, 5))
def test_pieces_make_a_corridor_cheaper(pieces):
    traj = minsnap.plan(CORNERS, DURATIONS, corridor=0.3, pieces=pieces)
    assert traj.control_points.shape == (4 * pieces, 8, 3)
    assert traj.legs == 4
    assert traj.leg_breaks == pytest.approx([0, 4, 6, 10, 12])
    assert minsnap.certify(traj, CORNERS, 0.3).ok
    fewer = minsnap.plan(CORNERS, DURATIONS, corridor=0.3)
    assert traj.cost() <= fewer.cost() * (1.0 + 1e-9)


def test_without_a_corridor_pieces_change_nothing():
    one, many = (minsnap.plan(CORNERS, DURATIONS, pieces=pieces) for pieces in (1, 3))
    assert many.cost() == pytest.approx(one.cost(), rel=1e-9)
    t = np.linspace(0.0, 12.0, 101)
    assert many(t) == pytest.approx(one(t), abs=1e-9)


def test_a_tolerance_of_one_waypoint_moves_that_one_alone():
    tolerance = np.zeros((5, 3))
    tolerance[2] = 0.5
    traj = minsnap.plan(CORNERS, DURATIONS, waypoint_tolerance=tolerance)
    off = np.abs(traj(traj.breaks) - CORNERS)
    assert off[[0, 1, 3, 4]].max() == 0.0
    assert 0.1 <= off[2].max() <= 0.5 + 1e-9
    assert traj.cost() < minsnap.plan(CORNERS, DURATIONS).cost()


def test_the_report_tells_which_core_answered():
    report = minsnap.plan(CORNERS, DURATIONS, corridor=0.3).report
    assert report.core == core().name
    assert report.handed_over == core().reason
    assert report.cost == pytest.approx(1557.005, rel=1e-5)


def test_the_report_tells_how_it_was_found():
    with using("python"):
        report = minsnap.plan(CORNERS, DURATIONS, corridor=0.3).report
    assert report.solver == "daqp"
    assert report.fallback == ()
    assert report.rounds > 1
    assert report.rows > 0
    assert report.cost == pytest.approx(1557.005, rel=1e-5)
    assert 0.0 <= report.corridor_margin < 1e-4
    assert report.milliseconds > 0.0
    free = minsnap.plan(CORNERS, DURATIONS).report
    assert (free.solver, free.rounds, free.rows, free.corridor_margin) == ("banded", 0, 0, None)


def test_the_same_question_has_the_same_answer():
    asked = {"waypoints": CORNERS, "durations": DURATIONS, "corridor": 0.3}
    one, other = minsnap.plan(**asked), minsnap.plan(**asked)
    assert (one.control_points == other.control_points).all()


def test_two_waypoints_are_enough():
    traj = minsnap.plan([(0, 0, 0), (1, 2, 3)], total_time=2.0, corridor=0.1)
    assert traj.cost() == pytest.approx(100_800.0 * 14.0 / 2.0**7)
    assert traj(1.0) == pytest.approx([0.5, 1.0, 1.5])


def test_importing_the_package_loads_nothing_heavy():
    heavy = ("scipy", "matplotlib", "qpsolvers", "pandas", "typer")
    code = f"import sys, minsnap; print([name for name in {heavy} if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


# Tubes from rest to rest take a way of their own to the native core.


@pytest.mark.parametrize("width", [1.0, 0.3, 0.05, 0.001])
@pytest.mark.parametrize("degree", [5, 7, 9])
def test_the_short_way_to_a_tube_is_the_long_one(width, degree):
    points = [(0, 0, 1), (8, 0, 1), (8, 4, 1), (0, 4, 2), (0, 0, 1)]
    short = minsnap.plan(points, durations=[4, 2, 4, 2], corridor=width, degree=degree)
    long = minsnap.plan(points, durations=[4, 2, 4, 2], corridor=minsnap.Tube(width), degree=degree)
    assert np.allclose(short.control_points, long.control_points, rtol=1e-7, atol=1e-7)
    assert np.allclose(short.breaks, long.breaks, rtol=1e-14)
    assert short.report.core == long.report.core
    assert short.report.cost == pytest.approx(long.report.cost, rel=1e-6)
    assert short.report.corridor_margin == pytest.approx(long.report.corridor_margin, abs=1e-6 * width)
    assert minsnap.certify(short, waypoints=points, corridor=width).ok


@pytest.mark.parametrize("width", [True, "0.3", np.nan, np.inf, -1.0, 0.0])
def test_a_width_that_is_none_is_refused_as_ever(width):
    points = [(0, 0), (1, 0), (1, 1)]
    if width is True or width == "0.3":
        assert minsnap.plan(points, durations=[1, 1], corridor=width).report.corridor_margin >= 0.0
    else:
        with pytest.raises(minsnap.errors.CorridorError):
            minsnap.plan(points, durations=[1, 1], corridor=width)


def test_a_lap_goes_on_to_its_first_waypoint():
    """Of an array, a list with a gate, and one that is closed already; ends that are nearly one point are refused."""
    points = np.array([(0, 0, 1), (3, 0, 1), (3, 2, 1.5)], dtype=float)
    open_lap = minsnap.plan(points, [2.0, 1.5, 2.5], closed=True)
    lap = minsnap.plan([*points, points[0]], [2.0, 1.5, 2.5], closed=True)
    assert np.array_equal(open_lap.control_points, lap.control_points) and open_lap.legs == 3
    gate = minsnap.Gate(points[0], (1, 0, 0), 1.0)
    assert minsnap.plan([gate, *points[1:]], [2.0, 1.5, 2.5], closed=True).legs == 3
    with pytest.raises(WaypointError, match="the last waypoint to be the first one"):
        minsnap.plan([*points, points[0] + 1e-9], [2.0, 1.5, 2.5], closed=True)
    with pytest.raises(WaypointError, match="the last waypoint to be the first one"):
        minsnap.plan(points, [2.0, 1.5], closed=True)


def test_waypoints_in_kilometres_are_doubted():
    tiny = minsnap.plan([(0, 0, 0.001), (0.003, 0, 0.001), (0.003, 0.005, 0.001)], [1.0, 1.0])
    assert any("if they are kilometres" in note for note in tiny.report.notes)
