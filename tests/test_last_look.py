"""The last look at a plan: it refuses what leaves a wall, a limit, a waypoint, a pin, a continuity or a time."""

from dataclasses import replace

import numpy as np
import pytest

import minsnap
from minsnap import Boxes, HalfSpaces, Limits, RoundTube, SolverError, Tube
from minsnap.basics.checks import DERIVATIVES
from minsnap.durations import allocate, resting, within_limits
from minsnap.durations.refused_times import AskedTimes
from minsnap.durations.timing import Timed
from minsnap.last_look import fault
from minsnap.native.free_optimum import resting_optimum
from minsnap.native.library import core
from minsnap.native.quick_look import keeps
from minsnap.optimisation.task import Task
from minsnap.planning import plan_many as batches

POINTS = np.array([(0, 0, 1), (4, 0, 1), (4, 3, 1), (0, 3, 1)], dtype=float)
TIMES = [2.0, 1.5, 2.0]
BOXES = Boxes(np.minimum(POINTS[:-1], POINTS[1:]) - 0.25, np.maximum(POINTS[:-1], POINTS[1:]) + 0.25)
SLOW = HalfSpaces([(1, 0, 0), (0, 1, 0)], [3.2, 3.1], order=1)
native = pytest.mark.skipif(core().library is None, reason="the Python core is in use")
SOFT = HalfSpaces((1, 0, 0), 3.5, order=2)


@pytest.mark.parametrize(
    "corridor", [0.3, RoundTube(0.3), BOXES, SLOW, SOFT, [BOXES, SLOW], [Tube(0.6), SLOW]], ids=repr
)
@pytest.mark.parametrize(
    "asked", [{"durations": TIMES}, {"limits": Limits(speed=4.0), "pieces": 1}, {"total_time": 5.5}], ids=str
)
def test_a_wall_that_the_solver_does_not_know_is_seen(monkeypatch, corridor, asked):
    """One wall after another is switched off inside, after the question is taken and before it is solved."""
    constraints = corridor if isinstance(corridor, list) else [corridor]
    asked = {**asked, "yaw": 0.1}
    assert minsnap.certify(minsnap.plan(POINTS, corridor=corridor, **asked), POINTS, corridor).ok
    solve, seen = allocate._choose_times, 0
    for off in range(len(constraints)):

        def without(task, *others, off=off):
            return solve(replace(task, walls=[*task.walls[:off], *task.walls[off + 1 :]]), *others)

        monkeypatch.setattr(allocate, "_choose_times", without)
        monkeypatch.setattr(AskedTimes, "in_other_times", lambda *others: None)
        monkeypatch.setattr(within_limits, "at_rest_everywhere", lambda *others: None)
        with pytest.raises(SolverError, match=r"refused at the last look: it leaves the .* by [\d.e-]+ at"):
            minsnap.plan(POINTS, corridor=corridor, **asked)
        seen += 1
    assert seen == len(constraints)


def test_a_limit_that_the_solver_does_not_know_is_seen(monkeypatch):
    solve, faster = allocate._choose_times, Limits(speed=9.0)

    def loose(task, timing, *others):
        return solve(task, replace(timing, limits=faster), *others)

    monkeypatch.setattr(allocate, "_choose_times", loose)
    monkeypatch.setattr(AskedTimes, "in_other_times", lambda *others: None)
    monkeypatch.setattr(within_limits, "at_rest_everywhere", lambda *others: None)
    with pytest.raises(SolverError, match="last look: speed reaches .* where 3 is allowed"):
        minsnap.plan(POINTS, limits=Limits(speed=3.0))


def task_of(curve, **changes):
    """Return what a curve from rest to rest keeps, with changes."""
    points = np.array(curve(curve.leg_breaks))
    pins = {k: {order: np.zeros(3) for order in (1, 2, 3)} for k in (0, len(points) - 1)}
    asked = {"pins": pins, "half": 4, "continuity": 3, "closed": False, "pieces": 1, "walls": (), "solver": "auto"}
    still = np.zeros(points.shape)
    return Task(points, **({"lower": still, "upper": still} | asked | changes))


def test_what_was_not_asked_for_is_named():
    curve = minsnap.plan(POINTS, durations=TIMES)
    assert fault(task_of(curve).conditions, curve, None, np.array(TIMES)) is None
    assert "waypoint" in fault(replace(task_of(curve), waypoints=POINTS + [0, 0, 1e-6]).conditions, curve, None)
    assert "other times" in fault(task_of(curve).conditions, curve, None, 5.6)
    assert "other times" in fault(task_of(curve).conditions, curve, None, np.array([2.0, 1.4, 2.1]))
    moving = {0: {1: np.array([1e-6, 0, 0])}, 3: {}}
    assert "derivative 1 at waypoint 0" in fault(task_of(curve, pins=moving).conditions, curve, None)
    assert "derivative 2 at waypoint 2" in fault(task_of(curve, pins={2: {2: np.zeros(3)}}).conditions, curve, None)
    points = curve.control_points.copy()
    points[1, 1] += 1e-6
    assert "continuous up to order 0" in fault(
        task_of(curve).conditions, minsnap.Trajectory(points, curve.durations, curve.yaw, curve.pieces), None
    )
    lap = minsnap.plan([*POINTS, POINTS[0]], durations=[*TIMES, 1.5], closed=True)
    closed = task_of(lap, pins={}, closed=True)
    assert fault(closed.conditions, lap, None) is None
    open_lap = minsnap.plan([*POINTS, POINTS[0]], durations=[*TIMES, 1.5], start={"velocity": (1, 0, 0)})
    assert "derivative 1 at the end of the lap" in fault(closed.conditions, open_lap, None)


