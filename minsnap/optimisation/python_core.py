"""Solve a task with the Python core: linear system, exchange, and the ladder of fallbacks."""

from __future__ import annotations

from functools import reduce

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.deadline import LateError
from minsnap.errors import CorridorError, SolverError
from minsnap.optimisation.effort import SHARED, Effort
from minsnap.optimisation.exchange import State, Trouble
from minsnap.optimisation.fallbacks import Attempt, Single, climb, first_attempt, optimum
from minsnap.optimisation.normalised_constraints import Compiled, WallRows, compile_walls
from minsnap.optimisation.optimum import InfeasibleRowsError, Optimum
from minsnap.optimisation.problem import Task
from minsnap.optimisation.reduced_qp import Problem
from minsnap.optimisation.rows import Curve
from minsnap.optimisation.solved_task import SolvedTask
from minsnap.optimisation.stop_and_go import leg_on_wall
from minsnap.optimisation.unconstrained import unbounded_optimum
from minsnap.optimisation.units import Units


def solved_in_python(
    task: Task,
    durations: FloatArray,
    units: Units,
    samples: int | None,
    seed: WallRows | None,
    gap: float,
    prove: bool,
    single: Single | None,
    spent: bool,
) -> SolvedTask:
    """Solve with the Python core.

    The arguments are those of ``solve``, what finds a curve of one piece per leg, and whether the native core has
    worked on it for as long as a problem is worth.
    """
    problem = task.problem(durations, units)
    base = unbounded_optimum(problem)
    compiled = compile_walls(task, problem, units)
    once = samples is not None
    seed = seed if samples is None else _sampled(problem, base, compiled, samples)
    proof = (lambda state: SolvedTask(task, durations, units, _bare(state), problem).inside) if prove else None
    effort = Effort(task.legs, SHARED if spent or single is not None else 1.0)
    first = first_attempt(problem, base, compiled, task.solver, effort, seed, proof, gap, task.deadline, once, single)
    last, rungs = climb(first)
    if last.trouble is not None:
        raise _no_room(task, last)
    return SolvedTask(task, durations, units, optimum(last, rungs), last.problem)


def _bare(state: State) -> Optimum:
    return Optimum(state.curve.knots, None, np.zeros(0), state.rounds, "")


def _sampled(problem: Problem, base: FloatArray, compiled: Compiled, instants: int) -> WallRows:
    """Rows of every wall at equally spaced inner instants of its pieces."""
    s, curve = np.arange(1, instants + 1) / (instants + 1), Curve(problem, compiled, base)
    rows = [
        curve.rows(number, np.repeat(np.arange(len(block.piece)), instants), np.tile(s, len(block.piece)))
        for number, block in enumerate(compiled.blocks)
    ]
    return reduce(WallRows.joined, rows)


def _no_room(task: Task, last: Attempt) -> SolverError | CorridorError | InfeasibleRowsError:
    """Return the error: where the straight leg itself touches a wall, or else that no curve was found."""
    if last.trouble is Trouble.LATE:
        return LateError("time_limit has passed without a certified plan: give more time, or widen the corridor")
    return leg_on_wall(task, last.state.curve) or InfeasibleRowsError()
