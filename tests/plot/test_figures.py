"""Figures: what they show is what the path is, and they are written whole."""

from __future__ import annotations

import subprocess
import sys

import matplotlib
import numpy as np
import pytest

matplotlib.use("agg")

import minsnap
from minsnap.basics.limit_kinds import KINDS
from minsnap.corridors.tubes import RoundTube, Tube
from minsnap.errors import FileError, InputError
from minsnap.limits.limits import Limits
from minsnap.plot import (
    plot_convergence,
    plot_heading,
    plot_overview,
    plot_path,
    plot_profiles,
    plot_utilisation,
    save_figure,
)
from minsnap.plot.geometry import arrow_heads, leg_bodies, outline
from minsnap.trajectory.samples import Samples

SQUARE = np.array([(0.0, 0.0, 1.0), (4.0, 0.0, 1.0), (4.0, 4.0, 1.0), (0.0, 4.0, 1.0), (0.0, 0.0, 1.0)])


@pytest.fixture
def path():
    return minsnap.helix(2.0, 0.5, laps=2.0)


class Bounds:
    """Limits as the figures read them: by name."""

    speed = 1.5
    acceleration = 4.0
    jerk = None


@pytest.mark.parametrize(("view", "chosen"), [("xy", [0, 1]), ("xz", [0, 2]), ("yz", [1, 2])])
def test_curve_is_the_position_in_the_view(path, view, chosen):
    ax = plot_path(path, view=view)
    curve = next(line for line in ax.lines if line.get_label() == "path")
    t = np.linspace(0.0, path.duration, len(curve.get_xdata()))
    assert np.column_stack([curve.get_xdata(), curve.get_ydata()]) == pytest.approx(path(t)[:, chosen])
    assert ax.get_xlabel() == f"{view[0]} [m]" and ax.get_ylabel() == f"{view[1]} [m]"


def test_given_axes_are_drawn_on_and_returned(path):
    from matplotlib.figure import Figure

    ax = Figure().add_subplot()
    assert plot_path(path, ax) is ax
    assert plot_path(path, Figure().add_subplot(projection="3d"), view="3d").name == "3d"


def test_waypoints_and_corridor_are_drawn_where_they_are():
    line = minsnap.line(constant_speed=True)
    ax = plot_path(line, corridor=0.5)
    points = next(line for line in ax.lines if line.get_label() == "waypoints")
    assert list(points.get_xdata()) == [0.0, 7.0]
    corners = ax.patches[0].get_xy()
    assert (corners.min(axis=0), corners.max(axis=0)) == (pytest.approx([0.0, 0.5]), pytest.approx([7.0, 1.5]))


def test_tube_of_a_skew_leg_has_the_width_of_the_infinity_norm():
    body = outline(leg_bodies(0.3, np.array([(0.0, 0.0), (4.0, 4.0)]))[0])
    across = body @ np.array([1.0, -1.0]) / np.sqrt(2.0)
    assert (across.min(), across.max()) == (pytest.approx(-0.3 * np.sqrt(2.0)), pytest.approx(0.3 * np.sqrt(2.0)))


def test_repeated_legs_give_one_body_and_round_tubes_are_round():
    twice = np.vstack([SQUARE, SQUARE[1:]])
    assert len(leg_bodies(Tube(0.3), twice)) == 4
    rim = leg_bodies(RoundTube(0.3), SQUARE)[0]
    assert np.hypot(rim[:, 1], rim[:, 2] - 1.0) == pytest.approx(0.3)
    assert np.minimum(np.abs(rim[:, 0]), np.abs(rim[:, 0] - 4.0)) == pytest.approx(0.0, abs=1e-12)
    assert np.ptp(rim[:, 0]) == pytest.approx(4.0)


def test_profiles_show_every_derivative_with_its_unit_and_limits(path):
    axes = plot_profiles(path, limits=Bounds())
    assert [ax.get_ylabel() for ax in axes] == [
        "position\n[m]", "velocity\n[m/s]", "acceleration\n[m/s²]", "jerk\n[m/s³]", "snap\n[m/s⁴]"
    ]  # fmt: skip
    assert axes[-1].get_xlabel() == "time [s]"
    for order, ax in enumerate(axes):
        t = ax.lines[0].get_xdata()
        drawn = np.column_stack([ax.lines[i].get_ydata() for i in range(3)])
        assert drawn == pytest.approx(path(t, order))
    assert [any(line.get_label() == "limit" for line in ax.lines) for ax in axes] == [False, True, True, False, False]


