"""Curves as cubics of whole units and whole milliseconds, as Skybrush's shows and compressed Crazyflie files hold them.

A cubic has the curve's position and velocity at both ends of its interval (Hermite), so that halving it divides the
distance by 16 and the error of its acceleration by 4: h^4 max|x''''| / 384 and h^2 max|x''''| / 12. Rounding to whole
units does the opposite: it adds some 5 units / h^2 to the acceleration. So an interval is halved where its cubic is
farther from the curve than the tolerance, or its acceleration gains more by halving than rounding takes away, and none
is shorter than a tenth of a second.

Knots lie on a grid of powers of two, counted from the last corner of the curve. Two neighbours then have durations of
which one divides the other, and a velocity in whole steps of the shorter one is held exactly by both: the velocity does
not step, which no limit on accelerations would see. Only the last knot before a corner, or the end, is off the grid.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from minsnap.basics.arrays import BoolArray, FloatArray, NDArray, ReadOnly
from minsnap.basics.checks import check_positive
from minsnap.errors import FileError
from minsnap.files.formats.bezier_segments import LARGEST, distance_bounds, distances_within
from minsnap.files.formats.pieces import check_spatial
from minsnap.polynomials.bernstein import basis, differentiate
from minsnap.trajectory.trajectory import Trajectory


@dataclass(frozen=True)
class CubicSettings:
    """How a curve is cut into cubics.

    Parameters
    ----------
    tolerance : float
        Largest distance of a cubic from the curve before rounding, by default: about what rounding adds [m].
    longest, shortest : int
        Longest segment, above which Skybrush's own builder splits, and shortest one [ms].
    cell : int
        Finest step of the grid of knots [ms].
    gain : float
        Error of an acceleration, in units over the square of a segment's duration, from which halving it helps: it
        leaves a quarter of the error, and multiplies what rounding adds, 5 of these, by 4.
    loose : float
        The same in units of the tolerance, for tolerances that are large.
    uneven : int
        How many times as long as its neighbour a moving segment is at most: steps of its velocity are the neighbour's.
    corner : float
        Step of the curve's velocity from which a knot is a corner [m/s].
    still : float
        Distance of a control point from an end at which the curve is at rest [units].
    scale : int
        Largest unit [mm].
    moved : float
        Units by which two neighbouring control points move against each other at most: 0.5 for the rounding of each,
        and 0.75 where a segment becomes a line.
    """

    tolerance: float = 0.002
    longest: int = 60_000
    shortest: int = 100
    cell: int = 125
    gain: float = 20.0
    loose: float = 10.0
    uneven: int = 2
    corner: float = 1e-6
    still: float = 1e-6
    scale: int = 127
    moved: float = 1.75


CUBIC = CubicSettings()

_Integers = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class CubicSegments(ReadOnly):
    """A curve as cubics of whole units.

    Parameters
    ----------
    breaks : ndarray of int, shape (segments + 1,)
        From 0 [ms].
    points : ndarray of int, shape (segments, 4, 3)
        Bernstein control points [scale mm]; the first is the last of the segment before.
    lines : ndarray of bool, shape (segments,)
        Which segments are stored by their ends alone.
    scale : int
        Unit [mm].
    distance : float
        Proved upper bound of the distance to the curve at any instant, rounding included [m].
    """

    breaks: _Integers
    points: _Integers
    lines: BoolArray
    scale: int
    distance: float

    def trajectory(self) -> Trajectory:
        """Return the curve that is flown: cubics, and lines where no control points are stored."""
        points = np.where(self.lines[:, None, None], lines_of(self.points[:, 0], self.points[:, -1]), self.points)
        return Trajectory(points * (self.scale / 1e3), np.diff(self.breaks) / 1e3)


def as_cubic_segments(trajectory: Trajectory, tolerance: float = CUBIC.tolerance) -> CubicSegments:
    """Return a curve as cubics.

    Parameters
    ----------
    trajectory : Trajectory
        Three coordinates.
    tolerance : float
        Largest distance of the cubics before they are rounded [m]; segments of a tenth of a second may be farther.

    Raises
    ------
    FileError
        If it has other than 3 coordinates, or leads too far away.
    """
    check_spatial(trajectory, "a show")
    tolerance = check_positive("the tolerance", tolerance, "m", FileError)
    fit = CubicFit.of(trajectory, np.full(3, scale_of(trajectory(trajectory.breaks)) / 1e3))
    breaks = fit.knots(tolerance)
    scale = scale_of(fit.hermite(breaks))
    points, lines = replace(fit, units=np.full(3, scale / 1e3)).whole(breaks, LARGEST - (scale == 1))
    held = CubicSegments(breaks, points, lines, scale, 0.0)
    return replace(held, distance=float(distance_bounds(held.trajectory(), trajectory)[0]))


def worst_distance(reach: float) -> float:
    """Return how far cubics may be from curves that stay within half as far again as ``reach`` of the origin [m].

    A position is rounded by half a unit, and a velocity by 1.5 units over the shorter neighbour's duration, which is at
    most ``CUBIC.uneven`` times shorter; a cubic follows its velocity at an end by 4/27 of its duration.

    Raises
    ------
    FileError
        If no show holds ``reach``.
    """
    farthest = max(reach, min(1.5 * reach, LARGEST * CUBIC.scale / 1e3))
    units = 0.5 + 2.0 * 1.5 * CUBIC.uneven * 4.0 / 27.0
    return float(CUBIC.tolerance + np.sqrt(3.0) * units * 1e-3 * scale_of(np.array([farthest])))


@dataclass(frozen=True, eq=False)
class CubicFit:
    """A curve that is cut into cubics.

    Parameters
    ----------
    curve : Trajectory
        Coordinates in space first.
    units : ndarray, shape (dim,)
        What each coordinate is rounded to.
    edges : ndarray of int, shape (sections + 1,)
        Start, end, and the knots at which the velocity steps, a shortest segment apart [ms].
    corners : ndarray, shape (sections + 1,)
        Their instants before they were rounded [s].
    """

    curve: Trajectory
    units: FloatArray
    edges: _Integers
    corners: FloatArray

    @classmethod
    def of(cls, curve: Trajectory, units: FloatArray) -> CubicFit:
        """Return it with the corners of the curve."""
        end, inner = max(int(np.ceil(curve.breaks[-1] * 1e3 - 1e-6)), 1), curve.breaks[1:-1]
        steps = np.abs(curve(inner, 1) - _arriving(curve, inner, 1)).max(axis=1, initial=0.0)
        edges, corners = [0], [0.0]
        for corner in inner[steps > CUBIC.corner].tolist():
            if edges[-1] + CUBIC.shortest <= round(corner * 1e3) <= end - CUBIC.shortest:
                edges.append(round(corner * 1e3))
                corners.append(corner)
        return cls(curve, units, np.array([*edges, end]), np.array([*corners, curve.duration]))

    def knots(self, tolerance: float) -> _Integers:
        """Return the knots of its cubics, from 0 to not before its end [ms]."""
        breaks, looks = self.edges, (self._hard, self._far)  # the second is dear, and hardly ever finds what is left
        while True:
            cuts = self._cuts(breaks)
            for look in looks:
                wanted = look(breaks, tolerance) & (cuts > 0)
                if wanted.any():
                    break
            else:
                return breaks
            breaks = np.union1d(breaks, cuts[wanted]).astype(np.int64)

    def hermite(self, breaks: _Integers) -> FloatArray:
        """Return the control points of the cubics, shape (segments, 4, dim); after its end the curve stays there."""
        t = self._instants(breaks)
        place, third = self.curve(t), (np.diff(breaks) / 3e3)[:, None]
        leaving, arriving = self.curve(t[:-1], 1), _arriving(self.curve, t[1:], 1)
        return np.stack([place[:-1], place[:-1] + third * leaving, place[1:] - third * arriving, place[1:]], axis=1)

    def whole(self, breaks: _Integers, largest: int) -> tuple[_Integers, BoolArray]:
        """Return the control points in whole units, none beyond the largest number, and which segments are lines.

        At a knot whose neighbours have a common measure, both have the same velocity: three units over that measure,
        times a whole number. A drone reads each segment from where the last one ends. Where a cubic stays between its
        ends, or the curve is at rest at one, the rounded one does: no vehicle dips below the ground as it lands.
        """
        spans, ends = np.diff(breaks)[:, None], self.hermite(breaks) / self.units
        places = np.round(np.concatenate([ends[:, 0], ends[-1:, 3]])).astype(np.int64)
        leaving, arriving = ends[:, 1] - ends[:, 0], ends[:, 3] - ends[:, 2]
        true, rounded = ends[:, 3] - ends[:, 0], np.diff(places, axis=0)
        room_out, room_back = _room(leaving, arriving, true, rounded), _room(arriving, leaving, true, rounded)
        out = np.clip(np.round(leaving).astype(np.int64), -room_out, room_out)
        back = np.clip(np.round(arriving).astype(np.int64), -room_back, room_back)
        measure = np.gcd(spans[:-1], spans[1:])
        smooth = (measure[:, 0] >= CUBIC.shortest) & ~np.isin(breaks[1:-1], self.edges)
        before, after = spans[:-1] // measure, spans[1:] // measure
        room = np.minimum(room_back[:-1] // before, room_out[1:] // after)
        common = np.clip(np.round(leaving[1:] / after).astype(np.int64), -room, room)
        out[1:] = np.where(smooth[:, None], common * after, out[1:])
        back[:-1] = np.where(smooth[:, None], common * before, back[:-1])
        points = np.stack([places[:-1], places[:-1] + out, places[1:] - back, places[1:]], axis=1)
        lines = np.abs(points - lines_of(places[:-1], places[1:])).max(axis=(1, 2))
        alone = np.concatenate([[True], ~smooth]) & np.concatenate([~smooth, [True]])
        return np.clip(points, -largest, largest), np.asarray(lines <= np.where(alone, 0.75, 1e-9))

    def _instants(self, breaks: _Integers) -> FloatArray:
        """Return the instants of the curve at knots [s]: those of corners are not rounded."""
        t = np.minimum(breaks / 1e3, self.curve.duration)
        t[np.searchsorted(breaks, self.edges)] = self.corners
        return t

    def _cuts(self, breaks: _Integers) -> _Integers:
        """Return where segments can be cut, on the coarsest grid that leaves room on both sides [ms], 0 for nowhere."""
        begins = self.edges[np.searchsorted(self.edges, breaks[:-1], side="right") - 1]
        low, high = breaks[:-1] - begins + CUBIC.shortest, breaks[1:] - begins - CUBIC.shortest
        cuts, step = np.zeros(len(low), dtype=np.int64), CUBIC.cell
        while step <= int(high.max()):
            on_grid = high // step * step
            cuts = np.where(on_grid >= low, begins + on_grid, cuts)
            step *= 2
        return cuts

    def _hard(self, breaks: _Integers, tolerance: float) -> BoolArray:
        """Return which segments are to be halved for their duration, or since that improves their acceleration."""
        points, spans, t = self.hermite(breaks), np.diff(breaks) / 1e3, self._instants(breaks)
        true = np.stack([self.curve(t[:-1], 2), _arriving(self.curve, t[1:], 2)], axis=1) * spans[:, None, None] ** 2
        allowed = np.maximum(CUBIC.gain, CUBIC.loose * tolerance / self.units[0]) * self.units
        hard = (np.abs(6.0 * np.diff(points, 2, axis=1) - true) > allowed).any(axis=(1, 2))
        return np.asarray(hard | (np.diff(breaks) > CUBIC.longest) | self._uneven(breaks) | _lost(breaks))

    def _far(self, breaks: _Integers, tolerance: float) -> BoolArray:
        """Return which segments are farther from the curve than the tolerance."""
        stored = Trajectory(self.hermite(breaks)[..., :3], np.diff(breaks) / 1e3)
        space = Trajectory(self.curve.control_points[..., :3], self.curve.durations)
        return np.asarray(distances_within(stored, space) > tolerance)

    def _uneven(self, breaks: _Integers) -> BoolArray:
        """Return which segments are too much longer than a neighbour to which they move, or from which."""
        spans, t = np.diff(breaks), self._instants(breaks)[1:-1]
        moves = np.abs(self.curve(t, 1)).max(axis=1, initial=0.0) > CUBIC.corner
        shorter = np.full(len(spans), CUBIC.longest)
        shorter[:-1] = np.where(moves, spans[1:], shorter[:-1])
        shorter[1:] = np.minimum(shorter[1:], np.where(moves, spans[:-1], shorter[1:]))
        return np.asarray(spans > CUBIC.uneven * shorter + CUBIC.cell)


def _room(way: FloatArray, other: FloatArray, true: FloatArray, rounded: _Integers) -> _Integers:
    """Return how far a control point may be from its end: to the other end, where the true one is between the two.

    The cubic of a curve that starts from rest as a fourth power of time goes back first: it is held, too.
    """
    between = np.abs(way) <= np.abs(true) * np.where(np.abs(other) < CUBIC.still, 2.0, 1.0)
    return np.where(between & (way * true >= 0.0), np.abs(rounded), 2 * LARGEST)


def _lost(breaks: _Integers) -> BoolArray:
    """Return which durations lose a millisecond where it is cut off of floating seconds, as Skybrush's server does."""
    spans = np.diff(breaks)
    return np.asarray(np.floor(np.round(spans / 1e3, 3) * 1e3).astype(np.int64) != spans)


