"""Positions on the Earth as local coordinates: WGS 84 to east, north and up about a point."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from minsnap.basics.arrays import FloatArray

SEMI_MAJOR = 6_378_137.0
"""Semi-major axis of the ellipsoid of WGS 84 [m]."""

FLATTENING = 1.0 / 298.257223563
"""Its flattening."""


def local_positions(geodetic: npt.ArrayLike, home: npt.ArrayLike) -> FloatArray:
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


def earth_centred(geodetic: npt.ArrayLike) -> FloatArray:
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
