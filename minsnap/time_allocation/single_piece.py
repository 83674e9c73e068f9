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
from minsnap.native.chain_programme import solve_chain
from minsnap.polynomials.bernstein import end_basis, ends_gram, ends_to_points


@dataclass(frozen=True)
class PieceSettings:
    """What a programme weighs, and how exactly it is solved.

    Parameters
    ----------
    smooth : float
        Weight of the squared highest derivative beside the slacks, so that the solution is unique.
    failed : float
        Price of the slack of a soft condition, as a share of the price of a hard one.
    accuracy : float
        Gap and residuals, relative to the cost.
    feasible : float
        Slack of hard conditions that counts as none, in widths.
    """

    smooth: float = 1e-6
    failed: float = 1e-4
    accuracy: float = 1e-6
    feasible: float = 1e-6


PIECE = PieceSettings()


def walls_on(walls: Sequence[Walls], leg: int, origin: FloatArray) -> list[Walls]:
    """Return the walls of one leg, positions counted from an origin (dim,) [m]."""
    return [wall.chosen(wall.leg == leg).from_origin(origin) for wall in walls if (wall.leg == leg).any()]


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

    def rest_ends(self, duration: float) -> FloatArray:
        """Like ``start_ends``, but at rest at the end, half way as far as at the speed of the start."""
        ends = self.start_ends(duration)
        ends[self.half :] = 0.0
        ends[self.half] = 0.5 * duration * self.state[1]
        return ends

    def solve(
        self, duration: float, ends: FloatArray, free: Sequence[int], demands: Sequence[Demand]
    ) -> FloatArray | None:
        """Choose the free derivatives at the end.

        Parameters
        ----------
        duration : float
            [s].
        ends : ndarray, shape (2k, dim)
            Derivatives at both ends on the unit interval [m]; the free ones are a guess.
        free : sequence of int
            Orders of the derivatives at the end that are unknown.
        demands : sequence of Demand

        Returns
        -------
        ndarray of shape (2k, dim), or None
            Control points from the start [m]; None where hard demands are not kept.

        Raises
        ------
        LateError
            If the deadline would have passed by then.
        """
        self.deadline.check()
        unit = self.acceleration * duration**2
        size = len(free) * self.dim + 2
        rows = [self._rows(demand, duration, ends, free, unit) for demand in demands]
        rows += [(-np.eye(1, size, slack)[None], np.zeros((1, 1))) for slack in (size - 2, size - 1)]
        cones = np.concatenate([np.full(len(bound), bound.shape[1]) for _, bound in rows])
        solution = solve_chain(
            np.arange(size)[None],
            self._costs(ends / unit, free),
            (np.zeros_like(cones), cones),
            (
                np.concatenate([part.reshape(-1, size) for part, _ in rows]),
                np.concatenate([b.ravel() for _, b in rows]),
            ),
            PIECE.accuracy,
        )
        if solution is None or solution[0][-2] > PIECE.feasible:
            return None
        moved = ends.copy()
        moved[self.half + np.asarray(free)] += unit * solution[0][:-2].reshape(len(free), self.dim)
        return np.asarray(ends_to_points(self.degree) @ moved)

    def _rows(
        self, demand: Demand, duration: float, ends: FloatArray, free: Sequence[int], unit: float
    ) -> tuple[FloatArray, FloatArray]:
        """Return cones of one size: bound (n, c) less matrix (n, c, unknowns) times the unknowns lies in each."""
        order, (rows, offset) = demand.walls.order, demand.walls.in_widths
        factors = end_basis(self.degree, order, demand.s) / duration**order
        if demand.ahead:
            factors = factors + demand.ahead * end_basis(self.degree, order + 1, demand.s) / duration ** (order + 1)
        value = np.einsum("rcd,md->mrc", rows, factors @ ends) + offset
        inwards = np.broadcast_to(demand.inwards.reshape(len(demand.s), -1), value.shape[:2])
        value[:, :, 0] -= inwards
        slope = unit * np.einsum("rcd,mf->mrcfd", rows, factors[:, self.half + np.asarray(free)])
        count, cone = value.shape[0] * value.shape[1], value.shape[2]
        matrix = np.zeros((count, cone, len(free) * self.dim + 2))
        matrix[:, :, :-2] = -slope.reshape(count, cone, -1)
        matrix[:, 0, -1 if demand.soft else -2] = -1.0
        return matrix, value.reshape(count, cone)

    def _costs(self, ends: FloatArray, free: Sequence[int]) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return Hessian, further diagonal and gradient: of the slacks, and of the curve as a tie-break."""
        size = len(free) * self.dim + 2
        gram = PIECE.smooth * ends_gram(self.degree) / ends_gram(self.degree).max()
        places = self.half + np.asarray(free)
        hessian = np.zeros((1, size, size))
        hessian[0, :-2, :-2] = np.kron(gram[np.ix_(places, places)], np.eye(self.dim))
        linear = np.zeros(size)
        linear[:-2] = (gram[places] @ ends).reshape(-1)
        linear[-2:] = 1.0, PIECE.failed
        return hessian, np.full(size, 1e-9), linear