def _arriving(curve: Trajectory, t: FloatArray, order: int) -> FloatArray:
    """Return derivatives from the left, which differ from those from the right where a curve has corners."""
    piece = np.maximum(np.searchsorted(curve.breaks, t) - 1, 0)
    duration = curve.durations[piece]
    share = np.clip((t - curve.breaks[piece]) / duration, 0.0, 1.0)
    values = differentiate(curve.control_points[piece], order) / duration[:, None, None] ** order
    return np.asarray(np.einsum("mj,mjd->md", basis(values.shape[1] - 1, share), values))


def scale_of(points: FloatArray) -> int:
    """Return the least unit in which int16 holds the coordinates, and which Skybrush's server chooses for them [mm].

    The server counts a millimetre more than the farthest coordinate, and another one since coordinates are written a
    trace beyond their unit. Where rounding makes the farthest one near enough for the unit before, that one is taken:
    the farthest one is then off by a unit and a half at most.
    """
    farthest = np.abs(points).max() * 1e3
    scale = int(np.ceil((farthest + 2.0) / (LARGEST + 1)))
    if np.round(farthest / scale) * scale + 2.0 <= (LARGEST + 1) * (scale - 1):
        scale -= 1
    if scale > CUBIC.scale:
        raise FileError(
            f"the trajectory leads {farthest / 1e3:.0f} m from the origin, and a show holds "
            f"{LARGEST * CUBIC.scale / 1e3:.0f} m: move the origin nearer"
        )
    return scale


def lines_of(starts: _Integers, ends: _Integers) -> FloatArray:
    """Return the control points of lines as cubics, shape (segments, 4, dim)."""
    share = np.arange(4)[:, None] / 3.0
    return starts[:, None] * (1.0 - share) + ends[:, None] * share