def test_coordinates_differ_in_dash_as_well_as_colour(path):
    lines = plot_profiles(path)[0].lines[:3]
    assert len({line.get_linestyle() for line in lines}) == 3
    assert len({line.get_color() for line in lines}) == 3


def test_samples_are_drawn_with_what_they_have():
    bare = Samples(np.arange(3.0), np.ones((3, 2)), velocity=np.zeros((3, 2)))
    assert len(plot_profiles(bare)) == 2
    assert len(plot_overview(bare).subfigs[1].axes) == 2


def test_curves_stand_in_two_columns_below_a_flat_path():
    figure = plot_overview(minsnap.line((0, 0, 1), (9, 0, 1)))
    figure.canvas.draw()
    place, curves = (panel.axes for panel in figure.subfigs)
    spots = [ax.get_window_extent() for ax in curves]
    assert len({round(spot.x0) for spot in spots}) == 2
    assert max(spot.y1 for spot in spots) < place[0].get_window_extent().y0
    assert place[0].get_window_extent().width > 0.7 * figure.bbox.width
    assert [ax.get_xlabel() for ax in curves] == ["", "", "time [s]", "", "time [s]"]


def test_impossible_requests_are_refused(path):
    with pytest.raises(InputError, match="xy, xz, yz, 3d"):
        plot_path(path, view="top")
    with pytest.raises(InputError, match="3 coordinates"):
        plot_path(Samples(np.arange(2.0), np.ones((2, 2))), view="3d")
    with pytest.raises(InputError, match="orders"):
        plot_profiles(path, orders=(0, 5))
    with pytest.raises(InputError, match="none"):
        plot_profiles(Samples(np.arange(2.0), np.ones((2, 2))), orders=(4,))
    with pytest.raises(InputError, match="axes"):
        plot_profiles(path, axes=[None])


@pytest.mark.slow
@pytest.mark.parametrize(("ending", "start"), [("png", b"\x89PNG"), ("svg", b"<?xml"), ("PDF", b"%PDF")])
def test_figures_are_written_by_their_ending_and_equal_ones_are_equal_files(path, tmp_path, ending, start):
    for name in ("a", "b"):
        with matplotlib.rc_context({"svg.hashsalt": "test"}):
            save_figure(plot_overview(path, view="3d"), tmp_path / f"{name}.{ending}")
    assert (tmp_path / f"a.{ending}").read_bytes().startswith(start)
    assert (tmp_path / f"a.{ending}").read_bytes() == (tmp_path / f"b.{ending}").read_bytes()


def test_other_endings_and_existing_files_are_refused(path, tmp_path):
    figure = plot_overview(path)
    with pytest.raises(FileError, match=r"\.png"):
        save_figure(figure, tmp_path / "a.jpg")
    (tmp_path / "a.png").write_text("precious")
    with pytest.raises(FileError, match="there already"):
        save_figure(figure, tmp_path / "a.png", clobber=False)
    assert (tmp_path / "a.png").read_text() == "precious"


@pytest.mark.parametrize("ending", ["png", "svg", "pdf"])
def test_a_figure_on_a_small_disk_is_one_sentence(tmp_path, ending):
    mount = ["mount", "-t", "tmpfs", "-o", "size=12k", "tmpfs", str(tmp_path)]
    if subprocess.run(mount, capture_output=True).returncode:
        pytest.skip("this user may not mount a small disk")
    try:
        with pytest.raises(FileError, match="cannot be written: No space left on device"):
            save_figure(plot_overview(minsnap.circle()), tmp_path / f"a.{ending}")
        assert not list(tmp_path.iterdir())
    finally:
        subprocess.run(["umount", str(tmp_path)], check=True)


