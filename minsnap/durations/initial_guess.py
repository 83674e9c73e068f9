"""Where searches begin: for the shortest time at rest at every waypoint, no faster than limits on norms allow."""

from __future__ import annotations

from dataclasses import replace
from math import sin

import numpy as np

from minsnap.basics.arrays import FloatArray, rounded, significant
from minsnap.basics.limit_kinds import KIND
from minsnap.durations.least_cost import distance_split
from minsnap.durations.time_stretch import walled_factor, without_derivative_walls
from minsnap.durations.timing import attempted, solved_or_explained
from minsnap.errors import MinsnapError
from minsnap.limits.limits import Limits
from minsnap.optimisation.optimum import InfeasibleRowsError
from minsnap.optimisation.solve import solve
from minsnap.optimisation.solved_task import SolvedTask
from minsnap.optimisation.task import Task
from minsnap.trajectory.trajectory import Trajectory

PEAKS = (2.1875, 7.5132, 52.5, 840.0)
"""Largest derivatives of the rest-to-rest profile 35 s^4 - 84 s^5 + 70 s^6 - 20 s^7 over the unit interval.

``peaks`` of ``shortest_time/shortest_time.hpp`` and ``planner/shortest_plan.cpp`` are the same numbers.
"""

SHORT = 0.3
"""Share of the mean length below which a leg is taken to be that long: passages may coincide."""


def norm_limits(limits: Limits) -> tuple[float, float, float, float]:
    """Speed, acceleration, jerk and snap that a motion in any direction may reach; infinite where free."""
    least = [np.inf] * 5
    for name, limit in limits.given().items():
        order = KIND[name].order
        least[order] = min(least[order], limit)
    reserve = [] if limits.max_thrust is None else [(limits.max_thrust - 1.0) * limits.gravity]
    reserve += [] if limits.min_thrust is None else [(1.0 - limits.min_thrust) * limits.gravity]
    reserve += [] if limits.tilt is None else [limits.gravity * sin(limits.tilt)]
    turning = [] if limits.body_rate is None else [0.5 * limits.gravity * limits.body_rate]
    return least[1], min((least[2], *reserve)), min((least[3], *turning)), least[4]


def stop_and_go_times(lengths: FloatArray, limits: Limits) -> FloatArray:
    """Leg durations at which the rest-to-rest profile of degree 7 along each leg keeps the limits on norms."""
    longest = PEAKS[0] * lengths / limits.speeds_of(len(lengths)) if limits.leg_speeds else np.zeros(len(lengths))
    for order, (peak, limit) in enumerate(zip(PEAKS, norm_limits(limits), strict=True), 1):
        if limit < np.inf:
            least = (peak * lengths / limit) ** (1.0 / order)
            longest = np.maximum(longest, rounded(least, 13) if order > 2 else least)  # libraries agree on square roots
    return np.asarray(longest if longest.all() else np.maximum(longest, 1e-3 + lengths))


def guessed_lengths(task: Task) -> FloatArray:
    """Straight lengths of the legs, none much shorter than the others, (legs,) [m]."""
    return np.maximum(task.lengths, SHORT * task.length)


def priced_first_guess(task: Task, price: float) -> FloatArray | MinsnapError:
    """Leg durations by distance at the total where cost + price * time is least, or the next that walls allow.

    Or the reason why no curve is found.
    """
    durations = distance_split(task, float(task.legs))
    times = task.piece_durations(durations)
    solved: SolvedTask | MinsnapError | InfeasibleRowsError = attempted(solve, without_derivative_walls(task), times)
    if isinstance(solved, InfeasibleRowsError):  # at these times, which are only a guess
        solved = solved_or_explained(replace(task, walls=(), samples=None), times)
    if not isinstance(solved, SolvedTask):
        return solved
    factor = priced_factor(solved.trajectory, price)
    return np.asarray(durations * (walled_factor(task.walls, solved.trajectory, factor) or factor))


def priced_factor(curve: Trajectory, price: float) -> float:
    """Factor on time at which cost + price * time is least, the price [1/s]."""
    worth = worth_of_time(curve)
    return significant((worth / price) ** (0.5 / curve.cost_order), 9) if worth > 0.0 else 1.0


def worth_of_time(curve: Trajectory) -> float:
    """How much the cost falls with every second in which a path is flown more slowly; it goes as total^(1 - 2k)."""
    return (2 * curve.cost_order - 1) * curve.cost() / curve.duration
