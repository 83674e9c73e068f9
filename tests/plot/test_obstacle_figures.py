"""Obstacles in every figure: of plans, courses, races, stored plans and simulated flights, in planes and in space."""

import numpy as np
import pytest
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

import minsnap
from minsnap import Course, Cuboid, Cylinder, Ellipsoid, Stop
from minsnap.files.formats.polynomials import read_polynomials, write_polynomials
from minsnap.plot import plot_mission, plot_overview, plot_race
from minsnap.plot.obstacles import drawn_places, surface
from minsnap.vehicle import Quadrotor

PATH = minsnap.plan([(0, 0, 1), (6, 0, 3)], [5.0])
PLACES = PATH(np.linspace(0.0, 5.0, 101))
AVOID = [Cylinder((2, 1.1), 0.5), Ellipsoid((4, -1, 1), (0.5, 0.3, 0.6)), Cuboid((5, 1, 0), (6, 2, 1))]


def named(figure):
    """Return the names in the legends of a figure."""
    legends = [ax.get_legend() for ax in figure.axes] + list(figure.legends)
    return {text.get_text() for legend in legends if legend is not None for text in legend.get_texts()}


@pytest.mark.parametrize(
    ("obstacle", "low", "high"),
    [
        (AVOID[0], (1.5, 0.6, 1.0 - 0.6), (2.5, 1.6, 3.0 + 0.6)),
        (AVOID[1], (3.5, -1.3, 0.4), (4.5, -0.7, 1.6)),
        (AVOID[2], (5, 1, 0), (6, 2, 1)),
        (Cylinder((2, 1.1), 0.5, low=0.5, high=1.5), (1.5, 0.6, 0.5), (2.5, 1.6, 1.5)),
    ],
    ids=lambda value: type(value).__name__,
)
def test_surfaces_in_space_have_the_extent_of_their_obstacle(obstacle, low, high):
    faces = np.array(list(surface(obstacle, PLACES)))
    assert faces.shape[1:] == (4, 3)
    assert faces.min(axis=(0, 1)) == pytest.approx(low, abs=1e-2)
    assert faces.max(axis=(0, 1)) == pytest.approx(high, abs=1e-2)
    assert list(surface(Cylinder((99.0, 0.0), 1.0), PLACES)) == []


def test_the_places_of_a_figure_hold_obstacles_near_the_path_and_no_others():
    flat = PLACES[:, :2]
    far = Cuboid((4, -2, 0), (60, -1, 1))
    corners = drawn_places(flat, [*AVOID, far, Cylinder((99.0, 0.0), 1.0)], [0, 1])
    assert corners.min(axis=0) == pytest.approx([0.0, -2.0]) and corners.max(axis=0) == pytest.approx([9.0, 2.0])


@pytest.mark.slow
@pytest.mark.parametrize("view", ["xy", "xz", "3d"])
def test_overviews_and_races_draw_obstacles(view):
    for figure in (
        plot_overview(PATH, view=view, avoid=AVOID),
        plot_race(PATH, Quadrotor.dji_f330(), view=view, avoid=AVOID),
    ):
        assert "obstacles" in named(figure)
        if view == "3d":
            shown = [one.get_label() for one in figure.axes[0].collections if isinstance(one, Poly3DCollection)]
            assert "obstacles" in shown


@pytest.mark.slow
def test_the_figure_of_a_course_draws_its_obstacles():
    stops = tuple(map(Stop, [(0, 0, 1), (4, 0, 1), (4, 3, 1)]))
    course = Course(stops, avoid=[Cylinder((2.0, 0.1), 0.4)], takeoff=True)
    figure = plot_mission(minsnap.plan_mission(course))
    assert "obstacles" in named(figure)
    assert any(len(patch.get_xy()) > 60 for patch in figure.axes[0].patches if hasattr(patch, "get_xy"))


@pytest.mark.slow
def test_a_stored_plan_is_drawn_with_what_it_keeps(tmp_path, monkeypatch):
    from minsnap.cli import main

    monkeypatch.chdir(tmp_path)
    write_polynomials(PATH, "plan.json", waypoints=[(0, 0, 1), (6, 0, 3)], corridor=0.5, avoid=AVOID)
    saved = []
    monkeypatch.setattr("minsnap.plot.figures.save_figure", lambda figure, *to, **how: saved.append(figure))
    monkeypatch.setattr("minsnap.plot.save_figure", lambda figure, *to, **how: saved.append(figure), raising=False)
    for words in (["plot", "plan.json", "-o", "a.png"], ["simulate", "plan.json", "--plot", "b.png"]):
        with pytest.raises(SystemExit) as left:
            main(words)
        assert left.value.code == 0
    for figure in saved:
        assert {"obstacles", "corridor"} <= named(figure)
    assert len(saved) == 2
    with pytest.raises(SystemExit):
        main(["plot", "plan.json", "-o", "film.gif"])
    assert (tmp_path / "film.gif").stat().st_size > 0
    assert read_polynomials("plan.json").drawn["avoid"][1].half_axes.tolist() == [0.5, 0.3, 0.6]


def test_the_figure_of_a_fleet_draws_its_obstacles():
    from minsnap.plot import plot_fleet

    fleet = minsnap.Fleet([PATH, minsnap.plan([(0, 2, 1), (6, 2, 3)], [5.0])])
    assert "obstacles" in named(plot_fleet(fleet, avoid=AVOID).figure)
