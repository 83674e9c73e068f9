"""Why no plan exists at given durations: the corridor is too narrow, or the limits ask for longer times."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.errors import InfeasibleError, MinsnapError, SolverError
from minsnap.optimisation.contradiction import contradicting_joints, find_contradiction
from minsnap.optimisation.elastic import ACCURACY, Elastic, Relaxation
from minsnap.optimisation.infeasibility import UNPROVED, explain_corridor, hardest_pressed, normalised
from minsnap.optimisation.linear_rows import DENSE
from minsnap.optimisation.normalised_constraints import Compiled
from minsnap.optimisation.rows import Curve
from minsnap.optimisation.stop_and_go import leg_on_wall
from minsnap.optimisation.task import Task


def explain(task: Task, durations: FloatArray) -> MinsnapError:
    """Find out why a task has no solution at piece durations (pieces in all,) [s].

    Returns
    -------
    InfeasibleError
        With a proof; with ``leg``, ``instant`` and ``smallest_width`` where a corridor is too narrow.
    CorridorError
        With ``leg``, where waypoints lie on a wall.
    SolverError
        If there is no proof: the solvers failed on a problem that may have a solution.
    """
    refused = _joined_by_nothing(task, durations) or explain_corridor(task, durations)
    if refused is not None:
        return refused
    if not any(wall.order for wall in task.walls):
        problem, _, compiled = normalised(task, durations)
        on_wall = leg_on_wall(task, Curve(problem, compiled, problem.values))
        if on_wall is not None:
            return on_wall
        if problem.jumps and problem.size > DENSE // 2:
            return SolverError(f"{UNPROVED}try another solver=, or lower continuity={task.continuity}")
        return _joined_by_nothing(task, durations, exactly=True) or SolverError(
            "the solvers failed on a problem that has a solution: try another solver="
        )
    return _too_fast(task, durations)


def _joined_by_nothing(task: Task, durations: FloatArray, exactly: bool = False) -> InfeasibleError | None:
    """Return the error where pins, gates and continuity contradict each other, whatever the walls are."""
    task = replace(task, touching=False)
    broken = contradicting_joints(task, durations, normalised(task, durations)[0], exactly)
    if broken is None:
        return None
    return InfeasibleError(
        "pins and continuity ask for more than the polynomials have free: lower "
        f"continuity={task.continuity}, or pin fewer derivatives",
        contradiction=broken,
    )


def _too_fast(task: Task, durations: FloatArray) -> InfeasibleError | SolverError:
    """Say by how much limits must give way where the corridor would do, and where they press hardest."""
    task = replace(task, touching=False)
    problem, units, compiled = normalised(task, durations)
    give, rows = give_limits(compiled), None
    for far in (ACCURACY, np.inf):  # what presses is known long before the least relaxation, but may not suffice
        relaxed = Elastic(problem, compiled, give, seed=rows, far=far, deadline=task.deadline).run()
        proof = find_contradiction(task, durations, problem, relaxed)
        if proof is not None or relaxed.rows is None or problem.size > DENSE:
            break
        rows = relaxed.rows.source.chosen(np.argsort(-relaxed.multipliers, kind="stable")[: problem.size + 1])
    if proof is None:
        return SolverError(f"{UNPROVED}give more time, or loosen the limits")
    leg, instant = hardest_pressed(task, problem, units, relaxed)
    message = f"the limits cannot be kept in {durations.sum():.4g} s: they are exceeded on leg {leg} at {instant:.4g} s"
    return InfeasibleError(message, leg=leg, instant=instant, contradiction=proof)


def give_limits(compiled: Compiled) -> Relaxation:
    """One slack for all walls on derivatives, weighted by what slowing down does; half at most is taken away."""
    order = np.concatenate([np.full(len(block.leg), block.order) for block in compiled.blocks])
    return Relaxation(np.where(order > 0, 0, -1), order.astype(np.float64), 1, -0.5)
