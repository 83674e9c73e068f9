r"""The full problem in its textbook form: every coefficient is an unknown, every condition a row.

Leg i is :math:`x_i(s) = \sum_j c_{ij} s^j` on its own unit time :math:`s = (t - t_i) / T_i`, for each axis; waypoints,
end states and continuity are equations, and the corridor is sampled at equally spaced instants of every leg (D.
Mellinger and V. Kumar, "Minimum snap trajectory generation and control for quadrotors", ICRA 2011, sections IV and V).
``plan`` solves an equivalent smaller problem, with the corridor at every instant; this one is for study, comparison and
other solvers.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import perm
from typing import Any

import numpy as np

from minsnap.basics.arrays import ArrayLike, FloatArray, ReadOnly, set_fields
from minsnap.basics.checks import (
    check_closing,
    check_continuity,
    check_degree,
    check_durations,
    check_pins,
    check_waypoints,
    is_whole,
)
from minsnap.basics.messages import explains_names
from minsnap.corridors.constraint import Constraint, walls_of
from minsnap.corridors.tubes import as_constraints
from minsnap.errors import CorridorError, WaypointError
from minsnap.optimisation.textbook_rows import RowCollector, join, keep_states, pass_waypoints, sample_planes
from minsnap.polynomials.bernstein import powers_to_points
from minsnap.trajectory.trajectory import Trajectory


@dataclass(frozen=True, eq=False)
class FullProblem(ReadOnly):
    r"""Minimise :math:`\tfrac12 x^\top P x + q^\top x` subject to :math:`G x \le h` and :math:`A x = b`.

    The unknowns are the coefficients of 1, s, s², … of every leg and axis [m]: entry
    ``(leg * dim + axis) * (degree + 1) + power`` of x.  The objective is the integral of the squared norm of the k-th
    derivative, degree 2k - 1, without a factor 1/2.

    Parameters
    ----------
    P : scipy.sparse.csc_matrix, shape (n, n), n = legs * dim * (degree + 1)
        Symmetric, positive semidefinite [s^(1-2k)].
    q : ndarray, shape (n,)
        Zero.
    G : scipy.sparse.csc_matrix, shape (rows, n)
        Corridor at the samples.
    h : ndarray, shape (rows,)
    A : scipy.sparse.csc_matrix, shape (equations, n)
        Waypoints, end states, pins and continuity.
    b : ndarray, shape (equations,)
    inequalities : tuple of str
        What each row of G is.
    equalities : tuple of str
        What each row of A is.
    durations : ndarray, shape (legs,)
        [s].
    dim : int
        Number of coordinates.
    degree : int
        Degree of the polynomials.
    """

    P: Any
    q: FloatArray
    G: Any
    h: FloatArray
    A: Any
    b: FloatArray
    inequalities: tuple[str, ...]
    equalities: tuple[str, ...]
    durations: FloatArray
    dim: int
    degree: int

    def __repr__(self) -> str:
        rows = f"{len(self.equalities)} equalities, {len(self.inequalities)} inequalities"
        return f"FullProblem({len(self.q)} unknowns, {rows}, dim={self.dim}, degree={self.degree})"

    def __post_init__(self) -> None:
        for name in ("P", "G", "A"):
            matrix = getattr(self, name)
            for part in (matrix.data, matrix.indices, matrix.indptr):
                part.flags.writeable = False
        for name in ("q", "h", "b", "durations"):
            set_fields(self, **{name: np.array(getattr(self, name), dtype=np.float64)})

    def __setstate__(self, state: dict[str, Any]) -> None:
        super().__setstate__(state)
        self.__post_init__()

    def for_qpsolvers(self, dense: bool = False) -> Any:
        """Return the same problem as a ``qpsolvers.Problem``, with copied arrays that a solver may write to.

        Parameters
        ----------
        dense : bool
            Dense matrices, which some solvers need.
        """
        import qpsolvers

        matrices = [part.toarray() if dense else part.copy() for part in (self.P, self.G, self.A)]
        P, G, A = (part if len(bound) else None for part, bound in zip(matrices, (self.q, self.h, self.b), strict=True))
        h, b = (bound.copy() if len(bound) else None for bound in (self.h, self.b))
        return qpsolvers.Problem(P, self.q.copy(), G, h, A, b)

    def coefficients(self, x: ArrayLike) -> FloatArray:
        """Arrange unknowns x, shape (n,), as coefficients of 1, s, s², …: (legs, dim, degree + 1) [m].

        Raises
        ------
        WaypointError
            If x is not of that shape.
        """
        values = np.asarray(x, dtype=np.float64)
        if values.shape != self.q.shape:
            raise WaypointError(f"the problem has unknowns of shape {self.q.shape}, not {values.shape}")
        return values.reshape(len(self.durations), self.dim, self.degree + 1)

    def trajectory(self, x: ArrayLike) -> Trajectory:
        """Return the curve that unknowns x, shape (n,), describe."""
        points = np.einsum("ij,ldj->lid", powers_to_points(self.degree), self.coefficients(x))
        return Trajectory(points, self.durations)


@explains_names({"limits": "nothing: a QP has durations, and no limits"})
def build_qp(
    waypoints: ArrayLike,
    durations: ArrayLike,
    corridor: ArrayLike | Constraint | Sequence[object] | None = None,
    samples: int = 20,
    continuity: int | None = None,
    degree: int = 7,
    start: Mapping[str, ArrayLike] | None = None,
    end: Mapping[str, ArrayLike] | None = None,
    closed: bool = False,
    *,
    pins: Mapping[int, Mapping[str, ArrayLike]] | None = None,
) -> FullProblem:
    """Build the quadratic programme of a trajectory with all its coefficients as unknowns.

    Parameters
    ----------
    waypoints : array_like, shape (n, dim)
        Positions to pass through [m], n >= 2.
    durations : array_like, shape (n - 1,)
        Seconds a leg.
    corridor : float, array_like, Constraint or sequence of Constraint, optional
        Half-width of a ``Tube`` around each leg [m], one for all or one per leg; or constraints that give planes.
    samples : int
        Equally spaced instants inside each leg at which the corridor holds; 0 for none.
    continuity : int, optional
        Derivatives continuous at inner waypoints; k - 1 unless given (3 for degree 7).
    degree : int
        2k - 1: 3, 5, 7, 9 or 11.
    start, end : mapping, optional
        Derivatives at the ends, such as ``{"velocity": (1, 0, 0)}``; those up to order k - 1 not named are zero.
    closed : bool
        The state at the end is the state at the start, and free.
    pins : mapping, optional
        Derivatives at inner waypoints: ``{2: {"velocity": (1, 0, 0)}}``.

    Returns
    -------
    FullProblem

    Raises
    ------
    WaypointError, TimingError, CorridorError, DegreeError
        If an argument is malformed, or the corridor is not made of planes.
    """
    points, half = check_waypoints(waypoints), check_degree(degree)
    times = check_durations(durations, len(points) - 1)
    shared = check_continuity(continuity, half)
    states = check_pins(pins, start, end, check_closing(closed, points), half, points)
    equations = RowCollector(times, points.shape[1], 2 * half)
    pass_waypoints(equations, points)
    keep_states(equations, states, shared)
    join(equations, shared, closed)
    instants = _instants(samples)
    rows = RowCollector(times, points.shape[1], 2 * half)
    for wall in walls_of(as_constraints(corridor), points):
        sample_planes(rows, wall, instants)
    A, b, equalities = equations.collected()
    G, h, inequalities = rows.collected()
    P = _cost(times, points.shape[1], half)
    return FullProblem(
        P, np.zeros(P.shape[0]), G, h, A, b, inequalities, equalities, times, points.shape[1], 2 * half - 1
    )


def _cost(durations: FloatArray, dim: int, half: int) -> Any:
    r"""Return P: twice :math:`T^{1-2k} \int_0^1 x^{(k)}(s)^2 ds` of every leg and axis."""
    from scipy.sparse import block_diag

    top = np.arange(half, 2 * half)
    falling = np.array([perm(power, half) for power in top], dtype=np.float64)
    gram = np.zeros((2 * half, 2 * half))
    gram[half:, half:] = 2.0 * np.outer(falling, falling) / np.add.outer(top - half, top - half + 1)
    return block_diag([gram * duration ** (1.0 - 2.0 * half) for duration in durations for _ in range(dim)], "csc")


def _instants(samples: Any) -> FloatArray:
    if not is_whole(samples) or samples < 0:
        raise CorridorError(f"samples is {samples!r}: it must be a whole number of instants per leg, 0 or more")
    return np.asarray(np.arange(1, samples + 1) / (samples + 1))
