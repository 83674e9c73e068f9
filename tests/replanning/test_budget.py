"""What a budget ends: searches, ways back and certified ends stop at their deadline, and nothing is explained."""

import gc
from dataclasses import replace
from itertools import count
from time import monotonic

import numpy as np
import pytest

import minsnap
from minsnap import Boxes, Limits, Replanner
from minsnap.basics import deadline
from minsnap.basics.deadline import Deadline, LateError
from minsnap.durations.connector import connect_start, pinned_state
from minsnap.durations.stopping import Stopping
from minsnap.errors import InputError, SolverError, TimingError
from minsnap.native.library import core
from minsnap.replanning import replanner as replanner_module
from minsnap.replanning.course_ahead import course_ahead
from minsnap.replanning.horizon import Aim, NotShorterError, search_ahead
from minsnap.replanning.memory import ANSWERS, MARGIN, SKIPS, Takes
from minsnap.replanning.splice import splice_of

POINTS = np.array([(0, 0, 1), (2, 0.5, 1), (4, 0, 1.2), (6, 1, 1)], dtype=float)
LIMITS = Limits(speed=3.0, acceleration=6.0)


@pytest.fixture(scope="module")
def flown():
    return minsnap.plan(POINTS, limits=LIMITS, corridor=0.5, pieces=1)


def task_of(flown, walls, points, **changes):
    splice = splice_of(flown, 0.3, 0.1, 4)
    course = course_ahead(splice, points, None, splice.leg_start, [walls], 1)
    return replace(course.task, explains=False, **changes)


def through(width):
    return Boxes(np.minimum(POINTS[:-1], POINTS[1:]) - width, np.maximum(POINTS[:-1], POINTS[1:]) + width)


def test_a_search_past_its_deadline_ends_without_a_way_back(flown):
    task = task_of(flown, through(0.5), POINTS[1:], deadline=Deadline(monotonic() - 1.0))
    with pytest.raises(LateError):
        search_ahead(task, Aim(LIMITS), lambda curve: curve, None, 10.0)
    with pytest.raises(LateError):
        connect_start(pinned_state(task), task.walls, Limits(speed=0.5), task.deadline)


def test_what_cannot_be_flown_is_refused_without_an_explanation(flown):
    task = task_of(flown, through(0.5), POINTS[1:])
    limited = task.with_walls(LIMITS.walls(task.waypoints))
    with pytest.raises(SolverError, match="no curve was found that keeps the walls and the limits in these durations"):
        search_ahead(limited, Aim(durations=np.array([0.1, 0.1, 0.1])), lambda curve: curve, None, 10.0)


def test_answers_come_by_their_budget_on_a_clock_that_runs_with_every_reading(flown, monkeypatch):
    ticks = count()

    def running():
        return 1e-3 * next(ticks)

    monkeypatch.setattr(deadline, "thread_time", running)
    found = []
    for budget in (0.03, 0.06, 0.12, 0.25, 0.5):
        replanner = Replanner(Limits(speed=4.0, acceleration=9.0), 0.5, clock=running)
        for moved in (0.0, 0.02, -0.02):
            change = replanner.replan(flown, 0.3, POINTS[1:] + [0.0, moved, 0.0], budget)
            assert round(change.took, 6) <= budget
            found.append(change.kept)
    assert any(found) and not all(found)


def test_the_times_of_the_last_answers_are_known():
    takes = Takes()
    assert takes.most("stop", 3.0) == 3.0 and takes.usual("stop") == 0.0
    for seconds in (*np.linspace(0.1, 0.9, 49), 5.0):
        takes.add("stop", seconds)
    assert takes.most("stop") == MARGIN * 5.0
    assert 0.7 < takes.usual("stop") / MARGIN <= 0.9
    for _ in range(SKIPS - 1):
        takes.skip("stop")
    assert takes.most("stop") == MARGIN * 5.0
    takes.skip("stop")
    assert takes.most("stop") == 0.0


def test_one_slow_answer_among_few_is_no_measure():
    takes = Takes()
    for seconds, usual in ((3.0, 3.0), (1.0, 1.0), (2.0, 2.0), (9.0, 3.0)):
        takes.add("stop", seconds)
        assert takes.usual("stop") == MARGIN * usual


def test_a_stop_that_took_long_to_find_aside_does_not_make_later_budgets_too_short(flown, monkeypatch):
    now = [0.0]
    monkeypatch.setattr(deadline, "thread_time", lambda: now[0])

    def found_late(self):
        now[0] += 0.3

    replanner = Replanner(LIMITS, 0.5, clock=lambda: now[0])
    with monkeypatch.context() as patch:
        patch.setattr(Stopping, "braking", lambda self: None)
        patch.setattr(Stopping, "aside", found_late)
        patch.setattr(replanner_module.horizon, "rest_within", lambda *_: False)
        replanner.replan(flown, 0.3, POINTS[1:], 0.5)
    assert now[0] == 0.3
    assert replanner.replan(flown, 0.3, POINTS[1:], 0.1).stop is not None


