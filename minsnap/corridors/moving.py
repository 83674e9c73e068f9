r"""Obstacles that move: where they are at each instant, and how near a curve comes to one, proved over all time.

On an interval on which both are polynomials, the curve keeps a margin :math:`m` where
:math:`(m + r + gt)^2 - |c(t) - o(t)|^2` is nowhere positive: one polynomial, whose maximum is proved.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np

from minsnap.basics.arrays import SMALLEST, ArrayLike, FloatArray, ReadOnly, bounded, numbers, set_fields
from minsnap.basics.checks import check_array, check_distance, check_number
from minsnap.basics.messages import shown
from minsnap.corridors.prism import check_places
from minsnap.errors import CorridorError, InputError
from minsnap.native import proved_extrema as native
from minsnap.polynomials import rationals
from minsnap.polynomials.bernstein import basis, multiply, squared_norm
from minsnap.polynomials.enclosures import UNIT
from minsnap.trajectory.norm_maxima import cut, elevated_points
from minsnap.trajectory.path import Path
from minsnap.trajectory.trajectory import Trajectory

LOOKED = 64
"""Instants of an interval at which a distance is looked at before its least value is found."""

LATEST = 1e12
"""Seconds by which a clock begins later, or earlier, at most."""

FIRST_GAP, WIDER = 1e-9, 10.0
"""How far a proved margin is below the one found at first [m], and by which factor further where it is not proved."""


@dataclass(frozen=True, eq=False)
class Moving(ReadOnly):
    """A ball, or an upright cylinder without ends, that moves as is known, and may depart from it ever further.

    What keeps out is the vehicle's center: make the radius larger by what the vehicle itself needs.

    Parameters
    ----------
    path : Path, or array_like of shape (k, 1 + dim)
        How its center moves: a trajectory, whose time 0 is that of the plan; or rows of an instant [s] and a position
        [m], straight between them, k >= 1. Before and after it rests. Of three coordinates it is a ball; of two an
        upright cylinder.
    radius : float
        [m].
    growth : float
        How fast the radius grows from the beginning of the path on [m/s]: the greatest speed with which it may leave
        the path. What was seen at one place has one row there, and its greatest speed here.

    Raises
    ------
    CorridorError
        If an argument is malformed.

    Examples
    --------
    >>> import minsnap
    >>> crossing = minsnap.Moving([(0, 3, -3, 1), (6, 3, 3, 1)], 0.5)
    >>> limits = minsnap.Limits(speed=2, acceleration=4, jerk=20)
    >>> curve = minsnap.plan([(0, 0, 1), (6, 0, 1)], limits=limits, avoid=crossing)
    >>> minsnap.certify(curve, avoid=crossing).ok
    True
    """

    motion: Trajectory
    radius: float
    growth: float
    begin: float

    def __init__(self, path: Path | ArrayLike, radius: float, growth: float = 0.0) -> None:
        motion, begin = _motion(path)
        give = "a positive number [m]"
        size = check_array("the radius of a moving obstacle", radius, ((),), give, CorridorError, SMALLEST)
        faster = check_distance("the growth of a moving obstacle", growth, CorridorError)
        set_fields(self, motion=motion, radius=float(size), growth=faster, begin=begin)

    def wider(self, distance: float) -> Moving:
        """Return the same obstacle with a radius that is larger by a distance [m]."""
        wider, radius = object.__new__(Moving), self.radius + check_distance("the distance", distance, CorridorError)
        set_fields(wider, motion=self.motion, radius=radius, growth=self.growth, begin=self.begin)
        return wider

    @property
    def dim(self) -> int:
        """Coordinates: 3 for a ball, 2 for a cylinder."""
        return self.motion.dim

    @property
    def speed(self) -> float:
        """Its greatest speed along the path [m/s]."""
        return self.motion.max_norm(1)[0]

    def center(self, t: ArrayLike) -> FloatArray:
        """Return where its center is at instants (...), shape (..., dim) [m]."""
        return self.motion(np.clip(_instants(t) - self.begin, 0.0, self.motion.duration))

    def radius_at(self, t: ArrayLike) -> FloatArray:
        """Return its radius at instants (...) [m]: it grows from the beginning of the path on."""
        return np.asarray(self.radius + self.growth * np.maximum(_instants(t) - self.begin, 0.0))

    def after(self, seconds: float) -> Moving:
        """Return the same obstacle on a clock that begins later."""
        later = object.__new__(Moving)
        begin = self.begin - check_number(
            "the seconds after which a clock begins", seconds, -LATEST, LATEST, "give them"
        )
        set_fields(later, motion=self.motion, radius=self.radius, growth=self.growth, begin=begin)
        return later

    def clearances(self, points: ArrayLike, t: ArrayLike) -> FloatArray:
        """Return how far points (..., 2 or 3) are from it at instants (...), negative inside [m]."""
        places = check_places(points)
        apart = _shared(places, self.dim) - _shared(self.center(t), places.shape[-1])
        return np.asarray(np.linalg.norm(apart, axis=-1) - self.radius_at(t))

    def rows(self) -> list[list[float]] | None:
        """Return instants and positions between which it moves straight; None where it does not."""
        if self.motion.degree != 1:
            return None
        ends = np.concatenate((self.motion.control_points[:, 0], self.motion.control_points[-1:, 1]))
        table = np.column_stack((self.begin + self.motion.breaks, ends))
        still = len(table) == 2 and (ends[0] == ends[1]).all()
        return [[float(value) for value in row] for row in (table[:1] if still else table)]


def _instants(t: ArrayLike) -> FloatArray:
    """Return instants as an array of finite numbers [s], or raise InputError."""
    instants = numbers(t)
    if instants is None or not bounded(instants).all():
        raise InputError(f"the instants are {shown(t)}: give finite numbers [s]")
    return instants


def _motion(path: Any) -> tuple[Trajectory, float]:
    """Return the motion of a path or of rows, and when it begins [s]."""
    if isinstance(path, Path):
        curve = path.as_trajectory()
        if curve.dim not in (2, 3):
            raise CorridorError(f"a moving obstacle has {curve.dim} coordinates: give two or three")
        return curve, 0.0
    rows = numbers(path)
    if rows is None or rows.ndim != 2 or rows.shape[1] not in (3, 4) or not len(rows) or not np.isfinite(rows).all():
        raise CorridorError(
            f"the path of a moving obstacle is {shown(path)}: give a trajectory, or rows t, x, y or t, x, y, z of "
            "finite numbers [s, m]"
        )
    if len(rows) == 1:
        rows = np.vstack((rows, rows + np.eye(1, rows.shape[1])))
    steps = np.diff(rows[:, 0])
    if not (steps > 0.0).all():
        raise CorridorError(
            f"the instants of a moving obstacle do not increase at row {int(np.argmax(steps <= 0.0)) + 1}"
        )
    return Trajectory(np.stack((rows[:-1, 1:], rows[1:, 1:]), axis=1), steps), float(rows[0, 0])


def _shared(points: FloatArray, dim: int) -> FloatArray:
    """Return the coordinates that points have in common with what has so many: a cylinder has no height."""
    return points[..., : min(points.shape[-1], dim)]


class LeastGap(NamedTuple):
    """The least distance of a curve to a moving obstacle [m], proved where it is not negative, and when [s]."""

    value: float
    instant: float


class _Arcs(NamedTuple):
    """What is between a curve and an obstacle on intervals: control points (m, n + 1, dim), and their ends (m,) [s]."""

    away: FloatArray
    begin: FloatArray
    end: FloatArray
    size: float


def nearest_moving(curve: Trajectory, obstacle: Moving) -> LeastGap:
    """Return how near a curve comes to a moving obstacle, from time 0 to its end."""
    arcs = _arcs(curve, obstacle)
    least, instant = _found(arcs, obstacle)
    if least <= 0.0:
        return LeastGap(least, instant)
    gap = FIRST_GAP
    while gap < least and not _is_kept(arcs, obstacle, least - gap):
        gap *= WIDER
    return LeastGap(least - gap if gap < least else 0.0, instant)


def _arcs(curve: Trajectory, obstacle: Moving) -> _Arcs:
    """Return the curve minus the obstacle wherever both are one polynomial."""
    dim, motion = min(curve.dim, obstacle.dim), obstacle.motion
    degree = max(curve.degree, motion.degree)
    inner = obstacle.begin + motion.breaks
    breaks = np.unique(np.concatenate((curve.breaks, inner[(inner > 0.0) & (inner < curve.duration)])))
    breaks = breaks[np.append(True, np.diff(breaks) > 8.0 * UNIT * curve.duration)]
    breaks[-1] = curve.duration
    ends = list(zip(breaks[:-1].tolist(), breaks[1:].tolist(), strict=True))
    own = np.concatenate([_part(curve, *each) for each in ends])[..., :dim]
    other = np.concatenate([_part(motion, *each, shift=obstacle.begin) for each in ends])[..., :dim]
    away = elevated_points(own, degree) - elevated_points(other, degree)
    return _Arcs(away, breaks[:-1], breaks[1:], float(max(np.abs(own).max(), np.abs(other).max())))


def _part(curve: Trajectory, begin: float, end: float, shift: float = 0.0) -> FloatArray:
    """Return the one polynomial of a curve between two instants, (1, n + 1, dim); at rest before and after it."""
    middle = 0.5 * (begin + end) - shift
    if not 0.0 < middle < curve.duration:
        place = curve(0.0 if middle <= 0.0 else curve.duration)
        return np.broadcast_to(place, (1, curve.degree + 1, curve.dim))
    first, last = max(begin - shift, 0.0), min(end - shift, curve.duration)
    piece = int(np.searchsorted(curve.breaks, middle, side="right")) - 1
    first, last = max(first, float(curve.breaks[piece])), min(last, float(curve.breaks[piece + 1]))
    return cut(curve.control_points, curve.durations, curve.breaks, first, last)[0][:1]


def _found(arcs: _Arcs, obstacle: Moving) -> tuple[float, float]:
    """Return the least distance less the radius that is found, and when: from samples on, by golden sections."""
    share = np.linspace(0.0, 1.0, LOOKED + 1)
    places = np.einsum("sk,mkd->msd", basis(arcs.away.shape[1] - 1, share), arcs.away)
    instants = arcs.begin[:, None] + share * (arcs.end - arcs.begin)[:, None]
    gaps = np.linalg.norm(places, axis=2) - obstacle.radius_at(instants)
    row, column = (int(index) for index in np.unravel_index(int(gaps.argmin()), gaps.shape))
    away, begin, width = arcs.away[row], float(arcs.begin[row]), float(arcs.end[row] - arcs.begin[row])

    def gap(s: float) -> float:
        place = basis(len(away) - 1, np.array([s]))[0] @ away
        return float(np.linalg.norm(place) - obstacle.radius_at(begin + s * width))

    low, high = float(share[max(column - 1, 0)]), float(share[min(column + 1, LOOKED)])
    golden = 0.5 * (5.0**0.5 - 1.0)
    for _ in range(60):
        one, two = high - golden * (high - low), low + golden * (high - low)
        low, high = (low, two) if gap(one) <= gap(two) else (one, high)
    places_found = np.array([float(share[column]), 0.5 * (low + high)])
    best = float(places_found[int(np.argmin([gap(s) for s in places_found]))])
    return gap(best), begin + best * width


def _is_kept(arcs: _Arcs, obstacle: Moving, margin: float) -> bool:
    """Whether a margin is proved on all intervals, with what rounding may have changed of the polynomials."""
    radii = np.maximum(margin + np.stack([obstacle.radius_at(at) for at in (arcs.begin, arcs.end)], axis=1), 0.0)
    square = squared_norm(arcs.away)
    wanted = elevated_points(multiply(radii, radii)[..., None], square.shape[1] - 1)[..., 0]
    count = 64.0 * (arcs.away.shape[1] + 1)
    error = count * UNIT * (np.abs(square).max() + arcs.size * np.abs(arcs.away).max() + float(radii.max()) ** 2)
    rows = wanted - square
    return native.maximum(rows, np.full_like(rows, error))[0] <= 0.0


def keeps_margin(curve: Trajectory, obstacle: Moving, margin: float) -> bool:
    """Whether a curve is proved to keep a margin to a moving obstacle, in exact arithmetic of the stored numbers."""
    return all(rationals.is_never_negative(each) for each in _exact_room(curve, obstacle, Fraction(margin)))


def _exact_room(curve: Trajectory, obstacle: Moving, margin: Fraction) -> Iterator[rationals.Scalar]:
    """Yield the squared distance less the square of what it is to be, on intervals of one polynomial each."""
    dim, begin = min(curve.dim, obstacle.dim), Fraction(obstacle.begin)
    own = _exact_breaks(curve, Fraction(0))
    other = _exact_breaks(obstacle.motion, begin)
    inner = sorted({*own, *(each for each in other if 0 < each < own[-1])})
    for low, high in zip(inner, inner[1:], strict=False):
        ours = _exact_part(curve, own, low, high)[:dim]
        theirs = _exact_part(obstacle.motion, other, low, high)[:dim]
        degree = max(len(ours[0]), len(theirs[0])) - 1
        pairs = zip((_raised(axis, degree) for axis in ours), (_raised(axis, degree) for axis in theirs), strict=True)
        square = rationals.squared_norm([[a - b for a, b in zip(*pair, strict=True)] for pair in pairs])
        grown = [Fraction(obstacle.growth) * max(at - begin, Fraction(0)) for at in (low, high)]
        radii = [margin + Fraction(obstacle.radius) + more for more in grown]
        first, last = (max(radius, Fraction(0)) for radius in radii)
        wanted = _raised([first * first, first * last, last * last], len(square) - 1)
        yield [a - b for a, b in zip(square, wanted, strict=True)]


def _exact_breaks(curve: Trajectory, begin: Fraction) -> list[Fraction]:
    return [begin + Fraction(each) for each in curve.breaks.tolist()]


def _exact_part(curve: Trajectory, breaks: list[Fraction], low: Fraction, high: Fraction) -> rationals.Curve:
    """Return the polynomial of a curve on an interval, coordinate by coordinate; at rest before and after it."""
    middle = (low + high) / 2
    if not breaks[0] < middle < breaks[-1]:
        place = curve.control_points[0, 0] if middle <= breaks[0] else curve.control_points[-1, -1]
        return [[Fraction(float(value))] for value in place]
    piece = max(index for index, each in enumerate(breaks[:-1]) if each <= middle)
    span = breaks[piece + 1] - breaks[piece]
    shares = (low - breaks[piece]) / span, (high - breaks[piece]) / span
    return [_between(axis, *shares) for axis in rationals.exact(curve.control_points[piece])]


def _between(points: list[Fraction], low: Fraction, high: Fraction) -> list[Fraction]:
    """Return the control points of a polynomial from one place of [0, 1] to another: its blossom."""
    degree = len(points) - 1
    return [_blossom(points, [low] * (degree - count) + [high] * count) for count in range(degree + 1)]


def _blossom(points: list[Fraction], places: list[Fraction]) -> Fraction:
    for place in places:
        points = [(1 - place) * a + place * b for a, b in zip(points, points[1:], strict=False)]
    return points[0]


def _raised(points: list[Fraction], degree: int) -> list[Fraction]:
    """Return a polynomial in a degree that is not lower."""
    while len(points) <= degree:
        n = len(points)
        padded = [Fraction(0), *points, Fraction(0)]
        points = [Fraction(i, n) * padded[i] + (1 - Fraction(i, n)) * padded[i + 1] for i in range(n + 1)]
    return points
