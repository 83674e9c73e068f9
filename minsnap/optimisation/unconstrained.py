"""The optimum without inequalities: one banded Cholesky factorisation for all axes.

LAPACK's pbsv solves the block tridiagonal system in time proportional to the number of legs.
"""

from __future__ import annotations

import numpy as np

from minsnap.basics.arrays import BoolArray, FloatArray, IntArray
from minsnap.errors import SolverError
from minsnap.optimisation.high_precision import decimal_optimum, is_extreme
from minsnap.optimisation.reduced_qp import ReducedProblem
from minsnap.polynomials.bernstein import ends_gram, rising_powers


def unbounded_optimum(problem: ReducedProblem) -> FloatArray:
    """Knot values of least cost that keep every pin, bounded positions held at their nominal values.

    Returns
    -------
    ndarray, shape (knots, slots, dim)
    """
    free = problem.free.copy()
    free[problem.held, 0] = False
    if problem.closed:
        return _closed_optimum(problem, free)
    return _open_optimum(problem, free, problem.values)


def _open_optimum(problem: ReducedProblem, free: BoolArray, values: FloatArray) -> FloatArray:
    if is_extreme(problem):
        return decimal_optimum(problem, free, values)
    knots = values.copy()
    slopes = _slopes(problem, values)
    if (free == free[:, :, :1]).all():
        _solve_axes(problem, free[:, :, 0], slopes, knots, slice(None))
        return knots
    for axis in range(problem.dim):
        _solve_axes(problem, free[:, :, axis], slopes, knots, slice(axis, axis + 1))
    return knots


def _closed_optimum(problem: ReducedProblem, free: BoolArray) -> FloatArray:
    """Least cost over the state shared by first and last knot: responses to it, then a small linear system."""
    seam = free[0] & free[-1]
    inner = free.copy()
    inner[0] = inner[-1] = False
    particular = _open_optimum(problem, inner, problem.values)
    if not seam.any():
        return particular
    places = np.argwhere(seam)
    responses = _responses(problem, inner, places)
    pulls = np.stack([_seam_pull(problem, response, True) for response in responses])[:, seam]
    pull = _seam_pull(problem, particular, False)[seam]
    shares = np.linalg.lstsq(pulls.T, -pull)[0]  # no force at all where curves without cost have any seam
    return np.asarray(particular + np.tensordot(shares, responses, axes=1))


def _responses(problem: ReducedProblem, free: BoolArray, places: IntArray) -> FloatArray:
    """Responses to a state of 1 at places (slot, axis) of the seam; axes alike have the same."""
    alike, still = bool((free == free[:, :, :1]).all()), _still(problem)
    responses, known = np.zeros((len(places), *problem.values.shape)), {}
    for response, (slot, axis) in zip(responses, places.tolist(), strict=True):
        values = np.zeros_like(problem.values)
        values[0, slot, axis] = values[-1, slot, axis] = 1.0
        if not (alike and slot in known):
            known[slot] = _open_optimum(still, free, values)[:, :, axis]
        response[:, :, axis] = known[slot]
    return responses


def _seam_pull(problem: ReducedProblem, knots: FloatArray, still: bool) -> FloatArray:
    gradient = (_still(problem) if still else problem).gradient(knots)
    return np.asarray(gradient[0] + gradient[-1])


def _still(problem: ReducedProblem) -> ReducedProblem:
    """Return the problem without displacements, for responses to boundary values only."""
    return ReducedProblem(
        problem.slots, problem.durations, np.zeros_like(problem.nominal), problem.values, problem.free, problem.held
    )


def _slopes(problem: ReducedProblem, values: FloatArray) -> FloatArray:
    """Minus half the gradient at the pinned values: (knots, slots, dim)."""
    k, slots, Q = problem.half, problem.slots, ends_gram(problem.degree)
    slopes = np.zeros(values.shape)
    scale = problem.durations ** (1.0 - 2.0 * k)
    pull = (scale[:, None] * problem.powers)[:, :, None] * problem.steps[:, None]
    slopes[:-1, slots.start] -= pull * Q[:k, k, None]
    slopes[1:, slots.end] -= pull * Q[k:, k, None]
    if values.any():
        touched = _touched(values)
        slopes -= _pinned_pull(problem, values, touched)
    return slopes


