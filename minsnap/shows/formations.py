"""Formations: where the vehicles of a show stand in one picture, all as points (vehicles, 3) in metres, z up."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from math import atan2, ceil, cos, pi, radians, sin, sqrt, tan
from typing import Any
from xml.etree import ElementTree

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.checks import check_number, check_positive
from minsnap.basics.messages import shown
from minsnap.basics.storage.text import FileName, read_text, reading
from minsnap.errors import FileError, FleetError
from minsnap.fleet.common_clock import Separation
from minsnap.polynomials.bernstein import basis

CAPITALS = 0.72
"""Height of a capital over the size of its font."""

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
    return along(text_lines(words, size, height), _count(vehicles))


def text_lines(words: str, size: float, height: float) -> list[FloatArray]:
    """Return the outlines of letters, polylines of shape (n, 3); see ``text``."""
    from matplotlib.textpath import TextPath

    size = check_positive("the size of a text", size, "m", FleetError)
    letters = str(words).strip()
    polygons = TextPath((0.0, 0.0), letters, size=size / CAPITALS).to_polygons() if letters else []
    outlines = [line for line in map(np.asarray, polygons) if len(line) > 1]
    if not outlines:
        raise FleetError(f"the text {shown(words)} has no outlines: give letters")
    across = np.concatenate(outlines)[:, 0]
    middle = (across.min() + across.max()) / 2.0
    return [np.column_stack((line[:, 0] - middle, np.zeros(len(line)), height + line[:, 1])) for line in outlines]


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
    return float(distance[first, 1]), (first, int(other[first, 1]))


def _count(value: Any, what: str = "vehicles") -> int:
    give = "give a whole number from 1 to 100000"
    return int(check_number(f"the number of {what}", value, 1, 100_000, give, FleetError, whole=True))


def mesh(vehicles: int, file: FileName, size: float, height: float = 0.0) -> FloatArray:
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


def read_triangles(file: FileName) -> FloatArray:
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


STEPS = 32
"""Straight parts of one curve."""

COUNT = {"M": 2, "L": 2, "H": 1, "V": 1, "C": 6, "S": 4, "Q": 4, "T": 2, "A": 7, "Z": 0}
"""Numbers of each command of a path."""

NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
WORD = re.compile(rf"[MmLlHhVvCcSsQqTtAaZz]|{NUMBER.pattern}")


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
    return along(svg_lines(file, size, height), vehicles)


def svg_lines(file: FileName, size: float, height: float = 0.0) -> list[FloatArray]:
    """Return the lines of a drawing, upright, polylines of shape (n, 3); see ``svg``."""
    size = check_positive("the size of a drawing", size, "m", FleetError)
    lines = read_lines(file)
    low, high = np.concatenate(lines).min(axis=0), np.concatenate(lines).max(axis=0)
    scale = size / max(float((high - low).max()), 1e-300)
    placed = [(line - [(low[0] + high[0]) / 2.0, high[1]]) * scale for line in lines]
    return [np.column_stack((line[:, 0], np.zeros(len(line)), height - line[:, 1])) for line in placed]


def read_lines(file: FileName) -> list[FloatArray]:
    """Return the lines of a drawing as polylines (n, 2), y downwards as in the file."""
    text = read_text(file)
    if "<!ENTITY" in text or "<!DOCTYPE" in text[:4096] and "[" in text[: text.find(">") + 1]:
        raise FileError(f"{file} declares entities, which are not read: save it as a plain SVG")
    with reading(file, "an SVG drawing"):
        polylines = list(_lines(ElementTree.fromstring(text), np.eye(3)))
    lines = [line for line in polylines if len(line) > 1 and np.isfinite(line).all() and np.ptp(line, axis=0).any()]
    if not lines:
        raise FileError(
            f"{file} has no lines: give an SVG with paths, lines, polygons, rectangles, circles or ellipses"
        )
    return lines


def _lines(element: ElementTree.Element, outer: FloatArray) -> Iterator[FloatArray]:
    name, attributes = element.tag.rpartition("}")[2], element.attrib
    if name in ("defs", "symbol", "clipPath", "mask", "marker", "pattern"):
        return
    place = outer @ _transform(attributes.get("transform", ""))
    for line in _element_lines(name, dict(attributes)):
        yield line @ place[:2, :2].T + place[:2, 2]
    for child in element:
        yield from _lines(child, place)


def _element_lines(name: str, attributes: dict[str, str]) -> list[FloatArray]:
    """Return the lines of one element."""

    def number(key: str) -> float:
        match = NUMBER.match(attributes.get(key, "0"))
        return float(match.group()) if match else 0.0

    if name == "path":
        return _path(attributes.get("d", ""))
    if name in ("polyline", "polygon"):
        points = np.array(NUMBER.findall(attributes.get("points", "")), dtype=np.float64).reshape(-1, 2)
        return [np.concatenate((points, points[:1])) if name == "polygon" else points]
    if name == "line":
        return [np.array([[number("x1"), number("y1")], [number("x2"), number("y2")]])]
    if name == "rect":
        x, y, w, h = (number(key) for key in ("x", "y", "width", "height"))
        return [np.array([[x, y], [x + w, y], [x + w, y + h], [x, y + h], [x, y]])]
    if name in ("circle", "ellipse"):
        radii = [number(key) for key in (("r", "r") if name == "circle" else ("rx", "ry"))]
        angle = np.linspace(0.0, 2.0 * np.pi, 4 * STEPS + 1)
        return [np.column_stack((number("cx") + radii[0] * np.cos(angle), number("cy") + radii[1] * np.sin(angle)))]
    return []


def _turned(degrees: float, x: float = 0.0, y: float = 0.0) -> Affine:
    c, s = cos(radians(degrees)), sin(radians(degrees))
    return (c, -s, x - c * x + s * y), (s, c, y - s * x - c * y)


Affine = tuple[tuple[float, float, float], tuple[float, float, float]]
TRANSFORMS: dict[str, Callable[..., Affine]] = {
    "matrix": lambda a, b, c, d, e, f: ((a, c, e), (b, d, f)),
    "translate": lambda x, y=0.0: ((1.0, 0.0, x), (0.0, 1.0, y)),
    "scale": lambda x, *y: ((x, 0.0, 0.0), (0.0, *(y or (x,)), 0.0)),
    "rotate": _turned,
    "skewX": lambda degrees: ((1.0, tan(radians(degrees)), 0.0), (0.0, 1.0, 0.0)),
    "skewY": lambda degrees: ((1.0, 0.0, 0.0), (tan(radians(degrees)), 1.0, 0.0)),
}
"""Two rows of the matrix of each transform, from its numbers."""


def _transform(text: str) -> FloatArray:
    """Return the matrix (3, 3) of a list of transforms."""
    whole = np.eye(3)
    for name, inside in re.findall(r"(\w+)\s*\(([^)]*)\)", text):
        whole = whole @ np.array([*TRANSFORMS[name](*map(float, NUMBER.findall(inside))), (0.0, 0.0, 1.0)])
    return whole


def _path(text: str) -> list[FloatArray]:
    """Return the polylines of a path; positions are complex numbers here."""
    words, lines, now, begin, kept, command = WORD.findall(text), [], 0j, 0j, 0j, ""
    line: list[complex] = []
    place, before = 0, ""
    while place < len(words):
        if words[place].isalpha():
            command, place = words[place], place + 1
        kind, count = command.upper(), COUNT[command.upper()]
        v = [float(word) for word in words[place : place + count]]
        place += count
        base = now if command.islower() else 0j
        ends = [base + complex(x, y) for x, y in zip(v[::2], v[1::2], strict=False)]
        if kind == "M":
            lines.append(line)
            begin, line, command = ends[0], [ends[0]], "l" if command == "m" else "L"
        elif kind == "Z":
            lines.append([*line, begin])
            line, command = [begin], "M"
        elif kind == "L":
            line.append(ends[0])
        elif kind == "H":
            line.append(complex(v[0] + base.real, now.imag))
        elif kind == "V":
            line.append(complex(now.real, v[0] + base.imag))
        elif kind == "A":
            line += _arc(now, v, base + complex(v[5], v[6]))
        else:
            if kind in "ST":  # the first control point mirrors the last one of the curve before
                ends.insert(0, 2.0 * now - kept if before in ("CS" if kind == "S" else "QT") and before else now)
            line += _bezier([now, *ends])
            kept = ends[-2]
        now, before = line[-1], kind
    return [np.array([(z.real, z.imag) for z in each]) for each in [*lines, line] if len(each) > 1]


def _bezier(points: list[complex]) -> list[complex]:
    weights = basis(len(points) - 1, np.arange(1, STEPS + 1) / STEPS)
    return [complex(place) for place in weights @ np.array(points)]


def _arc(start: complex, v: list[float], end: complex) -> list[complex]:
    """Return points of an elliptical arc: radii, rotation, large and sweep flags (SVG 1.1, F.6.5)."""
    rx, ry, turned = abs(v[0]), abs(v[1]), complex(cos(radians(v[2])), sin(radians(v[2])))
    if not rx or not ry or start == end:
        return [end]
    half = (start - end) / 2.0 / turned
    x, y = half.real / rx, half.imag / ry
    grown = max(1.0, sqrt(x * x + y * y))
    rx, ry, x, y = rx * grown, ry * grown, x / grown, y / grown
    away = sqrt(max(0.0, 1.0 / (x * x + y * y) - 1.0)) * (-1.0 if bool(v[3]) == bool(v[4]) else 1.0)
    cx, cy = away * y, -away * x
    first, last = atan2(y - cy, x - cx), atan2(-y - cy, -x - cx)
    sweep = (last - first) % (2.0 * pi) if v[4] else -((first - last) % (2.0 * pi))
    middle, count = (start + end) / 2.0 + complex(cx * rx, cy * ry) * turned, ceil(4 * STEPS * abs(sweep) / (2.0 * pi))
    angles = [first + sweep * (k + 1) / count for k in range(count - 1)]
    return [*(middle + complex(rx * cos(a), ry * sin(a)) * turned for a in angles), end]
