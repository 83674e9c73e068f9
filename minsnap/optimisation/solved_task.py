"""A task solved for given durations: its curve and its distance to the walls."""

from __future__ import annotations

from dataclasses import dataclass, replace

from minsnap.basics.arrays import FloatArray
from minsnap.basics.cached import cached_property
from minsnap.corridors.knot_regions import Placement, passing
from minsnap.corridors.margins import Margin, margin_to
from minsnap.optimisation.optimum import Optimum
from minsnap.optimisation.reduced_qp import ReducedProblem
from minsnap.optimisation.task import Task
from minsnap.optimisation.units import Units
from minsnap.trajectory.trajectory import Trajectory

NATIVE = "native"
"""What reports call the native core, as a core and as a solver."""


@dataclass(frozen=True, eq=False)
class SolvedTask:
    """A task solved for given durations.

    Parameters
    ----------
    task : Task
    durations : ndarray, shape (pieces in all,)
        [s].
    units : Units
    optimum : Optimum
    reduced : ReducedProblem or None
        As which it was solved; None where the native core solved it as it is.
    faster : SolvedTask or None
        The same control points in other durations, whose margins to walls on positions are the same.
    """

    task: Task
    durations: FloatArray
    units: Units
    optimum: Optimum
    reduced: ReducedProblem | None = None
    faster: SolvedTask | None = None

    def slowed(self, factor: float) -> SolvedTask:
        """Return the same path flown more slowly by a factor."""
        if factor == 1.0:
            return self
        durations = self.durations * factor
        return SolvedTask(self.task, durations, self.task.units(durations), self.optimum, faster=self)

    @cached_property
    def problem(self) -> ReducedProblem:
        """The reduced problem."""
        return self.reduced or self.task.problem(self.durations, self.units)

    @property
    def cost(self) -> float:
        """Integral of the squared norm of the k-th derivative."""
        unit = self.units.length**2 * self.units.time ** (1.0 - 2.0 * self.task.half)
        return float(self.problem.cost(self.optimum.knots) * unit)

    @cached_property
    def trajectory(self) -> Trajectory:
        """The curve in metres and seconds."""
        points = self.optimum.points
        if points is None:
            points = self.problem.control_points(self.optimum.knots, self.task.positions, self.units.length)
        points.setflags(write=False)
        return Trajectory(points, self.durations, pieces=self.task.pieces)

    @cached_property
    def flown(self) -> Trajectory:
        """The curve with its yaw."""
        return self.task.finish(self.trajectory)

    @cached_property
    def margins(self) -> list[Margin]:
        """Exact least distance to each block of walls, in their order."""
        walls, faster = self.task.walls, self.faster
        if faster is None:
            return [margin_to(self.trajectory, wall) for wall in walls]
        factor = self.trajectory.duration / faster.trajectory.duration
        return [
            margin_to(self.trajectory, wall) if wall.order else replace(known, instant=factor * known.instant)
            for wall, known in zip(walls, faster.margins, strict=True)
        ]

    def proved_margins(self, curve: Trajectory) -> dict[int, Margin]:
        """Return the margins by the identity of their walls; none if they are not of this very curve."""
        own = self.trajectory
        if curve.control_points is not own.control_points or curve.durations is not own.durations:
            return {}
        return {id(wall): margin for wall, margin in zip(self.task.walls, self.margins, strict=True)}

    @property
    def inside(self) -> bool:
        """Whether no margin is negative, and every waypoint that may vary is where it may be."""
        return all(margin.value >= 0.0 for margin in self.margins) and self._passes

    @property
    def _passes(self) -> bool:
        task = self.task
        if not task.held.any():
            return True
        placement = Placement(task.waypoints, task.lower, task.upper, regions=task.regions)
        return passing(self.trajectory, placement)[1]

    @property
    def corridor_margin(self) -> float | None:
        """Exact least distance to the walls on positions [m]; None where there are none."""
        pairs = zip(self.task.walls, self.margins, strict=True)
        return min((margin.value for wall, margin in pairs if wall.order == 0), default=None)
