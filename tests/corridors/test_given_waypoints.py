"""Waypoints as callers have them: by name, of three coordinates, and of the size of metres."""

import warnings

import numpy as np
import pandas
import pytest

import minsnap
from minsnap import Limits
from minsnap.errors import MagnitudeWarning, WaypointError

POINTS = np.array([[0.0, 0.0, 1.0], [4.0, 0.0, 1.0], [4.0, 3.0, 2.0]])
FRAME = pandas.DataFrame({"t": [0.0, 4.0, 7.5], "x": POINTS[:, 0], "y": POINTS[:, 1], "z": POINTS[:, 2]})


def test_columns_of_a_data_frame_are_used_by_name():
    traj = minsnap.plan(FRAME)
    assert traj.dim == 3 and traj.breaks == pytest.approx([0.0, 4.0, 7.5])
    assert traj(traj.breaks) == pytest.approx(POINTS)
    shuffled = minsnap.plan(FRAME[["z", "y", "t", "x"]])
    assert np.array_equal(shuffled.control_points, traj.control_points)


def test_a_time_that_is_given_takes_precedence_over_the_table():
    assert minsnap.plan(FRAME, durations=(1.0, 2.0)).duration == pytest.approx(3.0)
    assert minsnap.plan(FRAME, total_time=5.0).duration == pytest.approx(5.0)
    assert (
        minsnap.plan(FRAME, limits=Limits(speed=2.0), search=minsnap.Search(split="distance")).max_norm(1)[0]
        <= 2.0 + 1e-6
    )


@pytest.mark.parametrize(
    "table",
    [
        {"X": [0.0, 4.0, 4.0], "Y": [0.0, 0.0, 3.0], "duration": [2.0, 1.0, np.nan], "yaw": [0.0, 1.0, 2.0]},
        np.array(
            [(0, 0, 0, 0.0), (4, 0, 1, 2.0), (4, 3, 2, 3.0)],
            dtype=[("x", float), ("y", float), ("yaw", float), ("t", float)],
        ),
        pandas.DataFrame({"x": [0, 4, 4], "y": [0, 0, 3], "yaw": [0, 1, 2], "time": [3, 5, 6]}),
    ],
)
def test_any_table_with_names_gives_points_headings_and_durations(table):
    traj = minsnap.plan(table)
    assert traj(traj.breaks) == pytest.approx(POINTS[:, :2])
    assert np.diff(traj.breaks) == pytest.approx([2.0, 1.0]) and traj.yaw(traj.breaks) == pytest.approx([0, 1, 2])


def test_a_table_of_places_alone_leaves_the_times_to_others():
    table = {"x": [0.0, 4.0, 4.0], "y": [0.0, 0.0, 3.0]}
    assert minsnap.plan(table, durations=(1.0, 2.0)).dim == 2
    first = minsnap.plan({**table, "duration": [np.nan, 1.0, 2.0]})
    assert first.breaks == pytest.approx([0.0, 1.0, 3.0])


def test_a_data_frame_without_names_is_its_numbers():
    assert minsnap.plan(pandas.DataFrame(POINTS), total_time=3.0).dim == 3


@pytest.mark.parametrize(
    ("table", "message"),
    [
        (FRAME.assign(vx=0.0), "the column 'vx': select x, y and z"),
        (FRAME[["x", "z"]], "the columns x, z"),
        (FRAME.assign(duration=1.0), "duration and t both say when"),
        (FRAME.assign(t=[0.0, 2.0, 1.0]), "waypoint 2 is passed at t = 1 s, not after waypoint 1"),
        (FRAME.assign(t=[0.0, 1.0, 1.0]), "waypoint 2 is passed at t = 1 s, not after waypoint 1"),
        ({"x": [0, 1, 2], "y": [0, 1, 2], "duration": [1.0, np.nan, 1.0]}, "leave the duration of the first"),
        (FRAME.assign(x=["a", "b", "c"]), "the column x of the waypoints must be numbers"),
        ({"x": [0, 1], "y": [0, 1], "duration": [1.0, 2.0]}, "leave the duration of the first or the last one empty"),
        (
            {"x": [0, 1, 2], "y": [0, 1, 2], "duration": [np.nan, np.nan, 1.0]},
            "leave the duration of the first or the last one empty",
        ),
    ],
)
def test_a_table_that_is_not_clear_is_refused(table, message):
    with pytest.raises(WaypointError, match=message):
        minsnap.plan(table)


