r"""Upright prisms over polygons: to keep out of, or to keep inside of; and how near a curve comes to them, proved.

A polygon to keep out of is a union of convex ones. Of one to keep inside of, the edges are kept away from: a curve that
begins inside and touches no edge stays inside. A convex part is an overlap of half-planes :math:`n \cdot x \le b`; the
distance of a point outside to it is at least the greatest of :math:`n \cdot x - b`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from math import inf, isinf
from typing import NamedTuple

import numpy as np

from minsnap.basics.arrays import ArrayLike, BoolArray, FloatArray, IntArray, ReadOnly, bounded, numbers, set_fields
from minsnap.basics.cached import cached_property
from minsnap.basics.checks import check_array, check_finite, check_positive
from minsnap.basics.messages import shown
from minsnap.errors import CorridorError
from minsnap.polynomials import rationals
from minsnap.polynomials.enclosures import UNIT
from minsnap.polynomials.extrema import CurveParts
from minsnap.trajectory.trajectory import Trajectory

NARROWEST = 1e-9
"""Difference of a proved margin to a prism and one that is attained [m]."""

TOUCHING = 1e-6
"""How near a line touches a prism, and how far from it the polytopes stay that are laid around lines [m]."""

SIDES = 90
"""Edges of a polygon within a circle: it is 0.06 % smaller."""

HALVED = 60
"""Times that a part of a curve is halved at most."""


@dataclass(frozen=True, eq=False)
class Prism(ReadOnly):
    """An upright prism over a polygon, to keep out of or, with ``inclusion``, to keep inside of: a fence.

    What keeps out, or inside, is the vehicle's center.

    Parameters
    ----------
    polygon : array_like, shape (n, 2)
        Corners in their order [m], n >= 3; edges cross nowhere. It need not be convex.
    low, high : float
        Heights of its ends [m]; by default it has none.
    inclusion : bool
        Whether its inside is where to stay.

    Raises
    ------
    CorridorError
        If a number is none, edges cross, the polygon has no area, or ``low`` is not below ``high``.

    Examples
    --------
    >>> import minsnap
    >>> yard = minsnap.Prism([(0, 0), (9, 0), (9, 6), (5, 6), (5, 3), (0, 3)], inclusion=True)
    >>> curve = minsnap.plan([(1, 1, 1), (8, 5, 1)], limits=minsnap.Limits(speed=2, acceleration=4), avoid=yard)
    >>> minsnap.certify(curve, avoid=yard).ok
    True
    """

    polygon: FloatArray
    low: float
    high: float
    inclusion: bool

    def __init__(self, polygon: ArrayLike, low: float = -inf, high: float = inf, *, inclusion: bool = False) -> None:
        corners = numbers(polygon)
        if corners is None or corners.ndim != 2 or corners.shape[1:] != (2,):
            raise CorridorError(f"the polygon of a prism is {shown(polygon)}: give rows of two finite numbers [m]")
        check_finite("the polygon of a prism", corners, CorridorError)
        corners = corners[(corners != np.roll(corners, 1, axis=0)).any(axis=1)]
        ends = numbers((low, high))
        if ends is None or ends.shape != (2,) or not ends[0] < ends[1]:
            raise CorridorError(f"a prism runs from {shown(low)} to {shown(high)}: give low below high [m]")
        if len(corners) < 3 or _area(corners) == 0.0:
            raise CorridorError(f"the polygon of a prism has {len(corners)} corners and no area: give three or more")
        crossed = _crossing(corners)
        if crossed is not None:
            raise CorridorError(
                f"edges {crossed[0]} and {crossed[1]} of the polygon of a prism cross: order its corners"
            )
        corners = corners if _area(corners) > 0.0 else corners[::-1].copy()
        set_fields(self, polygon=corners, low=float(ends[0]), high=float(ends[1]), inclusion=bool(inclusion))
        _ = self.parts  # refuses what has none

    @classmethod
    def circle(
        cls, center: ArrayLike, radius: float, low: float = -inf, high: float = inf, *, inclusion: bool = False
    ) -> Prism:
        """Return a prism over a polygon of 90 corners: within a circle to keep inside of, else around it."""
        angle = 2.0 * np.pi * np.arange(SIDES) / SIDES
        middle = check_array("the center of a circle", center, ((2,),), "x and y [m]", CorridorError)
        far = check_positive("the radius of a circle", radius, "m", CorridorError)
        around = np.stack((np.cos(angle), np.sin(angle)), axis=1) / (1.0 if inclusion else np.cos(np.pi / SIDES))
        return cls(middle + far * around, low, high, inclusion=inclusion)

    @cached_property
    def parts(self) -> tuple[ConvexPart, ...]:
        """Convex sets that a curve keeps out of: those of the prism, or the edges and the ends of a fence."""
        if self.inclusion:
            walls = [_edge(*pair) for pair in zip(self.polygon, np.roll(self.polygon, -1, axis=0), strict=True)]
            below = [_half_space(-1.0, self.low)] * (not isinf(self.low))
            return (*walls, *below, *[_half_space(1.0, self.high)] * (not isinf(self.high)))
        return tuple(_part(self.polygon[list(corners)], self.low, self.high) for corners in convex_parts(self.polygon))

    def contains(self, points: ArrayLike) -> BoolArray:
        """Return which points (..., 2 or 3) are over the polygon and between the ends."""
        points = check_places(points)
        inside = _inside(self.polygon, points[..., :2])
        if points.shape[-1] > 2:
            inside &= (points[..., 2] >= self.low) & (points[..., 2] <= self.high)
        return inside

    def clearances(self, points: ArrayLike) -> FloatArray:
        """Return how far points (..., 2 or 3) are outside, or of a fence inside; negative on the other side [m]."""
        points = check_places(points)
        parts = [part for part in self.parts if part.upright or points.shape[-1] == 3]
        away = np.min([part.distances(points) for part in parts], axis=0)
        if not self.inclusion:
            return np.asarray(away)
        return np.asarray(np.where(self.contains(points), np.abs(away), -_beyond(self, points)))


def check_places(points: ArrayLike) -> FloatArray:
    """Return points as an array (..., 2 or 3) of finite numbers [m], or raise CorridorError."""
    places = numbers(points)
    if places is None or not places.ndim or places.shape[-1] not in (2, 3) or not bounded(places).all():
        raise CorridorError(f"the points are {shown(points)}: give rows of two or three finite numbers [m]")
    return places


class ConvexPart(NamedTuple):
    """A convex set: what satisfies n·x <= b.

    Parameters
    ----------
    corners : ndarray, shape (k, 2)
        Seen from above; none for all that is above or below a height [m].
    normals : ndarray, shape (m, 3)
    bounds : ndarray, shape (m,)
        [m].
    low, high : float
        Heights of its ends [m].
    """

    corners: FloatArray
    normals: FloatArray
    bounds: FloatArray
    low: float
    high: float

    @property
    def upright(self) -> bool:
        """Whether it has sides, not only an end."""
        return len(self.corners) > 0

    def clearances(self, points: FloatArray) -> FloatArray:
        """Return how far points (..., 2 or 3) are outside of its faces, at least; negative inside [m]."""
        products = points @ self.normals[:, : points.shape[-1]].T - self.bounds
        usable = np.asarray((self.normals[:, 2] == 0.0) | (points.shape[-1] == 3))
        return np.asarray(products[..., usable].max(axis=-1, initial=-inf))

    def distances(self, points: FloatArray) -> FloatArray:
        """Return how far points (..., 2 or 3) are from it [m]; inside, as ``clearances``."""
        away = np.linalg.norm(points - self.nearest(points), axis=-1)
        return np.asarray(np.where(away > 0.0, away, np.minimum(self.clearances(points), 0.0)))

    def nearest(self, points: FloatArray) -> FloatArray:
        """Return its nearest points to points (..., 2 or 3) [m]; the same for those inside."""
        flat = points[..., :2]
        if self.upright:
            a, b = self.corners, np.roll(self.corners, -1, axis=0)
            at, line = flat[..., None, :], b - a
            share = ((at - a) * line).sum(axis=-1) / (line * line).sum(axis=-1)
            feet = a + np.clip(share, 0.0, 1.0)[..., None] * line
            which = ((feet - at) ** 2).sum(axis=-1).argmin(axis=-1)
            nearest = np.take_along_axis(feet, which[..., None, None], axis=-2)[..., 0, :]
            inside = np.asarray((_side(a, b, np.broadcast_to(at, feet.shape)) >= 0.0).all(axis=-1) & (len(a) > 2))
            flat = np.where(inside[..., None], flat, nearest)
        if points.shape[-1] == 2:
            return np.asarray(flat)
        return np.concatenate((flat, np.clip(points[..., 2:], self.low, self.high)), axis=-1)

    def below(self, points: FloatArray) -> FloatArray:
        """Return lower bounds of the distance to curves with control points (m, n + 1, dim) [m].

        By a plane that touches the set where it is nearest to the middle of the control points, or by a face.
        """
        middle = 0.5 * (points.min(axis=1) + points.max(axis=1))
        normal = self._away(middle)
        beyond = np.einsum("mnd,md->mn", points, normal).min(axis=1) - self._support(normal)
        products = np.einsum("mnd,kd->mnk", points, self.normals[:, : points.shape[2]]) - self.bounds
        usable = (self.normals[:, 2] == 0.0) | (points.shape[2] == 3)
        faces = products[:, :, usable].min(axis=1).max(axis=1)
        return np.asarray(np.maximum(np.where(normal.any(axis=1), beyond, -inf), faces))

    def _away(self, places: FloatArray) -> FloatArray:
        """Return the directions away from it at places (m, dim), a little shorter than 1; 0 inside."""
        way = places - self.nearest(places)
        length = np.linalg.norm(way, axis=1, keepdims=True)
        return np.asarray(way / np.maximum(length * (1.0 + 16.0 * UNIT), 1e-300) * (length > 0.0))

    def _support(self, normal: FloatArray) -> FloatArray:
        """Return the greatest products of normals (m, dim) with points of it [m]."""
        most = (normal[:, :2] @ self.corners.T).max(axis=1, initial=-inf) if self.upright else np.zeros(len(normal))
        if normal.shape[1] == 3:
            ends = np.where(normal[:, 2] > 0.0, self.high, self.low)
            most = most + np.where(normal[:, 2] == 0.0, 0.0, normal[:, 2] * np.where(normal[:, 2] == 0.0, 0.0, ends))
        return np.asarray(most)

    def is_beyond(self, curve: rationals.Curve, margin: Fraction, halvings: int) -> bool:
        """Whether a curve is proved to be away from it by a margin, in exact arithmetic."""
        axes = [[float(value) for value in axis] for axis in curve]
        middle = np.array([[0.5 * (min(axis) + max(axis)) for axis in axes]])
        normal = self._away(middle)[0]
        if normal.any() and sum(Fraction(float(n)) ** 2 for n in normal) <= 1:
            if min(rationals.along(curve, normal)) - self._exact_support(normal) >= margin:
                return True
        for face, bound in zip(self.normals, self.bounds.tolist(), strict=True):
            if face[len(curve) :].any():
                continue
            if min(rationals.along(curve, face[: len(curve)])) - Fraction(bound) >= margin:
                return True
        if halvings == 0:
            return False
        halves = zip(*(_halves(axis) for axis in curve), strict=True)
        return all(self.is_beyond(list(half), margin, halvings - 1) for half in halves)

    def _exact_support(self, normal: FloatArray) -> Fraction:
        x, y, *up = (Fraction(float(n)) for n in normal)
        flat = [x * Fraction(float(a)) + y * Fraction(float(b)) for a, b in self.corners]
        most = max(flat, default=Fraction(0))
        return most + (up[0] * Fraction(self.high if up[0] > 0 else self.low) if up and up[0] else 0)


def _halves(points: rationals.Scalar) -> tuple[rationals.Scalar, rationals.Scalar]:
    """Return the control points of both halves of a polynomial: de Casteljau's algorithm."""
    first, last, rest = [points[0]], [points[-1]], list(points)
    while len(rest) > 1:
        rest = [(a + b) / 2 for a, b in zip(rest, rest[1:], strict=False)]
        first.append(rest[0])
        last.append(rest[-1])
    return first, last[::-1]


