"""What follows a refusal: other times where the plan may choose them, else what is proved of those of the request."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from math import ceil
from typing import TYPE_CHECKING

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.cached import cached_property
from minsnap.basics.checks import LONGEST
from minsnap.basics.deadline import LateError
from minsnap.durations.connector import pinned_use
from minsnap.durations.longer_times import least_longer
from minsnap.durations.outcome import if_possible
from minsnap.durations.starts import time_question
from minsnap.durations.timing import NO_RUN, Timed, Timing, solved_or_explained, timed
from minsnap.durations.ways import start_on_limit
from minsnap.durations.within_limits import from_rest, plans_for, searched_in_time
from minsnap.errors import InfeasibleError, MinsnapError, SolverError
from minsnap.limits.compliance import KEPT, keeps
from minsnap.optimisation.solve import Effort
from minsnap.optimisation.solved_task import SolvedTask
from minsnap.optimisation.task import Task
from minsnap.refusals.given_times import explain
from minsnap.refusals.sentences import any_time_too_short, below_least_time, leg_too_short, total_too_short, unproved

if TYPE_CHECKING:
    from minsnap.refusals.contradiction import Contradiction

Refused = InfeasibleError | SolverError


@dataclass(frozen=True, eq=False)
class AskedTimes:
    """The times that a request asks for or leaves to the plan, after a refusal: what else there is, and what is proved.

    Parameters
    ----------
    task : Task
    timing : Timing
    """

    task: Task
    timing: Timing

    def in_other_times(self, refused: Refused) -> Timed | InfeasibleError | None:
        """Search from rest at every waypoint, where those that were chosen first have no plan.

        None where there is none, or none may be: in durations that were given, or where the refusal is a proof for all.
        Or a proof that all times, or the total, are too short.
        """
        task, timing = self.task, self.timing
        short = self.too_short(refused) if self._own_times is None else None
        if short is not None:
            return short
        return None if timing.durations is not None or self._for_all_times(refused) else from_rest(task, timing)

    def by_necessary_walls(self, refused: Refused) -> Timed | Refused:
        """Plan anew, or refuse, where a proof is by walls that are sufficient for a limit, but not necessary."""
        task, timing = self.task, self.timing
        limits, proof = timing.limits, refused.contradiction if isinstance(refused, InfeasibleError) else None
        if limits is None or proof is None or len(getattr(proof, "durations", ())) != task.legs * task.pieces:
            return refused
        walls = limits.necessary_walls(task.waypoints)
        others = [wall for wall in limits.walls(task.waypoints) if wall not in walls]
        doubtful = {(wall.order, radius) for wall in others for radius in wall.radius.tolist()}
        if doubtful.isdisjoint(zip(proof.orders.tolist(), proof.walls.radius[proof.wall].tolist(), strict=True)):
            return refused
        solved = solved_or_explained(task.with_walls(walls), proof.durations)
        if isinstance(solved, LateError):
            raise solved
        if isinstance(solved, InfeasibleError | SolverError):
            return solved
        if isinstance(solved, SolvedTask) and self._of_these_times(proof):
            planned = timed(solved)
            kept = planned if keeps(limits, planned.trajectory) else searched_in_time(planned.solved, task, timing)
            if kept is not None:
                return kept
        return unproved(refused) if isinstance(refused, InfeasibleError) else refused

    def _for_all_times(self, refused: Refused) -> bool:
        """Whether a proof is of all times: of one leg from rest to rest by walls on positions, or of its total."""
        task, timing = self.task, self.timing
        proof = getattr(refused, "contradiction", None)
        if proof is None or task.legs > 1 or timing.refine:
            return False
        if timing.total_time is not None:
            return self._of_these_times(proof)
        return task.still and not proof.orders.any()

    def explained(self, refused: Refused) -> MinsnapError:
        """Return the refusal with what is proved of the times of the request."""
        timing = self.timing
        proof = refused.contradiction if isinstance(refused, InfeasibleError) else None
        if (
            isinstance(refused, InfeasibleError) and proof and not hasattr(proof, "orders")
        ):  # of all times, or of its own
            return self._with_longer(refused)
        own, own_times = self._own_times, proof is not None and self._of_these_times(proof)
        again: MinsnapError | None = None
        if timing.total_time is not None and own is not None and isinstance(refused, InfeasibleError) and not own_times:
            again = if_possible(partial(explain, self._necessary(self.task), own))
        if own is not None and not own_times and not isinstance(again, InfeasibleError):
            short = self.too_short(refused)
            if short is not None:
                return short
        if not isinstance(refused, InfeasibleError) or self._for_all_times(refused):
            return refused
        shortest = refused.shortest
        refused, own_times = (again, True) if isinstance(again, InfeasibleError) else (refused, own_times)
        sentence, note = str(refused), ""
        if proof is not None and not own_times:
            tried = "" if timing.durations is not None else ", and others that were tried have no plan either"
            refused, note = unproved(refused), f"; this is not proved of all times{tried}"
        if refused is again and shortest is not None:
            refused.shortest, note = shortest, f"{note}; the shortest found is {shortest:.6g} s"
        if note:
            refused.args = (sentence + note,)
        return self._with_longer(refused) if own_times else refused

    def _with_longer(self, refused: InfeasibleError) -> InfeasibleError:
        """Return a refusal of the times of a request with a factor on them that has a plan, where one is found."""
        task, timing = self.task, self.timing
        own, proof = self._own_times, refused.contradiction
        pressing = np.any(getattr(proof, "orders", 0)) or (timing.durations is not None and hasattr(proof, "least"))
        if own is None or not pressing or refused.shortest is not None:
            return refused
        bounded, room, grain = self._bounded(), 1.005, 1e-3
        effort = Effort.TRY if task.joined_orders else Effort.GLANCE  # a glance misses some that join more smoothly
        longer = least_longer(plans_for(bounded, timing, NO_RUN, effort), own, bounded.deadline)
        factor = 1.0 if longer is None else grain * ceil(room * longer.trajectory.duration / own.sum() / grain)
        if factor > 1.0 and plans_for(bounded, timing, NO_RUN, Effort.TRY)(factor * own) is not None:
            refused.stretch = factor
            refused.args = (f"{refused}; {factor:.4g} times as long would do in these proportions",)
        return refused

    def _bounded(self) -> Task:
        """Return the task with the walls of the limits, whose refusals are not explained, due when the search is."""
        return self.timing.in_time(replace(self.timing.bounded(self.task), explains=False))

    def _necessary(self, task: Task) -> Task:
        """Return a task with the walls that every curve within the limits keeps."""
        limits = self.timing.limits
        return task if limits is None else task.with_walls(limits.necessary_walls(task.waypoints))

    def too_short(self, refused: Refused | None = None) -> InfeasibleError | None:
        """Return a proof that the times of the request are too short for the ways between the waypoints, or None.

        It names the shortest total found, if a refusal knows any.
        """
        task, timing = self.task, self.timing
        if not task.explains or self._starts_beyond:
            return None
        shortest = getattr(refused, "shortest", None)
        from minsnap.refusals.short_total import short_leg, short_total

        bounded = self._necessary(replace(task, pieces=2) if timing.refine else task)
        if timing.durations is not None:
            proof = short_leg(bounded, timing.durations)
            return None if proof is None else leg_too_short(proof)
        longest, free = LONGEST * task.legs, timing.total_time is None
        proof = short_total(bounded, longest if free else timing.total, any_time=free)
        if proof is None:
            return None if free else self._below_least(shortest)
        return (any_time_too_short if proof.least > longest else total_too_short)(proof, shortest)

    def _below_least(self, shortest: float | None) -> InfeasibleError | None:
        """Return a proof that every flight within the limits takes longer than a total, whatever its curve, or None."""
        task, timing = self.task, self.timing
        if timing.limits is None:
            return None
        from minsnap.bounds.least_time import BelowLeast

        proof = BelowLeast(timing.total, time_question(task, timing.limits).bound)
        return below_least_time(proof, shortest) if proof.verify() else None

    def _of_these_times(self, proof: Contradiction) -> bool:
        """Whether a proof is of the durations of the request: it may be of others that a search chose."""
        own = self._own_times
        return own is not None and np.array_equal(proof.durations, own)

    @cached_property
    def _starts_beyond(self) -> bool:
        """Whether limits may be exceeded on a way back to them at the start, so that they prove nothing there."""
        task, timing = self.task, self.timing
        if timing.limits is None or not start_on_limit(task, timing.limits):
            return False
        higher = any(value.any() for order, value in task.pins[0].items() if order > 1)
        return higher or pinned_use(task, timing.limits) > 1.0 + KEPT

    @cached_property
    def _own_times(self) -> FloatArray | None:
        """Piece durations that the request leaves no choice of: its own, or those of the one leg that has its total."""
        task, timing = self.task, self.timing
        if self._starts_beyond:
            return None
        if timing.durations is not None:
            return task.piece_durations(timing.durations)
        one = timing.total_time is not None and task.legs == 1 and not timing.refine
        return task.piece_durations(np.array([timing.total])) if one else None
