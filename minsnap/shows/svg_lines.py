"""Formations along the lines of an SVG drawing: paths, lines and shapes, with the transforms of their groups."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from math import atan2, ceil, cos, pi, radians, sin, sqrt, tan
from xml.etree import ElementTree

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.checks import check_positive
from minsnap.basics.storage.reading import reading
from minsnap.basics.storage.text import read_text
from minsnap.errors import FileError, FleetError
from minsnap.polynomials.bernstein import basis
from minsnap.shows.formations import along

STEPS = 32
"""Straight parts of one curve."""

COUNT = {"M": 2, "L": 2, "H": 1, "V": 1, "C": 6, "S": 4, "Q": 4, "T": 2, "A": 7, "Z": 0}
"""Numbers of each command of a path."""

NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
WORD = re.compile(rf"[MmLlHhVvCcSsQqTtAaZz]|{NUMBER.pattern}")


def svg(vehicles: int, file: str | os.PathLike[str], size: float, height: float = 0.0) -> FloatArray:
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
    size = check_positive("the size of a drawing", size, "m", FleetError)
    lines = read_lines(file)
    points = along(lines, vehicles)
    low, high = np.concatenate(lines).min(axis=0), np.concatenate(lines).max(axis=0)
    placed = (points - [(low[0] + high[0]) / 2.0, high[1]]) * (size / max(float((high - low).max()), 1e-300))
    return np.column_stack((placed[:, 0], np.zeros(vehicles), height - placed[:, 1]))


def read_lines(file: str | os.PathLike[str]) -> list[FloatArray]:
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
    for line in _drawn(name, dict(attributes)):
        yield line @ place[:2, :2].T + place[:2, 2]
    for child in element:
        yield from _lines(child, place)


def _drawn(name: str, attributes: dict[str, str]) -> list[FloatArray]:
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


def _transform(text: str) -> FloatArray:
    """Return the matrix (3, 3) of a list of transforms."""
    whole = np.eye(3)
    for name, inside in re.findall(r"(\w+)\s*\(([^)]*)\)", text):
        v = [float(each) for each in NUMBER.findall(inside)]
        if name == "matrix":
            one = [[v[0], v[2], v[4]], [v[1], v[3], v[5]]]
        elif name == "translate":
            one = [[1, 0, v[0]], [0, 1, v[1] if len(v) > 1 else 0]]
        elif name == "scale":
            one = [[v[0], 0, 0], [0, v[-1], 0]]
        elif name == "rotate":
            c, s = cos(radians(v[0])), sin(radians(v[0]))
            x, y = v[1:3] if len(v) > 1 else (0.0, 0.0)
            one = [[c, -s, x - c * x + s * y], [s, c, y - s * x - c * y]]
        else:
            slope = tan(radians(v[0]))
            one = [[1, slope, 0], [0, 1, 0]] if name == "skewX" else [[1, 0, 0], [slope, 1, 0]]
        whole = whole @ np.array([*one, [0, 0, 1]], dtype=np.float64)
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
        place += max(count, 0 if kind == "Z" else 1)
        base = now if command.islower() else 0j
        ends = [base + complex(x, y) for x, y in zip(v[::2], v[1::2], strict=False)]
        if kind == "M":
            lines.append(line)
            now = begin = ends[0]
            line, command = [now], "l" if command == "m" else "L"
        elif kind == "Z":
            line.append(begin)
            lines.append(line)
            now, line, command = begin, [begin], "M"
        elif kind in "LHV":
            if kind == "H":
                ends = [complex(v[0] + base.real, now.imag)]
            elif kind == "V":
                ends = [complex(now.real, v[0] + base.imag)]
            now = ends[0]
            line.append(now)
        elif kind == "A":
            end = base + complex(v[5], v[6])
            line += _arc(now, v, end)
            now = end
        else:
            if kind in "ST":  # the first control point mirrors the last one of the curve before
                ends.insert(0, 2.0 * now - kept if before in ("CS" if kind == "S" else "QT") and before else now)
            line += _bezier([now, *ends])
            kept, now = ends[-2], ends[-1]
        before = kind
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
    angles = [first + sweep * (k + 1) / count for k in range(count)]
    return [middle + complex(rx * cos(a), ry * sin(a)) * turned for a in angles]
