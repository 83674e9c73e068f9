"""Why no plan exists at given durations: the corridor is too narrow, or the limits ask for longer times."""

from __future__ import annotations

from dataclasses import replace

from minsnap.basics.arrays import FloatArray
from minsnap.basics.deadline import LateError
from minsnap.errors import InfeasibleError, LimitError, MinsnapError, SolverError
from minsnap.optimisation.contradiction import contradicting_joints, find_contradiction
from minsnap.optimisation.elastic import Elastic
from minsnap.optimisation.infeasibility import UNPROVED, explain_corridor, hardest_pressed, normalised
from minsnap.optimisation.rows import Curve
from minsnap.optimisation.stop_and_go import leg_on_wall
from minsnap.optimisation.task import Task
from minsnap.time_allocation.elastic_scale import ElasticScale, give_limits
from minsnap.time_allocation.least_cost import leg_sums

STRETCH_ROOM = 1e-4
"""Share added to a stretch of time so that it does."""


def explain(task: Task, durations: FloatArray) -> MinsnapError:
    """Find out why a task has no solution at piece durations (pieces in all,) [s].

    Returns
    -------
    InfeasibleError
        With a proof; with ``leg``, ``instant`` and ``smallest_width`` where a corridor is too narrow; with ``stretch``
        where the corridor would do but limits would not.
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
        return leg_on_wall(task, Curve(problem, compiled, problem.values)) or SolverError(
            "the solvers failed on a problem that has a solution: try another solver="
        )
    return _too_fast(task, durations)


def _joined_by_nothing(task: Task, durations: FloatArray) -> InfeasibleError | None:
    """Return the error where pins, gates and continuity contradict each other, whatever the walls are."""
    task = replace(task, touching=False)
    broken = contradicting_joints(task, durations, normalised(task, durations)[0])
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
    found = Elastic(problem, compiled, give_limits(compiled), evident=True).run()
    proof = find_contradiction(task, durations, problem, found)
    if proof is None:
        return SolverError(f"{UNPROVED}give more time, or loosen the limits")
    leg, instant = hardest_pressed(task, problem, units, found)
    message = f"the limits cannot be kept in {durations.sum():.4g} s: they are exceeded on leg {leg} at {instant:.4g} s"
    stretch: float | None = None
    try:
        stretch = ElasticScale(task, leg_sums(durations, task.pieces), found).factor() * (1.0 + STRETCH_ROOM)
    except LateError:
        raise
    except (SolverError, LimitError):
        pass  # no factor does, or none was found
    return InfeasibleError(message, leg=leg, instant=instant, stretch=stretch, contradiction=proof)
