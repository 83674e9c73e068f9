"""Where the vehicles of a fleet are to stand: below their starts, or beside another that stands there."""

from __future__ import annotations

import math

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.errors import FleetError
from minsnap.fleet.approach import GROUND, SPAN
from minsnap.fleet.common_clock import Fleet, Separation

RINGS = 40
"""Rings of places around a start that are looked at for a free one."""

WIDER = 3e-3
"""By how much places beside each other are further apart than they must be [m]: they are in whole millimetres."""


def find_standing_places(fleet: Fleet) -> FloatArray:
    """Return where vehicles are to stand, shape (vehicles, 3) [m]: below their starts, or beside what is taken there.

    Those whose starts are lower choose first. Places are apart by the separation without its downwash.

    Raises
    ------
    FleetError
        If no free place is found near a start.
    """
    apart, starts = fleet.separation or Separation(SPAN), fleet(0.0)
    radii, places = apart.radii_of(len(fleet)), np.zeros((len(fleet), 3))
    beside = (2.0 * float(radii.max()) + WIDER) * _hexagons()
    taken: list[int] = []
    for vehicle in np.argsort(starts[:, 2], kind="stable").tolist():
        own = starts[vehicle, :2]
        for tried in (own[None], (own + beside[1:]).round(3)):  # its own place is free as a rule
            found = _first_free(tried, places[taken, :2], radii[vehicle] + radii[taken])
            if found is not None:
                break
        else:
            raise FleetError(f"no free place is near the start of {fleet.name(vehicle)}: give the fleet more room")
        places[vehicle, :2] = found
        taken.append(vehicle)
    low = starts[:, 2] <= GROUND
    places[low, 2] = starts[low, 2]
    return places


def _first_free(tried: FloatArray, taken: FloatArray, distances: FloatArray) -> FloatArray | None:
    """Return the first of points (m, 2) that is at its distance or more from each that is taken, (n, 2)."""
    free = np.flatnonzero((np.linalg.norm(tried[:, None] - taken, axis=2) >= distances).all(axis=1))
    return tried[free[0]] if len(free) else None


def _hexagons() -> FloatArray:
    """Return the points of a grid of triangles with side 1, the nearest to its origin first."""
    row, column = (each.ravel() for each in np.mgrid[-RINGS : RINGS + 1, -RINGS : RINGS + 1])
    points = np.stack([column + 0.5 * row, row * math.sqrt(0.75)], axis=1)
    return np.asarray(points[np.argsort(np.linalg.norm(points, axis=1).round(9), kind="stable")])