def test_importing_the_figures_does_not_import_matplotlib():
    code = "import sys, minsnap.plot; sys.exit('matplotlib' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_utilisation_peaks_at_what_the_certificate_says():
    limits = Limits(
        speed=2.0, acceleration=3.0, jerk=9.0, snap=40.0, horizontal_speed=2.5, horizontal_acceleration=4.0,
        climb_speed=1.0, descent_speed=0.8, vertical_speed=1.5, vertical_acceleration=2.0, max_thrust=1.5,
        min_thrust=0.5, tilt=0.6, body_rate=4.0, yaw_rate=3.0,
    )  # fmt: skip
    traj = minsnap.plan(
        [(0, 0, 1), (3, 1, 2), (2, 4, 0.5), (0, 2, 1)], durations=[2.5, 2.5, 2.5], yaw=[0.0, 1.0, 2.0, 1.0]
    )
    assert limits.given().keys() == {kind.name for kind in KINDS if kind.measure != "rotors"}
    exact = {used.name: used.fraction for used in limits.utilisation(traj)}
    ax = plot_utilisation(traj, limits)
    drawn = {line.get_label().replace(" ", "_"): np.max(line.get_ydata()) / 100.0 for line in ax.lines[:-1]}
    assert drawn.keys() == exact.keys()
    for name, fraction in exact.items():
        assert drawn[name] == pytest.approx(fraction, rel=1e-3), name


def test_utilisation_per_axis_and_without_what_it_needs(path):
    axis = plot_utilisation(path, Limits(speed=1.0, norm="axis")).lines[0].get_ydata()
    t = np.linspace(0.0, path.duration, len(axis))
    assert axis == pytest.approx(100.0 * np.abs(path(t, 1)).max(axis=1))
    bare = Samples(np.arange(3.0), np.ones((3, 3)))
    with pytest.raises(InputError, match="lack"):
        plot_utilisation(bare, Limits(speed=1.0))
    with pytest.raises(InputError, match="no limit"):
        plot_utilisation(path, Limits())


def test_convergence_goes_down_to_the_duration_found():
    traj = minsnap.rectangle(limits=Limits(speed=3.0, acceleration=6.0), pieces=1)
    axes = plot_convergence(traj)
    best = axes.lines[1].get_ydata()
    assert (np.diff(best) <= 0.0).all() and axes.get_ylabel() == "total time [s]"
    assert best[-1] == pytest.approx(traj.duration, rel=0.02)
    with pytest.raises(InputError, match="not searched"):
        plot_convergence(minsnap.line(total_time=7.0))


@pytest.mark.parametrize(("view", "projection"), [("3d", None), ("xy", "3d")])
def test_axes_of_another_dimension_than_the_view_are_refused(path, view, projection):
    from matplotlib.figure import Figure

    with pytest.raises(InputError, match=f"the view '{view}' needs axes of"):
        plot_path(path, Figure().add_subplot(projection=projection), view=view)


def rows(figure):
    """Return the names of what an overview draws against time."""
    return [ax.get_ylabel().partition("\n")[0] for ax in figure.subfigs[1].axes]


@pytest.mark.slow
def test_an_overview_has_the_heading_where_there_is_one_and_the_limits_where_there_are_some():
    derivatives = ["position", "velocity", "acceleration", "jerk", "snap"]
    level = minsnap.line()
    assert rows(plot_overview(level)) == derivatives
    assert rows(plot_overview(level, limits=Limits(speed=3.0))) == [*derivatives, "share of"]
    assert rows(plot_overview(minsnap.circle(yaw="velocity"))) == [*derivatives, "yaw", "yaw rate"]
    assert rows(plot_overview(minsnap.circle(yaw=1.0))) == [*derivatives, "yaw", "yaw rate"]
    bare = Samples(np.arange(3.0), np.ones((3, 3)), velocity=np.zeros((3, 3)))
    assert rows(plot_overview(bare, limits=Limits(acceleration=3.0))) == ["position", "velocity"]


def test_the_heading_is_that_of_the_path():
    path = minsnap.circle(yaw="velocity")
    for order, ax in enumerate(plot_heading(path)):
        t, drawn = ax.lines[0].get_data()
        assert drawn == pytest.approx(path.yaw(t, order))
    with pytest.raises(InputError, match="yaw"):
        plot_heading(Samples(np.arange(2.0), np.ones((2, 3))))


