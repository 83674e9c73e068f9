"""Solve a task for given durations: linear system, exchange, and exact satisfaction of pins and walls."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, reduce

import numpy as np

from minsnap.arrays import FloatArray
from minsnap.corridors.margins import Margin, margin_to
from minsnap.errors import CorridorError, SolverError
from minsnap.native.corridor import CorridorAnswer
from minsnap.optimisation.exchange import GAP, State, Trouble
from minsnap.optimisation.fallbacks import Attempt, climb, first_attempt, outcome
from minsnap.optimisation.native_solve import solve_natively, solve_without_walls
from minsnap.optimisation.normalised_constraints import Compiled, WallRows, compile_walls
from minsnap.optimisation.outcome import Outcome
from minsnap.optimisation.problem import Task
from minsnap.optimisation.reduced_qp import Problem
from minsnap.optimisation.rows import Curve, rows_in_unknowns
from minsnap.optimisation.stop_and_go import straight_heights
from minsnap.optimisation.unconstrained import unbounded_optimum
from minsnap.optimisation.units import Units
from minsnap.tolerances import EXACT
from minsnap.trajectory.trajectory import Trajectory

NATIVE = "native"
"""What reports call the native core, as a core and as a solver."""


@dataclass(frozen=True, eq=False)
class Solved:
    """A task solved for given durations.

    Parameters
    ----------
    task : Task
    problem : Problem
    units : Units
    outcome : Outcome
    """

    task: Task
    problem: Problem
    units: Units
    outcome: Outcome

    @property
    def cost(self) -> float:
        """Integral of the squared norm of the k-th derivative."""
        unit = self.units.length**2 * self.units.time ** (1.0 - 2.0 * self.task.half)
        return float(self.problem.cost(self.outcome.knots) * unit)

    @cached_property
    def trajectory(self) -> Trajectory:
        """The curve in metres and seconds."""
        points = self.outcome.points
        if points is None:
            points = self.problem.control_points(self.outcome.knots, self.task.positions, self.units.length)
        points.flags.writeable = False
        durations = self.problem.durations * self.units.time
        return Trajectory(points, durations, pieces=self.task.pieces)

    @cached_property
    def margins(self) -> list[Margin]:
        """Exact least distance to each block of walls, in their order."""
        return [margin_to(self.trajectory, wall) for wall in self.task.walls]

    @property
    def inside(self) -> bool:
        """Whether no margin is negative."""
        return all(margin.value >= 0.0 for margin in self.margins)

    @property
    def corridor_margin(self) -> float | None:
        """Exact least distance to the walls on positions [m]; None where there are none."""
        pairs = zip(self.task.walls, self.margins, strict=True)
        return min((margin.value for wall, margin in pairs if wall.order == 0), default=None)


def solve(
    task: Task,
    durations: FloatArray,
    samples: int | None = None,
    units: Units | None = None,
    seed: WallRows | None = None,
    gap: float = GAP,
    prove: bool = True,
) -> Solved:
    """Find the curve of least cost for piece durations (pieces in all,) [s].

    Parameters
    ----------
    samples : int, optional
        Instants per piece at which walls hold, nothing being promised between them; at every instant unless given.
    units : Units, optional
        Units to use; those of these durations unless given.
    seed : WallRows, optional
        Rows to begin with, from a solve in the same units.
    gap : float
        Share of the cost that may be given away for fewer rounds.
    prove : bool
        Whether the exact margin is checked; a search can do without.

    Raises
    ------
    InfeasibleRowsError
        If no curve keeps all walls.
    SolverError
        If none was found.
    """
    units = units or task.units(durations)
    problem = task.problem(durations, units)
    if not task.constrained and not (problem.jumps and task.pins):
        return _solved_without_walls(task, problem, units, durations)
    if samples is not None:
        return _solved_in_python(task, problem, units, samples, seed, gap, prove)
    answer = solve_natively(task, durations, units, gap)
    if isinstance(answer, CorridorAnswer):
        return Solved(task, problem, units, _native_outcome(task, problem, units, answer))
    found = _solved_in_python(task, problem, units, samples, seed, gap, prove)
    return replace(found, outcome=replace(found.outcome, handed_over=answer))


def _solved_without_walls(task: Task, problem: Problem, units: Units, durations: FloatArray) -> Solved:
    found = solve_without_walls(task, durations, units)
    if isinstance(found, str):
        outcome = Outcome(unbounded_optimum(problem), None, np.zeros(0), 0, "banded", handed_over=found)
    else:
        outcome = Outcome(found[1], None, np.zeros(0), 0, "banded", core=NATIVE, points=found[0])
    return Solved(task, problem, units, outcome)


def _native_outcome(task: Task, problem: Problem, units: Units, answer: CorridorAnswer) -> Outcome:
    """Convert a native solution, with its contacts as rows."""
    compiled = compile_walls(task, problem, units)
    block = np.searchsorted(compiled.first, answer.wall, side="right") - 1
    order, points, rows = np.argsort(block, kind="stable"), problem.relative_points(answer.knots), None
    for number in np.unique(block):
        chosen = order[block[order] == number]
        index = answer.wall[chosen] - compiled.first[number]
        found = compiled.rows(problem, points, int(number), index, answer.s[chosen])
        rows = found if rows is None else rows.joined(found)
    known = None if rows is None else rows_in_unknowns(problem, problem.plain_ends(answer.knots), compiled, rows)
    multipliers = answer.multiplier[order]
    return Outcome(answer.knots, known, multipliers, answer.rounds, NATIVE, core=NATIVE, points=answer.points)


def _solved_in_python(
    task: Task,
    problem: Problem,
    units: Units,
    samples: int | None,
    seed: WallRows | None,
    gap: float,
    prove: bool,
) -> Solved:
    base = unbounded_optimum(problem)
    compiled = compile_walls(task, problem, units)
    once = samples is not None
    seed = seed if samples is None else _sampled(problem, base, compiled, samples)
    proof = (lambda state: Solved(task, problem, units, _bare(state)).inside) if prove else None
    last, rungs = climb(first_attempt(problem, base, compiled, task.solver, seed, proof, gap, task.deadline, once))
    if last.trouble is not None:
        raise _no_room(task, last)
    return Solved(task, last.problem, units, outcome(last, rungs))


def _bare(state: State) -> Outcome:
    return Outcome(state.curve.knots, None, np.zeros(0), state.rounds, "")


def _sampled(problem: Problem, base: FloatArray, compiled: Compiled, instants: int) -> WallRows:
    """Rows of every wall at equally spaced inner instants of its pieces."""
    s, curve = np.arange(1, instants + 1) / (instants + 1), Curve(problem, compiled, base)
    rows = [
        curve.rows(number, np.repeat(np.arange(len(block.piece)), instants), np.tile(s, len(block.piece)))
        for number, block in enumerate(compiled.blocks)
    ]
    return reduce(WallRows.joined, rows)


def _no_room(task: Task, last: Attempt) -> SolverError | CorridorError:
    """Return the error: where the straight leg itself touches a wall, or else that all solvers failed."""
    curve = last.state.curve
    if last.trouble is Trouble.LATE:
        return SolverError("time_limit has passed without a certified plan: give more time, or widen the corridor")
    for block, straight in zip(curve.compiled.blocks, straight_heights(curve), strict=True):
        for wall in np.flatnonzero((straight >= -EXACT) & (block.order == 0)):
            leg = int(block.piece[wall]) // task.pieces
            return CorridorError(
                f"waypoint {leg} or {leg + 1} lies on a wall of leg {leg}, and the curve has no room to stay inside: "
                f"move the wall or the waypoint a little",
                leg=leg,
            )
    return SolverError("the solvers found no curve inside the walls to working precision: widen them or change units")
