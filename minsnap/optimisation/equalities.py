"""Equality rows of the QP: continuity above k - 1 at the knots, and planes in which knots must lie."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from minsnap.basics.arrays import BoolArray, FloatArray, IntArray
from minsnap.optimisation.reduced_qp import ReducedProblem


@dataclass(frozen=True, eq=False)
class Equalities:
    """Rows: the sum over j of values[r, j] times the unknown columns[r, j] is sides[r].

    Parameters
    ----------
    columns : ndarray of int, shape (r, m)
        Position of an unknown in its group, or the number of unknowns in the group for none.
    values : ndarray, shape (r, m)
    sides : ndarray, shape (r,)
    """

    columns: IntArray
    values: FloatArray
    sides: FloatArray

    def __len__(self) -> int:
        return len(self.sides)


def joined(parts: list[Equalities], unknowns: int) -> Equalities | None:
    """Return all the rows, padded to the same number of entries; None where there are none."""
    parts = [part for part in parts if len(part)]
    if not parts:
        return None
    width = max(part.columns.shape[1] for part in parts)
    columns = [_padded(part.columns, width, unknowns) for part in parts]
    values = [_padded(part.values, width, 0.0) for part in parts]
    return Equalities(np.concatenate(columns), np.concatenate(values), np.concatenate([part.sides for part in parts]))


def _padded(entries: np.ndarray, width: int, value: float) -> np.ndarray:
    return np.pad(entries, ((0, 0), (0, width - entries.shape[1])), constant_values=value)


def jump_rows(problem: ReducedProblem, base: FloatArray, axes: BoolArray, local: IntArray) -> Equalities:
    """Rows that make the derivatives of order ``problem.jumps`` continuous at the knots, for some axes.

    Parameters
    ----------
    base : ndarray, shape (knots, slots, dim)
        Values from which the unknowns are deviations.
    axes : ndarray of bool, shape (dim,)
    local : ndarray of int, shape (size + 1,)
        Position of every unknown in its group.
    """
    pieces = len(problem.durations)
    left = np.arange(pieces) if problem.closed else np.arange(pieces - 1)
    right = (left + 1) % pieces
    ends = problem.plain_ends(base)
    columns, values, sides = [np.zeros((0, 4 * problem.half), dtype=np.intp)], [np.zeros((0, 4 * problem.half))], []
    for order in problem.jumps if len(left) else ():
        before = problem.row_factors(left, np.ones(len(left)), order)
        after = problem.row_factors(right, np.zeros(len(right)), order)
        jump = np.einsum("rj,rjd->rd", before, ends[left]) - np.einsum("rj,rjd->rd", after, ends[right])
        for axis in np.flatnonzero(axes):
            both = (problem.piece_columns[left, axis], problem.piece_columns[right, axis])
            columns.append(local[np.concatenate(both, axis=1)])
            values.append(np.concatenate((before, -after), axis=1))
            sides.append(-jump[:, axis])
    return Equalities(np.concatenate(columns), np.concatenate(values), np.concatenate([np.zeros(0), *sides]))


def plane_rows(problem: ReducedProblem, base: FloatArray, axes: BoolArray, local: IntArray) -> Equalities:
    """Rows that keep knots in the planes of their gates, for some axes."""
    mine = [(knot, normal) for knot, normal in problem.planes if normal[axes].any()]
    if not mine:
        return Equalities(np.zeros((0, problem.dim), dtype=np.intp), np.zeros((0, problem.dim)), np.zeros(0))
    knots, normals = np.array([knot for knot, _ in mine]), np.array([normal for _, normal in mine])
    columns = local[problem.columns[knots, 0]]
    values = np.where(columns < local[-1], normals, 0.0)
    return Equalities(columns, values, -(normals * base[knots, 0]).sum(axis=1))
