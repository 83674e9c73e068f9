"""Local coordinates of WGS 84, against the radii of curvature of the ellipsoid and its axes."""

import numpy as np
import pytest

from minsnap.files.geodesy import FLATTENING, SEMI_MAJOR, earth_centred, geodetic_positions, local_positions

HOME = (47.3977419, 8.5455938, 488.0)


def radii(latitude: float) -> tuple[float, float]:
    """Return the radii of curvature of the ellipsoid: along the meridian, and across it [m]."""
    sine, eccentricity = np.sin(np.radians(latitude)), 2 * FLATTENING - FLATTENING**2
    across = SEMI_MAJOR / np.sqrt(1 - eccentricity * sine**2)
    return SEMI_MAJOR * (1 - eccentricity) / (1 - eccentricity * sine**2) ** 1.5, across


@pytest.mark.parametrize("latitude", [-63.0, 0.0, 1.0, 47.4, 80.0])
def test_small_steps_are_arcs_of_the_radii_of_curvature(latitude):
    home, step = np.array([latitude, 13.0, 120.0]), np.radians(1e-4)
    meridian, across = radii(latitude)
    north = local_positions(home + [1e-4, 0, 0], home)
    east = local_positions(home + [0, 1e-4, 0], home)
    assert north == pytest.approx([0.0, (meridian + 120.0) * step, 0.0], abs=2e-5)
    level = (across + 120.0) * np.cos(np.radians(latitude)) * step
    assert east == pytest.approx([level, 0.0, 0.0], abs=2e-5)
    assert local_positions(home + [0, 0, 7.0], home) == pytest.approx([0.0, 0.0, 7.0], abs=1e-8)


def test_level_ground_sinks_below_the_tangent_plane_by_its_curvature():
    meridian, _ = radii(HOME[0])
    away = local_positions([HOME[0] + np.degrees(1000.0 / meridian), HOME[1], HOME[2]], HOME)
    assert away[2] == pytest.approx(-(1000.0**2) / (2 * meridian), rel=1e-3)


def test_axes_of_the_earth_are_exact():
    semi_minor = SEMI_MAJOR * (1 - FLATTENING)
    places = [[0.0, 0.0, 0.0], [0.0, 90.0, 5.0], [90.0, 0.0, 2.0]]
    expected = [[SEMI_MAJOR, 0, 0], [0, SEMI_MAJOR + 5.0, 0], [0, 0, semi_minor + 2.0]]
    assert earth_centred(places) == pytest.approx(np.array(expected), abs=1e-8)


def test_distances_are_those_of_earth_centred_coordinates_for_any_shape():
    places = np.array(HOME) + np.random.default_rng(3).uniform(-0.01, 0.01, (2, 3, 3))
    local = local_positions(places, HOME)
    straight = np.linalg.norm(earth_centred(places) - earth_centred(HOME), axis=-1)
    assert local.shape == (2, 3, 3)
    assert np.linalg.norm(local, axis=-1) == pytest.approx(straight, rel=1e-9)


@pytest.mark.parametrize("home", [HOME, [0.0, 0.0, 0.0], [-89.99, 10.0, 3000.0], [60.0, 179.999, -50.0]])
def test_positions_are_taken_back_to_latitude_and_longitude(home):
    local = np.random.default_rng(3).uniform(-5000.0, 5000.0, (40, 3))
    back = local_positions(geodetic_positions(local, home), home)
    assert np.abs(back - local).max() <= 1e-8
