"""Plans by the native core against the same plans by the Python core, and what is handed over."""

import numpy as np
import pytest
from helpers.tasks import REFERENCE

import minsnap
from minsnap.native.library import core, using
from minsnap.optimisation.gradient import pressing_rows
from minsnap.optimisation.solve import solve
from minsnap.optimisation.solved_task import SolvedTask
from minsnap.planning.planner import task_of
from minsnap.planning.request import PlanRequest, plan_arguments

DURATIONS = (4.0, 2.0, 4.0, 2.0)
ROOM = ((-0.2, -0.2, 0.8), (8.2, 4.2, 1.2))

pytestmark = pytest.mark.skipif(core().library is None, reason="there is no native core")


def random_problem(seed):
    """Waypoints, durations and half-widths: 1 to 8 legs of 0.5 to 8 m in 2 or 3 dimensions, 5 cm to 1 m wide."""
    random = np.random.default_rng(seed)
    legs, dim = int(random.integers(1, 9)), int(random.integers(2, 4))
    steps = random.normal(size=(legs, dim))
    steps *= (random.uniform(0.5, 8.0, legs) / np.linalg.norm(steps, axis=1))[:, None]
    points = np.concatenate((np.zeros((1, dim)), np.cumsum(steps, axis=0))) + random.normal(size=dim)
    durations = np.linalg.norm(steps, axis=1) * random.uniform(0.5, 2.0, legs)
    return points, durations, random.uniform(0.05, 1.0, legs)


def compare(points, durations, **others):
    """The native cost is within 1e-6 of the least cost J*, the Python one now and then 1e-5 above it.

    For a convex set and the optimum x* in it, J(x - x*) <= J(x) - J*, so J(x - y) <= (1e-3 + 5.5e-3)^2 J*:
    the curves are close, too.
    """
    native = minsnap.plan(points, durations, **plan_arguments(others))
    assert native.report.core == "native", native.report.handed_over
    with using("python"):
        python = minsnap.plan(points, durations, **plan_arguments(others))
    assert python.report.core == "python"
    assert -1e-6 <= python.report.cost / native.report.cost - 1.0 <= 3e-5
    difference = minsnap.Trajectory(native.control_points - python.control_points, native.durations)
    assert difference.cost() <= 4.3e-5 * native.cost()
    assert native.report.corridor_margin >= 0.0


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(40))
def test_random_tubes_cost_the_same_as_in_python(seed):
    points, durations, widths = random_problem(seed)
    compare(points, durations, corridor=widths)


@pytest.mark.slow
@pytest.mark.parametrize(
    "others",
    [
        {"degree": 3},
        {"degree": 5},
        {"degree": 9},
        {"degree": 11},
        {"pieces": 2},
        {"closed": True},
        {"closed": True, "pieces": 3},
        {"waypoint_tolerance": 0.2},
        {"corridor": [0.3, minsnap.Room(*ROOM)]},
        {"start": {"velocity": (1.0, 0.2, 0.0)}, "end": {"acceleration": (0.0, 0.0, 0.5)}},
        {"pins": {2: {"velocity": (0.0, 1.0, 0.0)}}},
        {"continuity": 2},
        {"continuity": 1, "degree": 5, "pins": {2: {"acceleration": (1.0, 0.5, 0.0)}}},
        {"continuity": 0, "degree": 3},
        {"continuity": 4, "degree": 11, "closed": True, "pins": {1: {"snap": (1.0, 0.5, 0.0)}}},
        {"degree": 3, "limits": minsnap.Limits(jerk=5.4, snap=1.0)},
        {"continuity": 4, "pieces": 2},
        {"continuity": 6, "pieces": 3},
        {"continuity": 5, "pieces": 2, "closed": True},
        {"degree": 11, "continuity": 9, "pieces": 3},
        {"degree": 5, "continuity": 3, "waypoint_tolerance": 0.2},
        {"waypoint_tolerance": np.full(5, 0.2)},
        {"waypoint_tolerance": minsnap.Ball(np.full(5, 0.1)), "pieces": 2},
        {"waypoint_tolerance": np.full(5, 0.3), "closed": True},
    ],
)
def test_every_kind_of_task_costs_the_same_as_in_python(others):
    compare(REFERENCE, DURATIONS, **{"corridor": 0.3} | others)


