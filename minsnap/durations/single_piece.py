r"""One polynomial from a moving state: the conditions that it keeps at instants, as one small cone programme.

The unknowns are some of the derivatives at the end of the piece, as deviations from the motion that keeps the highest
given derivative of the start.  A wall :math:`\|A(x - a)\| \le \rho + c \cdot x` of a derivative x becomes a
second-order cone at every instant of a grid (S. Boyd and L. Vandenberghe, "Convex Optimization", section 4.4).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from math import factorial

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.deadline import NEVER, Deadline
from minsnap.corridors.constraint import Walls
from minsnap.native.piece_programme import PieceConditions, piece_within


@dataclass(frozen=True, eq=False)
class Demand:
    """Walls of one derivative at some instants of the piece.

    Parameters
    ----------
    walls : Walls
        Positions are counted from the start of the piece.
    s : ndarray, shape (m,)
        Instants, in [0, 1].
    inwards : ndarray, shape (m,) or (m, r)
        By how many widths they are moved inwards there.
    soft : bool
        Whether they may be exceeded where nothing else will do.
    ahead : float
        Seconds by which the derivative is extrapolated with the next one.
    """

    walls: Walls
    s: FloatArray
    inwards: FloatArray
    soft: bool = False
    ahead: float = 0.0

    def conditions(self) -> PieceConditions:
        """Return the walls at every instant."""
        (rows, offset), instants = self.walls.in_widths, len(self.s)
        bound = np.repeat(offset[None], instants, axis=0)
        bound[:, :, 0] -= self.inwards.reshape(instants, -1)
        count, size = instants * len(rows), rows.shape[1]
        return PieceConditions(
            np.full(count, self.walls.order),
            np.full(count, int(self.soft)),
            size * np.arange(count + 1),
            np.repeat(self.s, len(rows)),
            np.full(count, self.ahead),
            np.tile(rows.reshape(-1, rows.shape[2]), (instants, 1)),
            bound.reshape(-1),
        )


def conditions_of(demands: Sequence[Demand]) -> PieceConditions:
    """Return the conditions of all demands."""
    parts = [demand.conditions() for demand in demands]
    joined = {name: np.concatenate([getattr(part, name) for part in parts]) for name in vars(parts[0])}
    sizes = np.concatenate([np.diff(part.first) for part in parts])
    return PieceConditions(**joined | {"first": np.concatenate(([0], np.cumsum(sizes)))})


@cache
def _taylor(half: int) -> FloatArray:
    """Matrix from derivatives at 0 to those at 1 of the motion that keeps the highest one, (k, k)."""
    return np.array([[1.0 / factorial(q - p) if q >= p else 0.0 for q in range(half)] for p in range(half)])


class SinglePiece:
    """Pieces from one state.

    Parameters
    ----------
    state : ndarray, shape (k, dim)
        Derivatives 0 ... k - 1 at the start; the position is taken as the origin.
    acceleration : float
        One that counts as large here [m/s^2], positive.
    deadline : Deadline
        At which the search for one ends.
    """

    def __init__(self, state: FloatArray, acceleration: float, deadline: Deadline = NEVER) -> None:
        self.half, self.dim = state.shape
        self.state, self.acceleration, self.deadline = state.copy(), acceleration, deadline
        self.state[0] = 0.0
        self.degree = 2 * self.half - 1

    def start_ends(self, duration: float | FloatArray) -> FloatArray:
        """End derivatives on the unit interval of the motion that keeps the highest derivative, (..., 2k, dim)."""
        scale = np.asarray(duration, dtype=np.float64)[..., None] ** np.arange(self.half)
        start = self.state * scale[..., None]
        return np.concatenate((start, _taylor(self.half) @ start), axis=-2)

    def within(self, conditions: PieceConditions, duration: float) -> FloatArray | None:
        """Return the piece of a duration that keeps conditions, all of its end chosen; see :meth:`solve`."""
        return self.solve(duration, self.start_ends(duration), range(self.half), conditions)

    def rest_ends(self, duration: float) -> FloatArray:
        """Like ``start_ends``, but at rest at the end, after half the distance that the start's speed would cover."""
        ends = self.start_ends(duration)
        ends[self.half :] = 0.0
        ends[self.half] = 0.5 * duration * self.state[1]
        return ends

    def solve(
        self, duration: float, ends: FloatArray, free: Sequence[int], conditions: PieceConditions
    ) -> FloatArray | None:
        """Choose the free derivatives at the end: see :func:`piece_within`.

        Raises
        ------
        LateError
            If the deadline would have passed by then.
        """
        self.deadline.check()
        return piece_within(conditions, duration, ends, free, self.acceleration)
