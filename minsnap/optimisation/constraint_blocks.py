"""One-sided constraints in the normalised units of a problem, on pieces or at their ends, of two kinds.

Each kind gives control points of its excess, in widths, from the relative control points of all pieces
(``excess``); normals (r, dim) and bounds (r,) of rows for walls ``index`` where the derivative has a ``value``
(``cuts``); which axes it bounds (``touched``, shape (m, dim)); and itself moved outwards (``moved``). Walls with an
``s`` hold at the start (0) or the end (1) of their piece alone: their excess is a polynomial of degree 0.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from minsnap.basics.arrays import FloatArray, IntArray
from minsnap.basics.tolerances import ROUNDING
from minsnap.polynomials.bernstein import squared_norm


@dataclass(frozen=True, eq=False)
class FlatWalls:
    """One-sided planes: normal . x <= bound."""

    order: int
    piece: IntArray
    normal: FloatArray
    bound: FloatArray
    width: FloatArray
    s: FloatArray | None = None

    def excess(self, points: FloatArray) -> FloatArray:
        """Return (n . x - bound) / width."""
        along = np.matmul(_bounded(points, self.piece, self.s), self.normal[:, :, None])[:, :, 0]
        along -= self.bound[:, None]
        return np.asarray(along / self.width[:, None])

    def cuts(self, index: IntArray, value: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the planes themselves."""
        return self.normal[index], self.bound[index]

    def touched(self) -> npt.NDArray[np.bool_]:
        """Axes with a component of the normal above rounding."""
        return np.asarray(np.abs(self.normal) > ROUNDING * np.abs(self.normal).max(axis=1, keepdims=True))

    def relaxation(self, excess: FloatArray) -> FloatArray:
        """Widths by which each wall must move outwards for its largest excess, (m,)."""
        return excess

    def moved(self, distance: FloatArray) -> FlatWalls:
        """Return the same walls moved outwards, shape (m,)."""
        return replace(self, bound=self.bound + distance)


@dataclass(frozen=True, eq=False)
class Spheres:
    """One-sided balls or cones: norm of (matrix x + offset) <= radius + slope . x."""

    order: int
    piece: IntArray
    matrix: FloatArray
    offset: FloatArray
    radius: FloatArray
    slope: FloatArray
    width: FloatArray
    s: FloatArray | None = None

    def excess(self, points: FloatArray) -> FloatArray:
        """Return half the excess of the squared norm in squared widths: to first order the excess in widths."""
        mine = _bounded(points, self.piece, self.s)
        mapped = np.matmul(mine, self.matrix.transpose(0, 2, 1)) + self.offset[:, None, :]
        squares = squared_norm(mapped / self.width[:, None, None])
        reach = self.radius[:, None] + np.matmul(mine, self.slope[:, :, None])[:, :, 0]
        return (squares - squared_norm((reach / self.width[:, None])[..., None])) / 2.0

    def cuts(self, index: IntArray, value: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Tangent planes in the direction of the value."""
        mapped = np.einsum("rqd,rd->rq", self.matrix[index], value) + self.offset[index]
        norm = np.linalg.norm(mapped, axis=1, keepdims=True)
        return self.tangents(index, mapped / np.where(norm > 0.0, norm, 1.0))

    def tangents(self, index: IntArray, direction: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Tangent planes in directions (r, q) of length 1 at most."""
        normal = np.einsum("rq,rqd->rd", direction, self.matrix[index]) - self.slope[index]
        return normal, self.radius[index] - (direction * self.offset[index]).sum(axis=1)

    def touched(self) -> npt.NDArray[np.bool_]:
        """Axes whose column of the matrix or component of the slope is above rounding."""
        return np.asarray((np.abs(self.matrix).max(axis=1) > ROUNDING) | (np.abs(self.slope) > ROUNDING))

    def relaxation(self, excess: FloatArray) -> FloatArray:
        """Widths by which each wall must move outwards for its largest excess, (m,); exact where it has no slope.

        The excess e is half that of the squared norm, so that the norm is the square root of radius^2 + 2 e.
        """
        reach = self.radius / self.width
        return np.asarray(np.sqrt(np.maximum(reach**2 + 2.0 * excess, 0.0)) - reach)

    def moved(self, distance: FloatArray) -> Spheres:
        """Return the same walls moved outwards, shape (m,)."""
        return replace(self, radius=self.radius + distance)


def _bounded(points: FloatArray, piece: IntArray, s: FloatArray | None) -> FloatArray:
    """Control points of what each wall bounds: of its whole piece (m, n, dim), or the value at its end (m, 1, dim)."""
    if s is None:
        return np.asarray(points[piece])
    return np.asarray(points[piece, np.where(s > 0.0, points.shape[1] - 1, 0)][:, None])


Block = FlatWalls | Spheres
