"""What is drawn of a plan, against the plan itself and the vehicle's own equations."""

import numpy as np
import pytest

import minsnap
from minsnap.files.file_request import FileRequest
from minsnap.native.library import core
from minsnap.studio import path_view
from minsnap.studio import plan_drawing as drawing
from minsnap.studio.documents import example_scene
from minsnap.studio.file_panel import facts
from minsnap.studio.plan_drawing import CHARTS, ROTORS, Charts, data_with_cursor, round_up
from minsnap.studio.workbench import BenchState, planned_in_stages
from minsnap.vehicle import Quadrotor

VEHICLE = Quadrotor.crazyflie()


@pytest.fixture(scope="module")
def curve():
    return minsnap.plan([(0, 0, 1), (4, 0, 1), (4, 3, 2)], total_time=6.0, corridor=0.3)


def test_the_path_is_drawn_where_it_is_in_the_colour_of_its_speed(curve):
    points, colours, top = drawing.coloured_path(curve)
    t = np.linspace(0.0, curve.duration, len(points) + 1)
    assert points[:, 0] == pytest.approx(curve(t)[:-1], abs=1e-6)
    assert np.array_equal(points[1:, 0], points[:-1, 1])
    speed = np.linalg.norm(curve(t, 1), axis=1)
    assert top == pytest.approx(speed.max())
    assert tuple(colours[0, 0]) == tuple(drawing.SPEED_SCALE[0])
    assert tuple(drawing.speed_colours(1.0)) == tuple(drawing.SPEED_SCALE[-1])
    assert np.array_equal(colours[5, 1], drawing.speed_colours(speed[6] / top))


def light(colour):
    """Return the relative luminance of a colour of the screen (WCAG 2)."""
    shares = np.asarray(colour, dtype=np.float64) / 255.0
    linear = np.where(shares <= 0.04045, shares / 12.92, ((shares + 0.055) / 1.055) ** 2.4)
    return linear @ (0.2126, 0.7152, 0.0722)


def test_every_line_of_a_path_reads_on_a_light_page_and_on_a_dark_one():
    """Yellow on white did not."""
    lines = [*drawing.speed_colours(np.linspace(0.0, 1.0, 101)), path_view.FLIGHT, path_view.GHOST]
    for colour in lines:
        assert 1.05 / (light(colour) + 0.05) > 2.8, colour
        assert (light(colour) + 0.05) / (light((20, 20, 20)) + 0.05) > 2.8, colour


def test_colours_of_lines_are_given_as_light():
    """The page shows the curve of the screen of what it is given: colours came out pale."""
    given = drawing.blended(np.arange(256)) / 255.0
    shown = np.where(given <= 0.0031308, 12.92 * given, 1.055 * given ** (1 / 2.4) - 0.055)
    assert np.abs(255.0 * shown - np.arange(256)).max() < 12.8
    assert drawing.blended((0, 255, 255)).tolist() == [0, 255, 255]


def test_the_legend_names_what_is_drawn_and_nothing_else():
    alone = drawing.legend(3.0)
    assert "3.00" in alone and "simulated" not in alone
    assert "simulated" in drawing.legend(3.0, ("simulated", (1, 2, 3))) and "rgb(1, 2, 3)" in drawing.legend(
        3.0, ("simulated", (1, 2, 3))
    )


def test_rotor_thrusts_carry_the_vehicle(curve):
    profiles = drawing.profiles_of(curve, VEHICLE)
    bare = Quadrotor(**{name: getattr(VEHICLE, name) for name in BARE})
    without_drag = drawing.profiles_of(curve, bare)
    thrusts, weights = without_drag.curves[ROTORS].sum(axis=0), profiles.curves["thrust [weights]"][0]
    assert thrusts == pytest.approx(weights * bare.weight, rel=1e-9)
    rotors = profiles.curves[ROTORS].T
    assert rotors[0].sum() == pytest.approx(VEHICLE.weight)
    pose = drawing.pose_at(curve, VEHICLE, profiles.t[100])
    assert pose.rotors == pytest.approx(rotors[100])
    assert pose.position == pytest.approx(curve(profiles.t[100]))
    assert drawing.pose_at(curve, VEHICLE, 99.0).position == pytest.approx([4, 3, 2])


BARE = "mass inertia arm_length thrust_coefficient torque_coefficient rotor_speed_max layout".split()


def test_the_cursor_rises_at_its_instant_and_moves_no_curve():
    t, curves = np.linspace(0.0, 4.0, 5), np.array([[0.0, 1.0, 4.0, 9.0, 16.0]])
    times, values, least, most, cursor = data_with_cursor(t, curves, (-1.0, 20.0, 2.0, 18.0), 2.5)
    assert times.tolist() == [0, 1, 2, 2.5, 2.5, 2.5, 3, 4]
    assert values.tolist() == [0, 1, 4, 6.5, 6.5, 6.5, 9, 16]
    assert cursor.tolist() == [-1, -1, -1, -1, 20, -1, -1, -1]
    assert set(least) == {2.0} and set(most) == {18.0}
    assert data_with_cursor(t, curves, (0.0, 1.0, 0.0, 0.0), 77.0)[0].max() == 4.0


@pytest.mark.parametrize("value", [1e-3, 0.99, 1.0, 1.3, 9.7, 99.0, 12345.0])
def test_edges_of_plots_are_round_and_not_far_above(value):
    assert value <= round_up(value) <= 1.3 * value


class Page:
    """Takes plots, as the page does."""

    def __init__(self):
        self.plots = []

    def add_uplot(self, data, series, **how):
        self.plots.append(type("Plot", (), {"data": data, "series": series, "scales": None, **how})())
        return self.plots[-1]


def test_plots_have_a_column_for_every_series_and_the_limits_of_the_scene(curve):
    page, scene = Page(), example_scene()
    charts = Charts(page)
    limited = type(scene)(scene.waypoints, limits=(("speed", 3.0),), vehicle="crazyflie")
    charts.show(drawing.profiles_of(curve, VEHICLE), dict(limited.limits), VEHICLE, 1.0)
    assert [plot.title for plot in page.plots] == [*CHARTS, ROTORS]
    assert all(len(plot.data) == len(plot.series) for plot in page.plots)
    assert set(page.plots[0].data[-2]) == {3.0}
    assert set(page.plots[4].data[-2]) == {VEHICLE.rotor_thrust_limits[1]}
    low, _ = page.plots[1].scales["y"]["range"]
    assert page.plots[1].data[-2].max() < low


@pytest.mark.skipif(core().name != "native", reason="plans within limits need the native core")
def test_the_use_of_limits_is_said_in_their_units():
    limits = (("min_thrust", 0.5), ("speed", 2.0), ("tilt", 0.5))
    scene = FileRequest(((0, 0, 1), (4, 0, 1), (4, 3, 2)), limits=limits, rotors=0.1, vehicle="crazyflie")
    planned = list(planned_in_stages(scene, None, lambda: False))[-1]
    said = dict(facts(BenchState(scene, planned)))
    rotors = drawing.profiles_of(planned.trajectory, VEHICLE).curves[ROTORS]
    part, limit = said["rotor thrust"].split(" % of ")
    assert 0.01 * float(part) * float(limit.split()[0]) == pytest.approx(rotors.max(), rel=0.02)
    assert float(said["min rotor thrust"].split(" of at least ")[0]) == pytest.approx(rotors.min(), rel=0.02)
    assert said["min thrust"].split(" of at least ")[1].startswith("0.5 of the weight")
    assert said["speed"].startswith("100.0 % of 2 m/s")
