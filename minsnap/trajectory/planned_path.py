"""A path that is a plan, with what else is known of it: a course, a route, a survey."""

from __future__ import annotations

from minsnap.basics.arrays import FloatArray
from minsnap.trajectory.heading import Heading
from minsnap.trajectory.path import Path
from minsnap.trajectory.trajectory import Trajectory


class PlannedPath(Path):
    """A path whose curve is its ``trajectory``."""

    trajectory: Trajectory

    @property
    def duration(self) -> float:
        """Length of the interval [s]."""
        return self.trajectory.duration

    @property
    def dim(self) -> int:
        """Number of coordinates."""
        return self.trajectory.dim

    @property
    def yaw(self) -> Heading:  # type: ignore[override]
        """Heading of the plan."""
        return self.trajectory.yaw

    def as_trajectory(self) -> Trajectory:
        """Return the plan."""
        return self.trajectory

    def _evaluate(self, t: FloatArray, order: int) -> FloatArray:
        return self.trajectory._evaluate(t, order)
