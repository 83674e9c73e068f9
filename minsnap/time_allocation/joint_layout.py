r"""Unknowns of the joint search: scaled knot derivatives and the durations of all pieces.

A free derivative of order p at a knot is searched as :math:`w = z\,\tau^p`, with :math:`\tau` the geometric mean of the
durations at both sides of the knot: a length, whatever the durations.  Pinned derivatives stay physical.  The end
derivatives of a piece on its unit interval are then :math:`e = w \prod_q T_q^{E_q}`, q over the piece before, the piece
itself and the one after it, and so is every derivative in a duration: :math:`\partial e / \partial \ln T_q = E_q e`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np

from minsnap.basics.arrays import BoolArray, FloatArray, IntArray
from minsnap.optimisation.problem import Task
from minsnap.optimisation.reduced_qp import Problem
from minsnap.optimisation.units import Units
from minsnap.polynomials.bernstein import basis, derivative_basis_map, ends_to_points
from minsnap.trajectory.trajectory import Trajectory

NEIGHBOURS = 3
"""Durations that the ends of a piece depend on: of the piece before, its own, of the piece after."""


SLACKS = 2
"""Unknowns after the derivatives and the durations: one slack for limits, one for walls."""


@dataclass(frozen=True, eq=False)
class JointState:
    """A curve and its durations, normalised.

    Parameters
    ----------
    scaled : ndarray, shape (knots, slots, dim)
        Free derivatives times a power of time, as lengths; pinned ones as they are; positions as deviations.
    durations : ndarray, shape (pieces in all,)
        Of the pieces.
    """

    scaled: FloatArray
    durations: FloatArray

    @property
    def total(self) -> float:
        """Sum of the durations."""
        return float(self.durations.sum())


class JointLayout:
    """Where the unknowns of a task stand, and what they make of a curve.

    Parameters
    ----------
    task : Task
    units : Units
        In which everything here is normalised.
    """

    def __init__(self, task: Task, units: Units) -> None:
        self.task, self.units = task, units
        pieces = task.legs * task.pieces
        self.problem: Problem = task.problem(np.full(pieces, units.time), units)
        self.pieces, self.half, self.dim = pieces, task.half, task.dim
        self.size = self.problem.size
        self.degree = self.problem.degree
        self.orders = np.tile(np.arange(self.half), 2)
        self._known: list[tuple[JointState, tuple[FloatArray, FloatArray]]] = []

    @cached_property
    def columns(self) -> IntArray:
        """Unknown of every end derivative, -1 where pinned: (pieces, 2k, dim)."""
        return np.ascontiguousarray(self.problem.piece_columns.transpose(0, 2, 1))

    @cached_property
    def neighbours(self) -> IntArray:
        """Piece before, the piece itself and the piece after, -1 where there is none: (pieces, 3)."""
        found = np.arange(self.pieces)[:, None] + np.array([-1, 0, 1])
        if self.task.closed:
            return np.asarray(found % self.pieces)
        found[found >= self.pieces] = -1
        return np.asarray(found)

    @cached_property
    def unknowns(self) -> IntArray:
        """Unknowns of every piece: its ends, the durations around it, the slacks; their number for none."""
        none = self.size + self.pieces + SLACKS
        ends = self.columns.reshape(self.pieces, -1)
        times = np.where(self.neighbours >= 0, self.size + self.neighbours, none)
        slacks = np.broadcast_to(none - SLACKS + np.arange(SLACKS), (self.pieces, SLACKS))
        return np.concatenate((np.where(ends >= 0, ends, none), times, slacks), axis=1)

    @cached_property
    def _shared(self) -> BoolArray:
        """Free slots that both sides of a knot share, and that are therefore scaled by both durations."""
        slots = self.problem.slots
        both = np.zeros(slots.count, dtype=bool)
        both[slots.start[slots.start == slots.end]] = True
        inner = np.ones(self.pieces + 1, dtype=bool)
        if not self.task.closed:
            inner[[0, -1]] = False
        return self.problem.free.any(axis=2) & both & inner[:, None]

    @cached_property
    def _side_weights(self) -> tuple[FloatArray, FloatArray]:
        """Powers of the left and of the right duration in the scale of each knot value, (knots, slots) each."""
        slots, free = self.problem.slots, self.problem.free.any(axis=2)
        left, right = np.where(self._shared, 0.5, 0.0), np.where(self._shared, 0.5, 0.0)
        alone = free & ~self._shared
        starts = np.isin(np.arange(slots.count), slots.start)
        right[alone & starts] = 1.0
        left[alone & ~starts] = 1.0
        last = alone[-1] & ~np.array(self.task.closed)
        right[-1, last], left[-1, last] = 0.0, 1.0
        orders = self._slot_orders
        return left * orders, right * orders

    @cached_property
    def _slot_orders(self) -> FloatArray:
        slots = self.problem.slots
        orders = np.zeros(slots.count)
        orders[slots.start], orders[slots.end] = np.arange(self.half), np.arange(self.half)
        return orders

    @cached_property
    def exponents(self) -> FloatArray:
        """E: powers of the durations of the neighbours in each end derivative, (pieces, 2k, 3)."""
        slots, (left, right) = self.problem.slots, self._side_weights
        powers = np.zeros((self.pieces, 2 * self.half, NEIGHBOURS))
        powers[:, :, 1] = self.orders
        powers[:, : self.half, 0] -= left[:-1, slots.start]
        powers[:, : self.half, 1] -= right[:-1, slots.start]
        powers[:, self.half :, 1] -= left[1:, slots.end]
        powers[:, self.half :, 2] -= right[1:, slots.end]
        return powers

    @cached_property
    def places(self) -> IntArray:
        """Place of every unknown, and of none at the end: those of a piece stand close together."""
        durations = self.size + np.arange(self.pieces)
        last = self.size + self.pieces + np.arange(SLACKS)
        knots = [np.unique(columns[columns >= 0]) for columns in self.problem.columns[: self.pieces + 1]]
        around = [knots[0], durations[:1], durations[-1:]] if self.task.closed else []
        border = np.unique(np.concatenate([*around, last]))
        parts = [part for k in range(self.pieces) for part in (knots[k], durations[k : k + 1])]
        inner = np.concatenate([*parts, knots[-1]])
        inner = inner[~np.isin(inner, border)]
        place = np.empty(self.size + self.pieces + SLACKS + 1, dtype=np.int64)
        place[np.concatenate((inner, border, [len(place) - 1]))] = np.arange(len(place))
        return place

    def knot_scales(self, durations: FloatArray) -> FloatArray:
        """Factor from physical to scaled derivatives at every knot, (knots, slots)."""
        logs = np.log(durations)
        left, right = self._side_weights
        before, after = np.append(logs[-1], logs), np.append(logs, logs[0])
        return np.asarray(np.exp(left * before[:, None] + right * after[:, None]))

    def end_scales(self, durations: FloatArray) -> FloatArray:
        """Factor from scaled knot values to the end derivatives of every piece, (pieces, 2k)."""
        logs = np.where(self.neighbours >= 0, np.log(durations)[self.neighbours], 0.0)
        return np.asarray(np.exp(np.einsum("ijq,iq->ij", self.exponents, logs)))

    def state(self, knots: FloatArray, durations: FloatArray) -> JointState:
        """Scale physical knot derivatives (knots, slots, dim), positions as deviations."""
        return JointState(knots * self.knot_scales(durations)[:, :, None], durations)

    def knots(self, state: JointState) -> FloatArray:
        """Physical knot derivatives (knots, slots, dim) of a state."""
        return np.asarray(state.scaled / self.knot_scales(state.durations)[:, :, None])

    def ends(self, state: JointState) -> FloatArray:
        """End derivatives of all pieces on the unit interval, (pieces, 2k, dim)."""
        return self._curve(state)[0]

    def scales(self, state: JointState) -> FloatArray:
        """Factor from scaled knot values to these, (pieces, 2k)."""
        return self._curve(state)[1]

    def _curve(self, state: JointState) -> tuple[FloatArray, FloatArray]:
        """Return ends and scales; those of the last two states, which a step begins at and tries, are kept."""
        for known, curve in self._known:
            if known is state:
                return curve
        scales = self.end_scales(state.durations)
        found = self._ends(state, scales), scales
        self._known = [*self._known[-1:], (state, found)]
        return found

    def _ends(self, state: JointState, scales: FloatArray) -> FloatArray:
        slots, nominal = self.problem.slots, self.problem.nominal
        ends = np.concatenate((state.scaled[:-1, slots.start], state.scaled[1:, slots.end]), axis=1)
        ends *= scales[:, :, None]
        ends[:, 0] += nominal[:-1]
        ends[:, self.half] += nominal[1:]
        return ends

    def moved(self, state: JointState, step: FloatArray, share: float = 1.0) -> JointState:
        """Return the state after a share of a step in the unknowns and in the logarithms of the durations."""
        change = np.append(share * step[: self.size], 0.0)[self.problem.columns]
        relative = share * step[self.size : self.size + self.pieces]
        return JointState(state.scaled + change, state.durations * (1.0 + relative))

    def trajectory(self, state: JointState) -> Trajectory:
        """Return the curve in metres and seconds."""
        durations = state.durations
        problem = self.task.problem(durations * self.units.time, self.units)
        points = problem.control_points(self.knots(state), self.task.positions, self.units.length)
        return Trajectory(points, durations * self.units.time, pieces=self.task.pieces)


def end_basis(degree: int, order: int, s: FloatArray) -> FloatArray:
    """Factors of the end derivatives in a derivative on the unit interval: (m, 2k) for s of shape (m,)."""
    if order > degree:
        return np.zeros((len(s), degree + 1))
    return np.asarray(basis(degree - order, s) @ ends_to_derivative(degree, order))


@cache
def ends_to_derivative(degree: int, order: int) -> FloatArray:
    """Map from end derivatives to the control points of a derivative: (2k - order, 2k)."""
    return np.asarray(derivative_basis_map(degree, order) @ ends_to_points(degree))


@cache
def end_metric(degree: int, order: int) -> FloatArray:
    """Gram matrix of a derivative on the unit interval in end derivatives, (2k, 2k), by Gauss quadrature."""
    nodes, weights = np.polynomial.legendre.leggauss(degree + 1)
    factors = end_basis(degree, order, (nodes + 1.0) / 2.0)
    return np.asarray((factors * (weights / 2.0)[:, None]).T @ factors)
