"""Surveys whose lines follow the ground, against heights interpolated here."""

import numpy as np
import pytest
from scipy.interpolate import RegularGridInterpolator

import minsnap
from minsnap.errors import ShapeError, WaypointError
from minsnap.paths.routes.terrain import Terrain

AREA = [(0.0, 0.0), (90.0, 5.0), (85.0, 40.0), (10.0, 45.0)]


def hills(steep=1.0):
    """Return ground over 300 m, cells of 5 m, with hills some 100 m apart."""
    x = -100.0 + 5.0 * np.arange(61)
    heights = steep * (6.0 * np.sin(x / 40.0)[:, None] + 4.0 * np.cos(x / 30.0)[None])
    return Terrain(heights, np.array([-100.0, -100.0]), 5.0, "hills")


@pytest.mark.slow
def test_lines_follow_the_ground_at_their_speed_and_turns_stay_above_it():
    ground = hills()
    found = minsnap.plan_survey(AREA, 20.0, 30.0, speed=6.0, terrain=ground, within=3.0)
    axes = [ground.middle[i] + ground.side * np.arange(61) for i in range(2)]
    t = np.linspace(0.0, found.trajectory.duration, 20001)
    places, flat = found.trajectory(t), np.linalg.norm(found.trajectory(t, 1)[:, :2], axis=1)
    above = places[:, 2] - RegularGridInterpolator(axes, ground.heights)(places[:, :2])
    on_line = ((t[:, None] >= found.spans[:, 0]) & (t[:, None] <= found.spans[:, 1])).any(axis=1)
    assert np.abs(above[on_line] - 30.0).max() <= 3.0 and above.min() >= 27.0
    assert np.ptp(places[on_line, 2]) > 5.0  # it does climb
    assert np.allclose(flat[on_line], 6.0, atol=1e-9)
    assert minsnap.certify(found.trajectory, limits=found.limits).ok


SMALL = Terrain(np.zeros((9, 9)), np.zeros(2), 5.0, "small")
FLAT = Terrain(np.zeros((22, 22)), np.array([-5.0, -5.0]), 5.0, "flat")


@pytest.mark.parametrize(
    ("given", "error", "says"),
    [
        ({"terrain": hills()}, ShapeError, "go together"),
        ({"within": 3.0}, ShapeError, "go together"),
        ({"terrain": hills(), "within": 30.0}, ShapeError, "cannot be 30 m lower"),
        ({"terrain": hills(), "within": -1.0}, ShapeError, "within"),
        ({"terrain": hills(4.0), "within": 0.05}, ShapeError, "cannot follow the ground within 0.05 m"),
        ({"terrain": SMALL, "within": 3.0}, ShapeError, "beyond the heights"),
        ({"terrain": FLAT, "within": 3.0}, WaypointError, "turn"),
    ],
)
def test_ground_that_cannot_be_followed_is_said(given, error, says):
    with pytest.raises(error, match=says):
        minsnap.plan_survey(AREA, 20.0, 30.0, speed=6.0, **given)
