"""Where the shortest plan is searched from, and with how many pieces: the way of every plan within limits.

A search finds the nearest of several shortest flights. So it begins at rest at every waypoint, near the least time
where that may end far away, and at the flight of fewer pieces.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from math import prod

import numpy as np

from minsnap.bounds.least_time import TimeQuestion, calm_orders
from minsnap.corridors.gates import Gate
from minsnap.corridors.knot_regions import Placement
from minsnap.durations.initial_guess import norm_limits
from minsnap.durations.least_cost import distance_split
from minsnap.durations.outcome import End, PlanOutcome, if_possible, outcome_of
from minsnap.durations.shortest_question import QUESTION
from minsnap.durations.strategy import Strategy
from minsnap.durations.timing import Run, Timing, found_in, timed
from minsnap.errors import LimitError
from minsnap.limits.limits import Limits
from minsnap.optimisation.task import Task
from minsnap.trajectory.trajectory import Trajectory

NEAR_LEAST = 1.05
"""The time of the second start of a search, over the least that is proved."""

SHORT, STRAIGHT = 0.2, 0.9
"""Legs are close together below this share of the way to stop, on a straight way from this cosine on."""


def shortest_of_starts(task: Task, timing: Timing, first: Trajectory | None = None) -> PlanOutcome:
    """Search from a curve, or from the usual start and, where that may end far away, from near the least time too.

    Every flight of fewer pieces is one of more: one piece less is searched too, and divided where it is shorter. Where
    many, or those that a search chose, took all of the work, one piece a leg is searched in little more.
    """
    if first is not None:
        return Strategy(task, timing).run(first)
    found = outcome_of(lambda: _of_starts(task, timing))
    fewest = task.pieces == 1 and not timing.refine
    if fewest or isinstance(found.reason, LimitError):
        return found
    spent = found.end is End.SPENT
    if not (timing.in_time(task).deadline.has_last_try() if spent else task.pieces > 1):
        return found
    fewer = replace(task, pieces=1 if spent else task.pieces - 1, explains=False)
    divided = _divided(shortest_of_starts(fewer, replace(timing, refine=False)), task, timing)
    if (found.planned is None or found.stands_in) and divided.planned is not None and not spent:
        curve = divided.planned.solved.trajectory
        divided = _quicker(divided, outcome_of(lambda: Strategy(task, timing).run(curve)))
    return _quicker(found, divided)


def _of_starts(task: Task, timing: Timing) -> PlanOutcome:
    found = Strategy(task, timing).run()
    if found.end is not End.KEPT or not _misled(task, timing.bounds):
        return found
    finest = replace(task, pieces=prod(QUESTION.divisions)) if timing.refine else task
    other = near_least(finest, timing.bounds)
    if other is None:
        return found
    return _quicker(found, outcome_of(lambda: Strategy(finest, replace(timing, refine=False)).run(other)))


def _divided(fewer: PlanOutcome, task: Task, timing: Timing) -> PlanOutcome:
    """Divide a plan into the pieces of a task; refused where there is none, or more samples find it too fast."""
    whole = fewer.planned
    divided = None if whole is None else if_possible(lambda: Strategy(task, timing).cut(whole.solved))
    if whole is None or divided is None:
        return PlanOutcome(reason=fewer.reason)
    planned = timed(divided, Run(whole.steps, whole.interrupted))
    return PlanOutcome(replace(planned, stands_in=whole.stands_in))


def _quicker(one: PlanOutcome, other: PlanOutcome) -> PlanOutcome:
    """Return the plan of the shorter flight with the steps of both, its own last; interrupted where either was."""
    if one.planned is None or other.planned is None:
        return one if other.planned is None else other
    quick, slow = sorted((one.planned, other.planned), key=lambda each: each.trajectory.duration)
    interrupted = quick.interrupted or slow.interrupted
    return PlanOutcome(replace(quick, steps=(*slow.steps, *quick.steps), interrupted=interrupted))


def _misled(task: Task, limits: Limits) -> bool:
    """Whether a search that begins with rest at every waypoint may end at a flight that is far too long.

    Between two states in motion there are quick flights and slow ones, which turn back, and none between. And
    waypoints close to each other on a straight way are passed slowly once they are: each short leg asks for rates that
    fall only as it is flown faster.
    """
    if task.closed or task.dim > 3:
        return False
    if {0, task.legs} <= task.moving:
        return True
    speed, acceleration = norm_limits(limits)[:2]
    steps, lengths = np.diff(task.waypoints, axis=0), task.lengths
    stop = min(speed, np.sqrt(acceleration * lengths.sum())) ** 2 / (2.0 * acceleration)
    straight = (steps[1:] * steps[:-1]).sum(axis=1) > STRAIGHT * lengths[1:] * lengths[:-1]
    return bool(np.isfinite(acceleration) and (straight & (np.minimum(lengths[1:], lengths[:-1]) < SHORT * stop)).any())


def time_question(
    task: Task, limits: Limits, gates: Mapping[int, Gate] | None = None, beside: tuple[str, ...] = ()
) -> TimeQuestion:
    """Return the question how long every flight of a task within limits takes at least.

    Parameters
    ----------
    task : Task
    limits : Limits
    gates : mapping of int to Gate, optional
        By waypoint; others count as the boxes around them.
    beside : tuple of str
        What the flights keep besides.
    """
    placement = Placement(task.waypoints, task.lower, task.upper, regions=task.regions)
    calm = calm_orders(task.pins, task.legs, task.continuity)
    return TimeQuestion(placement, gates or {}, task.end_velocities, limits, beside, calm)


def near_least(task: Task, limits: Limits) -> Trajectory | None:
    """Return the curve of least cost in barely more than the least time there is; None where nothing is known of it."""
    least = replace(time_question(task, limits), calm=(0, 0)).bound.seconds
    if least is None:
        return None
    durations = distance_split(task, NEAR_LEAST * least)
    solved = found_in(replace(task, walls=()), task.piece_durations(durations))
    return None if solved is None else solved.trajectory
