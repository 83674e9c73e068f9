"""Curves as SciPy's piecewise polynomials, and from them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.errors import WaypointError
from minsnap.polynomials.bernstein import points_to_powers, powers_to_points

if TYPE_CHECKING:
    from scipy.interpolate import BPoly, PPoly


def ppoly_of(points: FloatArray, durations: FloatArray, breaks: FloatArray) -> PPoly:
    """Return control points (pieces, degree + 1, dim) as local powers of seconds, descending."""
    from scipy.interpolate import PPoly

    degree = points.shape[1] - 1
    powers = np.einsum("ij,mjd->imd", points_to_powers(degree), points)
    powers /= durations[None, :, None] ** np.arange(degree + 1)[:, None, None]
    return PPoly(powers[::-1], breaks)


def pieces_of_ppoly(ppoly: PPoly) -> tuple[FloatArray, FloatArray]:
    """Return control points and durations."""
    powers = _trailing_dim(ppoly.c)[::-1]
    durations = np.diff(ppoly.x)
    scaled = powers * durations[None, :, None] ** np.arange(len(powers))[:, None, None]
    return np.einsum("ji,imd->mjd", powers_to_points(len(powers) - 1), scaled), durations


def bpoly_of(points: FloatArray, breaks: FloatArray) -> BPoly:
    """Return the control points as they are."""
    from scipy.interpolate import BPoly

    return BPoly(points.transpose(1, 0, 2), breaks)


def pieces_of_bpoly(bpoly: BPoly) -> tuple[FloatArray, FloatArray]:
    """Return control points and durations."""
    return _trailing_dim(bpoly.c).transpose(1, 0, 2), np.diff(bpoly.x)


def _trailing_dim(coefficients: FloatArray) -> FloatArray:
    if coefficients.ndim not in (2, 3):
        raise WaypointError(f"a piecewise polynomial must have one trailing dimension, not {coefficients.ndim - 2}")
    return coefficients if coefficients.ndim == 3 else coefficients[:, :, None]
