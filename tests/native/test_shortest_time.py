"""The native search for the shortest time at its border."""

from dataclasses import replace

import numpy as np
import pytest

from minsnap import Limits
from minsnap.durations.shortest_question import question_of
from minsnap.native.library import core, using
from minsnap.native.shortest_time import Guess, Watch, search_shortest
from minsnap.planning.planner import task_of
from minsnap.planning.request import PlanRequest

pytestmark = pytest.mark.skipif(core().name != "native", reason="there is no native core")

CORNERS = np.array([(0, 0, 1), (8, 0, 1), (8, 4, 1), (0, 4, 1)], dtype=float)


def question(points=CORNERS, limits=None, pieces=1, closed=False):
    task = task_of(PlanRequest(waypoints=points, corridor=0.4, closed=closed, pieces=pieces))
    return question_of(task, limits or Limits(speed=3.0, acceleration=6.0), False)


go_on = Watch(lambda *_: False)


@pytest.mark.parametrize("pieces", [1, 3])
def test_the_curve_found_is_smooth_passes_the_waypoints_and_is_what_its_knots_say(pieces):
    found = search_shortest(question(pieces=pieces), go_on)
    assert not found.stopped and len(found.durations) == pieces * (len(CORNERS) - 1)
    assert found.points[::pieces, 0] == pytest.approx(CORNERS[:-1], abs=1e-12)
    values = found.points
    for order in range(4):
        starts, ends = values[:, 0], values[:, -1]
        size = np.abs(values).max()
        assert starts == pytest.approx(found.knots[:-1, order], abs=1e-9 * size)
        assert ends == pytest.approx(found.knots[1:, order], abs=1e-9 * size)
        values = (values.shape[1] - 1) * np.diff(values, axis=1) / found.durations[:, None, None]


@pytest.mark.parametrize("pieces", [1, 2])
def test_a_lap_ends_as_it_begins_and_in_motion(pieces):
    found = search_shortest(question(np.concatenate((CORNERS, CORNERS[:1])), pieces=pieces, closed=True), go_on)
    assert found.knots[0] == pytest.approx(found.knots[-1], abs=1e-12)
    assert np.linalg.norm(found.knots[0, 1]) > 0.5


def test_flight_times_scale_with_lengths_and_times():
    found = search_shortest(question(), go_on)
    for length, time in ((1e3, 1.0), (1e-3, 1.0), (1.0, 1e2), (1.0, 1e-2)):
        limits = Limits(speed=3.0 * length / time, acceleration=6.0 * length / time**2)
        task = task_of(PlanRequest(waypoints=length * CORNERS, corridor=0.4 * length))
        other = search_shortest(question_of(task, limits, False), go_on)
        assert other.durations.sum() == pytest.approx(time * found.durations.sum(), rel=2e-4)


def test_turning_and_moving_a_course_changes_nothing():
    found = search_shortest(question(), go_on)
    turned = search_shortest(question(CORNERS[:, [1, 0, 2]] * (1, -1, 1) + (5.0, -7.0, 3.0)), go_on)
    assert turned.durations == pytest.approx(found.durations, rel=1e-3)


def test_a_poll_ends_the_search_and_what_it_raises_is_raised():
    told = []
    stopped = search_shortest(question(), Watch(lambda totals, *_: told.extend(totals) or len(told) == 3, live=True))
    assert stopped.stopped and len(told) == 3

    def broken(*_):
        raise ZeroDivisionError("of the caller")

    with pytest.raises(ZeroDivisionError, match="of the caller"):
        search_shortest(question(), Watch(broken, live=True))


def test_all_iterations_and_their_work_are_told_whether_one_by_one_or_together():
    told = {}
    for live in (True, False):
        heard = []
        watch = Watch(lambda *new, heard=heard: heard.append(new), live, 4, 1e-4, 0.5, work=7.0)
        found = search_shortest(question(), watch)
        totals = [total for new, _, _ in heard for total in new]
        told[live] = totals, heard[-1][1], found.durations.tolist()
    assert told[True] == told[False] and told[True][1] > 7.0 + 0.5 * len(told[True][0])


def test_a_search_ends_after_its_work_or_where_the_time_vanishes():
    told = []
    spent = search_shortest(question(), Watch(lambda new, *_: told.extend(new), iteration_work=1.0, worth=4.5))
    assert spent.stopped and len(told) == 5
    assert search_shortest(question(), Watch(lambda *_: False, longest=1e9, vanishing=1e-6)).stopped


def test_what_is_malformed_or_unknown_is_not_answered():
    good = question()
    beyond = good.sets[0].changed(leg=good.sets[0].kept["leg"] + 3)
    assert search_shortest(replace(good, sets=[beyond, *good.sets[1:]]), go_on) is None
    assert search_shortest(replace(good, sets=[good.sets[0].changed(order=5)]), go_on) is None
    assert search_shortest(replace(good, parts=(10**6,)), go_on) is None
    with using("python"):
        assert search_shortest(good, go_on) is None


def test_a_plan_is_searched_on_from_only_in_its_own_pieces():
    first = search_shortest(question(), go_on)
    guess = Guess(1, first.durations, first.knots)
    again = search_shortest(replace(question(), guess=guess, parts=(), planned=True), go_on)
    assert again.durations.sum() == pytest.approx(first.durations.sum(), rel=1e-3)
    assert search_shortest(replace(question(), guess=guess, parts=(3,), planned=True), go_on) is None