def test_budgets_below_what_answers_took_are_refused_at_once_and_tried_again_later(flown, monkeypatch):
    ticks = count()
    monkeypatch.setattr(deadline, "thread_time", lambda: 1e-3 * next(ticks))
    replanner = Replanner(LIMITS, 0.5, clock=deadline.thread_time)
    replanner.replan(flown, 0.3, POINTS[1:], 1.0)
    readings, refused = [], 0
    for _ in range(2 * ANSWERS):
        before = next(ticks)
        try:
            replanner.replan(flown, 0.3, POINTS[1:], 1e-3)
        except TimingError as short:
            refused += 1
            assert "the budget is 0.001 s and a stop plan takes" in str(short)
        readings.append(next(ticks) - before)
    assert refused >= 1.8 * ANSWERS
    assert min(readings) < max(readings)


def test_an_answer_that_was_long_in_closing_does_not_end_all_searches(flown, monkeypatch):
    now = [0.0]

    def running():
        now[0] += 1e-6
        return now[0]

    monkeypatch.setattr(deadline, "thread_time", running)
    replanner, moved = Replanner(LIMITS, 0.5, clock=running), POINTS[1:] + [0.0, 0.02, 0.0]
    change = Replanner._change

    def slow(self, *values):
        now[0] += 0.3
        return change(self, *values)

    with monkeypatch.context() as patch:
        patch.setattr(Replanner, "_change", slow)
        replanner.replan(flown, 0.3, moved, 0.1)
    reasons = [replanner.replan(flown, 0.3, moved, 0.1).reason for _ in range(SKIPS + 1)]
    assert all("the budget of 0.1 s" in reason for reason in reasons[:SKIPS])
    assert "the budget" not in reasons[SKIPS]


def test_no_garbage_is_collected_within_an_answer(flown):
    replanner, collected, threshold = Replanner(LIMITS, 0.5), [], gc.get_threshold()
    gc.set_threshold(5, 2, 2)
    gc.callbacks.append(lambda *_: collected.append(True))
    try:
        replanner.replan(flown, 0.3, POINTS[1:], 10.0, began=monotonic())
        assert len(collected) <= 1, "the first objects after the answer"
        with pytest.raises(minsnap.errors.WaypointError):
            replanner.replan(flown, 0.3, [[1.0, 2.0]], 10.0, began=monotonic())
        assert gc.isenabled()
        gc.disable()
        replanner.replan(flown, 0.3, POINTS[1:], 10.0, began=monotonic())
        assert not gc.isenabled()
    finally:
        gc.callbacks.pop()
        gc.set_threshold(*threshold)
        gc.enable()


@pytest.mark.skipif(core().name != "native", reason="plans within limits need the native core")
@pytest.mark.parametrize("kind", [np.float64, np.float32, int])
def test_times_are_numbers_of_any_kind(flown, kind):
    """Also where a total time is so short that the search within limits is asked for the shortest."""
    ahead = minsnap.replan(flown, 0.3, POINTS[1:], 10.0, limits=LIMITS, corridor=0.5).trajectory.duration
    replanner = Replanner(LIMITS, 0.5, clock=lambda: kind(7))
    times = {"total_time": 1.02 * ahead, "began": kind(99)}
    change = replanner.replan(flown, np.float32(0.3), POINTS[1:] + [0.0, 0.02, 0.0], np.float64(0.1), **times)
    assert not change.kept and abs(change.trajectory.duration - 1.02 * ahead) < 1e-6
    assert type(change.took) is float


@pytest.mark.parametrize("clock", [5.0, lambda: None, lambda: "7", lambda: float("nan"), lambda: np.ones(1)])
def test_what_is_no_clock_is_refused(flown, clock):
    with pytest.raises(InputError, match="the clock"):
        Replanner(LIMITS, 0.5, clock=clock).replan(flown, 0.3, POINTS[1:])


def test_a_search_that_promises_nothing_shorter_ends(flown):
    """Not where it must be shorter than a time that it undercuts."""
    task = task_of(flown, through(0.5), POINTS[1:])
    found = search_ahead(task, Aim(LIMITS), lambda curve: curve, None, 10.0)
    assert search_ahead(task, Aim(LIMITS), lambda curve: curve, None, 10.0, 1.2 * found.curve.duration).curve.duration
    with pytest.raises(NotShorterError):
        search_ahead(task, Aim(LIMITS), lambda curve: curve, None, 10.0, 0.9 * found.curve.duration)