def _touched(values: FloatArray) -> IntArray:
    knots = np.asarray(values.any(axis=(1, 2)))
    return np.flatnonzero(knots[:-1] | knots[1:])


def _pinned_pull(problem: ReducedProblem, values: FloatArray, touched: IntArray) -> FloatArray:
    """Half the gradient that non-zero pinned values cause, from the pieces they touch."""
    k, slots, T = problem.half, problem.slots, problem.durations[touched]
    powers = np.concatenate((problem.powers[touched], problem.powers[touched]), axis=1)[:, :, None]
    ends = np.concatenate((values[touched][:, slots.start], values[touched + 1][:, slots.end]), axis=1) * powers
    forces = np.matmul(ends_gram(problem.degree), ends) * powers * (T ** (1.0 - 2.0 * k))[:, None, None]
    pull = np.zeros_like(values)
    for a in range(k):
        pull[touched, slots.start[a]] += forces[:, a]
        pull[touched + 1, slots.end[a]] += forces[:, k + a]
    return pull


def _solve_axes(problem: ReducedProblem, free: BoolArray, slopes: FloatArray, knots: FloatArray, axes: slice) -> None:
    """Solve for the free values of some axes that share the pattern ``free`` (knots, slots), into ``knots``."""
    from scipy.linalg.lapack import dpbsv

    first = 0 if free[:, 0].any() else 1
    free = free[:, first:]
    if not free.any():
        return
    bands = _bands(problem, first)
    _pin(bands, free)
    size = free.size
    right = slopes[:, first:, axes].transpose(2, 0, 1) * free
    right = np.ascontiguousarray(right).reshape(-1, size)
    _, solution, info = dpbsv(bands.reshape(size, -1).T, right.T, lower=1, overwrite_ab=1, overwrite_b=1)
    if info != 0:
        raise SolverError(
            "the system without inequalities is singular to working precision: durations or pins are too extreme"
        )
    by_axis = solution.T.reshape(-1, *free.shape).transpose(1, 2, 0)
    knots[:, first:, axes] += np.where(free[:, :, None], by_axis, 0.0)


def _bands(problem: ReducedProblem, first: int) -> FloatArray:
    """Lower bands of the Hessian, knot by knot: (knots, slots - first, 2 (slots - first))."""
    k, slots, Q = problem.half, problem.slots, ends_gram(problem.degree)
    width = slots.count - first
    bands = np.zeros((len(problem.nominal), width, 2 * width))
    scaled = rising_powers(problem.durations, 1 - 2 * k, 2 * k - 1)
    start, end = (slots.start - first).tolist(), (slots.end - first).tolist()
    for a in range(first, k):
        for b in range(first, k):
            power = scaled[:, a + b]
            low, high = start[b], start[a]
            if high >= low:
                bands[:-1, low, high - low] += power * Q[a, b]
            low, high = end[b], end[a]
            if high >= low:
                bands[1:, low, high - low] += power * Q[k + a, k + b]
            low, high = start[b], width + end[a]
            bands[:-1, low, high - low] = power * Q[b, k + a]
    return bands


def _pin(bands: FloatArray, free: BoolArray) -> None:
    """Turn the rows and columns of pinned values into those of the identity."""
    width = free.shape[1]
    flat = bands.reshape(-1, 2 * width)
    pinned = np.flatnonzero(~free)
    flat[pinned] = 0.0
    flat[pinned, 0] = 1.0
    distance = np.arange(1, 2 * width)
    row = pinned[:, None] - distance
    inside = row >= 0
    flat[row[inside], np.broadcast_to(distance, row.shape)[inside]] = 0.0
