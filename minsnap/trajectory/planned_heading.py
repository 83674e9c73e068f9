"""A heading that is itself a planned trajectory."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from minsnap.basics.arrays import FloatArray
from minsnap.trajectory.trajectory import Trajectory


@dataclass(frozen=True, eq=False)
class PlannedHeading:
    """A yaw that is itself a one-dimensional trajectory.

    Parameters
    ----------
    trajectory : Trajectory
        Yaw [rad], dim 1, over the same interval as the path it belongs to; not wrapped.
    """

    trajectory: Trajectory

    def __call__(self, t: npt.ArrayLike, order: int = 0) -> FloatArray:
        """Yaw or its derivative at ``t``, in the shape of ``t``."""
        inside = np.minimum(t, self.trajectory.duration)
        return np.asarray(self.trajectory(inside, order)[..., 0])
