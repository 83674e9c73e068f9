"""A heading that is itself a planned trajectory."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from minsnap.basics.arrays import ArrayLike, FloatArray
from minsnap.native.free_optimum import pinned_optimum
from minsnap.trajectory.heading import Heading, Largest
from minsnap.trajectory.trajectory import Trajectory


@dataclass(frozen=True, eq=False)
class PlannedHeading(Heading):
    """A yaw that is itself a one-dimensional trajectory.

    Parameters
    ----------
    trajectory : Trajectory
        Yaw [rad], dim 1, over the same interval as the path it belongs to; not wrapped.
    """

    trajectory: Trajectory
    limited_last = True

    @classmethod
    def through(cls, angles: FloatArray, durations: FloatArray, closed: bool, rate: float = 0.0) -> PlannedHeading:
        """Return the yaw through angles with the least integral of squared angular acceleration: a cubic spline.

        Parameters
        ----------
        angles : ndarray, shape (n,)
            Not wrapped [rad].
        durations : ndarray, shape (n - 1,)
            [s].
        closed : bool
            Whether the yaw rate at the end equals that at the start; else it is zero.
        rate : float
            Yaw rate at the start, where it is not closed [rad/s].
        """
        ends = {} if closed else {0: {1: np.array([rate])}, len(durations): {1: np.zeros(1)}}
        spline = pinned_optimum(angles[:, None], durations, 2, ends, closed)
        points = spline[0] if isinstance(spline, tuple) else _spline(angles, durations, closed, rate)
        return cls(Trajectory(points, durations))

    @property
    def polynomial(self) -> Trajectory:
        """The trajectory."""
        return self.trajectory

    def __call__(self, t: ArrayLike, order: int = 0) -> FloatArray:
        """Yaw or its derivative at ``t``, in the shape of ``t``."""
        inside = np.minimum(t, self.trajectory.duration)
        return np.asarray(self.trajectory(inside, order)[..., 0])

    def largest_rate(self, start: float, end: float) -> Largest:
        """Return it from the rate's control points, which keep their digits where little of a piece is left."""
        yaw = self.trajectory
        if start <= 0.0 and end >= yaw.duration:
            return yaw.max_norm(1)
        first, last = (min(max(t, 0.0), yaw.duration) for t in (start, end))
        if first >= last:
            return float(np.abs(yaw(last, 1)).max()), last
        value, instant = yaw.derivative(1).between(first, last).max_norm(0)
        return value, first + instant

    @property
    def largest_jerk(self) -> float:
        """The exact one."""
        return float(self.trajectory.max_norm(3)[0])


def _spline(angles: FloatArray, durations: FloatArray, closed: bool, rate: float) -> FloatArray:
    """Return control points (n - 1, 4, 1) of the same spline without the native core, from its rates at the angles.

    The integral over a leg of rates r and s is 4 (r^2 + r s + s^2) / T - 12 (r + s) rise / T^2, and a constant.
    """
    from scipy.sparse import coo_matrix
    from scipy.sparse.linalg import spsolve

    legs, rise, rates = len(durations), np.diff(angles), np.zeros(len(angles))
    ends = np.arange(legs), np.arange(1, legs + 1) % (legs if closed else legs + 1)
    weight, pull = 1.0 / durations, 3.0 * rise / durations**2
    places = [np.concatenate([ends[k] for k in order]) for order in ((0, 0, 1, 1), (0, 1, 0, 1))]
    matrix = coo_matrix((np.concatenate((2.0 * weight, weight, weight, 2.0 * weight)), places)).tocsc()
    slope = np.bincount(ends[0], pull, matrix.shape[0]) + np.bincount(ends[1], pull, matrix.shape[0])
    free = slice(0, legs) if closed else slice(1, legs)
    if not closed:
        rates[0] = rate
        slope -= matrix @ rates
    if free.start < free.stop:
        rates[free] = spsolve(matrix[free, free], slope[free])
    if closed:
        rates[-1] = rates[0]
    bends = angles[:-1] + durations * rates[:-1] / 3.0, angles[1:] - durations * rates[1:] / 3.0
    return np.asarray(np.stack((angles[:-1], *bends, angles[1:]), axis=1)[:, :, None])
