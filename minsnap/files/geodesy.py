"""Places on the ellipsoid of WGS 84, and positions around one of them."""

from __future__ import annotations

import numpy as np

from minsnap.basics.arrays import ArrayLike, FloatArray

SEMI_MAJOR = 6_378_137.0
"""Semi-major axis of the ellipsoid of WGS 84 [m]."""

FLATTENING = 1.0 / 298.257223563
"""Its flattening."""

STEPS = 7
"""Steps to a latitude: the error of the first, 1e-5 near the ground, is below rounding after five."""


def local_positions(geodetic: ArrayLike, home: ArrayLike) -> FloatArray:
    r"""Return positions east, north and up of a home position, in the plane tangent to the ellipsoid there.

    Through earth-centered coordinates: :math:`R^\top (p - p_{home})`, with the axes east, north and up at home as the
    columns of R (NIMA TR8350.2, *Department of Defense World Geodetic System 1984*).

    Parameters
    ----------
    geodetic : array_like, shape (..., 3)
        Latitude [degrees], longitude [degrees], height [m].
    home : array_like, shape (3,)
        The same of the origin, heights above the same surface.

    Returns
    -------
    ndarray, shape (..., 3)
        [m].
    """
    away = earth_centred(geodetic) - earth_centred(home)
    return np.asarray(away @ _axes(np.asarray(home, dtype=np.float64)))


def geodetic_positions(local: ArrayLike, home: ArrayLike) -> FloatArray:
    r"""Return latitude, longitude [degrees] and height [m] of positions: what :func:`local_positions` takes back.

    The latitude is the fixed point of :math:`\tan\varphi = (Z + e^2 N \sin\varphi) / p` (Heiskanen and Moritz,
    *Physical Geodesy*, 5-3), of which each step leaves a share :math:`e^2` of the error.

    Parameters
    ----------
    local : array_like, shape (..., 3)
        East, north and up of home [m].
    home : array_like, shape (3,)
        Latitude, longitude [degrees] and height [m] of the origin.

    Returns
    -------
    ndarray, shape (..., 3)
    """
    origin = np.asarray(home, dtype=np.float64)
    place = np.asarray(local, dtype=np.float64) @ _axes(origin).T + earth_centred(origin)
    square = FLATTENING * (2.0 - FLATTENING)
    level = np.hypot(place[..., 0], place[..., 1])
    latitude = np.arctan2(place[..., 2], (1.0 - square) * level)
    for _ in range(STEPS):
        normal = SEMI_MAJOR / np.sqrt(1.0 - square * np.sin(latitude) ** 2)
        latitude = np.arctan2(place[..., 2] + square * normal * np.sin(latitude), level)
    sine, cosine = np.sin(latitude), np.cos(latitude)
    height = level * cosine + place[..., 2] * sine - SEMI_MAJOR * np.sqrt(1.0 - square * sine**2)
    longitude = np.arctan2(place[..., 1], place[..., 0])
    return np.stack([np.degrees(latitude), np.degrees(longitude), height], axis=-1)


def earth_centred(geodetic: ArrayLike) -> FloatArray:
    r"""Return earth-centered, earth-fixed coordinates of positions, shape (..., 3) [m].

    :math:`((N + h) \cos\varphi \cos\lambda, (N + h) \cos\varphi \sin\lambda, (N (1 - e^2) + h) \sin\varphi)` with
    :math:`N = a / \sqrt{1 - e^2 \sin^2 \varphi}`.

    Parameters
    ----------
    geodetic : array_like, shape (..., 3)
        Latitude [degrees], longitude [degrees], height above the ellipsoid [m].
    """
    values = np.asarray(geodetic, dtype=np.float64)
    latitude, longitude, height = np.radians(values[..., 0]), np.radians(values[..., 1]), values[..., 2]
    square = FLATTENING * (2.0 - FLATTENING)
    normal = SEMI_MAJOR / np.sqrt(1.0 - square * np.sin(latitude) ** 2)
    level = (normal + height) * np.cos(latitude)
    polar = (normal * (1.0 - square) + height) * np.sin(latitude)
    return np.stack([level * np.cos(longitude), level * np.sin(longitude), polar], axis=-1)


def _axes(home: FloatArray) -> FloatArray:
    """Return the directions east, north and up at a position, as columns."""
    (sin_lat, sin_lon), (cos_lat, cos_lon) = np.sin(np.radians(home[:2])), np.cos(np.radians(home[:2]))
    east = (-sin_lon, cos_lon, 0.0)
    north = (-sin_lat * cos_lon, -sin_lat * sin_lon, cos_lat)
    up = (cos_lat * cos_lon, cos_lat * sin_lon, sin_lat)
    return np.array([east, north, up]).T
