"""Proof of largest values of quantities along a path, by bounds on ever smaller parts."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.polynomials.bernstein import differentiate, elevate, subdivide

if TYPE_CHECKING:
    from minsnap.trajectory.trajectory import Trajectory

MARGIN = 1e-4
"""Share added to the largest of many samples, below which bounds prove that all values stay."""

ROUNDS, FIRST, PARTS, MOST = 9, 8, 4, 400_000
"""How often a piece is divided, into how many parts at first and later, and up to how many parts in all."""


def proved(
    values: FloatArray, bounds: Callable[[FloatArray, FloatArray, FloatArray], FloatArray], traj: Trajectory
) -> FloatArray:
    """Return values (count,) of quantities, raised until bounds prove that none goes beyond.

    Parameters
    ----------
    bounds : callable
        From control points (parts, 4, 3, n) of velocity to snap on parts that begin at instants and are so wide [s] to
        bounds (count, parts).
    """
    points, start, width = motion_points(traj), traj.breaks[:-1], traj.durations
    for level in range(ROUNDS):
        proved_bounds = bounds(points, start, width)
        proved_bounds = np.where(np.isnan(proved_bounds), np.inf, proved_bounds)
        open_ = (proved_bounds > values[:, None]).any(axis=0)
        if not open_.any():
            return values
        parts = PARTS if level else FIRST
        if open_.sum() * parts > MOST or level == ROUNDS - 1:
            break
        points, start, width = _divided(points[open_], start[open_], width[open_], parts)
    return np.asarray(np.maximum(values, proved_bounds.max(axis=1)))


def motion_points(traj: Trajectory) -> FloatArray:
    """Return control points of velocity to snap on each piece, of one degree, (pieces, 4, 3, n)."""
    control, durations = traj.control_points, traj.durations
    size = control.shape[1] - 1
    scaled = (differentiate(control, order) / durations[:, None, None] ** order for order in range(1, 5))
    return np.stack([elevate(part.transpose(0, 2, 1), size) for part in scaled], axis=1)


def _divided(
    points: FloatArray, start: FloatArray, width: FloatArray, parts: int
) -> tuple[FloatArray, FloatArray, FloatArray]:
    count, size = len(points), points.shape[3]
    finer = subdivide(points.reshape(-1, size), parts).reshape(count, 12, parts, size).transpose(0, 2, 1, 3)
    begins = start[:, None] + width[:, None] * np.arange(parts) / parts
    return np.ascontiguousarray(finer).reshape(-1, 4, 3, size), begins.reshape(-1), np.repeat(width / parts, parts)
