"""Walls on velocities and accelerations where a path is flown faster or slower: the factor on time that keeps them.

A derivative of order p is divided by the p-th power of a factor on time.  Walls around zero, such as a greatest
velocity, are kept by all factors from one on; others, such as a least velocity, may be kept by none.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from minsnap.corridors.constraint import Walls
from minsnap.corridors.margins import nearest_wall
from minsnap.errors import SolverError
from minsnap.limits.limits import Limits
from minsnap.optimisation.task import Task
from minsnap.time_allocation.time_stretch import touching_factor
from minsnap.trajectory.trajectory import Trajectory

PRECISION = 1e-10
"""Relative, of a factor on time."""

DOUBLINGS = 20
"""How often a factor is doubled until walls are kept."""


def on_derivatives(walls: Sequence[Walls]) -> list[Walls]:
    """Return those walls that bound a derivative."""
    return [wall for wall in walls if wall.order]


def without_derivative_walls(task: Task) -> Task:
    """Return a task with its walls on positions alone, which no change of time breaks."""
    kept = [wall for wall in task.walls if not wall.order]
    return task if len(kept) == len(task.walls) else replace(task, walls=kept)


def walled_factor(walls: Sequence[Walls], curve: Trajectory, least: float) -> float | None:
    """Return the least factor on time, from one on, with which a curve keeps walls; None without one.

    Parameters
    ----------
    walls : sequence of Walls
        Those on positions are kept or broken by every factor alike.
    curve : Trajectory
    least : float
        Factor from which on it is looked for.
    """
    bounded = on_derivatives(walls)

    def keeps(factor: float) -> bool:
        nearest = nearest_wall(curve.stretched(factor), bounded)
        return nearest is None or nearest.value >= 0.0

    if not bounded or keeps(least):
        return least
    low = high = least
    for _ in range(DOUBLINGS):
        low, high = high, 2.0 * high
        if keeps(high):
            break
    else:
        return None
    while high - low > PRECISION * high:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if keeps(middle) else (middle, high)
    return high


def kept_factor(limits: Limits, walls: Sequence[Walls], curve: Trajectory, guess: float | None = None) -> float:
    """Return the least factor on time with which a curve keeps limits and walls on derivatives.

    Parameters are those of :func:`touching_factor`.

    Raises
    ------
    LimitError
        If the path uses none of the limits at any speed.
    SolverError
        If walls are kept by no factor with which the limits are.
    """
    factor = walled_factor(walls, curve, touching_factor(limits, curve, guess))
    if factor is None:
        raise SolverError("no speed was found at which the path keeps its limits and the walls on derivatives")
    return factor
