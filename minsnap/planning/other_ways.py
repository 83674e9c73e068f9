"""Ways of other topology than the first: a bend of it is closed off, from what it leads around to what is beyond.

The shortest way need not be the quickest flight: a bend costs time that a longer way without it may save.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from math import inf

import numpy as np

from minsnap.basics.arrays import BoolArray, FloatArray
from minsnap.limits.limits import Limits
from minsnap.limits.trapezoid import trapezoid_time
from minsnap.trajectory.trajectory import Trajectory

Search = Callable[[BoolArray], FloatArray | None]
"""Looks for a way (m, dim) [m] through free cells."""


@dataclass(frozen=True)
class OtherWaysSettings:
    """Which other ways are tried.

    Parameters
    ----------
    bends : int
        Bends of a way that are closed off, one at a time, those passed slowest first.
    gain : float
        Share of the flight that a way must be able to save, by its length, for others to be looked for.
    beside : int
        Cells to each side of its plane to which a bend in space is closed off.
    """

    bends: int = 4
    gain: float = 0.005
    beside: int = 12


OTHER_WAYS = OtherWaysSettings()


def least_by_length(way: FloatArray, limits: Limits) -> float:
    """Return about the least time along a line from rest to rest, by its length [s]; 0 where nothing bounds it."""
    steps = np.abs(np.diff(way, axis=0))
    length = float((steps.max(axis=1) if limits.norm == "axis" else np.linalg.norm(steps, axis=1)).sum())
    speed, acceleration = (
        float(value) if isinstance(value, float | int) else inf for value in (limits.speed, limits.acceleration)
    )
    return trapezoid_time(length, speed, acceleration)


def other_ways(
    free: BoolArray, lower: FloatArray, size: FloatArray, way: FloatArray, flown: Trajectory, search: Search
) -> Iterator[FloatArray]:
    """Return ways that do not pass a bend of a way where it does, one after the other.

    Parameters
    ----------
    free : ndarray of bool
        Cells that a way may have.
    lower, size : ndarray, shape (dim,)
        Where the first cell begins, and the sides of a cell [m].
    way : ndarray, shape (m, dim)
        The first one [m].
    flown : Trajectory
        A flight along it.
    search : callable
    """
    for bend in _find_slowest_bends(way, flown):
        closed = _close_off(free, lower, size, way[bend - 1 : bend + 2], way[[0, -1]])
        other = None if closed is None else search(free & ~closed)
        if other is not None:
            yield other


def _find_slowest_bends(way: FloatArray, flown: Trajectory) -> list[int]:
    """Return the corners of a way that are passed slowest, those beside which a flight is longest."""
    instants = np.linspace(0.0, flown.duration, 64 * len(way))
    places, speeds = flown(instants)[:, : way.shape[1]], np.linalg.norm(flown(instants, 1), axis=1)
    nearest = [int(((places - corner) ** 2).sum(axis=1).argmin()) for corner in way[1:-1]]
    order = np.argsort(speeds[np.array(nearest, dtype=np.intp)], kind="stable")
    return [int(index) + 1 for index in order[: OTHER_WAYS.bends]]


def _close_off(
    free: BoolArray, lower: FloatArray, size: FloatArray, corner: FloatArray, ends: FloatArray
) -> BoolArray | None:
    """Return cells from what a bend leads around to what is beyond; None at a straight corner, or beside an end."""
    along = np.diff(corner, axis=0)
    along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-12)
    inward = along[1] - along[0]
    if not np.linalg.norm(inward) > 1e-6:
        return None
    inward /= np.linalg.norm(inward)
    across = np.cross(along[0], along[1]) if len(size) == 3 else np.zeros(1)
    upright = across / np.linalg.norm(across) if len(size) == 3 else np.zeros(2)
    aside = range(-OTHER_WAYS.beside, OTHER_WAYS.beside + 1) if len(size) == 3 else (0,)
    step, closed = 0.5 * float(size.min()), np.zeros_like(free)
    for lift in aside:
        for sign in (1.0, -1.0):
            _close(closed, free, (corner[1] - lower + lift * 2.0 * step * upright) / size, sign * step * inward / size)
    taken = np.floor((ends - lower) / size).astype(np.intp).clip(0, np.array(free.shape) - 1)
    return None if closed[tuple(taken.T)].any() else closed


def _close(closed: BoolArray, free: BoolArray, at: FloatArray, step: FloatArray) -> None:
    """Close cells and those that touch them, in place, from a cell on up to the first one that is not free."""
    shape, far = np.array(free.shape), len(free.shape) == 3
    for count in range(4 * OTHER_WAYS.beside if far else 2 * int(shape.sum())):
        cell = np.floor(at + count * step).astype(np.intp)
        if (cell < 0).any() or (cell >= shape).any() or not (free[tuple(cell)] or count < 2):
            return
        closed[tuple(slice(max(int(index) - 1, 0), int(index) + 2) for index in cell)] = True
