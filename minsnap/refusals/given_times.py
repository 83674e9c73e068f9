"""Why no plan exists at given durations: the corridor is too narrow, or the limits ask for longer times."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.errors import InfeasibleError, MinsnapError, SolverError
from minsnap.native.corridor import Give
from minsnap.optimisation.linear_rows import DENSE
from minsnap.optimisation.rows import Curve
from minsnap.optimisation.stop_and_go import leg_on_wall
from minsnap.optimisation.task import Task
from minsnap.optimisation.task_walls import all_walls, normalised_walls
from minsnap.refusals.contradiction import Contradiction, contradicting_joints
from minsnap.refusals.infeasibility import UNPROVED, Pressed, explain_corridor


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
    if any(wall.order for wall in task.walls):
        return _too_fast(task, durations)
    units = task.units(durations)
    problem = task.problem(durations, units)
    on_wall = leg_on_wall(task, Curve(problem, normalised_walls(task, problem, units), problem.values))
    if on_wall is not None:
        return on_wall
    if problem.joined_orders and problem.size > DENSE // 2:
        return SolverError(f"{UNPROVED}try another solver=, or lower continuity={task.continuity}")
    return _joined_by_nothing(task, durations, exactly=True) or SolverError(
        "the solvers failed on a problem that has a solution: try another solver="
    )


def _joined_by_nothing(task: Task, durations: FloatArray, exactly: bool = False) -> InfeasibleError | None:
    """Return the error where pins, gates and continuity contradict each other, whatever the walls are."""
    task = replace(task, touching=False)
    broken = contradicting_joints(task, durations, exactly)
    return None if broken is None else overdetermined(task, broken)


def overdetermined(task: Task, proof: Contradiction) -> InfeasibleError:
    """Return the error where pins and continuity contradict each other."""
    return InfeasibleError(
        f"pins and continuity ask for more than the polynomials have free: lower "
        f"continuity={task.continuity}, or pin fewer derivatives",
        contradiction=proof,
    )


def _too_fast(task: Task, durations: FloatArray) -> InfeasibleError | SolverError:
    """Say where limits press hardest when the corridor would do."""
    task = replace(task, touching=False)
    walls = all_walls(task)
    order = walls.order  # a limit gives way as it does where time is stretched
    give = Give(np.where(order > 0, 0, -1), order.astype(np.float64), 1)
    pressed = Pressed(task, durations, walls, give, sign=True)
    proof = pressed.proof()
    if proof is None:
        return SolverError(f"{UNPROVED}give more time, or loosen the limits")
    leg, instant = pressed.hardest()
    message = f"the limits cannot be kept in {durations.sum():.4g} s: they are exceeded on leg {leg} at {instant:.4g} s"
    return InfeasibleError(message, leg=leg, instant=instant, contradiction=proof)