def test_a_margin_counts_for_the_very_curve_alone():
    """A stretched curve, or a wall that was not known, is proved anew."""
    task = task_of(minsnap.plan(POINTS, durations=TIMES), walls=BOXES.walls(POINTS))
    found: list[Timed] = []
    timing = allocate.Timing(durations=TIMES)
    found.append(allocate.plan_timed(task, timing))
    solved, curve = found[0].solved, found[0].trajectory
    assert solved.inside and len(solved.proved_margins(curve)) == len(task.walls)
    assert solved.proved_margins(curve.with_yaw(curve.yaw))
    assert not solved.proved_margins(curve.stretched(1.0 + 1e-15))
    narrower = Boxes(BOXES.lower + 0.2, BOXES.upper - 0.2).walls(POINTS)
    assert "it leaves the box" in fault(
        replace(task, walls=narrower).conditions, curve, None, margins=solved.proved_margins(curve)
    )


@native
def test_a_tube_that_the_quick_way_makes_too_wide_is_seen(monkeypatch):
    """The native core is told of another tube; the look at what comes back hands the question over."""
    solve = resting.tube_optimum
    quick = minsnap.plan(POINTS, durations=TIMES, corridor=0.1)
    monkeypatch.setattr(resting, "tube_optimum", lambda p, t, widths, half: solve(p, t, np.array(1.5 * widths), half))
    assert minsnap.certify(minsnap.plan(POINTS, durations=TIMES, corridor=0.1), POINTS, 0.1).ok
    assert resting.resting_plan(POINTS, TIMES, None, 0.1, 7) is None
    monkeypatch.undo()
    again = resting.resting_plan(POINTS, TIMES, None, 0.1, 7)
    assert again is not None and np.array_equal(again.control_points, quick.control_points)


@native
@pytest.mark.parametrize("off", range(3))
def test_a_tube_that_a_batch_makes_too_wide_is_seen(monkeypatch, off):
    """One leg's tube after another is wider inside; what comes back is inside of the one asked for."""
    solve, widened = batches.many_tubes, np.tile(np.where(np.arange(3) == off, 2.0, 1.0), 4)
    monkeypatch.setattr(batches, "many_tubes", lambda chains, w, *rest: solve(chains, widened * w, *rest))
    many = minsnap.plan_many(np.stack([POINTS] * 4), durations=TIMES, corridor=0.1)
    assert all(minsnap.certify(curve, POINTS, 0.1).ok for curve in many)


@native
@pytest.mark.parametrize("dim", [1, 2, 3, 4])
@pytest.mark.parametrize("half", [2, 3, 4, 5, 6])
def test_the_native_look_sees_every_control_point(dim, half):
    """Each control point of a free curve decides about a waypoint, a joint or rest."""
    points = np.random.default_rng(dim).normal(size=(4, dim))
    curve = resting_optimum(points, np.array(TIMES), half)
    asked = points, np.array(TIMES)
    assert keeps(*asked, curve, half - 1, half - 1)
    assert not keeps(*asked, curve, half - 1, half)
    assert not keeps(points, np.array(TIMES) * [1.0, 1.0001, 1.0], curve, half - 1, half - 1)
    for place in np.ndindex(curve.shape):
        changed = curve.copy()
        changed[place] += 1e-4
        assert not keeps(*asked, changed, half - 1, half - 1), place


@native
@pytest.mark.parametrize("half", [2, 3, 4, 5, 6])
def test_the_native_look_sees_every_derivative_at_the_ends(half):
    draw = np.random.default_rng(half)
    states, times = draw.normal(size=(2, half - 1, 3)), np.array(TIMES)
    named = [dict(zip(DERIVATIVES[1:half], state, strict=True)) for state in states]
    curve = np.array(minsnap.plan(POINTS, TIMES, degree=2 * half - 1, start=named[0], end=named[1]).control_points)
    asked = POINTS, times, curve, half - 1, half - 1
    assert keeps(*asked, states=states)
    assert not keeps(*asked)
    for place in np.ndindex(states.shape):
        other = states.copy()
        other[place] += 1e-6
        assert not keeps(*asked, states=other), place


@native
def test_the_native_look_sees_every_side_of_a_tube():
    points = np.array(POINTS) + [(0, 0, 0), (0, 0.1, 0.3), (0.2, 0, 0), (0, 0, 0.4)]
    curve = np.array(minsnap.plan(points, durations=TIMES, corridor=0.1).control_points)
    widths = np.array([0.1, 0.1, 0.1])
    assert keeps(points, np.array(TIMES), curve, 3, 3, widths)
    assert keeps(points, np.array(TIMES), curve, 3, 3, np.array(0.1))
    path, seen = minsnap.plan(points, durations=TIMES, corridor=0.1), []
    for leg in range(3):
        narrow = widths * np.where(np.arange(3) == leg, 0.9, 1.0)
        seen.append(keeps(points, np.array(TIMES), curve, 3, 3, narrow))
        assert seen[-1] == minsnap.certify(path, points, narrow).ok
    assert not all(seen)
