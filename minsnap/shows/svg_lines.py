"""Lines of SVG drawings: every command of paths, shapes, transforms of groups, and what ``use`` repeats (SVG 1.1)."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from math import atan2, ceil, cos, pi, radians, sin, sqrt, tan
from xml.etree import ElementTree

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.storage.text import FileName, read_text, reading
from minsnap.errors import FileError
from minsnap.polynomials import basis

STEPS = 32
"""Straight parts of one curve."""

DEEPEST = 64
"""How often groups and repeated elements may be inside of each other."""

COUNT = {"M": 2, "L": 2, "H": 1, "V": 1, "C": 6, "S": 4, "Q": 4, "T": 2, "A": 7, "Z": 0}
"""Numbers of each command of a path."""

NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
COMMAND = re.compile(r"([MmLlHhVvCcSsQqTtAaZz])([^MmLlHhVvCcSsQqTtAaZz]*)")
FLAG = re.compile(r"[01]")
HIDDEN = re.compile(r"(?:display\s*:\s*none|visibility\s*:\s*(?:hidden|collapse))")
HREF = ("href", "{http://www.w3.org/1999/xlink}href")
NOT_DRAWN = ("defs", "symbol", "clipPath", "mask", "marker", "pattern")

Element = ElementTree.Element


def read_lines(file: FileName) -> list[FloatArray]:
    """Return the lines of a drawing as polylines (n, 2), y downwards as in the file.

    Raises
    ------
    FileError
        If the file is no SVG, declares entities, or has no lines.
    """
    text = read_text(file)
    if "<!ENTITY" in text or "<!DOCTYPE" in text[:4096] and "[" in text[: text.find(">") + 1]:
        raise FileError(f"{file} declares entities, which are not read: save it as a plain SVG")
    with reading(file, "an SVG drawing"):
        root = ElementTree.fromstring(text)
        named = {str(element.get("id")): element for element in root.iter() if element.get("id")}
        polylines = list(_lines(root, np.eye(3), named))
        letters = any(element.tag.rpartition("}")[2] == "text" for element in root.iter())
    lines = [line for line in polylines if len(line) > 1 and np.isfinite(line).all() and np.ptp(line, axis=0).any()]
    if not lines:
        give = "give an SVG with paths, lines, polygons, rectangles, circles or ellipses"
        give += "; letters become paths in the program that drew it" if letters else ""
        raise FileError(f"{file} has no lines: {give}")
    return lines


def _lines(
    element: Element, outer: FloatArray, named: Mapping[str, Element], depth: int = 0, shown: bool = False
) -> Iterator[FloatArray]:
    """Return the lines of an element and of those inside; one that is repeated is drawn where it stands in defs too."""
    name, attributes = element.tag.rpartition("}")[2] if isinstance(element.tag, str) else "", element.attrib
    if (name in NOT_DRAWN and not shown) or _hidden(attributes):
        return
    if depth > DEEPEST:
        raise FileError("groups are too deep inside of each other, or an element repeats itself")
    place = outer @ _transform(attributes.get("transform", ""))
    if name in ("use", "svg") and (depth or name == "use"):
        place = place @ _transform(f"translate({_number(attributes, 'x')} {_number(attributes, 'y')})")
    for line in _element_lines(name, attributes):
        yield line @ place[:2, :2].T + place[:2, 2]
    for child in element:
        yield from _lines(child, place, named, depth + 1)
    repeated = next((attributes[key] for key in HREF if key in attributes), "") if name == "use" else ""
    if repeated.startswith("#") and repeated[1:] in named:
        yield from _lines(named[repeated[1:]], place, named, depth + 1, True)


def _hidden(attributes: Mapping[str, str]) -> bool:
    drawn = attributes.get("display") != "none" and attributes.get("visibility") not in ("hidden", "collapse")
    return not drawn or HIDDEN.search(attributes.get("style", "")) is not None


def _number(attributes: Mapping[str, str], key: str) -> float:
    match = NUMBER.match(attributes.get(key, "0").strip())
    return float(match.group()) if match else 0.0


def _element_lines(name: str, attributes: Mapping[str, str]) -> list[FloatArray]:
    """Return the lines of one element."""
    if name == "path":
        return path_lines(attributes.get("d", ""))
    if name in ("polyline", "polygon"):
        values = NUMBER.findall(attributes.get("points", ""))
        points = np.array(values[: len(values) // 2 * 2], dtype=np.float64).reshape(-1, 2)
        return [np.concatenate((points, points[:1])) if name == "polygon" else points]
    if name == "line":
        ends = [[_number(attributes, axis + end) for axis in "xy"] for end in "12"]
        return [np.array(ends)]
    if name == "rect":
        return path_lines(_rectangle(attributes))
    if name in ("circle", "ellipse"):
        radii = [_number(attributes, key) for key in (("r", "r") if name == "circle" else ("rx", "ry"))]
        center, angle = [_number(attributes, key) for key in ("cx", "cy")], np.linspace(0.0, 2.0 * pi, 4 * STEPS + 1)
        return [np.column_stack((center[0] + radii[0] * np.cos(angle), center[1] + radii[1] * np.sin(angle)))]
    return []


def _rectangle(attributes: Mapping[str, str]) -> str:
    """Return a rectangle as a path, its corners round where it says so."""
    x, y, w, h = (_number(attributes, key) for key in ("x", "y", "width", "height"))
    radii = {key: _number(attributes, key) for key in ("rx", "ry") if key in attributes}
    rx, ry = (radii.get(key, next(iter(radii.values()), 0.0)) for key in ("rx", "ry"))
    rx, ry = min(rx, w / 2.0), min(ry, h / 2.0)
    if rx <= 0.0 or ry <= 0.0:
        return f"M{x} {y}h{w}v{h}h{-w}z"
    corner = f"a{rx} {ry} 0 0 1"
    sides = f"{corner} {rx} {ry}v{h - 2 * ry}{corner} {-rx} {ry}h{2 * rx - w}{corner} {-rx} {-ry}v{2 * ry - h}"
    return f"M{x + rx} {y}h{w - 2 * rx}{sides}{corner} {rx} {-ry}z"


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


def _commands(text: str) -> Iterator[tuple[str, list[float]]]:
    """Return the commands of a path with their numbers, each time that one has enough of them again.

    The flags of an arc are one digit each and need no space: ``a1 1 0 0110 5``.
    """
    for command, inside in COMMAND.findall(text):
        kind, rest, count = command.upper(), inside, COUNT[command.upper()]
        if kind == "Z":
            yield command, []
            continue
        while match := NUMBER.search(rest):
            values: list[float] = []
            for i in range(count):
                match = (FLAG if kind == "A" and i in (3, 4) else NUMBER).search(rest)
                if match is None:
                    raise FileError(f"the path command {command} has {len(values)} numbers of {count}")
                values.append(float(match.group()))
                rest = rest[match.end() :]
            yield command, values
            command = {"M": "L", "m": "l"}.get(command, command)


def path_lines(text: str) -> list[FloatArray]:
    """Return the polylines of a path's data, shape (n, 2); positions are complex numbers inside."""
    lines: list[list[complex]] = []
    line: list[complex] = []
    now, begin, kept, before = 0j, 0j, 0j, ""
    for command, v in _commands(text):
        kind, base = command.upper(), now if command.islower() else 0j
        ends = [base + complex(x, y) for x, y in zip(v[::2], v[1::2], strict=False)]
        if kind == "M":
            lines.append(line)
            begin, line = ends[0], [ends[0]]
        elif kind == "Z":
            lines.append([*line, begin])
            line = [begin]
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
    # In axes in which the ellipse is a unit circle around the origin of its own center: (x, y) is half of the chord.
    half = (start - end) / 2.0 / turned
    x, y = half.real / rx, half.imag / ry
    grown = max(1.0, sqrt(x * x + y * y))  # radii too short for the chord are enlarged until they reach, as SVG asks
    rx, ry, x, y = rx * grown, ry * grown, x / grown, y / grown
    # The center lies off the chord's middle, at a right angle to it; the two flags choose the side.
    away = sqrt(max(0.0, 1.0 / (x * x + y * y) - 1.0)) * (-1.0 if bool(v[3]) == bool(v[4]) else 1.0)
    cx, cy = away * y, -away * x
    first, last = atan2(y - cy, x - cx), atan2(-y - cy, -x - cx)
    sweep = (last - first) % (2.0 * pi) if v[4] else -((first - last) % (2.0 * pi))
    middle, count = (start + end) / 2.0 + complex(cx * rx, cy * ry) * turned, ceil(4 * STEPS * abs(sweep) / (2.0 * pi))
    angles = [first + sweep * (k + 1) / count for k in range(count - 1)]
    return [*(middle + complex(rx * cos(a), ry * sin(a)) * turned for a in angles), end]