@pytest.mark.parametrize(("continuity", "width"), [(4, 0.5), (5, 0.5), (6, 4.0), (6, None)])
@pytest.mark.parametrize("closed", [False, True])
def test_splines_are_as_often_differentiable_as_asked(continuity, width, closed):
    asked = {"continuity": continuity, "pieces": 2, "closed": closed, "corridor": width}
    traj = minsnap.plan(REFERENCE, np.geomspace(0.5, 6.0, 4), **asked)
    assert traj.report.core == "native", traj.report.handed_over
    assert minsnap.certify(traj).continuity == continuity
    seam = [np.abs(traj(0.0, order) - traj(traj.duration, order)).max() for order in range(1, continuity + 1)]
    sizes = [np.abs(traj.derivative(order).control_points).max() for order in range(1, continuity + 1)]
    assert not closed or (np.array(seam) <= 1e-9 * np.array(sizes)).all()


def test_boxes_and_polytopes_cost_the_same_as_in_python():
    lower, upper = [(-1, -1), (3, -1), (3, 3)], [(4, 1), (5, 4), (9, 5)]
    compare([(0, 0), (4, 0), (4, 4), (8, 4)], (4.0, 4.0, 4.0), corridor=minsnap.Boxes(lower, upper))
    normals = np.concatenate((np.eye(2), -np.eye(2)))
    sets = [(normals, np.concatenate((u, -np.array(b)))) for b, u in zip(lower, upper, strict=True)]
    compare([(0, 0), (4, 0), (4, 4), (8, 4)], (4.0, 4.0, 4.0), corridor=minsnap.Polytopes(sets))


def test_a_start_on_the_floor_is_planned_natively():
    points = np.array([(0.0, 0.0, 0.0), (4.0, 0.0, 1.0), (4.0, 4.0, 0.0)])
    compare(points, (4.0, 4.0), corridor=[minsnap.Room((-1.0, -1.0, 0.0), (5.0, 5.0, 2.0))])


def test_what_is_handed_over_says_why():
    report = minsnap.plan(REFERENCE, DURATIONS, corridor=0.3, solver="daqp").report
    assert report.core == "python"
    assert "daqp" in report.handed_over


def test_the_certificate_has_the_last_word(monkeypatch):
    monkeypatch.setattr(SolvedTask, "inside", property(lambda solved: solved.optimum.core == "python"))
    report = minsnap.plan(REFERENCE, DURATIONS, corridor=minsnap.Tube(0.3)).report
    assert report.core == "python" and "did not prove" in report.handed_over


def test_an_infeasible_corridor_is_explained_by_the_python_core():
    with pytest.raises(minsnap.errors.InfeasibleError, match="leg"):
        minsnap.plan(REFERENCE, DURATIONS, corridor=0.01, start={"velocity": (0.0, 3.0, 0.0)})


@pytest.mark.slow
@pytest.mark.parametrize("part", range(8))
def test_many_random_tubes_cost_the_same_as_in_python(part):
    for seed in range(1000 + 25 * part, 1025 + 25 * part):
        points, durations, widths = random_problem(seed)
        compare(points, durations, corridor=widths)


@pytest.mark.parametrize("pieces", [1, 3, 5])
@pytest.mark.parametrize("degree", [7, 9, 11])
@pytest.mark.parametrize("tolerance", [0.1, 0.3])
def test_zigzags_with_free_waypoints_are_planned(tolerance, degree, pieces):
    """Boxes of 0.3 m around the legs, durations of 1 and 3 s in turn: some were refused as singular."""
    for legs in (3, 6):
        points = np.array([(i, i % 2, 0.0) for i in range(legs + 1)])
        durations = np.resize([1.0, 3.0], legs)
        ends = points[:-1], points[1:]
        boxes = minsnap.Boxes(np.minimum(*ends) - 0.3, np.maximum(*ends) + 0.3)
        asked = {"corridor": boxes, "waypoint_tolerance": tolerance, "degree": degree, "pieces": pieces}
        traj = minsnap.plan(points, durations, **asked)
        assert traj.report.core == "native" and minsnap.certify(traj, corridor=boxes).ok
        assert np.abs(traj(traj.leg_breaks) - points).max() <= tolerance + 1e-9


