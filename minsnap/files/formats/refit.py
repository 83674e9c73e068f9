"""Polynomials fitted to samples, to write setpoints in a format that holds polynomials."""

from __future__ import annotations

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.errors import FileError
from minsnap.trajectory.heading import ConstantHeading, Heading
from minsnap.trajectory.planned_heading import PlannedHeading
from minsnap.trajectory.samples import Samples
from minsnap.trajectory.trajectory import Trajectory

TOLERANCE = 1e-3
"""Greatest distance of the curve from a sample [m]."""


def refit(samples: Samples, max_pieces: int | None = None, tolerance: float = TOLERANCE) -> Trajectory:
    """Return quintics through some of the samples that pass within a tolerance of all of them.

    Each piece meets position, velocity and acceleration of the samples at its ends (Hermite), so the curve is twice
    continuously differentiable; the number of pieces is the smallest that suffices, and they are of nearly equal
    length.

    Parameters
    ----------
    samples : Samples
        With velocities and accelerations.
    max_pieces : int or None
        No more than this.
    tolerance : float
        [m], and [rad] for the heading.

    Raises
    ------
    FileError
        If there are no accelerations, or too few pieces are allowed; says what they would reach.
    """
    if samples.velocity is None or samples.acceleration is None:
        raise FileError("polynomials need samples with velocities and accelerations")
    most = min(len(samples) - 1, max_pieces or len(samples) - 1)
    for pieces in _growing(most):
        knots = np.unique(np.round(np.linspace(0, len(samples) - 1, pieces + 1)).astype(int))
        trajectory = _through(samples, knots)
        error = _deviation(trajectory, samples)
        if error <= tolerance:
            return trajectory
    raise FileError(f"{most} pieces are {error:.3g} m from the samples, more than {tolerance:g} m: fly it in parts")


def _growing(most: int) -> list[int]:
    """Numbers of pieces to try: 1, 2, 3, … while this is fast, then by factors of 1.2, up to the maximum."""
    counts = [1]
    while counts[-1] < most:
        counts.append(min(most, max(counts[-1] + 1, counts[-1] * 6 // 5)))
    return counts


def _through(samples: Samples, knots: FloatArray) -> Trajectory:
    from scipy.interpolate import BPoly

    t = samples.t[knots] - samples.t[0]
    orders = (samples.position, samples.velocity, samples.acceleration)
    curve = BPoly.from_derivatives(t, np.stack([values[knots] for values in orders if values is not None], axis=1))
    return Trajectory.from_bpoly(curve, _heading(samples, knots, t))


def _heading(samples: Samples, knots: FloatArray, t: FloatArray) -> Heading:
    from scipy.interpolate import BPoly

    if samples.yaw is None or np.ptp(samples.yaw) == 0.0:
        return ConstantHeading(0.0 if samples.yaw is None else float(samples.yaw[0]))
    known = [samples.yaw] if samples.yaw_rate is None else [samples.yaw, samples.yaw_rate]
    columns = np.stack([values[knots] for values in known], axis=1)[:, :, None]
    return PlannedHeading(Trajectory.from_bpoly(BPoly.from_derivatives(t, columns)))


def _deviation(trajectory: Trajectory, samples: Samples) -> float:
    """Return the greatest deviation of the curve from a sample, in position or heading."""
    t = np.minimum(samples.t - samples.t[0], trajectory.duration)
    error = float(np.linalg.norm(trajectory(t) - samples.position, axis=1).max())
    if samples.yaw is not None:
        error = max(error, float(np.abs(trajectory.yaw(t) - samples.yaw).max()))
    return error