def test_an_array_whose_rows_are_x_y_and_z_is_refused():
    points = np.random.default_rng(0).normal(size=(3, 5))
    for timing in ({"durations": (1.0, 1.0)}, {"total_time": 2.0}):
        with pytest.raises(WaypointError, match="3 rows of 5 coordinates: give rows of x, y, z .transpose"):
            minsnap.plan(points, **timing)
    assert minsnap.plan(points.T, durations=(1.0,) * 4).dim == 3


def test_more_than_three_coordinates_are_planned():
    points = np.random.default_rng(0).normal(size=(4, 5))
    assert minsnap.plan(points, durations=(1.0,) * 3, start={"velocity": np.ones(5)}).dim == 5
    assert minsnap.plan(points, total_time=3.0).dim == 5


def test_many_problems_of_four_coordinates_are_planned():
    points = np.random.default_rng(1).normal(size=(3, 4, 4))
    found = minsnap.plan_many(points, durations=np.ones(3), corridor=0.5)
    assert [traj.dim for traj in found] == [4, 4, 4]


@pytest.mark.parametrize(
    ("points", "message"),
    [
        ([(0, 0, 1000), (1500, 0, 1000), (1500, 2000, 1200)], "extend over 2000 m: if they are millimetres"),
        ([(0.5, 0.25, 1200.5), (1500.25, 3.0, 1200.0)], "millimetres"),
        ([(47.3977, 8.5456, 10.0), (47.3981, 8.5460, 12.0)], r"near \(47.3977, 8.5456\) .* latitudes and longitudes"),
        ([(47.3977, 8.5456), (47.3981, 8.5460)], "latitudes"),
        ([(1.5, 0.0), (1.5001, 0.0)], "latitudes"),
        ([(47.3977, 8.5456, 10.0), (47.4977, 8.6456, 12.0)], "latitudes"),
        ([(0, 0, 100), (1200, 0, 100), (1200, 900, 150)], "by 1000, and by 100 if they are centimetres"),
        ([(0, 0), (1500, 0)], "millimetres"),
    ],
)
def test_numbers_of_another_unit_are_warned_of(points, message):
    with pytest.warns(MagnitudeWarning, match=message):
        minsnap.plan(points, durations=np.full(len(points) - 1, 100.0))
    with pytest.warns(MagnitudeWarning, match=message):
        minsnap.plan(points, total_time=100.0, search=minsnap.Search(split="distance"))


@pytest.mark.parametrize(
    "points",
    [
        POINTS,
        POINTS * 100.0,
        POINTS[:, :2] + 700.0,
        POINTS * 0.02,
        [(0, 0, 0), (0, 0, 0.01)],
        POINTS - 5e5,
        [(0.5, 0.25), (1500.25, 3.5)],
        [(700.0, 700.0), (700.0001, 700.0)],
        [(180.5, 0.0), (180.5001, 0.0)],
        [(0.5, 0.5, 50.0), (0.5001, 0.5, 50.0)],
        [(5.0, 5.0), (5.0, 5.0)],
        [(47.0,), (47.0001,)],
        [(5.0, 5.0), (5.0001, 5.0), (9.0, 9.0)],
    ],
)
def test_metres_are_not_warned_of(points):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        minsnap.plan(points, durations=np.full(len(points) - 1, 10.0))


@pytest.mark.parametrize("yaw", [90.0, [0.0, 45.0, 170.0]])
def test_a_yaw_that_may_be_in_degrees_is_warned_of(yaw):
    points = [(0, 0, 1), (2, 0, 1), (2, 2, 1)]
    with pytest.warns(MagnitudeWarning, match="if it is degrees, give radians"):
        minsnap.plan(points, durations=[2, 2], yaw=yaw)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        minsnap.plan(points, durations=[2, 2], yaw=np.radians(yaw))


def test_a_thrust_that_may_be_in_newtons_is_warned_of():
    with pytest.warns(MagnitudeWarning, match="max_thrust is 20 times the weight: if it is newtons"):
        Limits(max_thrust=20.0)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        Limits(max_thrust=5.0)
