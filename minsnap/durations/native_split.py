"""Asks the native core for the durations of least cost, where it does that kind of task."""

from __future__ import annotations

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.deadline import WORK
from minsnap.basics.tolerances import GAP
from minsnap.native.corridor import CorridorQuestion
from minsnap.native.durations import BestSplit, best_corridor_split, best_split
from minsnap.native.library import core
from minsnap.optimisation.native_solve import corridor_question
from minsnap.optimisation.task import Task


def native_split(task: Task, first: FloatArray, price: float | None) -> BestSplit | None:
    """Return the durations of legs that cost least, from first ones (legs,) [s]; None where Python has to search.

    Before a deadline they are the best found in time; LateError where nothing was.

    Parameters
    ----------
    task : Task
    first : ndarray, shape (legs,)
    price : float or None
        Cost of a second; None for the total of the first durations.
    """
    if core().library is None or task.solver != "auto":
        return None
    if not (task.constrained or task.free_ends):
        return _without_walls(task, first, price)
    question = _question(task, first)
    if question is None:
        return None
    free = _without_walls(task, first, price) if price is None else None
    for start in [first] if free is None else [free.durations, first]:
        task.deadline.check()
        left = task.deadline.unspent / WORK.solve
        split = best_corridor_split(question, start, task.pieces, price, GAP, task.deadline.left, left)
        task.deadline.resume()
        if isinstance(split, BestSplit):
            task.deadline.spend(WORK.solve * split.work)
            return split
    return None


def _without_walls(task: Task, first: FloatArray, price: float | None) -> BestSplit | None:
    """Return the durations that cost least without the walls, where waypoints are fixed."""
    if not _is_free(task):
        return None
    chain = {} if task.closed else task.pins, task.closed
    split = best_split(task.waypoints, first, task.half, price, *chain, task.deadline.left)
    task.deadline.resume()
    return split if isinstance(split, BestSplit) else None


def _question(task: Task, first: FloatArray) -> CorridorQuestion | None:
    """Return the question of the native search, whose slopes of the cost know no further continuity."""
    if task.continuity != task.half - 1:
        return None
    durations = task.piece_durations(first)
    question = corridor_question(task, durations, task.units(durations))
    return question if isinstance(question, CorridorQuestion) else None


def _is_free(task: Task) -> bool:
    """Whether the curve without walls is a chain of one piece a leg; more pieces change nothing there."""
    whole = set(range(1, task.half))
    ends = [set(task.pins.get(knot, {})) for knot in (0, task.legs)]
    inner = any(state for knot, state in task.pins.items() if 0 < knot < task.legs)
    if task.closed:
        return not any(task.pins.values()) and task.continuity >= task.half - 1
    smooth = task.continuity == task.half - 1 or (task.continuity > task.half - 1 and not inner)
    return smooth and ends == [whole, whole] and bool(np.isfinite(task.waypoints).all())
