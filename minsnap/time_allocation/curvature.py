r"""Positive part of the second derivative of the Lagrangian in scaled derivatives and durations.

With F the force on the ends :math:`e = w\,\rho(T)` of a piece, the Lagrangian bends as :math:`F \cdot e`: between w and
:math:`\ln T_q` by :math:`F \rho E_q`, and between two durations by :math:`F \cdot e\,(E_q E_r - \delta_{qr} E_q)`.
It has rank six at most a piece, so that a small eigenvalue problem gives the nearest positive one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.time_allocation.joint_layout import NEIGHBOURS, JointLayout

REST_PEAKS = np.array([1.0, 1.0, 8.0, 60.0, 500.0, 5000.0])
"""Size of derivatives on the unit interval of a curve of length one, by order."""


@dataclass(frozen=True, eq=False)
class Forces:
    """Multipliers times gradients: in the ends of every piece (pieces, 2k, dim), and what bends with its duration."""

    ends: FloatArray
    own: FloatArray


def positive_curvature(
    layout: JointLayout, ends: FloatArray, scales: FloatArray, forces: Forces, lengths: FloatArray
) -> FloatArray:
    """Return the positive part, in scaled ends and the durations around: (pieces, 2k dim + 3, 2k dim + 3).

    Parameters
    ----------
    ends : ndarray, shape (pieces, 2k, dim)
    scales : ndarray, shape (pieces, 2k)
        From scaled derivatives to ends.
    forces : Forces
    lengths : ndarray, shape (pieces,)
        Typical lengths, in which changes of the ends are weighed.
    """
    pieces, dim, exponents = layout.pieces, layout.dim, layout.exponents
    natural = np.tile(REST_PEAKS[: layout.half], 2)
    unit = np.repeat(lengths[:, None] / natural / scales, dim, axis=1)
    mixed = (forces.ends * scales[:, :, None])[..., None] * exponents[:, :, None, :]
    mixed = np.where(layout.columns[..., None] >= 0, mixed, 0.0).reshape(pieces, -1, NEIGHBOURS)
    present = layout.neighbours >= 0
    mixed = mixed * unit[:, :, None] * present[:, None, :]
    pulled = (forces.ends * ends).sum(axis=2)
    times = np.einsum("ij,ijq,ijr->iqr", pulled, exponents, exponents)
    times -= np.einsum("ij,ijq->iq", pulled, exponents)[:, :, None] * np.eye(NEIGHBOURS)
    times[:, 1, 1] += forces.own
    times = times * (present[:, :, None] & present[:, None, :])
    return _positive(mixed, times, unit)


def _positive(mixed: FloatArray, times: FloatArray, unit: FloatArray) -> FloatArray:
    """Positive part of [[0, mixed], [mixed', times]], back in unscaled unknowns."""
    pieces, size, n = mixed.shape
    frame, triangle = np.linalg.qr(mixed)
    small = np.zeros((pieces, 2 * n, 2 * n))
    small[:, :n, n:], small[:, n:, :n] = triangle, triangle.transpose(0, 2, 1)
    small[:, n:, n:] = times
    values, vectors = np.linalg.eigh(small)
    small = (vectors * np.maximum(values, 0.0)[:, None, :]) @ vectors.transpose(0, 2, 1)
    lift = np.zeros((pieces, size + n, 2 * n))
    lift[:, :size, :n] = frame / unit[:, :, None]
    lift[:, size:, n:] = np.eye(n)
    return np.asarray(lift @ small @ lift.transpose(0, 2, 1))
