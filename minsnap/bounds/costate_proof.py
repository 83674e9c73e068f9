r"""A costate, and the time below which it proves that no flight is.

Let a flight go through points with steps :math:`D_k` between them in durations :math:`T_k`, with accelerations in a
convex set A and velocities in V, whose support functions are :math:`h_A` and :math:`h_V`.  For a costate p, continuous
and piecewise linear in :math:`s \in [0, 1]` on every leg, and rates :math:`\lambda_k`, integration by parts of
:math:`\int p^\top a\,dt` gives

.. math:: \sum_k \lambda_k^\top D_k / T_k + [\,p^\top v\,] \le \sum_k T_k \int h_A(p)\,ds
          + \sum_k \int h_V(p' + \lambda_k)\,ds .

With :math:`a_k = \int h_A(p)\,ds < 1` and :math:`b_k = \lambda_k^\top D_k \ge 0` the sum of all :math:`T_k` is least
where :math:`T_k = \sqrt{b_k / (1 - a_k)}`, so that every flight takes at least

.. math:: \sum_k 2 \sqrt{(1 - a_k)\, b_k} - \sum_k \int h_V(p' + \lambda_k)\,ds + [\,p^\top v\,] .

Where the points lie in regions B, :math:`b_k` is known up to :math:`\pm X_k`.  The root is concave in it, and so not
below its chord, which is linear in the places of the points: what they may take from it is :math:`h_B(c_k \lambda_k -
c_{k-1} \lambda_{k-1})` at each, with the slopes c of the chords.  A set that is the intersection of several has, for
any shares of p that add up to it, at most the sum of their support functions.

A flight that begins or ends hovering keeps sets besides that grow with the time from there.  Where that leg takes at
most U, it keeps the set of time s U up to its share s, which makes :math:`a_k` less.  So :math:`T_k` is looked at in
intervals, each with the :math:`a_k` of its end: the least of :math:`(1 - a_k) T + b_k / T` in all of them stands for
the leg, and is concave in :math:`b_k` too.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import inf
from typing import NamedTuple

import numpy as np

from minsnap.basics.arrays import FloatArray, OwnsArrays
from minsnap.basics.cached import cached_property
from minsnap.bounds.derivative_sets import Growing, Sets
from minsnap.bounds.passed_course import PassedCourse


class LegSums(NamedTuple):
    """What stands for each leg in the bound, (legs,) each.

    Parameters
    ----------
    room : ndarray
        1 - a, without sets that grow.
    product, change : ndarray
        b and X [s].
    lost : ndarray
        Integrals of the velocities' support [s].
    saved : dict of int to ndarray, shape (intervals,)
        What sets that grow add to the room of the first and of the last leg, by leg.
    """

    room: FloatArray
    product: FloatArray
    change: FloatArray
    lost: FloatArray
    saved: dict[int, FloatArray]


@dataclass(frozen=True, eq=False)
class CostateProof(OwnsArrays):
    """What bounds the time of a flight, and the costate that proves it.

    Parameters
    ----------
    course : PassedCourse
    accelerations, velocities : tuple of DerivativeSet
        Without velocities the costate is linear on each leg, and ``rate`` is what it falls by there.
    grid : ndarray, shape (legs, cells + 1)
        Ends of the cells in which it is linear, on [0, 1].
    costate : ndarray, shape (legs, cells + 1, 3)
        [s^2/m]
    rate : ndarray, shape (legs, 3)
        [s^2/m]
    splits : ndarray, shape (legs, cells, parts + 1, sets - 1, 3)
        Shares of the sets of accelerations after the first, at instants spread evenly in each cell.
    rate_splits : ndarray, shape (legs, cells, sets - 1, 3)
        Shares of the sets of velocities after the first.
    growing : tuple of GrowingSet
        That hold after the start and before the end.
    latest : ndarray, shape (2, intervals)
        Ends of intervals of the durations of the first and the last leg, rising [s]; the last one has no end.
    hovering : ndarray, shape (2, intervals, cells * parts, 2, growing, 3)
        What they share of the costate on the first and the last leg in each interval, at both ends of every part.
    """

    course: PassedCourse
    accelerations: Sets
    velocities: Sets
    grid: FloatArray
    costate: FloatArray
    rate: FloatArray
    splits: FloatArray
    rate_splits: FloatArray
    growing: Growing
    latest: FloatArray
    hovering: FloatArray

    @property
    def parts(self) -> int:
        """In how many parts of each cell norms are summed, by the trapezoid rule, which is not below the integral."""
        return int(self.splits.shape[2]) - 1

    @property
    def end_legs(self) -> tuple[int, int]:
        """The first and the last leg."""
        return 0, self.course.legs - 1

    def times(self, factor: float) -> CostateProof:
        """Return the same with a costate and rates that are multiplied."""
        names = ("costate", "rate", "splits", "rate_splits", "hovering")
        return replace(self, **{name: factor * getattr(self, name) for name in names})

    def seconds(self) -> tuple[float, float]:
        """Return the time that is proved, not rounded down, and the sum of the sizes of what it is the sum of [s]."""
        sums = self.sums
        if (sums.room <= 0.0).any() or (sums.product < sums.change).any():
            return -inf, inf
        chords, roots, change = self.chords, self._roots(sums), sums.change
        least = np.minimum(roots[0] - chords * change, roots[1] + chords * change)
        turned = np.zeros(self.course.centers.shape)
        turned[:-1] += chords[:, None] * self.rate
        turned[1:] -= chords[:, None] * self.rate
        if self.course.closed:
            turned[0] += turned[-1]
            turned[-1] = 0.0
        at_knots = self.course.reach(turned)
        ends = (self.costate[-1, -1] * self.course.ends[1]).sum() - (self.costate[0, 0] * self.course.ends[0]).sum()
        size = float(np.abs(least).sum() + sums.lost.sum() + at_knots.sum() + abs(ends))
        return float(least.sum() - sums.lost.sum() - at_knots.sum() + ends), size

    def _roots(self, sums: LegSums) -> tuple[FloatArray, FloatArray]:
        """Return the least times of the legs where their products are greatest and least, without what is lost [s]."""
        most, least = (self._least(sums, sums.product + change) for change in (sums.change, -sums.change))
        return most, least

    def _least(self, sums: LegSums, product: FloatArray) -> FloatArray:
        """Return the least of (1 - a) T + b / T for each leg, (legs,) [s]."""
        found = 2.0 * np.sqrt(sums.room * product)
        for leg, saved in sums.saved.items():
            begins = np.append(0.0, self.latest[self.end_legs.index(leg)])  # of intervals
            ends, rooms = np.append(begins[1:], inf), sums.room[leg] + np.append(saved, 0.0)
            best = np.clip(np.sqrt(product[leg] / np.maximum(rooms, 1e-300)), np.maximum(begins, 1e-300), ends)
            found[leg] = (rooms * best + product[leg] / best).min()
        return found

    @cached_property
    def chords(self) -> FloatArray:
        """Slopes of the chords, (legs,) [1/s]."""
        sums = self.sums
        room, product = np.maximum(sums.room, 0.0), np.maximum(sums.product, 0.0)
        change = np.minimum(sums.change, product)
        more, less = self._roots(sums._replace(room=room, product=product, change=change))
        wide = change > 1e-6 * product
        tangent = np.sqrt(room / np.where(product > 0.0, product, np.inf))
        return np.asarray(np.where(wide, (more - less) / np.where(wide, 2.0 * change, 1.0), tangent))

    def instants(self) -> FloatArray:
        """Return the costate where each part of a cell begins and ends, (legs, cells, parts + 1, 3) [s^2/m]."""
        share = np.linspace(0.0, 1.0, self.parts + 1)[:, None]
        return np.asarray((1.0 - share) * self.costate[:, :-1, None] + share * self.costate[:, 1:, None])

    @cached_property
    def sums(self) -> LegSums:
        """What stands for each leg in the bound."""
        width, along = np.diff(self.grid, axis=1), self.instants()
        weight = np.full(self.parts + 1, 1.0 / self.parts)
        weight[[0, -1]] *= 0.5
        used = ((support(self.accelerations, along, self.splits) @ weight) * width).sum(axis=1)
        moved = np.diff(self.costate, axis=1) / width[:, :, None] + self.rate[:, None]
        lost = (support(self.velocities, moved, self.rate_splits) * width).sum(axis=1)
        course = self.course
        product = (self.rate * course.steps).sum(axis=1)
        none = np.zeros((1, 3))
        change = course.reach(np.concatenate((self.rate, none)))[:-1]
        change += course.reach(np.concatenate((none, self.rate)))[1:]
        return LegSums(1.0 - used, product, change, lost, self._saved(width, along))

    def _saved(self, width: FloatArray, along: FloatArray) -> dict[int, FloatArray]:
        """Return what sets that grow take from the integrals of the accelerations' support, in every interval."""
        saved = dict[int, FloatArray]()
        for leg in set(self.end_legs) if self.latest.size else ():
            places, shares = self.of_parts(along[leg]), self.of_parts(self.splits[leg])
            rest, grown = places, np.zeros((1, 1, 1))
            for end in (0, 1):
                if leg == self.end_legs[end]:
                    rest, after = rest - self.hovering[end].sum(axis=3), self.after(end)[..., None]
                    for g, one in enumerate(self.growing):
                        grown = grown + one.support(self.hovering[end, ..., g, :], after)
            gained = support(self.accelerations, places, shares) - support(self.accelerations, rest, shares) - grown
            lengths = np.repeat(width[leg] / self.parts, self.parts)
            saved[leg] = 0.5 * (gained.sum(axis=2) * lengths).sum(axis=1)
        return saved

    def after(self, end: int) -> FloatArray:
        """Return how long after the start, or before the end, parts of that leg last at most, (intervals, n) [s]."""
        grid, share = self.grid[self.end_legs[end]], np.arange(self.parts) / self.parts
        begins = (grid[:-1, None] + share * np.diff(grid)[:, None]).reshape(-1)
        return np.asarray(self.latest[end, :, None] * (np.append(begins[1:], 1.0) if end == 0 else 1.0 - begins))

    @staticmethod
    def of_parts(values: FloatArray) -> FloatArray:
        """Return what is known at instants of cells (cells, parts + 1, ...) at both ends of parts (n, 2, ...)."""
        both = np.stack((values[:, :-1], values[:, 1:]), axis=2)
        return both.reshape(both.shape[0] * both.shape[1], *both.shape[2:])


def support(sets: Sets, whole: FloatArray, shares: FloatArray) -> FloatArray:
    """Return the support of an intersection along (..., 3), divided among its sets: shares are (..., sets - 1, 3)."""
    if not sets:
        return np.zeros(whole.shape[:-1])
    rest = whole - shares.sum(axis=-2)
    others = (one.support(shares[..., i, :]) for i, one in enumerate(sets[1:]))
    return sum(others, start=sets[0].support(rest))
