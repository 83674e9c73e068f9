"""Formations: where the vehicles of a show stand in one picture, all as points (vehicles, 3) in metres, z up.

Of every formation, ``size`` is the largest extent in any coordinate, and ``height`` that of its lowest point.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.checks import check_number, check_positive
from minsnap.basics.messages import shown
from minsnap.basics.storage.text import FileName
from minsnap.errors import FleetError
from minsnap.fleet import Separation
from minsnap.shows.letters import letter_lines
from minsnap.shows.meshes import read_triangles, spread
from minsnap.shows.svg_lines import read_lines

DRAWN = 40
"""Points drawn for each that is kept."""

MOST_MOVES = 20
"""How often each point of a drawing is moved on average, at most, so that they are apart."""


def grid(vehicles: int, spacing: float, height: float = 0.0, columns: int | None = None) -> FloatArray:
    """Return rows of a level grid around the origin, row by row; as square as possible by default."""
    count, spacing = _count(vehicles), check_positive("the spacing of a grid", spacing, "m", FleetError)
    wide = int(np.ceil(np.sqrt(count))) if columns is None else _count(columns, "columns")
    rows, places = np.divmod(np.arange(count), wide)
    plane = np.stack([places, rows], axis=1) * spacing
    return np.column_stack([plane - (plane.min(axis=0) + plane.max(axis=0)) / 2.0, np.full(count, float(height))])


def circle(vehicles: int, radius: float, height: float = 0.0, upright: bool = False) -> FloatArray:
    """Return points on a circle around the z axis, equally spaced; upright, in the x-z plane, its foot at the height.

    The lowest of its points is the foot only where a point lies there, as with 4, 8 or 12.
    """
    count, radius = _count(vehicles), check_positive("the radius of a circle", radius, "m", FleetError)
    angle = 2.0 * np.pi * np.arange(count) / count
    across, along, flat = radius * np.cos(angle), radius * np.sin(angle), np.zeros(count)
    return np.column_stack([across, flat, height + radius + along] if upright else [across, along, flat + height])


def text(
    vehicles: int,
    words: str,
    size: float,
    height: float = 0.0,
    *,
    outlines: bool = False,
    font: FileName | None = None,
) -> FloatArray:
    """Return points at equal lengths on letters in the x-z plane.

    Parameters
    ----------
    vehicles : int
    words : str
        A line break begins a new line.
    size : float
        Larger extent of the whole text, mostly its width [m].
    height : float
        Of its lowest point [m].
    outlines : bool
        Along the outlines of a font in place of single strokes.
    font : str or path, optional
        Name of a font that is installed, or a file of one: its outlines.

    Raises
    ------
    FleetError
        If a letter is missing, or the font; says which.
    """
    return along(text_lines(words, size, height, outlines=outlines, font=font), _count(vehicles))


def text_lines(
    words: str, size: float, height: float = 0.0, *, outlines: bool = False, font: FileName | None = None
) -> list[FloatArray]:
    """Return the strokes or outlines of letters, polylines of shape (n, 3); see ``text``."""
    size = check_positive("the size of a text", size, "m", FleetError)
    return _upright(letter_lines(str(words), outlines, font), size, height, f"the text {shown(words)}")


def svg(vehicles: int, file: FileName, size: float, height: float = 0.0) -> FloatArray:
    """Return points at equal lengths along the lines of a drawing, upright in the x-z plane: (vehicles, 3).

    Parameters
    ----------
    vehicles : int
    file : str or path
    size : float
        Larger extent of the drawing [m].
    height : float
        Of its lowest point; it is centered around the z axis [m].

    Raises
    ------
    FileError
        If the file is no SVG, or has no lines.
    """
    return along(svg_lines(file, size, height), _count(vehicles))


def svg_lines(file: FileName, size: float, height: float = 0.0) -> list[FloatArray]:
    """Return the lines of a drawing, upright, polylines of shape (n, 3); see ``svg``."""
    size = check_positive("the size of a drawing", size, "m", FleetError)
    return _upright([line * (1.0, -1.0) for line in read_lines(file)], size, height, f"the drawing {file}")


LINES: dict[str, Callable[..., list[FloatArray]]] = {"text": text_lines, "svg": svg_lines}
"""Formations along lines."""


def _upright(lines: list[FloatArray], size: float, height: float, what: str) -> list[FloatArray]:
    """Return lines (n, 2) with y up in the x-z plane, in their size, centered, their lowest point at a height [m]."""
    points = np.concatenate(lines)
    low, high = points.min(axis=0), points.max(axis=0)
    extent = float((high - low).max())
    if not extent > 0.0:
        raise FleetError(f"{what} is one point: give lines that have a length")
    placed = [(line - ((low[0] + high[0]) / 2.0, low[1])) * (size / extent) for line in lines]
    return [np.column_stack((line[:, 0], np.zeros(len(line)), height + line[:, 1])) for line in placed]


def mesh(vehicles: int, file: FileName, size: float, height: float = 0.0) -> FloatArray:
    """Return points spread over the surface of a mesh, shape (vehicles, 3).

    Parameters
    ----------
    vehicles : int
    file : str or path
        OBJ, STL or PLY, z up; of a PLY of points alone, some of them.
    size : float
        Largest extent of the mesh in any coordinate [m].
    height : float
        Of its lowest point; it is centered around the z axis [m].

    Raises
    ------
    FileError
        If the file holds no faces, or has no extent.
    """
    size = check_positive("the size of a mesh", size, "m", FleetError)
    triangles = read_triangles(file)
    low, high = triangles.min(axis=(0, 1)), triangles.max(axis=(0, 1))
    middle = np.array([(low[0] + high[0]) / 2.0, (low[1] + high[1]) / 2.0, low[2]])
    points = spread(triangles, _count(vehicles), DRAWN)
    return np.asarray((points - middle) * (size / float((high - low).max())) + (0.0, 0.0, height))


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


def relaxed(lines: list[FloatArray], points: FloatArray, separation: Separation) -> FloatArray:
    """Return points moved along the lines that they lie on until they are apart, or no move brings the nearest further.

    Of the two that are nearest, one goes to the place on the lines, no farther than three times the separation, that is
    farthest from all others.

    Parameters
    ----------
    lines : list of ndarray, shape (n, 3)
    points : ndarray, shape (points, 3)
        On the lines [m].
    separation : Separation
    """
    from scipy.spatial import KDTree

    places = along(lines, DRAWN * len(points))
    flat, moved, asked = separation.flat(places), points.copy(), separation.distance or 0.0
    for _ in range(MOST_MOVES * len(points)):
        least, pair = spacing_of(separation.flat(moved))
        if least >= asked:
            break
        best, gained = None, least
        for which in pair:
            others = KDTree(separation.flat(np.delete(moved, which, axis=0)))
            near = np.flatnonzero(np.linalg.norm(places - moved[which], axis=1) <= 3.0 * asked)
            if not len(near):
                continue
            away = others.query(flat[near])[0]
            if away.max() > gained * (1.0 + 1e-9):
                gained, best = float(away.max()), (which, places[near[away.argmax()]])
        if best is None:
            break
        moved[best[0]] = best[1]
    return moved


def spacing_of(points: FloatArray) -> tuple[float, tuple[int, int]]:
    """Return the least distance of two points, and which two."""
    from scipy.spatial import KDTree

    distance, other = KDTree(points).query(points, k=2)
    first = int(distance[:, 1].argmin())
    return float(distance[first, 1]), (first, int(other[first][other[first] != first][0]))


def _count(value: Any, what: str = "vehicles") -> int:
    give = "give a whole number from 1 to 100000"
    return int(check_number(f"the number of {what}", value, 1, 100_000, give, FleetError, whole=True))
