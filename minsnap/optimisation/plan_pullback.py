r"""How a function of plans without walls changes with their durations and waypoints, by the adjoint of their optimum.

With v the derivatives at inner knots, :math:`\theta` durations and waypoints, and J the cost, the optimum is
:math:`\nabla_v J(v, \theta) = 0`. A function :math:`L(c)` of the control points c then has

.. math:: \frac{dL}{d\theta} = \frac{\partial L}{\partial\theta} - \lambda^\top \frac{\partial}{\partial\theta}
          \nabla_v J, \qquad \nabla_v^2 J \, \lambda = \frac{\partial L}{\partial v},

one more solve with the matrix of the plan itself (the implicit function theorem). With the scaled end derivatives
:math:`e_i` of a piece, A their orders, Q their Gram matrix and :math:`f_i` those of :math:`\lambda`,
:math:`\lambda^\top \nabla_v J = \sum_i 2 T_i^{1-2k} f_i^\top Q e_i`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.polynomials.bernstein import ends_gram, ends_to_points
from minsnap.trajectory.trajectories import moved_ends


class Pulled(NamedTuple):
    """Derivatives of a function of plans.

    Parameters
    ----------
    durations : ndarray, shape (plans, legs)
    waypoints : ndarray, shape (plans, legs + 1, dim)
    """

    durations: FloatArray
    waypoints: FloatArray


def plan_pullback(points: FloatArray, durations: FloatArray, upstream: FloatArray) -> Pulled:
    """Return the derivatives in durations and waypoints of a function whose derivatives in control points are known.

    Parameters
    ----------
    points : ndarray, shape (plans, legs, 2k, dim)
        Control points of optima without walls, continuous up to order k - 1, with given derivatives at both ends [m].
    durations : ndarray, shape (plans, legs)
        [s].
    upstream : ndarray, shape (plans, legs, 2k, dim)
        Derivatives in the control points.
    """
    plans, legs, size, dim = points.shape
    half = size // 2
    orders = np.tile(np.arange(half), 2)
    ends = moved_ends(points.reshape(-1, size, dim)).reshape(points.shape)
    pulled = np.einsum("ji,bljd->blid", ends_to_points(size - 1), upstream)
    powers = durations[..., None] ** orders
    at_knots = _gathered(pulled * powers[..., None])
    own = np.zeros((plans, legs + 1, half, dim))
    own[:, 1:-1, 1:] = _solved(durations, at_knots[:, 1:-1, 1:])
    adjoint = powers[..., None] * np.concatenate([own[:, :-1], own[:, 1:]], axis=2)
    gram, weights = 2.0 * ends_gram(size - 1), durations[..., None, None] ** (1.0 - 2.0 * half)
    forces = weights * np.einsum("ij,bljd->blid", gram, adjoint)
    weighed = (1.0 - 2.0 * half) + orders[:, None] + orders
    bent = weights * np.einsum("ij,bljd->blid", gram * weighed, ends)
    slopes = orders[:, None] * pulled * ends - adjoint * bent
    places = _gathered(pulled - forces)[:, :, 0]
    return Pulled(slopes.sum(axis=(2, 3)) / durations, places)


def _gathered(at_ends: FloatArray) -> FloatArray:
    """Add up by knots what stands at the ends of pieces: (plans, legs, 2k, dim) to (plans, legs + 1, k, dim)."""
    plans, legs, size, dim = at_ends.shape
    sums = np.zeros((plans, legs + 1, size // 2, dim))
    sums[:, :-1] += at_ends[:, :, : size // 2]
    sums[:, 1:] += at_ends[:, :, size // 2 :]
    return sums


def _solved(durations: FloatArray, right: FloatArray) -> FloatArray:
    """Solve with the second derivatives of the cost: right-hand sides (plans, legs - 1, k - 1, dim)."""
    plans, inner, free, dim = right.shape
    if not inner:
        return right
    half = free + 1
    orders = np.tile(np.arange(half), 2)
    powers = orders[:, None] + orders + 1.0 - 2.0 * half
    blocks = 2.0 * ends_gram(2 * half - 1) * durations[..., None, None] ** powers
    whole = np.zeros((plans, (inner + 2) * half, (inner + 2) * half))
    for leg in range(inner + 1):
        place = slice(leg * half, (leg + 2) * half)
        whole[:, place, place] += blocks[:, leg]
    kept = (half * np.arange(1, inner + 1)[:, None] + np.arange(1, half)).ravel()
    matrix = whole[:, kept[:, None], kept]
    scale = 1.0 / np.sqrt(np.diagonal(matrix, axis1=1, axis2=2))
    scaled = np.linalg.solve(
        matrix * scale[:, :, None] * scale[:, None], right.reshape(plans, -1, dim) * scale[..., None]
    )
    return np.asarray((scaled * scale[..., None]).reshape(right.shape))
