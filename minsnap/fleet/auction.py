"""Assignments of thousands of vehicles, by an auction whose prices prove how near the least sum of squares it is.

For any prices p of the goals, no assignment costs less than the sum over vehicles of the least of cost and price, less
the sum of all prices (D. P. Bertsekas, "The auction algorithm", Annals of Operations Research 14, 1988).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from minsnap.basics.arrays import FloatArray, IntArray
from minsnap.native.fleet_border import bid_for_goals


@dataclass(frozen=True)
class AuctionSettings:
    """How steps of bids fall.

    Parameters
    ----------
    factor : float
        From one round to the next.
    gap : float
        Share of the sum of squared ways by which it may be above the least.
    step : float
        Last step, at most, in units of the squared spacing: two vehicles that would better exchange their goals gain no
        more than twice that.
    smallest : float
        Step at which the auction ends in any case, in the same units.
    bids : int
        Of one call of the native core: Ctrl-C is heard between two.
    """

    factor: float = 6.0
    gap: float = 1e-3
    step: float = 1e-2
    smallest: float = 1e-6
    bids: int = 5000


AUCTION = AuctionSettings()

Told = Callable[[int, int], None]
"""Is told the round, and how many vehicles have no goal yet."""


@dataclass(frozen=True, eq=False)
class AuctionResult:
    """An assignment, and what proves it.

    Parameters
    ----------
    order : ndarray of int, shape (m,)
        ``goals[order[i]]`` belongs to ``starts[i]``.
    cost : float
        Sum of its squared ways [m^2].
    bound : float
        No assignment has less [m^2].
    """

    order: IntArray
    cost: float
    bound: float


def auction(starts: FloatArray, goals: FloatArray, told: Told | None = None) -> AuctionResult:
    """Assign goals to vehicles, close to the least sum of squared ways.

    Parameters
    ----------
    starts, goals : ndarray, shape (m, dim) and (k, dim), k >= m
        [m].
    told : callable, optional

    Raises
    ------
    NativeCoreError
        If the native core is not in use.
    """
    begin, end = _centred(starts, goals)
    square = max(min(_spacing(begin), _spacing(end)) ** 2, 1e-18 * _span(begin, end) ** 2, 1e-300)
    step = max(0.25 * _span(begin, end) ** 2, AUCTION.step * square)
    prices, number = np.zeros(end.shape[1]), 0
    while True:
        goal_of, waiting, number = np.full(end.shape[1], -1, dtype=np.int64), 1, number + 1
        while waiting:
            waiting = bid_for_goals(begin, end, step, AUCTION.bids, prices, goal_of)
            if told is not None:
                told(number, waiting)
        prices -= prices.min()  # so that they do not grow from round to round
        if step <= AUCTION.step * square:
            found = _proved(starts, goals, begin, end, prices, goal_of[: len(starts)])
            if found.cost - found.bound <= AUCTION.gap * found.cost or step <= AUCTION.smallest * square:
                return found
        step /= AUCTION.factor


def _centred(starts: FloatArray, goals: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return places as rows of coordinates (3, n); about their centers where all goals are taken.

    A way of the whole formation adds the same to the cost of every assignment.
    """
    shift = (starts.mean(axis=0), goals.mean(axis=0)) if len(starts) == len(goals) else (0.0, 0.0)
    rows = [np.zeros((3, len(places))) for places in (starts, goals)]
    for row, places, center in zip(rows, (starts, goals), shift, strict=True):
        row[: places.shape[1]] = (places - center).T
    return rows[0], rows[1]


def _span(begin: FloatArray, end: FloatArray) -> float:
    both = np.concatenate((begin, end), axis=1)
    return float(np.linalg.norm(np.ptp(both, axis=1)))


def _spacing(rows: FloatArray) -> float:
    from scipy.spatial import cKDTree

    return float(cKDTree(rows.T).query(rows.T, k=2)[0][:, 1].min()) if rows.shape[1] > 1 else 0.0


ROWS = 256
"""Vehicles whose costs are computed at once."""


def _proved(
    starts: FloatArray, goals: FloatArray, begin: FloatArray, end: FloatArray, prices: FloatArray, order: IntArray
) -> AuctionResult:
    """Return an assignment with its cost, and the bound that prices prove."""
    from scipy.spatial.distance import cdist

    ways = end[:, order] - begin
    blocks = range(0, begin.shape[1], ROWS)
    least = sum(
        float((cdist(begin[:, first : first + ROWS].T, end.T, "sqeuclidean") + prices).min(axis=1).sum())
        for first in blocks
    )
    spare = (end.shape[1] - begin.shape[1]) * float(prices.min())  # of goals that nobody flies to
    cost = float(((goals[order] - starts) ** 2).sum())
    gap = float((ways * ways).sum()) - (least + spare - float(prices.sum()))
    return AuctionResult(order.astype(np.intp), cost, cost - gap)