@pytest.mark.slow
def test_a_climbing_path_is_drawn_from_the_side_on_the_same_scale(path):
    figure = plot_overview(path, corridor=None)
    figure.draw_without_rendering()
    above, below = figure.subfigs[0].axes
    assert (above.get_ylabel(), below.get_ylabel()) == ("y [m]", "z [m]")
    boxes = [ax.get_window_extent() for ax in (above, below)]
    assert [boxes[0].x0, boxes[0].x1] == pytest.approx([boxes[1].x0, boxes[1].x1], abs=1.5)
    scales = [box.height / np.ptp(ax.get_ylim()) for box, ax in zip(boxes, (above, below), strict=True)]
    assert scales[0] == pytest.approx(scales[1], rel=0.01)
    assert len(plot_overview(minsnap.circle()).subfigs[0].axes) == 1


@pytest.mark.slow
@pytest.mark.parametrize("view", ["xy", "3d"])
def test_no_legend_covers_a_curve(view):
    limits = Limits(speed=3.0, acceleration=6.0)
    traj = minsnap.plan(SQUARE + [[0, 0, 0], [0, 0, 1], [0, 0, 2], [0, 0, 1], [0, 0, 0]], limits=limits, yaw="velocity")
    figure = plot_overview(traj, corridor=0.3, limits=limits, view=view)
    figure.draw_without_rendering()
    flat = [ax for part in figure.subfigs for ax in part.axes if ax.name != "3d" and ax.get_legend() is not None]
    assert len(flat) >= 4
    for ax in flat:
        assert ax.get_legend().get_window_extent().x0 >= ax.get_window_extent().x1


def test_arrowheads_in_space_are_small_on_the_curve_and_point_along_it(path):
    curve = path(np.linspace(0.0, path.duration, 5000))
    heads = arrow_heads(curve, 6)
    extent = np.linalg.norm(np.ptp(curve, axis=0))
    distance = np.linalg.norm(heads[:, :, None] - curve, axis=3).min(axis=2)
    assert len(heads) == 6 and 0.0 < distance.max() < 0.04 * extent
    for tip, left, right in heads:
        nearest = np.argmin(np.linalg.norm(curve - (2 * tip + left + right) / 4.0, axis=1))
        assert (tip - (left + right) / 2.0) @ (curve[nearest + 1] - curve[nearest - 1]) > 0.0
    assert len(arrow_heads(np.zeros((5, 3)), 6)) == 0


@pytest.mark.parametrize("view", ["xy", "3d"])
def test_a_flat_path_has_axes_that_leave_room_for_their_labels(view):
    ax = plot_path(minsnap.line(), view=view)
    limits = [ax.get_xlim(), ax.get_ylim(), *([ax.get_zlim()] if view == "3d" else [])]
    spans = np.ptp(limits, axis=1)
    assert spans.min() >= 0.25 * spans.max()


def test_drawing_leaves_the_parameters_of_matplotlib_alone(path):
    before = dict(matplotlib.rcParams)
    plot_overview(path, limits=Limits(speed=3.0))
    with pytest.raises(InputError):
        plot_path(path, view="top")
    assert dict(matplotlib.rcParams) == before


def test_obstacles_are_drawn_as_what_they_cover():
    avoid = [
        minsnap.Cylinder((2, 0.1), 0.5),
        minsnap.Ellipsoid((4, -1, 1), (0.5, 0.3, 0.6)),
        minsnap.Cuboid((5, 1, 0), (6, 2, 1)),
    ]
    path = minsnap.plan([(0, 0, 1), (6, 0, 3)], [5.0])
    for view, spans in (("xy", [(1, 1), (1, 0.6), (1, 1)]), ("xz", [(1, 2 + 2 * 0.1 * 6), (1, 1.2), (1, 1)])):
        drawn = [patch.get_xy() for patch in plot_path(path, view=view, avoid=avoid).patches if len(patch.get_xy()) > 4]
        assert [tuple(np.ptp(ring, axis=0)) for ring in drawn[:3]] == [pytest.approx(span, rel=1e-2) for span in spans]
