"""Figures of races: curves coloured by speed, gates, balls and rotor thrusts, as drawn."""

import matplotlib
import numpy as np
import pytest

matplotlib.use("agg")

import minsnap
from minsnap import Ball, Gate
from minsnap.errors import InputError
from minsnap.plot import plot_overview, plot_path, plot_race, plot_rotors, plot_utilisation, save_figure
from minsnap.trajectory.samples import Samples
from minsnap.vehicle import Quadrotor, flatness_of

GATE = Gate((3, 1, 2), (1, 1, 0.5), 1.4, 1.0)
COURSE = [(0, 0, 1), GATE, (6, -1, 1), (8, 3, 2)]
VEHICLE = Quadrotor.dji_f330()


@pytest.fixture(scope="module")
def path():
    return minsnap.plan(COURSE, [1.2, 1.3, 1.2], yaw="tilt", waypoint_tolerance=Ball(0.3))


def line(ax, label):
    return next(drawn for drawn in ax.lines if drawn.get_label() == label)


@pytest.mark.slow
def test_an_overview_in_colours_has_one_scale_beside_the_places_and_no_name_over_them(path):
    figure = plot_overview(path, colour_by="speed", title="in colours")
    above, below = figure.subfigs[0].axes
    assert [len(ax.child_axes) for ax in (above, below)] == [1, 0]
    figure.canvas.draw()
    place, scale = above.get_window_extent(), above.child_axes[0].get_window_extent()
    assert place.x1 < scale.x0 < place.x1 + 0.1 * place.width and scale.height == pytest.approx(place.height)
    assert above.get_legend().get_window_extent().y0 >= place.y1


def test_the_colour_of_a_segment_is_its_speed(path):
    ax = plot_path(path, colour_by="speed")
    (curve,) = [found for found in ax.collections if found.get_array() is not None]
    segments, speeds = np.array(curve.get_segments()), np.array(curve.get_array())
    t = np.linspace(0.0, path.duration, len(segments) + 1)
    assert segments[:, 0] == pytest.approx(path(t[:-1])[:, :2])
    middle = np.linalg.norm(path((t[1:] + t[:-1]) / 2.0, 1), axis=1)
    assert speeds == pytest.approx(middle, abs=1e-3 * middle.max())
    assert curve.get_clim() == pytest.approx((0.0, middle.max()), rel=1e-3)
    low, high = ax.get_xlim()
    assert low < path(t)[:, 0].min() and path(t)[:, 0].max() < high


@pytest.mark.parametrize("view", ["xy", "xz", "3d"])
def test_gates_and_balls_are_drawn_where_they_are(path, view):
    ax = plot_path(path, view=view, waypoints=COURSE, tolerance=Ball(0.3))
    axes = {"xy": [0, 1], "xz": [0, 2], "3d": [0, 1, 2]}[view]
    gate, ball = line(ax, "gates"), line(ax, "balls")
    drawn = np.array(gate.get_data_3d() if view == "3d" else gate.get_data()).T
    assert drawn == pytest.approx(np.concatenate((GATE.corners, GATE.corners[:1]))[:, axes])
    ring = np.array(ball.get_data_3d() if view == "3d" else ball.get_data()).T
    distance = np.linalg.norm(ring - np.array(COURSE[2], dtype=float)[axes], axis=1)
    assert distance == pytest.approx(0.3)
    dots = line(ax, "waypoints")
    assert len(dots.get_xdata()) == 3, "the gate is no dot"


def test_rotors_are_those_of_the_vehicle(path):
    ax = plot_rotors(path, VEHICLE)
    t = line(ax, "rotor 1").get_xdata()
    speed = flatness_of(VEHICLE, path, t).rotor_speed
    for rotor in range(4):
        thrust = VEHICLE.thrust_coefficient * speed[:, rotor] ** 2
        assert line(ax, f"rotor {rotor + 1}").get_ydata() == pytest.approx(thrust)
    levels = [drawn.get_ydata()[0] for drawn in ax.lines[4:]]
    assert levels == pytest.approx(VEHICLE.rotor_thrust_limits)


def test_the_yaw_rate_that_is_limited_is_the_spin(path):
    limits = minsnap.Limits(yaw_rate=1.0, speed=9.0)
    ax = plot_utilisation(path, limits)
    spin = next(drawn for drawn in ax.lines if drawn.get_label() == "yaw rate")
    assert np.abs(path.yaw(path.breaks, 1)).max() > 0.0 and not np.any(spin.get_ydata())


@pytest.mark.slow
def test_a_race_is_both_in_one_figure(path, tmp_path):
    figure = plot_race(path, VEHICLE, view="3d", waypoints=COURSE, tolerance=Ball(0.3), title="a race")
    assert any(ax.name == "3d" for ax in figure.axes)
    assert any(ax.get_ylabel() == "thrust [N]" for ax in figure.axes)
    save_figure(figure, tmp_path / "race.png")
    assert (tmp_path / "race.png").stat().st_size > 20_000


def test_colours_of_nothing_known_are_refused(path):
    with pytest.raises(InputError, match="colour_by is 'height'"):
        plot_path(path, colour_by="height")
    still = Samples(np.arange(3.0), np.zeros((3, 3)))
    with pytest.raises(InputError, match="no velocity"):
        plot_path(still, colour_by="speed")
    with pytest.raises(InputError, match="two or three coordinates"):
        plot_rotors(minsnap.plan([[0.0], [1.0]], [1.0]), VEHICLE)
