"""Coordinates for the QP: in small problems the Hessian is the identity, in large ones it has a unit diagonal."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from minsnap.basics.arrays import FloatArray, IntArray
from minsnap.errors import SolverError
from minsnap.optimisation.high_precision import decimal_whitening, is_extreme
from minsnap.optimisation.qp import DENSE
from minsnap.optimisation.reduced_qp import Problem
from minsnap.polynomials.bernstein import ends_gram


class Space(Protocol):
    """Coordinates x of the unknowns u = B x."""

    hessian: Any

    def rows(self, columns: IntArray, values: FloatArray) -> tuple[Any, FloatArray]:
        """Normalised rows in x, and the norms they were divided by, from padded rows in u (column n: none)."""
        ...

    def gradient(self, gradient: FloatArray) -> FloatArray:
        """Transform a gradient in u to x."""
        ...

    def unknowns(self, x: FloatArray) -> FloatArray:
        """Return u."""
        ...


@dataclass(eq=False)
class Whitened:
    """Coordinates in which the Hessian is the identity; dense.

    Parameters
    ----------
    basis : ndarray, shape (n, n)
        B with B'HB = 1.
    """

    basis: FloatArray

    def __post_init__(self) -> None:
        self.hessian = np.eye(len(self.basis))

    def rows(self, columns: IntArray, values: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return dense rows."""
        n = len(self.basis)
        flat = np.bincount(
            (np.arange(len(columns))[:, None] * (n + 1) + columns).reshape(-1),
            values.reshape(-1),
            len(columns) * (n + 1),
        )
        dense = flat.reshape(len(columns), n + 1)[:, :n] @ self.basis
        norms = np.sqrt((dense * dense).sum(axis=1))
        norms[norms == 0.0] = 1.0
        return dense / norms[:, None], norms

    def gradient(self, gradient: FloatArray) -> FloatArray:
        """Transform a gradient in u to x."""
        return np.asarray(gradient @ self.basis)

    def unknowns(self, x: FloatArray) -> FloatArray:
        """Return u."""
        return np.asarray(self.basis @ x)


@dataclass(eq=False)
class Scaled:
    """Coordinates in which the Hessian has a unit diagonal; sparse.

    Parameters
    ----------
    hessian : csc_matrix, shape (n, n)
    scale : ndarray, shape (n,)
        B = diag(scale).
    """

    hessian: Any
    scale: FloatArray

    def rows(self, columns: IntArray, values: FloatArray) -> tuple[Any, FloatArray]:
        """Return sparse rows."""
        from scipy.sparse import csc_matrix

        n = len(self.scale)
        scaled = values * np.append(self.scale, 0.0)[columns]
        row = np.broadcast_to(np.arange(len(columns))[:, None], columns.shape)
        used = (columns < n) & (scaled != 0.0)
        matrix = csc_matrix((scaled[used], (row[used], columns[used])), shape=(len(columns), n))
        norms = np.sqrt(np.bincount(matrix.indices, matrix.data**2, len(columns)))
        norms[norms == 0.0] = 1.0
        matrix.data /= norms[matrix.indices]
        return matrix, norms

    def gradient(self, gradient: FloatArray) -> FloatArray:
        """Transform a gradient in u to x."""
        return gradient * self.scale

    def unknowns(self, x: FloatArray) -> FloatArray:
        """Return u."""
        return self.scale * x


def make_space(problem: Problem, columns: IntArray, n: int, dense: bool) -> Space:
    """Choose coordinates for n unknowns.

    Parameters
    ----------
    columns : ndarray of int, shape (pieces, axes, 2k)
        Unknown of each end derivative, n for none.
    dense : bool
        Whether to whiten.
    """
    from scipy.linalg.lapack import dpotrf, dtrtri

    if n == 0:
        return Whitened(np.zeros((0, 0)))
    if dense and n <= DENSE and is_extreme(problem):
        return Whitened(decimal_whitening(problem, columns, n))
    value, row, column, scale = _scaled_entries(problem, columns, n)
    if not dense:
        from scipy.sparse import csc_matrix

        return Scaled(csc_matrix((value, (row, column)), shape=(n, n)), scale)
    hessian = np.bincount(row * n + column, value, n * n).reshape(n, n)
    factor, singular = dpotrf(hessian, lower=1)
    if not singular:
        inverse, _ = dtrtri(factor, lower=1)
        return Whitened(scale[:, None] * inverse.T)
    if n > DENSE:
        raise SolverError("the QP is singular to working precision: durations are too extreme")
    return Whitened(decimal_whitening(problem, columns, n))


def _scaled_entries(problem: Problem, columns: IntArray, n: int) -> tuple[FloatArray, IntArray, IntArray, FloatArray]:
    """Entries of the Hessian scaled to a unit diagonal: values, rows, columns (repeated ones add), and the scale."""
    powers = problem.end_powers
    weights = problem.durations ** (1.0 - 2.0 * problem.half)
    blocks = powers[:, :, None] * powers[:, None, :] * (weights[:, None, None] * ends_gram(problem.degree))
    shape = (*columns.shape, columns.shape[2])
    row, column = np.broadcast_to(columns[:, :, :, None], shape), np.broadcast_to(columns[:, :, None, :], shape)
    value = np.broadcast_to(blocks[:, None], shape)
    used = (row < n) & (column < n)
    row, column, value = row[used], column[used], value[used]
    scale = 1.0 / np.sqrt(np.bincount(row[row == column], value[row == column], n))
    return value * scale[row] * scale[column], row, column, scale
