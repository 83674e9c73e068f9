"""Solve a task for given durations: linear system, exchange, and what makes the result hold exactly."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from minsnap.arrays import FloatArray
from minsnap.corridors.margins import Margin, margin_to
from minsnap.errors import CorridorError, SolverError
from minsnap.native.corridor import CorridorAnswer
from minsnap.optimisation.exchange import GAP, Exchange, Outcome
from minsnap.optimisation.master_qp import InfeasibleRowsError
from minsnap.optimisation.native_solve import solve_natively
from minsnap.optimisation.normalised_constraints import Compiled, Rows, compile_walls
from minsnap.optimisation.preconditioning import EXTENDED
from minsnap.optimisation.problem import Task
from minsnap.optimisation.reduced_qp import Problem
from minsnap.optimisation.rows import rows_in_unknowns
from minsnap.optimisation.unconstrained import unbounded_optimum
from minsnap.optimisation.units import Units
from minsnap.polynomials.extrema import maxima
from minsnap.trajectory.trajectory import Trajectory

TOUCHING = 1e-9
"""Distance to a wall, in its widths, below which a straight leg touches it."""

NOISE = 1e-13
"""Share of the largest derivative of its order below which one is rounding, where that decides what is inside."""

NATIVE = "native"
"""What reports call the native core, as a core and as a solver."""

TRIES = 5
"""How often the walls are moved inwards again when rounding left the curve outside."""


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
    certify: bool = True,
    units: Units | None = None,
    seed: Rows | None = None,
    gap: float = GAP,
    prove: bool = True,
) -> Solved:
    """Find the curve of least cost for piece durations (pieces in all,) [s].

    Parameters
    ----------
    samples : int, optional
        With ``certify=False``: instants a piece where walls hold; nothing is promised between them.
    units : Units, optional
        Units to use; those of these durations unless given.
    seed : Rows, optional
        Rows to begin with, from a solve in the same units.
    gap : float
        Share of the cost that may be given away for fewer rounds.
    prove : bool
        Whether the exact margin is checked; a search can do without.

    Raises
    ------
    InfeasibleRowsError
        If no curve keeps all walls.
    """
    units = units or task.units(durations)
    problem = task.problem(durations, units)
    if not certify or not task.constrained:
        return _solved_in_python(task, problem, units, samples, certify, seed, gap, prove)
    answer = solve_natively(task, durations, units, gap)
    if isinstance(answer, CorridorAnswer):
        return Solved(task, problem, units, _native_outcome(task, problem, units, answer))
    found = _solved_in_python(task, problem, units, samples, certify, seed, gap, prove)
    return replace(found, outcome=replace(found.outcome, handed_over=answer))


def _native_outcome(task: Task, problem: Problem, units: Units, answer: CorridorAnswer) -> Outcome:
    """Wrap a native answer, its contacts as rows."""
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
    return Outcome(answer.knots, known, multipliers, answer.rounds, NATIVE, (), 0.0, NATIVE, "", answer.points)


def _solved_in_python(
    task: Task,
    problem: Problem,
    units: Units,
    samples: int | None,
    certify: bool,
    seed: Rows | None,
    gap: float,
    prove: bool,
) -> Solved:
    base = unbounded_optimum(problem)
    if not task.constrained and not (problem.jumps and task.pins):
        return Solved(task, problem, units, Outcome(base, None, np.zeros(0), 0, "banded", (), 0.0))
    compiled = compile_walls(task, problem, units)
    exchange = Exchange(problem, base, compiled, task.solver, seed, gap)
    if not certify:
        return Solved(task, problem, units, exchange.run_sampled(samples or 20))
    if not prove:
        return Solved(task, problem, units, exchange.run())
    return _certified(task, problem, units, exchange)


def _certified(task: Task, problem: Problem, units: Units, exchange: Exchange) -> Solved:
    """Run the exchange until the exact margin of the result is not negative.

    Where the solvers see no solution though stop-and-go is one, the arithmetic is at fault: it is tried once more with
    more digits, and if that does not help the last relaxation is blended with stop-and-go.
    """
    try:
        solved = _insisted(task, problem, units, exchange)
    except InfeasibleRowsError:
        if not _straight_inside(task, exchange.relaxation.compiled, problem):
            raise
        if not problem.extended and problem.size <= EXTENDED:
            careful = replace(problem, extended=True)
            again = Exchange(careful, unbounded_optimum(careful), exchange.relaxation.compiled, task.solver)
            return _certified(task, careful, units, again)
        return _blended(task, problem, units, exchange)
    if solved.inside:
        return solved
    if not _straight_inside(task, exchange.relaxation.compiled, problem):
        raise _no_room(task, problem, exchange.relaxation.compiled)
    return _blended(task, problem, units, exchange)


def _insisted(task: Task, problem: Problem, units: Units, exchange: Exchange) -> Solved:
    """Run the exchange, and again with proofs and then with walls moved inwards while rounding leaves it outside."""
    last: list[Solved] = []
    asked: list[Outcome] = []

    def inside(outcome: Outcome) -> bool:
        if not asked or asked[-1] is not outcome:
            asked[:], last[:] = [outcome], [_quietest(Solved(task, problem, units, outcome))]
        return last[-1].inside

    for _ in range(TRIES):
        if inside(exchange.run(inside)):
            break
        exchange.insist()
    else:
        inside(exchange.run(inside))
    return last[-1]


def _quietest(solved: Solved) -> Solved:
    """Set derivatives that are rounding alone to zero where that brings a curve inside: it slides along a wall."""
    if solved.inside:
        return solved
    knots = solved.outcome.knots
    quiet = np.where(np.abs(knots) > NOISE * np.abs(knots).max(axis=(0, 2), keepdims=True), knots, 0.0)
    other = replace(solved, outcome=replace(solved.outcome, knots=quiet))
    return other if other.inside else solved


def _no_room(task: Task, problem: Problem, compiled: Compiled) -> SolverError | CorridorError:
    """Say where the straight leg itself touches a wall, or else that the solvers are at their end."""
    straight = _heights(compiled, problem, np.zeros_like(problem.values))
    for block, heights in zip(compiled.blocks, straight, strict=True):
        touching = np.flatnonzero((heights >= -TOUCHING) & (block.order == 0))
        for wall in touching:
            leg = int(block.piece[wall]) // task.pieces
            return CorridorError(
                f"waypoint {leg} or {leg + 1} lies on a wall of leg {leg}, and the curve has no room to stay inside: "
                f"move the wall or the waypoint a little",
                leg=leg,
            )
    return SolverError("the solvers found no curve inside the walls to working precision: widen them or change units")


def _straight_inside(task: Task, compiled: Compiled, problem: Problem) -> bool:
    """Whether stopping and going along the straight legs keeps every pin and stays strictly inside."""
    if problem.values.any() or problem.jumps or any(block.order for block in compiled.blocks):
        return False
    return all((values < 0.0).all() for values in _heights(compiled, problem, np.zeros_like(problem.values)))


def _heights(compiled: Compiled, problem: Problem, knots: FloatArray) -> list[FloatArray]:
    """Largest excess over each wall, block by block."""
    return [maxima(points).values for points in compiled.excess(problem, problem.relative_points(knots))]


def _blended(task: Task, problem: Problem, units: Units, exchange: Exchange) -> Solved:
    """Move the last curve towards stop-and-go along the straight legs, by the least share that brings it inside.

    Walls are convex and stop-and-go has all free values zero, so the blend is a scaling of the knot values.
    """
    knots = exchange.relaxation.curve.knots
    share = _least_share(exchange.relaxation.compiled, problem, knots)
    while True:
        outcome = replace(exchange.outcome(), knots=knots * (1.0 - share))
        solved = Solved(task, problem, units, outcome)
        if share == 1.0 or solved.inside:
            return solved
        share = min(1.0, 2.0 * share + 1e-12)


def _least_share(compiled: Compiled, problem: Problem, knots: FloatArray) -> float:
    """Share of stop-and-go that brings every exact extremum inside, but for rounding."""
    straight = _heights(compiled, problem, np.zeros_like(knots))
    share = 0.0
    for curve, line in zip(_heights(compiled, problem, knots), straight, strict=True):
        out = curve > 0.0
        share = max(share, float((curve[out] / (curve[out] - line[out])).max(initial=0.0)))
    return min(1.0, share * (1.0 + 1e-9))