def _area(corners: FloatArray) -> float:
    after = np.roll(corners, -1, axis=0)
    return float(0.5 * (corners[:, 0] * after[:, 1] - corners[:, 1] * after[:, 0]).sum())


def _side(a: FloatArray, b: FloatArray, c: FloatArray) -> FloatArray:
    """Return on which side of the lines ab points c are: positive to the left; shapes (..., 2)."""
    along, to = b - a, c - a
    return np.asarray(along[..., 0] * to[..., 1] - along[..., 1] * to[..., 0])


def _crossing(corners: FloatArray) -> tuple[int, int] | None:
    """Return two edges that cross or touch and are no neighbours, or None."""
    after, count = np.roll(corners, -1, axis=0), len(corners)
    a, b, c, d = corners[:, None], after[:, None], corners[None], after[None]
    apart = (_side(a, b, c) * _side(a, b, d) > 0.0) | (_side(c, d, a) * _side(c, d, b) > 0.0)
    low, high = np.minimum(a, b), np.maximum(a, b)
    boxes = (low > np.maximum(c, d)).any(axis=2) | (high < np.minimum(c, d)).any(axis=2)
    gap = np.abs(np.arange(count)[:, None] - np.arange(count))
    met = np.argwhere(~(apart | boxes) & (gap > 1) & (gap < count - 1))
    return None if not len(met) else (int(met[0, 0]), int(met[0, 1]))


