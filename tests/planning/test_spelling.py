"""What several calls take is spelled the same in all of them, and means the same."""

import warnings

import numpy as np
import pytest

import minsnap
from minsnap.errors import TimingError

POINTS = np.array([(0.0, 0.0, 1.0), (4.0, 0.0, 1.0), (4.0, 3.0, 1.0)])
ROOM = ((-0.05, -0.05, 0.0), (4.05, 4.0, 2.0))
LIMITS = minsnap.Limits(speed=2.0, acceleration=4.0)
LANES = [POINTS[:2], POINTS[:2] + (0.0, 3.0, 0.0)]


@pytest.mark.parametrize(
    "corridor", [None, 0.3, [0.3, 0.2], minsnap.Sampled(0.3)], ids=["none", "one", "each", "sampled"]
)
def test_a_room_is_a_wall_besides_the_corridor(corridor):
    here = minsnap.plan(POINTS, [3.0, 2.0], corridor=corridor, room=ROOM)
    whole = corridor.corridor if isinstance(corridor, minsnap.Sampled) else corridor
    inside = [minsnap.Room(*ROOM)] if whole is None else [whole, minsnap.Room(*ROOM)]
    walls = minsnap.Sampled(inside) if isinstance(corridor, minsnap.Sampled) else inside
    assert np.array_equal(here.control_points, minsnap.plan(POINTS, [3.0, 2.0], corridor=walls).control_points)
    outside = minsnap.plan(POINTS, [3.0, 2.0], corridor=corridor)
    assert not np.array_equal(here.control_points, outside.control_points)


@pytest.mark.parametrize("asked", [{"durations": [3.0, 2.0], "room": ROOM}, {"limits": LIMITS, "room": ROOM}])
def test_many_plans_take_a_room_as_one_does(asked):
    many = minsnap.plan_many(np.stack([POINTS, POINTS + (0.0, 0.01, 0.0)]), **asked)
    assert np.array_equal(many[0].control_points, minsnap.plan(POINTS, **asked).control_points)


def test_many_plans_search_as_one_does():
    search = minsnap.Search(split="distance")
    many = minsnap.plan_many([POINTS, POINTS[:2]], total_time=6.0, search=[search, None])
    assert np.array_equal(many[0].durations, minsnap.plan(POINTS, total_time=6.0, search=search).durations)
    assert not np.array_equal(many[0].durations, minsnap.plan(POINTS, total_time=6.0).durations)


def test_a_fleet_takes_the_limit_of_time_of_a_search():
    fleet = minsnap.plan_fleet(LANES, LIMITS, 0.3, search=minsnap.Search(time_limit=60.0))
    with pytest.warns(DeprecationWarning, match="search=Search") as told:
        assert minsnap.plan_fleet(LANES, LIMITS, 0.3, time_limit=60.0).duration == fleet.duration
    assert told[0].filename == __file__
    with pytest.raises(TimingError, match="time_weight"):
        minsnap.plan_fleet(LANES, LIMITS, 0.3, search=minsnap.Search(time_weight=2.0))


@pytest.mark.parametrize(
    ("called", "named", "first"),
    [
        (lambda: minsnap.plan(POINTS, [3.0, 2.0], None, None, 0.3, 3, 9), {"continuity": 3, "degree": 9}, "continuity"),
        (lambda: minsnap.plan(POINTS, [3.0, 2.0], None, None, 0.3, 3), {"continuity": 3}, "continuity"),
    ],
)
def test_arguments_by_their_place_work_with_a_warning(called, named, first):
    with pytest.warns(DeprecationWarning, match=f"{first}=") as told:
        curve = called()
    assert told[0].filename == __file__
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert np.array_equal(
            curve.control_points, minsnap.plan(POINTS, [3.0, 2.0], corridor=0.3, **named).control_points
        )


def test_a_replanner_and_a_fleet_take_a_room_by_its_place_with_a_warning():
    with pytest.warns(DeprecationWarning, match="room="):
        minsnap.Replanner(LIMITS, None, ROOM)
    with pytest.warns(DeprecationWarning, match="room="):
        minsnap.plan_fleet(LANES, LIMITS, 0.3, ((-1, -1, 0), (5, 5, 3)))


def test_what_is_named_twice_is_refused_by_python():
    with pytest.raises(TypeError):
        minsnap.plan(POINTS, [3.0, 2.0], None, None, 0.3, 3, continuity=4)


CALLS = {
    "plan_many": lambda progress: minsnap.plan_many([POINTS, POINTS], total_time=6.0, progress=progress),
    "plan_fleet": lambda progress: minsnap.plan_fleet([POINTS[:2], POINTS[1::-1]], LIMITS, 0.3, progress=progress),
}


@pytest.mark.parametrize("name", CALLS)
def test_progress_is_called_with_one_step_and_with_its_numbers_for_a_version(name):
    steps, numbers = [], []
    CALLS[name](steps.append)
    with pytest.warns(DeprecationWarning, match="a function of one step"):
        CALLS[name](lambda first, second: numbers.append((first, second)))
    assert steps and sorted(set(steps)) == sorted(set(numbers))
    assert all(step._fields in (("done", "problems"), ("time", "least_distance")) for step in steps)