def test_the_plane_of_a_gate_is_not_taken_for_a_wall_that_a_waypoint_touches():
    points = [(0, 0, 1), minsnap.Gate((2, 0.3, 1.2), (1, 0.5, 0.2), 1.0), (4, 1.5, 1), (6, 0, 1)]
    room = minsnap.Room((-1, -2, 0), (8, 1.5, 3))
    task = task_of(PlanRequest(waypoints=points, corridor=room))
    assert task.touches.any()
    solved = solve(task, np.array([1.5, 1.3, 1.4]))
    assert solved.optimum.core == "native" and len(solved.optimum.contacts.multiplier)
    assert pressing_rows(solved) == []


def test_pieces_that_are_too_hard_cost_no_more_than_one_polynomial_per_leg():
    draw = np.random.default_rng(0)
    points = np.cumsum(draw.normal(size=(7, 2)) * 5.0, axis=0)
    durations = 2.0 * 10.0 ** np.linspace(-1.5, 1.5, 6)[draw.permutation(6)]
    asked = {"durations": durations, "corridor": 0.01, "degree": 9}
    whole, pieces = minsnap.plan(points, **asked), minsnap.plan(points, **asked, pieces=4)
    assert minsnap.certify(pieces, points, 0.01).ok
    assert pieces.cost() <= whole.cost() * (1.0 + 1e-6)


@pytest.mark.slow
def test_pieces_that_only_a_blend_keeps_inside_give_way_to_one_polynomial_per_leg():
    points, durations = [(0.0, 0.0, 0.0), (0.879, -0.329, -0.527), (5.723, 4.206, -3.07)], [168.0, 0.0238]
    asked = {"durations": durations, "corridor": 0.0598, "degree": 11}
    whole, pieces = minsnap.plan(points, **asked), minsnap.plan(points, **asked, pieces=2)
    assert minsnap.certify(pieces, points, 0.0598).ok
    assert pieces.report.rungs == ("one polynomial per leg",)
    assert pieces.cost() <= whole.cost() * (1.0 + 1e-6)


@pytest.mark.slow
def test_a_moving_start_that_leaves_no_stop_blends_with_the_curve_of_most_room():
    points, durations = [(0.0, 0.0, 0.0), (-2.796, 1.919, 5.22), (-3.403, 3.591, 7.88)], [165.0, 0.0554]
    start = {"velocity": (-0.0085, 0.0058, 0.0158)}
    patient = minsnap.Search(time_limit=300.0)  # more than the work that a question is worth
    traj = minsnap.plan(points, durations, corridor=0.000572, degree=11, pieces=3, start=start, search=patient)
    assert traj.report.rungs[-1:] == ("blend",)
    assert minsnap.certify(traj, points, 0.000572).ok


@pytest.mark.parametrize(("degree", "asked"), [(5, {"total_time": 12.0}), (9, {"durations": [4.0, 2.0, 4.0, 3.0]})])
@pytest.mark.parametrize("corridor", [None, 0.3])
def test_laps_whose_least_cost_is_open_have_one_more_continuous_derivative(degree, asked, corridor):
    """They cost 20 to 4,000 times as much in a tube, and were refused without one."""
    lap, half = [(0, 0, 1), (8, 0, 1), (8, 4, 2), (0, 4, 1), (0, 0, 1)], (degree + 1) // 2
    low, usual = (
        minsnap.plan(lap, closed=True, corridor=corridor, degree=degree, continuity=half - more, **asked)
        for more in (2, 1)
    )
    assert low.cost() == pytest.approx(usual.cost(), rel=1e-6)
    assert minsnap.certify(low, lap, corridor=corridor).ok