def _inside(corners: FloatArray, points: FloatArray) -> BoolArray:
    """Return which points (..., 2) a line from far away reaches over an odd number of edges."""
    x, y = points[..., 0], points[..., 1]
    inside = np.zeros(x.shape, dtype=np.bool_)
    for (ax, ay), (bx, by) in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        if ay != by:
            inside ^= ((ay > y) != (by > y)) & (x < (bx - ax) * (y - ay) / (by - ay) + ax)
    return inside


def _beyond(prism: Prism, points: FloatArray) -> FloatArray:
    """Return how far points outside of a fence are from it, at least its rounding [m]."""
    a, b = prism.polygon, np.roll(prism.polygon, -1, axis=0)
    flat = to_segments(points[..., None, :2], a, b).min(axis=-1)
    flat = np.where(_inside(prism.polygon, points[..., :2]), 0.0, flat)
    if points.shape[-1] > 2:
        flat = np.maximum(flat, np.maximum(prism.low - points[..., 2], points[..., 2] - prism.high))
    return np.asarray(np.maximum(flat, 2.0 * NARROWEST))


def to_segments(points: FloatArray, a: FloatArray, b: FloatArray) -> FloatArray:
    """Return the distances of points (..., 2) to segments ab (..., 2) [m]."""
    line = b - a
    share = ((points - a) * line).sum(axis=-1) / np.maximum((line * line).sum(axis=-1), 1e-300)
    return np.asarray(np.linalg.norm(points - a - np.clip(share, 0.0, 1.0)[..., None] * line, axis=-1))


