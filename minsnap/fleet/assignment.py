"""Which vehicle flies to which goal, and whether straight lines are then apart."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from minsnap.basics.arrays import ArrayLike, FloatArray, IntArray, bounded, numbers
from minsnap.basics.messages import explains_names, shown
from minsnap.basics.progress import ProgressLine, progress_line
from minsnap.basics.tolerances import EXACT
from minsnap.errors import FleetError
from minsnap.fleet.auction import Told, auction
from minsnap.fleet.common_clock import Separation, as_separation
from minsnap.native.library import loaded

LARGE = 1000
"""Vehicles beyond which an assignment is made by an auction: the exact method takes a second here, and 40 for 5,000."""

ROWS = 256
"""Vehicles whose pairs are computed at once."""


@dataclass(frozen=True)
class LineDistance:
    """How near vehicles come on straight lines that all fly with one common profile.

    Parameters
    ----------
    apart : bool
        Whether every pair keeps its separation, to ``EXACT``.
    least_distance : float
        Of the pair nearest to its separation, heights divided by the downwash [m]; infinite for one vehicle.
    pair : tuple of int or None
        Which.
    progress : float
        How far along its line each of them is then, from 0 to 1.
    """

    apart: bool
    least_distance: float
    pair: tuple[int, int] | None
    progress: float


@explains_names({})
def assign(starts: ArrayLike, goals: ArrayLike, progress: bool = False) -> IntArray:
    r"""Assign a goal to each vehicle, with the least sum of squared distances.

    Beyond 1,000 vehicles an auction finds one that is proved to be at most 0.1 % above the least sum; 5,000 take four
    seconds, and no matrix of costs.

    Vehicles on straight lines with one common profile then come no nearer to each other than
    the least spacing of starts and goals over :math:`\sqrt{2}` (M. Turpin, N. Michael and V. Kumar, "CAPT",
    IJRR 33, 2014, theorem 3.3), without a downwash.

    Parameters
    ----------
    starts : array_like, shape (m, dim)
        [m].
    goals : array_like, shape (k, dim), k >= m
        [m].
    progress : bool
        Show a line on the terminal while it takes long.

    Returns
    -------
    order : ndarray of int, shape (m,)
        ``goals[order[i]]`` belongs to ``starts[i]``.

    Raises
    ------
    FleetError
        If they are malformed, or there are more vehicles than goals.
    """
    begin, end = points_of(starts, "starts"), points_of(goals, "goals")
    if begin.shape[1] != end.shape[1]:
        raise FleetError(f"starts have {begin.shape[1]} coordinates and goals {end.shape[1]}: give both as many")
    if len(begin) > len(end):
        raise FleetError(f"there are {len(begin)} vehicles and {len(end)} goals: give each vehicle a goal")
    if len(begin) <= LARGE or loaded().library is None:
        return _exactly(begin, end)
    with progress_line(progress, "assignment", _line) as told:
        return auction(begin, end, told).order


def _exactly(begin: FloatArray, end: FloatArray) -> IntArray:
    from scipy.optimize import linear_sum_assignment
    from scipy.spatial.distance import cdist

    _, order = linear_sum_assignment(cdist(begin, end, "sqeuclidean"))
    return np.asarray(order, dtype=np.intp)


def _line(line: ProgressLine) -> Told:
    return lambda number, waiting: line.show(None, f"round {number}, {waiting} vehicles without a goal")


def line_distance(starts: ArrayLike, goals: ArrayLike, separation: Separation | float) -> LineDistance:
    r"""Say how near vehicles come that all fly straight lines, the same share of them at each instant.

    The difference of two is :math:`a + \lambda (b - a)`, a at the starts and b at the goals,
    :math:`0 \le \lambda \le 1`: its least norm has a closed form.

    Parameters
    ----------
    starts, goals : array_like, shape (m, dim)
        Of vehicle i, ``starts[i]`` and ``goals[i]`` [m].
    separation : Separation or float
        [m].

    Returns
    -------
    LineDistance

    Raises
    ------
    FleetError
        If they are malformed, or not as many.
    """
    apart = as_separation(separation)
    begin, end = points_of(starts, "starts"), points_of(goals, "goals")
    if begin.shape != end.shape:
        raise FleetError(f"starts and goals have shapes {begin.shape} and {end.shape}: give each vehicle both")
    if len(begin) == 1:
        return LineDistance(True, np.inf, None, 0.0)
    begin, end, radii = apart.flat(begin), apart.flat(end), apart.radii_of(len(begin))
    nearest = [_nearest_of(begin, end, radii, first) for first in range(0, len(begin) - 1, ROWS)]
    share, distance, pair, progress = min(nearest, key=lambda entry: entry[0])
    return LineDistance(share >= 1.0 - EXACT, distance, pair, progress)


def points_of(values: ArrayLike, what: str) -> FloatArray:
    """Return points (m, 2) or (m, 3), finite, or raise FleetError."""
    points = numbers(values)
    if points is None or points.ndim != 2 or points.shape[1] not in (2, 3) or not len(points):
        raise FleetError(f"the {what} are {shown(values)}: give one row of two or three coordinates per vehicle [m]")
    if not bounded(points).all():
        wrong = int(np.flatnonzero(~bounded(points).all(axis=1))[0])
        text = f"row {wrong} of the {what} is {points[wrong]}: every coordinate must be finite"
        raise FleetError(text, vehicle=wrong)
    return points


def _nearest_of(
    begin: FloatArray, end: FloatArray, radii: FloatArray, first: int
) -> tuple[float, float, tuple[int, int], float]:
    """Return share, distance, pair and progress of the nearest pair with its first vehicle in one block."""
    rows = np.arange(first, min(first + ROWS, len(begin)))
    apart = begin[rows, None] - begin[None, first:]
    move = end[rows, None] - end[None, first:] - apart
    square = (move * move).sum(axis=2)
    with np.errstate(divide="ignore", invalid="ignore"):
        progress = np.where(square > 0.0, -(apart * move).sum(axis=2) / square, 0.0)
    progress = np.clip(progress, 0.0, 1.0)
    distance = np.sqrt(((apart + progress[..., None] * move) ** 2).sum(axis=2))
    share = distance / (radii[rows, None] + radii[None, first:])
    share[np.arange(len(begin) - first)[None] <= (rows - first)[:, None]] = np.inf
    i, j = (int(k) for k in np.unravel_index(int(np.argmin(share)), share.shape))
    return float(share[i, j]), float(distance[i, j]), (i + first, j + first), float(progress[i, j])
