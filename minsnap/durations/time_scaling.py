"""Plans that keep limits by their time scale alone, in the proportions of the legs."""

from __future__ import annotations

from collections.abc import Sequence

from minsnap.corridors.constraint import Walls
from minsnap.durations.least_cost import distance_split
from minsnap.durations.outcome import PlanOutcome
from minsnap.durations.time_stretch import kept_factor, nearby_factor, without_derivative_walls
from minsnap.durations.timing import Timed, Timing, solved_or_explained, timed
from minsnap.errors import SolverError, TimingError
from minsnap.limits.compliance import keeps, most_used
from minsnap.limits.limits import Limits, VehicleLimits
from minsnap.optimisation.solved_task import SolvedTask
from minsnap.optimisation.task import Task
from minsnap.refusals.sentences import yaw_too_fast


def scaled_plan(task: Task, timing: Timing) -> PlanOutcome:
    """Plan in the proportions of the legs, and scale to touch the limits."""
    if not task.still:
        raise TimingError("derivatives that are pinned do not scale with time: use split='optimal'")
    limits, shape = timing.bounds, without_derivative_walls(task)
    solved = solved_or_explained(shape, task.piece_durations(distance_split(task, float(task.legs))))
    if not isinstance(solved, SolvedTask):
        return PlanOutcome(reason=solved)
    return PlanOutcome(flown_fastest(solved, limits, task.walls))


def flown_fastest(solved: SolvedTask, limits: Limits, walls: Sequence[Walls]) -> Timed:
    """Fly a path as fast as limits and walls on derivatives allow.

    Raises
    ------
    LimitError
        If a yaw that is a function of time turns too fast at that speed.
    SolverError
        If no speed was found at which it leaves the rotors enough.
    """
    yaw, deadline = solved.flown.yaw, solved.task.deadline
    limited = isinstance(limits, VehicleLimits) or limits.yaw_rate is not None
    turns = limited and yaw.constant is None and yaw.medium is None
    factor = kept_factor(limits, walls, solved.flown, roughly=turns, deadline=deadline)
    planned = timed(solved, factor=factor)
    if not turns or keeps(limits, planned.trajectory):
        return planned
    nearby = nearby_factor(limits, lambda slower: timed(solved, factor=factor * slower).trajectory, deadline=deadline)
    if nearby is not None:
        return timed(solved, factor=factor * nearby)
    used = most_used(limits, planned.trajectory)
    if used.name == "yaw_rate":
        raise yaw_too_fast(used)
    raise SolverError("no speed was found at which the path keeps its limits with a yaw that is a function of time")