def _part(corners: FloatArray, low: float, high: float) -> ConvexPart:
    """Return the prism over a convex polygon whose corners run to the left."""
    along = np.roll(corners, -1, axis=0) - corners
    normals = np.stack((along[:, 1], -along[:, 0]), axis=1) / np.linalg.norm(along, axis=1, keepdims=True)
    return _with_ends(corners, normals, (normals * corners).sum(axis=1), low, high)


def _edge(a: FloatArray, b: FloatArray) -> ConvexPart:
    """Return an edge of a fence as a set without width."""
    along = (b - a) / np.linalg.norm(b - a)
    across = np.array([along[1], -along[0]])
    normals = np.stack((across, -across, along, -along))
    bounds = np.array([across @ a, -(across @ a), along @ b, -(along @ a)])
    return _with_ends(np.stack((a, b)), normals, bounds, -inf, inf)


def _half_space(up: float, height: float) -> ConvexPart:
    """Return all that is above (1) or below (-1) a height."""
    ends = (height, inf) if up > 0.0 else (-inf, height)
    return ConvexPart(np.zeros((0, 2)), np.array([[0.0, 0.0, -up]]), np.array([-up * height]), *ends)


def _with_ends(corners: FloatArray, normals: FloatArray, bounds: FloatArray, low: float, high: float) -> ConvexPart:
    faces, ends = np.pad(normals, ((0, 0), (0, 1))), np.array([[0.0, 0.0, -1.0], [0.0, 0.0, 1.0]])
    has = [not isinf(low), not isinf(high)]
    return ConvexPart(corners, np.vstack((faces, ends[has])), np.append(bounds, np.array([-low, high])[has]), low, high)


