"""Why no curve stays inside a corridor: the leg, the instant, and the smallest sufficient width."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import reduce

import numpy as np

from minsnap.basics.arrays import FloatArray, IntArray
from minsnap.basics.deadline import LateError
from minsnap.basics.tolerances import EXACT
from minsnap.corridors.constraint import Walls
from minsnap.errors import InfeasibleError, MinsnapError, SolverError
from minsnap.optimisation.contradiction import find_contradiction
from minsnap.optimisation.elastic import Elastic, Relaxation, Relaxed
from minsnap.optimisation.normalised_constraints import Compiled, WallRows, compile_walls
from minsnap.optimisation.optimum import InfeasibleRowsError
from minsnap.optimisation.reduced_qp import ReducedProblem
from minsnap.optimisation.rows import Curve, rows_in_unknowns, rows_outside
from minsnap.optimisation.solve import solve
from minsnap.optimisation.task import Task
from minsnap.optimisation.units import Units

NOTICEABLE = 1e-6
"""Slack, in widths, below which a problem counts as solvable after all."""

WIDTH_ROOM = 1e-4
"""Share added to a smallest width so that it does."""


UNPROVED = "no curve was found that keeps all walls, and it could not be proved that there is none: "


def explain_corridor(task: Task, durations: FloatArray) -> InfeasibleError | SolverError | None:
    """Find whether the walls on positions alone are infeasible at piece durations (pieces in all,) [s], and why.

    Returns
    -------
    InfeasibleError, SolverError or None
        With ``leg``, ``instant``, ``smallest_width`` and its proof where a corridor is too narrow; a SolverError where
        that has no proof; None where the walls on positions leave a curve inside.
    """
    corridor = replace(task, walls=[wall for wall in task.walls if wall.order == 0], touching=False)
    problem, units, compiled = normalised(corridor, durations)
    if not compiled.blocks:
        return None
    groups, names = _leg_groups(corridor, compiled)
    give = Relaxation(groups, np.ones(len(groups)), len(names))
    inward = 4.0 * WIDTH_ROOM
    try:
        relaxed = Elastic(problem, compiled, give, accuracy=NOTICEABLE, inward=inward, deadline=task.deadline).run()
    except LateError:
        raise
    except SolverError as unsolved:
        return _standing(corridor, durations, problem, units, compiled) or unsolved
    if relaxed.slacks.max() <= NOTICEABLE:
        return None
    if relaxed.rows is None:
        relaxed = _outside(problem, compiled, relaxed)
    leg, instant = hardest_pressed(corridor, problem, units, relaxed)
    proof = find_contradiction(corridor, durations, problem, relaxed)
    if proof is None:
        return SolverError(f"{UNPROVED}widen the corridor of leg {leg}, or change durations that differ much")
    tried = _room(task, durations, problem, relaxed)
    room = WIDTH_ROOM if tried is None else tried
    widths = compiled.widths * units.length * (1.0 + np.append(relaxed.slacks, 0.0)[groups] * (1.0 + room) + room)
    on_leg = (groups >= 0) & (np.concatenate([block.leg for block in compiled.blocks]) // task.pieces == leg)
    width = float(widths[on_leg].max())
    others = {
        name: float(widths[groups == name].max())
        for name, slack in zip(names, relaxed.slacks, strict=True)
        if slack > NOTICEABLE and name not in (None, leg)
    }
    message = (
        f"no curve stays inside the {corridor.walls[0].name} of leg {leg}: it is too narrow at {instant:.4g} s; "
        f"{_sufficient(width, names == [None], others, tried is not None)}{_advice(task)}"
    )
    smallest = None if tried is None else width
    return InfeasibleError(message, leg=leg, instant=instant, smallest_width=smallest, contradiction=proof)


def _room(task: Task, durations: FloatArray, problem: ReducedProblem, relaxed: Relaxed) -> float | None:
    """Share to add to widths for which a plan keeps the other walls and limits too; None without one.

    Curves with control points ten million legs away keep walls by differences of large numbers, which solvers find only
    a little inside.
    """
    giant = EXACT * np.abs(problem.relative_points(relaxed.knots)).max() >= 0.01
    for room in (0.01, 0.02, 0.05) if giant else (WIDTH_ROOM, 0.01):
        share = np.broadcast_to(relaxed.slacks * (1.0 + room) + room, task.legs)
        walls = [wall if wall.order else _widened(wall, share[wall.leg]) for wall in task.walls]
        try:
            solve(replace(task, walls=walls), durations)
        except (InfeasibleRowsError, MinsnapError):
            continue
        return room
    return None


def _widened(wall: Walls, share: FloatArray) -> Walls:
    """Return walls that are wider by a share of the width of each."""
    return replace(wall, radius=wall.radius + share * wall.width)


def _sufficient(width: float, everywhere: bool, others: Mapping[int, float], tried: bool) -> str:
    """Say what widths would do, or what is needed at least: that of the leg, or of all, and of others."""
    where = "for all legs" if everywhere else "there"
    what = f"a half-width of {width:.6g} m {where} would do"
    if not tried:
        what = (
            f"the walls on positions alone need a half-width of about {width:.6g} m {where}, the others may need more"
        )
    wider = ", ".join(f"{other:.6g} m on leg {name}" for name, other in others.items())
    return f"{what}, together with {wider}" if wider else what


def _standing(
    task: Task, durations: FloatArray, problem: ReducedProblem, units: Units, compiled: Compiled
) -> InfeasibleError | None:
    """Return the error where the walls contradict each other at waypoints, which widths of a corridor do not help."""
    count = len(compiled.widths)
    give = Relaxation(np.zeros(count, dtype=np.intp), np.ones(count), 1)
    relaxed = Elastic(problem, compiled, give, accuracy=NOTICEABLE, deadline=task.deadline).run()
    proof = find_contradiction(task, durations, problem, relaxed)
    if proof is None:
        return None
    leg, instant = hardest_pressed(task, problem, units, relaxed)
    return InfeasibleError(
        f"no curve passes the waypoints as near as asked for: leg {leg} is the hardest, at {instant:.4g} s; widen the "
        f"tolerances or gates, pin fewer derivatives, or lower continuity={task.continuity}",
        leg=leg,
        instant=instant,
        contradiction=proof,
    )


def _outside(problem: ReducedProblem, compiled: Compiled, relaxed: Relaxed) -> Relaxed:
    """Add the rows that a curve without unknowns breaks, each pressed by as much."""
    rows, _ = rows_outside(Curve(problem, compiled, problem.values), None, np.zeros(0))
    if not rows:
        return relaxed
    known = rows_in_unknowns(problem, problem.plain_ends(problem.values), compiled, reduce(WallRows.joined, rows))
    pressed = np.maximum(-known.bound, 0.0)
    return replace(relaxed, rows=known, multipliers=pressed)


def normalised(task: Task, durations: FloatArray) -> tuple[ReducedProblem, Units, Compiled]:
    """Return a task's problem at piece durations, its units and its walls."""
    units = task.units(durations)
    problem = task.problem(durations, units)
    return problem, units, compile_walls(task, problem, units)


