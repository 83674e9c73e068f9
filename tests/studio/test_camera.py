"""Where cameras stand: everything is in the picture, and fills it."""

import numpy as np
import pytest

from minsnap.studio.browser_page import FILLED, framing


@pytest.mark.parametrize("aspect", [0.4, 1.0, 2.4])
@pytest.mark.parametrize("size", [(8.0, 4.0, 0.0), (200.0, 1.0, 40.0), (0.0, 0.0, 30.0), (3.0, 90.0, 2.0)])
def test_all_points_are_seen_and_one_is_near_the_edge(size, aspect):
    points = np.random.default_rng(1).uniform(-0.5, 0.5, (50, 3)) * size + [100.0, -50.0, 20.0]
    place, center = framing(points, 1.3, aspect)
    forward = (center - place) / np.linalg.norm(center - place)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    seen = (points - place) @ np.stack([right, np.cross(right, forward), forward]).T
    assert (seen[:, 2] > 0.0).all()
    reach = np.abs(seen[:, :2] / seen[:, 2:]) / np.tan(0.65) / [aspect, 1.0]
    assert reach.max() == pytest.approx(FILLED)


def test_a_single_place_is_looked_at_from_a_distance():
    place, center = framing(np.ones((2, 3)), 1.3, 1.0)
    assert np.linalg.norm(place - center) == pytest.approx(2.0)
