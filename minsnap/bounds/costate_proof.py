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
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import inf

import numpy as np

from minsnap.basics.arrays import FloatArray, OwnsArrays
from minsnap.bounds.derivative_sets import Sets
from minsnap.bounds.passed_course import PassedCourse


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
    chords : ndarray, shape (legs,)
        [1/s]
    """

    course: PassedCourse
    accelerations: Sets
    velocities: Sets
    grid: FloatArray
    costate: FloatArray
    rate: FloatArray
    splits: FloatArray
    rate_splits: FloatArray
    chords: FloatArray

    @property
    def parts(self) -> int:
        """In how many parts of each cell norms are summed, by the trapezoid rule, which is not below the integral."""
        return int(self.splits.shape[2]) - 1

    def times(self, factor: float) -> CostateProof:
        """Return the same with a costate and rates that are multiplied, and with their own chords."""
        names = ("costate", "rate", "splits", "rate_splits")
        changed = replace(self, **{name: factor * getattr(self, name) for name in names})
        return replace(changed, chords=changed._chords())

    def seconds(self) -> tuple[float, float]:
        """Return the time that is proved, not rounded down, and the sum of the sizes of what it is the sum of [s]."""
        room, product, change, lost = self._sums()
        if (room <= 0.0).any() or (product < change).any():
            return -inf, inf
        chords, roots = self.chords, self._roots(room, product, change)
        least = np.minimum(roots[0] - chords * change, roots[1] + chords * change)
        turned = np.zeros(self.course.centers.shape)
        turned[:-1] += chords[:, None] * self.rate
        turned[1:] -= chords[:, None] * self.rate
        if self.course.closed:
            turned[0] += turned[-1]
            turned[-1] = 0.0
        at_knots = self.course.reach(turned)
        ends = (self.costate[-1, -1] * self.course.ends[1]).sum() - (self.costate[0, 0] * self.course.ends[0]).sum()
        size = float(np.abs(least).sum() + lost.sum() + at_knots.sum() + abs(ends))
        return float(least.sum() - lost.sum() - at_knots.sum() + ends), size

    def _roots(self, room: FloatArray, product: FloatArray, change: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the least times of the legs where their products are greatest and least, without what is lost [s]."""
        return 2.0 * np.sqrt(room * (product + change)), 2.0 * np.sqrt(room * (product - change))

    def _chords(self) -> FloatArray:
        room, product, change, _ = self._sums()
        more, less = self._roots(np.maximum(room, 0.0), product, np.minimum(change, product))
        wide = change > 1e-6 * product
        tangent = np.sqrt(np.maximum(room, 0.0) / np.where(product > 0.0, product, np.inf))
        return np.where(wide, (more - less) / np.where(wide, 2.0 * change, 1.0), tangent)

    def _sums(self) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Return 1 - a, b, X and the integrals of the velocities' support of each leg."""
        width = np.diff(self.grid, axis=1)
        share = np.linspace(0.0, 1.0, self.parts + 1)[:, None]
        along = (1.0 - share) * self.costate[:, :-1, None] + share * self.costate[:, 1:, None]
        weight = np.full(self.parts + 1, 1.0 / self.parts)
        weight[[0, -1]] *= 0.5
        used = ((_support(self.accelerations, along, self.splits) @ weight) * width).sum(axis=1)
        moved = np.diff(self.costate, axis=1) / width[:, :, None] + self.rate[:, None]
        lost = (_support(self.velocities, moved, self.rate_splits) * width).sum(axis=1)
        course = self.course
        product = (self.rate * course.steps).sum(axis=1)
        none = np.zeros((1, 3))
        change = course.reach(np.concatenate((self.rate, none)))[:-1]
        change += course.reach(np.concatenate((none, self.rate)))[1:]
        return 1.0 - used, product, change, lost


def _support(sets: Sets, whole: FloatArray, shares: FloatArray) -> FloatArray:
    """Return the support of an intersection along (..., 3), divided among its sets: shares are (..., sets - 1, 3)."""
    if not sets:
        return np.zeros(whole.shape[:-1])
    rest = whole - shares.sum(axis=-2)
    others = (one.support(shares[..., i, :]) for i, one in enumerate(sets[1:]))
    return sum(others, start=sets[0].support(rest))
