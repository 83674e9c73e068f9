"""Pictures of routes in space with what is around them, and of surveys with the ground below."""

import numpy as np
import pytest
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

import minsnap
from minsnap.paths.routes import Terrain, plan_through
from minsnap.plot import map_scene, plot_route, plot_survey, save_figure

ENDS = (0.5, 0.5, 1.0), (9.0, 7.0, 1.5)
X, Y = np.meshgrid(np.arange(-60.0, 121.0, 5.0), np.arange(-60.0, 121.0, 5.0), indexing="ij")
HILL = Terrain(12.0 * np.exp(-((X - 30.0) ** 2 + (Y - 20.0) ** 2) / 900.0), np.array([-60.0, -60.0]), 5.0, "hill")


def cells():
    taken = np.zeros((50, 40, 15), dtype=bool)
    taken[20:23, 5:30], taken[35, :20, :9] = True, True
    return taken


AROUND = {
    "cells": (cells, {"resolution": 0.2}, "occupied"),
    "a plane map": (lambda: cells().any(axis=2), {"resolution": 0.2}, "occupied"),
    "obstacles": (lambda: [minsnap.Cylinder((4, 3), 0.5), minsnap.Cuboid((6, 4, 0), (7, 5, 9))], {}, "obstacles"),
    "points": (lambda: np.random.default_rng(1).uniform((3, 2, 0), (7, 6, 3), (200, 3)), {}, "points"),
}


@pytest.mark.parametrize("name", AROUND)
def test_a_route_in_space_is_drawn_with_what_is_around_it(name, monkeypatch):
    """There was a path in an empty box."""
    faces, draw = [], map_scene.draw_faces
    monkeypatch.setattr(
        map_scene, "draw_faces", lambda ax, *drawn, **how: faces.append(drawn[0]) or draw(ax, *drawn, **how)
    )
    make, how, label = AROUND[name]
    ax = plot_route(plan_through(make(), *ENDS, clearance=0.2, **how), view="3d").subfigs[0].axes[0]
    box = np.array([ax.get_xlim(), ax.get_ylim(), ax.get_zlim()]).T
    artists = [artist for artist in [*ax.collections, *ax.lines] if artist.get_label() == label]
    assert len(artists) == 1 and label in [text.get_text() for text in ax.get_legend().get_texts()]
    if name == "points":
        drawn = np.array(artists[0].get_data_3d()).T
        assert {tuple(row) for row in drawn} <= {tuple(row) for row in make()} and len(drawn) > 100
    else:
        assert isinstance(artists[0], Poly3DCollection)
        drawn = np.concatenate(faces).reshape(-1, 3)
    assert (drawn >= box[0] - 1e-9).all() and (drawn <= box[1] + 1e-9).all()
    if name == "cells":
        at = np.round(drawn / 0.2).astype(int)
        near = np.pad(cells(), 1)  # each corner of a face touches an occupied cell
        touched = [near[i : i + 2, j : j + 2, k : k + 2].any() for i, j, k in at if (at >= 0).all()]
        assert all(touched)


def test_a_fence_is_drawn_where_it_is_in_the_box_of_the_route():
    fence = minsnap.Prism([(-30, -2), (40, -1), (40, 9), (-30, 9)], inclusion=True)
    ax = plot_route(plan_through([fence], *ENDS, clearance=0.2), view="3d").subfigs[0].axes[0]
    (line,) = [line for line in ax.lines if line.get_label() == "fence"]
    x, y, _ = np.array(line.get_data_3d())
    known = ~np.isnan(x)
    low, high = ax.get_xlim()
    assert ((x[known] >= low) & (x[known] <= high)).all()
    sides = np.abs(np.stack([y + 2.0 - (x + 30.0) / 70.0, y - 9.0]))[:, known].min(axis=0)
    assert known.any() == (low <= x[known]).any() and (sides < 1e-9).all()


@pytest.fixture(scope="module")
def survey():
    field = [(0, 0), (60, 0), (60, 40), (0, 40)]
    return minsnap.plan_survey(field, spacing=20, height=30, speed=6, terrain=HILL, within=4)


@pytest.mark.parametrize("view", ["xy", "xz", "yz", "3d"])
def test_a_survey_over_ground_is_drawn_with_it(survey, view):
    """Surveys that follow the ground showed none."""
    axes = plot_survey(survey, view=view).subfigs[0].axes
    plain = plot_survey(minsnap.plan_survey(survey.outline[:, :2], spacing=20, height=30, speed=6), view=view)
    assert len(axes[0].collections) > len(plain.subfigs[0].axes[0].collections)
    if view == "xy":
        assert len(axes[1].collections) == 2  # the ground from the side
        levels = [float(text.get_text()[:-2]) for text in axes[0].texts if text.get_text().endswith(" m")]
        assert len(levels) > 3 and 0.0 < min(levels) < max(levels) < 12.0 and axes[1].get_ylim()[0] < 3.0
    else:
        least = axes[0].get_zlim()[0] if view == "3d" else axes[0].get_ylim()[0]
        assert least < 3.0


def test_ground_that_is_not_known_or_elsewhere_is_left_out(survey):
    from dataclasses import replace

    unknown = replace(HILL, heights=np.full_like(HILL.heights, np.nan))
    far = replace(HILL, middle=HILL.middle + 1e4)
    some = replace(HILL, heights=np.where(Y > 10.0, HILL.heights, np.nan))
    counts = [len(plot_survey(replace(survey, terrain=each)).subfigs[0].axes[0].collections) for each in (unknown, far)]
    assert counts == [len(plot_survey(replace(survey, terrain=None)).subfigs[0].axes[0].collections)] * 2
    for view in ("xy", "xz", "3d"):
        assert len(plot_survey(replace(survey, terrain=some), view=view).subfigs[0].axes[0].collections) > counts[0]


def test_the_legend_of_a_survey_is_beside_its_profiles(survey, tmp_path):
    """The axes became wider than the layout had them, and the legend stood on the names of the profiles."""
    figure = plot_survey(survey)
    save_figure(figure, tmp_path / "survey.png")
    place, profiles = figure.subfigs
    right = max(ax.get_legend().get_window_extent().x1 for ax in place.axes if ax.get_legend())
    left = min(ax.yaxis.get_label().get_window_extent().x0 for ax in profiles.axes)
    assert right < left
