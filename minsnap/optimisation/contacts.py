r"""Contacts: where walls press on the curve, and where they will press in the end.

A row at :math:`s_0` keeps the curve inside there, yet the curve then peaks at another instant :math:`p` nearby.  In
coordinates where the Hessian is the identity, with :math:`\varphi` the row, :math:`\mu` its multiplier and :math:`g`
the excess, the peak moves by
:math:`-\mu \, (|\varphi'|^2 - (\varphi \cdot \varphi')^2 / |\varphi|^2) / |g''|` for every step of the row: always
against it.  The contact is therefore between the two, and rows at the peaks alone close in on it from both sides by no
more than a constant factor a round.  One more row in between takes it there much faster.
"""

from __future__ import annotations

import numpy as np

from minsnap.arrays import FloatArray, IntArray
from minsnap.optimisation.normalised_constraints import Rows

PRESSING = 1e-8
"""Share of the largest multiplier above which a row is taken to press."""

REACH = 0.3
"""Distance, in pieces, up to which a row and a peak belong to one contact."""

APART = 1e-2
"""Distance below which they are one: a row more would be nearly parallel to the others."""

ONWARD = 0.68
"""How far from the row towards the peak the contact is looked for: between a half and all, as the peak moves."""


class Contacts:
    """Places where rows press on the curve, in the order of their walls and instants.

    Parameters
    ----------
    rows : Rows
    multipliers : ndarray, shape (r,)
        Of the first r rows.
    """

    def __init__(self, rows: Rows, multipliers: FloatArray) -> None:
        pressing = np.flatnonzero(multipliers > PRESSING * multipliers.max(initial=0.0))
        self.places = np.sort(2.0 * rows.wall[pressing] + rows.s[pressing])
        self.rows, self.multipliers = rows, multipliers

    def expected(self, wall: IntArray, s: FloatArray) -> tuple[IntArray, FloatArray]:
        """Where contacts are expected from peaks at s on some walls: indices of the peaks that have one, and where."""
        if not len(self.places):
            return np.zeros(0, dtype=np.intp), np.zeros(0)
        peak = 2.0 * wall + s
        after = np.searchsorted(self.places, peak)
        down = self.places[np.maximum(after - 1, 0)] - peak
        up = self.places[np.minimum(after, len(self.places) - 1)] - peak
        step = np.where(np.abs(down) < np.abs(up), down, up)
        distance = np.abs(step)
        index = np.flatnonzero((distance < REACH) & (distance > APART))
        return index, s[index] + (1.0 - ONWARD) * step[index]

    def forces(self, wall: IntArray) -> FloatArray:
        """Sum of multiplier times normal of the rows of some walls: (m, dim)."""
        known = len(self.multipliers)
        pressing = np.isin(self.rows.wall[:known], wall)
        place = np.searchsorted(wall, self.rows.wall[:known][pressing])
        forces = np.zeros((len(wall), self.rows.normal.shape[1]))
        np.add.at(forces, place, self.multipliers[pressing, None] * self.rows.normal[:known][pressing])
        return forces
