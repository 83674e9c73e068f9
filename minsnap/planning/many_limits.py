"""Many plans within limits by the native core over threads, for plain questions: the bits are those of ``plan``."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from minsnap.basics.arrays import FloatArray, numbers
from minsnap.corridors.given_waypoints import warn_magnitude
from minsnap.durations.resting import half_widths
from minsnap.limits.limits import Limits
from minsnap.native.plan_batches import plans_within
from minsnap.planning.planner import plan
from minsnap.trajectory.report import Report
from minsnap.trajectory.trajectory import Plan, Trajectory, planned

KNOWN = ("speed", "acceleration", "jerk", "snap", "max_thrust", "min_thrust", "tilt", "body_rate")
"""Limits within which the native planner finds the curves of ``plan``, in its order."""

BLOCK = 32
"""Problems of each thread in one call, between which Ctrl-C is taken."""


class PlainProblem(NamedTuple):
    """A problem from rest to rest within limits, perhaps in a tube.

    Parameters
    ----------
    points : ndarray, shape (n, dim)
        [m].
    limits : Limits
        Of the kinds ``KNOWN`` alone.
    widths : ndarray, shape (n - 1,), or None
        Half-widths [m].
    corridor : object
        As it was given.
    """

    points: FloatArray
    limits: Limits
    widths: FloatArray | None
    corridor: Any

    @classmethod
    def of(cls, waypoints: Any, limits: Any, corridor: Any) -> PlainProblem | None:
        """Return what was asked for; None where it is anything else, or may be wrong."""
        points = numbers(waypoints) if isinstance(waypoints, (np.ndarray, list, tuple)) else None
        if points is None or points.ndim != 2 or len(points) < 2 or not 1 <= points.shape[1] <= 3:
            return None
        if type(limits) is not Limits or limits.norm != "euclidean" or limits.leg_speeds:
            return None
        if not set(limits.given()) <= set(KNOWN):
            return None
        if corridor is None:
            return cls(points, limits, None, None)
        width = half_widths(corridor, len(points) - 1)
        if width is None or points.shape[1] == 1:
            return None
        return cls(points, limits, np.broadcast_to(width, (len(points) - 1,)), corridor)

    def report(self, curve: Trajectory) -> Report:
        """Return the report of the plan, which is made once more by itself: it has the same bits."""
        return plan(self.points, limits=self.limits, corridor=self.corridor).report


def plan_together(
    problems: Sequence[PlainProblem | None], threads: int, watch: Callable[[int], None]
) -> list[Plan | None]:
    """Plan all that are plain problems, and None in the place of others and of what is left to ``plan``.

    Parameters
    ----------
    problems : sequence
    threads : int
    watch : callable
        Called with the number of problems that are planned.
    """
    plans: list[Plan | None] = [None] * len(problems)
    by_kind: dict[tuple[int, bool], list[int]] = {}
    for index, problem in enumerate(problems):
        if problem is not None:
            by_kind.setdefault((problem.points.shape[1], problem.widths is None), []).append(index)
    blocks = [own[i : i + BLOCK * threads] for own in by_kind.values() for i in range(0, len(own), BLOCK * threads)]
    done = 0
    for block in blocks:
        asked = [problem for problem in (problems[index] for index in block) if problem is not None]
        names = (*KNOWN, "gravity")
        limits = np.array([[getattr(one.limits, name) or 0.0 for name in names] for one in asked])
        tubes = [one.widths for one in asked if one.widths is not None]
        widths = np.concatenate(tubes) if tubes else None
        found = plans_within([one.points for one in asked], limits, widths, 0, threads)
        for index, problem, curve in zip(block, asked, found, strict=True):
            if curve is not None:
                warn_magnitude(problem.points)
                plans[index] = planned(curve[0], curve[1], problem, curve[2])
                done += 1
        watch(done)
    return plans