def convex_parts(corners: FloatArray) -> list[tuple[int, ...]]:
    """Return convex parts of a polygon whose corners run to the left, by the numbers of their corners.

    Ears are cut off, and triangles joined where the union is convex (S. Hertel and K. Mehlhorn, "Fast triangulation of
    simple polygons", FCT 1983): at most four times as many parts as the least.
    """
    parts = _triangles(corners)
    joined = True
    while joined:
        joined = False
        edges = {(part[i - 1], part[i]): number for number, part in enumerate(parts) for i in range(len(part))}
        for (a, b), one in list(edges.items()):
            other = edges.get((b, a))
            if other is None or other == one:
                continue
            union = _joined(parts[one], parts[other], a, b)
            if _convex(corners[list(union)]):
                parts = [part for number, part in enumerate(parts) if number not in (one, other)] + [union]
                joined = True
                break
    return parts


def _joined(one: tuple[int, ...], other: tuple[int, ...], a: int, b: int) -> tuple[int, ...]:
    """Join two parts along the edge ab of the first, which is ba of the other."""
    first, second = one.index(b), other.index(a)
    return (*one[first:], *one[:first], *(other[second:] + other[:second])[1:-1])


def _convex(corners: FloatArray) -> bool:
    after = np.roll(corners, -1, axis=0)
    return bool((_side(corners, after, np.roll(corners, -2, axis=0)) > 0.0).all())


def _triangles(corners: FloatArray) -> list[tuple[int, ...]]:
    """Cut ears off a polygon."""
    left, triangles = list(range(len(corners))), list[tuple[int, ...]]()
    while len(left) > 3:
        for i, tip in enumerate(left):
            before, after = left[i - 1], left[(i + 1) % len(left)]
            a, b, c = corners[before], corners[tip], corners[after]
            turn = float(_side(a, b, c))
            others = corners[[each for each in left if each not in (before, tip, after)]]
            within = (_side(a, b, others) > 0.0) & (_side(b, c, others) > 0.0) & (_side(c, a, others) > 0.0)
            if turn == 0.0 or (turn > 0.0 and not within.any()):
                triangles += [(before, tip, after)] * (turn > 0.0)
                left.pop(i)
                break
        else:
            raise CorridorError("the polygon of a prism is degenerate to rounding: drop corners that lie on its edges")
    return [*triangles, tuple(left)]


class PrismGap(NamedTuple):
    """The least distance of a curve to a prism [m], proved, and when [s]."""

    value: float
    instant: float


