"""Formations: where the vehicles of a show stand in one picture, all as points (vehicles, 3) in metres, z up."""

from __future__ import annotations

import os
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.checks import check_positive, is_whole
from minsnap.basics.messages import shown
from minsnap.basics.storage.reading import reading
from minsnap.basics.storage.text import read_text
from minsnap.errors import FileError, FleetError
from minsnap.files.waypoints import read_waypoints

CAPITALS = 0.72
"""Height of a capital over the size of its font."""

DRAWN = 40
"""Points drawn for each that is kept."""


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


def spacing_of(points: FloatArray) -> tuple[float, tuple[int, int]]:
    """Return the least distance of two points, and which two."""
    from scipy.spatial import KDTree

    distance, other = KDTree(points).query(points, k=2)
    first = int(distance[:, 1].argmin())
    return float(distance[first, 1]), (first, int(other[first, 1]))


def _count(value: Any) -> int:
    if not is_whole(value) or not 1 <= value <= 100_000:
        raise FleetError(f"the number of vehicles is {shown(value)}: give a whole number from 1 to 100000")
    return int(value)


def mesh(vehicles: int, file: str | os.PathLike[str], size: float, height: float = 0.0) -> FloatArray:
    """Return points on the surface of a Wavefront OBJ file, shape (vehicles, 3).

    Parameters
    ----------
    vehicles : int
    file : str or path
        Vertices ``v x y z``, z up, and faces ``f``.
    size : float
        Largest extent of the mesh in any coordinate [m].
    height : float
        Of its lowest point; it is centered around the z axis [m].

    Raises
    ------
    FileError
        If the file holds no faces.
    """
    size = check_positive("the size of a mesh", size, "m", FleetError)
    triangles = read_triangles(file)
    low, high = triangles.min(axis=(0, 1)), triangles.max(axis=(0, 1))
    scale = size / max(float((high - low).max()), 1e-300)
    middle = np.array([(low[0] + high[0]) / 2.0, (low[1] + high[1]) / 2.0, low[2]])
    return _farthest(_drawn(triangles, DRAWN * vehicles), vehicles, scale, middle, height)


def read_triangles(file: str | os.PathLike[str]) -> FloatArray:
    """Return the faces of an OBJ file as triangles, shape (n, 3, 3); larger faces are fans around a vertex."""
    corners: list[list[float]] = []
    faces: list[list[list[float]]] = []
    with reading(file, "an OBJ mesh"):
        for line in read_text(file).splitlines():
            words = line.split()
            if words[:1] == ["v"]:
                corners.append([float(word) for word in words[1:4]])
            elif words[:1] == ["f"]:
                numbers = [int(word.split("/")[0]) for word in words[1:]]
                face = [corners[number - 1 if number > 0 else number] for number in numbers]
                faces += [[face[0], *face[i : i + 2]] for i in range(1, len(face) - 1)]
        triangles = np.array(faces, dtype=np.float64)
    if triangles.ndim != 3 or not np.isfinite(triangles).all():
        raise FileError(f"{file} holds no faces of finite vertices: give an OBJ with v and f lines")
    return triangles


def _drawn(triangles: FloatArray, count: int) -> FloatArray:
    """Return points evenly distributed over the area, the same for the same mesh."""
    a, b, c = triangles.transpose(1, 0, 2)
    areas = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    draw = np.random.default_rng(0)
    which = np.minimum(np.searchsorted(np.cumsum(areas), draw.uniform(0.0, areas.sum(), count)), len(areas) - 1)
    root, share = np.sqrt(draw.uniform(size=(count, 1))), draw.uniform(size=(count, 1))
    return np.asarray(a[which] * (1.0 - root) + b[which] * root * (1.0 - share) + c[which] * root * share)


def _farthest(points: FloatArray, count: int, scale: float, middle: FloatArray, height: float) -> FloatArray:
    """Return points each of which is the farthest from those before, beginning with the lowest, in their place."""
    kept = [int(points[:, 2].argmin())]
    distance = np.linalg.norm(points - points[kept[0]], axis=1)
    while len(kept) < count:
        kept.append(int(distance.argmax()))
        distance = np.minimum(distance, np.linalg.norm(points - points[kept[-1]], axis=1))
    return np.asarray((points[kept] - middle) * scale + (0.0, 0.0, height))
