"""Curves as cubics of whole millimetres and milliseconds, split until they are proved to be near: what shows hold.

A cubic has the curve's position and velocity at both ends of its interval, so that halving it divides the distance by
16 (error of Hermite interpolation, h^4 max|x''''| / 384). Intervals end at whole milliseconds: no time is rounded.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from minsnap.basics.arrays import FloatArray, ReadOnly
from minsnap.basics.checks import check_positive
from minsnap.errors import FileError
from minsnap.files.formats.bezier_segments import LARGEST, distance_bounds, distances_within
from minsnap.files.formats.pieces import check_spatial
from minsnap.polynomials.bernstein import basis, differentiate
from minsnap.trajectory.trajectory import Trajectory

TOLERANCE = 0.002
"""Largest distance of a cubic from the curve before rounding, by default: about what rounding adds [m]."""

LONGEST = 60_000
"""Longest segment [ms]: Skybrush's own builder splits above."""

SHORTEST_SEGMENT = 8
"""Segments that are not split any more [ms]."""

LARGEST_SCALE = 127
"""Largest unit [mm]."""

_Integers = npt.NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class CubicSegments(ReadOnly):
    """A curve as cubics of whole units.

    Parameters
    ----------
    breaks : ndarray of int, shape (segments + 1,)
        From 0 [ms].
    points : ndarray of int, shape (segments, 4, 3)
        Bernstein control points [scale mm]; the first is the last of the segment before.
    scale : int
        Unit [mm].
    distance : float
        Proved upper bound of the distance to the curve at any instant, rounding included [m].
    """

    breaks: _Integers
    points: _Integers
    scale: int
    distance: float

    def trajectory(self) -> Trajectory:
        """Return the curve that is flown: cubics, and lines where no control points are stored."""
        points = np.where(is_line(self.points)[:, None, None], _lines(self.points[:, [0, -1]]), self.points)
        return Trajectory(points * (self.scale / 1e3), np.diff(self.breaks) / 1e3)


def cubic_segments(trajectory: Trajectory, tolerance: float = TOLERANCE) -> CubicSegments:
    """Return a curve as cubics.

    Parameters
    ----------
    trajectory : Trajectory
        Three coordinates.
    tolerance : float
        Largest distance of the cubics before they are rounded [m]; segments of 8 ms may be farther.

    Raises
    ------
    FileError
        If it has other than 3 coordinates, or leads too far away.
    """
    check_spatial(trajectory, "a show")
    tolerance = check_positive("the tolerance", tolerance, "m", FileError)
    breaks = _whole(trajectory.breaks)
    while len(coarse := _coarse(trajectory, breaks, tolerance)):
        breaks = np.union1d(breaks, coarse).astype(np.int64)
    points = _hermite(trajectory, breaks)
    scale = _scale(points)
    rounded = np.round(points * (1e3 / scale)).astype(np.int64)
    # A drone reads each segment from where the last one ends: ends that round to two numbers would be a jump.
    rounded[1:, 0] = rounded[:-1, -1]
    held = CubicSegments(breaks, _straightened(rounded), scale, 0.0)
    return CubicSegments(breaks, held.points, scale, float(distance_bounds(held.trajectory(), trajectory)[0]))


def worst_distance(reach: float, tolerance: float = TOLERANCE) -> float:
    """Return how far cubics may be from curves that stay within half as far again as ``reach`` of the origin [m]."""
    scale = _scale(np.array([1.5 * reach]))
    return float(tolerance + np.sqrt(3.0) * 0.5e-3 * scale)


def _whole(breaks: FloatArray) -> _Integers:
    """Return knots at whole milliseconds, none farther apart than ``LONGEST``; the last is not before the end."""
    whole = np.unique(np.round(breaks * 1e3).astype(np.int64))
    end = max(int(np.ceil(breaks[-1] * 1e3 - 1e-6)), 1)
    whole = np.append(whole[whole < end], end)
    return np.union1d(whole, np.concatenate([np.arange(a, b, LONGEST) for a, b in zip(whole, whole[1:], strict=False)]))


def _coarse(trajectory: Trajectory, breaks: _Integers, tolerance: float) -> _Integers:
    """Return the middles of segments whose cubics are farther from the curve than is allowed [ms]."""
    stored = Trajectory(_hermite(trajectory, breaks), np.diff(breaks) / 1e3)
    coarse = (distances_within(stored, trajectory) > tolerance) & (np.diff(breaks) > SHORTEST_SEGMENT)
    return (breaks[:-1] + breaks[1:])[coarse] // 2


def _hermite(trajectory: Trajectory, breaks: _Integers) -> FloatArray:
    """Return the control points of the cubics, shape (segments, 4, 3); after its end the curve stays there."""
    t = breaks / 1e3
    inside = np.minimum(t, trajectory.duration)
    place = trajectory(inside)
    third = (np.diff(t) / 3.0)[:, None]
    leaving, arriving = trajectory(inside[:-1], 1), _arriving(trajectory, inside[1:])
    return np.stack([place[:-1], place[:-1] + third * leaving, place[1:] - third * arriving, place[1:]], axis=1)


def _arriving(trajectory: Trajectory, t: FloatArray) -> FloatArray:
    """Velocities from the left, which differ from those from the right where a curve has corners."""
    piece = np.maximum(np.searchsorted(trajectory.breaks, t) - 1, 0)
    duration = trajectory.durations[piece]
    share = np.clip((t - trajectory.breaks[piece]) / duration, 0.0, 1.0)
    slopes = differentiate(trajectory.control_points[piece], 1) / duration[:, None, None]
    return np.asarray(np.einsum("mj,mjd->md", basis(trajectory.degree - 1, share), slopes))


def _scale(points: FloatArray) -> int:
    """Return the least unit in which int16 holds the coordinates [mm]."""
    farthest = np.abs(points).max() * 1e3
    scale = int(np.ceil((farthest + 1.0) / (LARGEST + 1)))
    if scale > LARGEST_SCALE:
        raise FileError(
            f"the trajectory leads {farthest / 1e3:.0f} m from the origin, and a show holds "
            f"{LARGEST * LARGEST_SCALE / 1e3:.0f} m: move the origin nearer"
        )
    return scale


def _straightened(points: _Integers) -> _Integers:
    """Put the control points of segments that are lines, but for rounding, where those of a line are."""
    ends = points[:, [0, -1]]
    thirds = np.stack([2 * ends[:, 0] + ends[:, 1], ends[:, 0] + 2 * ends[:, 1]], axis=1) / 3.0
    straight = np.asarray(np.abs(points[:, 1:3] - thirds).max(axis=(1, 2)) <= 0.75)
    return np.where(straight[:, None, None], np.round(_lines(ends)).astype(np.int64), points)


def _lines(ends: _Integers) -> FloatArray:
    """Return control points of lines, shape (segments, 4, 3), from their ends."""
    share = np.arange(4)[:, None] / 3.0
    return ends[:, :1] * (1.0 - share) + ends[:, 1:] * share


def is_line(points: _Integers) -> npt.NDArray[np.bool_]:
    """Whether segments are stored as lines: their control points are the roundings of those of one."""
    return np.asarray((points == np.round(_lines(points[:, [0, -1]]))).all(axis=(1, 2)))
