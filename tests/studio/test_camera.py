"""Where cameras stand: everything is in the picture, and fills it."""

import asyncio
from contextlib import nullcontext
from types import SimpleNamespace

import numpy as np
import pytest

from minsnap.studio.browser_page import FILLED, framing, keep_framed


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


@pytest.mark.parametrize("aspect", [0.4, 1.0])
def test_what_a_sheet_lies_over_is_left_free(aspect):
    """On a phone the path lay behind the controls."""
    place, center = framing(SCENE, 1.3, aspect, hidden=0.45)
    forward = (center - place) / np.linalg.norm(center - place)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    seen = (SCENE - place) @ np.stack([right, np.cross(right, forward), forward]).T
    height = seen[:, 1] / seen[:, 2] / np.tan(0.65)
    assert (-0.1 < height).all() and (height < 1.0).all()


def test_a_single_place_is_looked_at_from_a_distance():
    place, center = framing(np.ones((2, 3)), 1.3, 1.0)
    assert np.linalg.norm(place - center) == pytest.approx(2.0)


@pytest.fixture
def browser():
    """Return a browser of 1000 x 1200 pixels that reports the poses and sizes that it has."""
    seen = []
    camera = SimpleNamespace(fov=1.3, image_width=1000, image_height=1200, on_update=seen.append)

    def report(**changes):
        vars(camera).update(changes)
        for act in seen:
            asyncio.run(act(None))

    return SimpleNamespace(camera=camera, atomic=nullcontext, report=report)


SCENE = np.array([[0.0, 0.0, 1.0], [8.0, 4.0, 1.0]])


def place(aspect):
    return pytest.approx(framing(SCENE, 1.3, aspect)[0])


def test_a_page_that_opens_late_at_its_first_place_is_framed_again(browser):
    opening, _ = framing(SCENE, 1.3, 1.0)
    keep_framed(browser, lambda: SCENE, opening)
    browser.report(position=opening)
    assert browser.camera.position == place(1000 / 1200)


def test_a_page_that_opens_without_pixels_is_framed_when_it_has_some(browser):
    vars(browser.camera).update(image_width=0, image_height=0)
    opening, _ = framing(SCENE, 1.3, 1.0)
    keep_framed(browser, lambda: SCENE, opening)
    browser.report(image_width=1000, image_height=1200)
    assert browser.camera.position == place(1000 / 1200)


def test_a_camera_follows_the_size_of_its_picture_until_its_user_moves_it(browser):
    keep_framed(browser, lambda: SCENE, framing(SCENE, 1.3, 1.0)[0])
    browser.report(image_width=900)
    assert browser.camera.position == place(900 / 1200)
    moved = browser.camera.position + [0.0, 0.0, 3.0]
    browser.report(position=moved)
    browser.report(image_width=300)
    assert np.array_equal(browser.camera.position, moved)


def test_a_square_picture_is_framed_once(browser):
    """It stands where pages open: a report from there asks for nothing."""
    browser.camera.image_width = 1200
    opening, _ = framing(SCENE, 1.3, 1.0)
    keep_framed(browser, lambda: SCENE, opening)
    place = browser.camera.position
    browser.report()
    assert browser.camera.position is place