def nearest_prism(curve: Trajectory, prism: Prism) -> PrismGap:
    """Return how near a curve comes to a prism; of a fence, how far inside it stays."""
    instants = np.concatenate([np.linspace(a, b, 33) for a, b in zip(curve.breaks, curve.breaks[1:], strict=False)])
    sampled = prism.clearances(np.asarray(curve(instants)))
    least = int(sampled.argmin())
    if prism.inclusion and sampled[least] < 0.0:
        return PrismGap(float(sampled[least]), float(instants[least]))
    found = _least_gap(curve, prism, float(sampled[least]), float(instants[least]))
    touched = prism.inclusion and found.value <= NARROWEST
    return PrismGap(-2.0 * NARROWEST, found.instant) if touched else found


def _least_gap(curve: Trajectory, prism: Prism, best: float, instant: float) -> PrismGap:
    """Halve the pairs of a piece and a part until the bound of each is near what is attained."""
    count, proved = len(curve.durations), inf
    for part in prism.parts:
        if not part.upright and curve.dim == 2:
            continue
        left = CurveParts([curve.control_points], np.arange(count), np.zeros(count), np.ones(count))
        size = float(np.abs(curve.control_points).max()) + float(np.abs(part.corners).max(initial=0.0))
        for _ in range(HALVED):
            points = left.curves[0]
            lower = part.below(points) - 64.0 * UNIT * size
            ends = part.distances(points[:, [0, -1]])
            row, end = (int(index) for index in np.unravel_index(int(ends.argmin()), ends.shape))
            if ends[row, end] < best:
                piece, where = int(left.row[row]), float(left.low[row] + end * left.width[row])
                best = float(ends[row, end])
                instant = float(curve.breaks[piece] + where * curve.durations[piece])
            open_ = lower < best - NARROWEST
            proved = min(proved, float(lower[~open_].min(initial=inf)))
            if not open_.any():
                break
            left = left.chosen(open_).halved()
        else:
            proved = min(proved, float(lower.min()))
    return PrismGap(min(proved, best), instant)


def keeps_from_prism(curve: Trajectory, prism: Prism, margin: float) -> bool:
    """Whether a margin to a prism is proved over all time, in exact arithmetic of the stored numbers."""
    if prism.inclusion and (margin <= 0.0 or not prism.contains(curve.control_points[0, 0])):
        return margin < 0.0
    parts = [part for part in prism.parts if part.upright or curve.dim == 3]
    asked = Fraction(margin)
    return all(
        part.is_beyond(rationals.exact(points), asked, HALVED) for points in curve.control_points for part in parts
    )


ALL = slice(None)
"""Every part."""