def _leg_groups(task: Task, compiled: Compiled) -> tuple[IntArray, list[int | None]]:
    """One common slack if all walls are equally wide, else one per leg: slack of each wall, leg of each slack."""
    leg = np.concatenate([block.leg // task.pieces for block in compiled.blocks])
    stands = compiled.momentary
    width = compiled.widths[~stands]
    if len(width) and np.ptp(width) <= 1e-9 * width.max():
        return np.where(stands, -1, 0), [None]
    return np.where(stands, -1, leg), list(range(task.legs))


def _advice(task: Task) -> str:
    if task.continuity > task.half - 1:
        return (
            f"; or lower continuity={task.continuity}, which leaves degree {2 * task.half - 1} little freedom: "
            f"continuity={task.half - 1} fits any width from rest to rest"
        )
    return ""


def hardest_pressed(task: Task, problem: ReducedProblem, units: Units, relaxed: Relaxed) -> tuple[int, float]:
    """Leg and instant of the row with the largest multiplier."""
    if relaxed.rows is None:
        return 0, 0.0
    rows = relaxed.rows.source
    press = relaxed.multipliers * relaxed.rows.width
    by_leg = np.bincount(rows.piece // task.pieces, press, task.legs)
    leg = int(by_leg.argmax())
    row = int(np.where(rows.piece // task.pieces == leg, press, -1.0).argmax())
    breaks = np.concatenate(([0.0], np.cumsum(problem.durations)))
    return leg, float((breaks[rows.piece[row]] + rows.s[row] * problem.durations[rows.piece[row]]) * units.time)
