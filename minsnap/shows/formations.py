"""Formations: where the vehicles of a show stand in one picture, all as points (vehicles, 3) in metres, z up."""

from __future__ import annotations

import os
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.checks import check_positive, is_whole
from minsnap.basics.messages import shown
from minsnap.errors import FleetError
from minsnap.files.waypoints import read_waypoints

CAPITALS = 0.72
"""Height of a capital over the size of its font."""


def grid(vehicles: int, spacing: float, height: float = 0.0, columns: int | None = None) -> FloatArray:
    """Return rows of a level grid around the origin, row by row; as square as possible by default."""
    count, spacing = _count(vehicles), check_positive("the spacing of a grid", spacing, "m", FleetError)
    wide = int(np.ceil(np.sqrt(count))) if columns is None else _count(columns)
    rows, places = np.divmod(np.arange(count), wide)
    plane = np.stack([places, rows], axis=1) * spacing
    return np.column_stack([plane - (plane.min(axis=0) + plane.max(axis=0)) / 2.0, np.full(count, float(height))])


def circle(vehicles: int, radius: float, height: float = 0.0, upright: bool = False) -> FloatArray:
    """Return points on a circle around the z axis, equally spaced; upright, in the x-z plane around that height."""
    count, radius = _count(vehicles), check_positive("the radius of a circle", radius, "m", FleetError)
    angle = 2.0 * np.pi * np.arange(count) / count
    across, along, flat = radius * np.cos(angle), radius * np.sin(angle), np.zeros(count)
    return np.column_stack([across, flat, height + along] if upright else [across, along, flat + height])


def text(vehicles: int, words: str, size: float, height: float) -> FloatArray:
    """Return points on the outlines of letters in the x-z plane, at equal lengths.

    Parameters
    ----------
    vehicles : int
    words : str
    size : float
        Height of capitals [m].
    height : float
        Of the line that letters stand on [m].
    """
    from matplotlib.textpath import TextPath

    count, size = _count(vehicles), check_positive("the size of a text", size, "m", FleetError)
    letters = str(words).strip()
    polygons = TextPath((0.0, 0.0), letters, size=size / CAPITALS).to_polygons() if letters else []
    outlines = [line for line in map(np.asarray, polygons) if len(line) > 1]
    if not outlines:
        raise FleetError(f"the text {shown(words)} has no outlines: give letters")
    points = along(outlines, count)
    points[:, 0] -= (points[:, 0].min() + points[:, 0].max()) / 2.0
    return np.column_stack([points[:, 0], np.zeros(count), height + points[:, 1]])


def along(lines: list[FloatArray], count: int) -> FloatArray:
    """Return points at equal lengths along polylines of shape (n, dim), the gaps between them left out."""
    steps = [np.diff(line, axis=0) for line in lines]
    lengths = np.concatenate([np.linalg.norm(step, axis=1) for step in steps])
    starts = np.concatenate([line[:-1] for line in lines])
    ends = np.cumsum(lengths)
    place = (np.arange(count) + 0.5) / count * ends[-1]
    leg = np.minimum(np.searchsorted(ends, place), len(ends) - 1)
    share = 1.0 - (ends[leg] - place) / np.where(lengths[leg] > 0.0, lengths[leg], 1.0)
    return np.asarray(starts[leg] + share[:, None] * np.concatenate(steps)[leg])


def points_file(path: str | os.PathLike[str]) -> FloatArray:
    """Return the points of a CSV or YAML of waypoints."""
    return np.asarray(read_waypoints(path).points)


def spacing_of(points: FloatArray, downwash: float = 1.0) -> tuple[float, tuple[int, int]]:
    """Return the least distance of two points, heights divided by the downwash, and which two."""
    from scipy.spatial import KDTree

    distance, other = KDTree(points / (1.0, 1.0, downwash)).query(points / (1.0, 1.0, downwash), k=2)
    first = int(distance[:, 1].argmin())
    return float(distance[first, 1]), (first, int(other[first, 1]))


def _count(value: Any) -> int:
    if not is_whole(value) or not 1 <= value <= 100_000:
        raise FleetError(f"the number of vehicles is {shown(value)}: give a whole number from 1 to 100000")
    return int(value)
