"""Formations on the surface of a mesh: points as far from each other as they can be.

Points are drawn evenly over the area of the triangles with a fixed seed, and of these each next one is the farthest
from those before (T. F. Gonzalez, "Clustering to minimize the maximum intercluster distance", 1985).
"""

from __future__ import annotations

import os

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.checks import check_positive
from minsnap.basics.storage.reading import reading
from minsnap.basics.storage.text import read_text
from minsnap.errors import FileError, FleetError

DRAWN = 40
"""Points drawn for each that is kept."""


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