class PartTable:
    """Convex parts of prisms in arrays, to measure many lines against all of them.

    Parameters
    ----------
    prisms : sequence of Prism
    dim : int
        Of lines and points.
    """

    def __init__(self, prisms: Sequence[Prism], dim: int) -> None:
        self.dim, self.prisms = dim, tuple(prisms)
        parts = [(part, which) for which, prism in enumerate(prisms) for part in prism.parts if len(part.corners)]
        self.parts, self.which = [part for part, _ in parts], np.array([which for _, which in parts], dtype=np.intp)
        most = max((len(part.corners) for part in self.parts), default=1)
        filled = [np.vstack((p.corners, np.repeat(p.corners[-1:], most - len(p.corners), axis=0))) for p in self.parts]
        self.corners = np.array(filled).reshape(-1, most, 2)
        self.low = np.array([part.low for part in self.parts])
        self.high = np.array([part.high for part in self.parts])

    def __len__(self) -> int:
        return len(self.parts)

    def ends(self) -> list[tuple[float, float]]:
        """Return between which heights the fences stay, where they have ends."""
        found = [(each.low, each.high) for each in self.prisms if each.inclusion]
        return [pair for pair in found if not (isinf(pair[0]) and isinf(pair[1]))] if self.dim == 3 else []

    def solid(self, index: int) -> bool:
        """Whether a part is no edge of a fence."""
        return not self.prisms[self.which[index]].inclusion

    def box(self, index: int) -> tuple[FloatArray, FloatArray]:
        """Return the lower and the upper corner around a part, (dim,) [m]."""
        flat = self.corners[index]
        low, high = np.append(flat.min(axis=0), self.low[index]), np.append(flat.max(axis=0), self.high[index])
        return low[: self.dim], high[: self.dim]

    def gaps(self, points: FloatArray, index: int) -> FloatArray:
        """Return the distances of points (..., dim) to a part, (...) [m]."""
        places = points[..., None, :]
        return np.asarray(np.linalg.norm(self._nearest(places, slice(index, index + 1)) - places, axis=-1)[..., 0])

    def from_lines(self, lines: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return distances of segments (m, 2, dim) to all parts, (m, parts), and the ways there, (m, parts, dim) [m].

        The distance is convex along a segment: golden sections find its least value.
        """
        begin, along = lines[:, 0], lines[:, 1] - lines[:, 0]
        count = len(self)
        golden = 0.5 * (5.0**0.5 - 1.0)
        low, high = np.zeros((len(lines), count)), np.ones((len(lines), count))

        def way(share: FloatArray) -> FloatArray:
            places = begin[:, None] + share[..., None] * along[:, None]
            return self._nearest(places) - places

        for _ in range(40):
            one, two = high - golden * (high - low), low + golden * (high - low)
            better = np.linalg.norm(way(one), axis=-1) <= np.linalg.norm(way(two), axis=-1)
            low, high = np.where(better, low, one), np.where(better, two, high)
        tried = np.stack([way(share) for share in (0.5 * (low + high), np.zeros_like(low), np.ones_like(low))])
        least = np.linalg.norm(tried, axis=-1)
        best = least.argmin(axis=0)
        ways = np.take_along_axis(tried, best[None, ..., None], axis=0)[0]
        distances = np.take_along_axis(least, best[None], axis=0)[0]
        return np.where(distances < TOUCHING, 0.0, distances), ways

    def _nearest(self, places: FloatArray, which: slice = ALL) -> FloatArray:
        """Return the nearest points of parts to places (..., parts or 1, dim), of each part to its own [m]."""
        a = self.corners[which]
        b = np.roll(a, -1, axis=1)
        at, line = places[..., None, :2], b - a
        share = ((at - a) * line).sum(axis=-1) / np.maximum((line * line).sum(axis=-1), 1e-300)
        feet = a + np.clip(share, 0.0, 1.0)[..., None] * line
        apart = ((feet - at) ** 2).sum(axis=-1)
        nearest = np.take_along_axis(feet, apart.argmin(axis=-1)[..., None, None], axis=-2)[..., 0, :]
        point_like = (line == 0.0).all(axis=-1)
        left = (_side(a, b, np.broadcast_to(at, feet.shape)) >= 0.0) | point_like
        inside = ((~point_like).sum(axis=1) > 2) & left.all(axis=-1)
        nearest = np.where(inside[..., None], np.broadcast_to(places[..., :2], nearest.shape), nearest)
        if self.dim == 2:
            return np.asarray(nearest)
        height = np.clip(np.broadcast_to(places[..., 2], nearest.shape[:-1]), self.low[which], self.high[which])
        return np.concatenate((nearest, height[..., None]), axis=-1)

    def supports(self, normals: FloatArray, which: IntArray | int) -> FloatArray:
        """Return the least products of normals (..., dim) with points of parts [m]."""
        flat = (self.corners[which] * normals[..., None, :2]).sum(axis=-1).min(axis=-1)
        if self.dim == 2:
            return np.asarray(flat)
        up = normals[..., 2]
        with np.errstate(invalid="ignore"):
            heights = np.where(up > 0.0, up * self.low[which], np.where(up < 0.0, up * self.high[which], 0.0))
        return np.asarray(flat + heights)
