"""A heading that is itself a planned trajectory."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from minsnap.basics.arrays import ArrayLike, FloatArray
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
