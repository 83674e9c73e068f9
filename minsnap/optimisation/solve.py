"""Solve a task for given durations: by the native core, or by the Python core what that one does not take."""

from __future__ import annotations

import logging
from contextlib import suppress
from dataclasses import replace
from enum import Enum

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.tolerances import GAP
from minsnap.errors import MinsnapError
from minsnap.native.status import GAVE_UP, Status
from minsnap.optimisation.native_solve import in_pieces, solve_natively, solve_without_walls
from minsnap.optimisation.optimum import BLEND, ONE_PIECE, GaveUpError, InfeasibleRowsError, Optimum
from minsnap.optimisation.solved_task import SolvedTask
from minsnap.optimisation.task import Task
from minsnap.optimisation.units import Units

LOGGER = logging.getLogger(__name__)


class Effort(Enum):
    """Work after which the native core gives up, as a multiple of what it counts for a problem of this size."""

    WHOLE = 2.0  # a tube of eleven legs in 1,400 takes 1.7; the Python core takes up to 18 s where this one gives up
    LAST = 6.0  # where nothing proves that there is no curve: it may cost 1e18 times as much as stops at all waypoints
    TRY = 0.25  # of a search: what it does not solve soon has nearly never a curve; 0.1 misses some that fly faster
    GLANCE = 0.05  # in double precision alone: most that have a curve take less, most that have none take all of it


def solve(
    task: Task,
    durations: FloatArray,
    samples: int | None = None,
    units: Units | None = None,
    gap: float = GAP,
    prove: bool = True,
    effort: Effort = Effort.WHOLE,
) -> SolvedTask:
    """Find the curve of least cost for piece durations (pieces in all,) [s].

    Parameters
    ----------
    samples : int, optional
        Instants per piece at which walls hold, nothing being promised between them; by default at every instant.
    units : Units, optional
        Units to use; by default those of these durations.
    gap : float
        Share of the cost that may be given away for fewer rounds.
    prove : bool
        Whether the exact margin is checked; a search can do without.
    effort : Effort
        After which the native core gives up.

    Raises
    ------
    InfeasibleRowsError
        If no curve keeps all walls; a GaveUpError where the native core gave up.
    SolverError
        If none was found.
    """
    units = units or task.units(durations)
    free, low = not task.constrained and not (task.joined_orders and task.pins), task.continuity < task.half - 1
    native: SolvedTask | str = ""
    if free and not low and not task.free_ends:
        native = solve_without_walls(task, durations, units)
    elif free or samples is None:
        native = solve_natively(task, durations, units, gap, prove, effort.value)
    if LOGGER.isEnabledFor(logging.DEBUG):
        ended = native or "not taken by the native core"
        told = f"{ended.optimum.rounds} rounds, cost {ended.cost:.6g}" if isinstance(ended, SolvedTask) else ended
        LOGGER.debug("curve of %d pieces in %.6g s: %s", len(durations), durations.sum(), told)
    if isinstance(native, SolvedTask):
        return native
    if low and native == Status.SINGULAR.reason:  # of a lap: curves through zeros cost nothing
        with suppress(InfeasibleRowsError):
            return solve(replace(task, continuity=task.half - 1), durations, samples, units, gap, prove, effort)
    if free:
        return _unbounded(task, durations, units, native)
    if native in GAVE_UP:
        raise GaveUpError(native)
    return solve_by_reference(task, durations, native, units, samples, gap, prove)


def _unbounded(task: Task, durations: FloatArray, units: Units, reason: str) -> SolvedTask:
    """Return the optimum without walls by the Python core, where the native one does not for a reason."""
    from minsnap.optimisation.linear_rows import joined_exactly
    from minsnap.optimisation.unconstrained import unbounded_optimum

    problem = task.problem(durations, units)
    knots = joined_exactly(problem, unbounded_optimum(problem))
    return SolvedTask(task, durations, units, Optimum(knots, 0, "banded", handed_over=reason), problem)


def solve_by_reference(
    task: Task,
    durations: FloatArray,
    reason: str = "",
    units: Units | None = None,
    samples: int | None = None,
    gap: float = GAP,
    prove: bool = True,
) -> SolvedTask:
    """Find the same curve by the Python core, where the native one does not for a reason; parameters as above."""
    from minsnap.optimisation.reference_core import ReferenceCore

    units = units or task.units(durations)
    solved = ReferenceCore(task, durations, units, gap, prove).run(samples)
    if task.pieces > 1 and not task.joined_orders and BLEND in solved.optimum.rungs:
        whole = _in_one_piece(task, durations, units, gap)
        solved = whole if whole is not None and whole.inside and whole.cost < solved.cost else solved
    return replace(solved, optimum=replace(solved.optimum, handed_over=reason))


def _in_one_piece(task: Task, durations: FloatArray, units: Units, gap: float) -> SolvedTask | None:
    """Return the optimum of one polynomial per leg, cut into the task's pieces; None where there is none."""
    try:
        times = durations.reshape(task.legs, task.pieces).sum(axis=1)
        whole = solve_by_reference(replace(task, pieces=1), times, gap=gap)
    except (InfeasibleRowsError, MinsnapError):
        return None
    orders = range(task.half)
    scale = np.array([whole.units.of_order(order) / units.of_order(order) for order in orders])
    curve, knots = whole.trajectory.control_points, whole.optimum.knots * scale[:, None]
    points, knots = in_pieces(task, durations, units, curve, knots)
    optimum = Optimum(knots, whole.optimum.rounds, whole.optimum.solver, rungs=(ONE_PIECE,), points=points)
    return SolvedTask(task, durations, units, optimum)
