"""Solve a task with the native core if it supports that kind of task; otherwise return the reason."""

from __future__ import annotations

from math import perm

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.deadline import WORK
from minsnap.native.corridor import CorridorQuestion, solve_corridor
from minsnap.native.free_optimum import pinned_optimum
from minsnap.native.library import core
from minsnap.native.status import Status
from minsnap.optimisation.optimum import Contacts, Optimum
from minsnap.optimisation.solved_task import NATIVE, SolvedTask
from minsnap.optimisation.task import Task
from minsnap.optimisation.task_walls import AllWalls, all_walls
from minsnap.optimisation.units import Units
from minsnap.polynomials.bernstein import from_whole, parted, to_whole


def solve_natively(
    task: Task, durations: FloatArray, units: Units, gap: float, prove: bool, effort: float
) -> SolvedTask | str:
    """Solve for piece durations (pieces in all,) [s], or return the reason why there is no answer, or none proved.

    It gives up when the task is due, after a share ``effort`` of the work that a task is worth, and with the work left.
    """
    question = corridor_question(task, durations, units)
    if isinstance(question, str):
        return question
    answer = solve_corridor(question, gap, min(effort, task.deadline.solves), task.deadline.left)
    task.deadline.spend(WORK.solve * answer.work)
    if answer.status is not Status.DONE:
        return answer.status.reason
    contacts = Contacts(answer.wall, answer.s, answer.multiplier)
    optimum = Optimum(answer.knots, answer.rounds, NATIVE, contacts, core=NATIVE, points=answer.points)
    solved = SolvedTask(task, durations, units, optimum)
    return solved if not prove or solved.inside else Status.NOT_PROVED.reason


def corridor_question(
    task: Task, durations: FloatArray, units: Units, walls: AllWalls | None = None
) -> CorridorQuestion | str:
    """Return the input of the native core for piece durations (pieces in all,) [s], or why it is not used.

    The walls are by default those of the task.
    """
    reason = core().reason or ("" if task.solver == "auto" else f"the solver {task.solver} was asked for")
    if reason:
        return reason
    positions, pinned = np.ascontiguousarray(task.positions), np.ascontiguousarray(~task.free)
    known = (pinned, None if task.still else task.pinned, task.closed, task.continuity)
    records = [block.record for block in (walls or all_walls(task)).blocks]
    return CorridorQuestion(
        task.half, positions, np.ascontiguousarray(durations), records, units.length, units.time, *known
    )


def solve_without_walls(task: Task, durations: FloatArray, units: Units) -> SolvedTask | str:
    """Solve a task without walls, or return the reason why there is no answer.

    One polynomial per leg is the optimum of any number of pieces: these are parts of it.

    Parameters
    ----------
    durations : ndarray, shape (legs * pieces,)
        [s].
    """
    if core().reason:
        return core().reason
    points, times = np.ascontiguousarray(task.waypoints), durations.reshape(task.legs, task.pieces)
    answer = pinned_optimum(points, times.sum(axis=1), task.half, task.pins, task.closed)
    if not isinstance(answer, tuple):
        return answer.reason
    knots = np.zeros((task.legs + 1, task.half, task.dim))
    for order in range(1, task.half):
        knots[:, order] = answer[1][:, order - 1] / units.of_order(order)
    points, knots = in_pieces(task, durations, units, answer[0], knots)
    return SolvedTask(task, durations, units, Optimum(knots, 0, "banded", core=NATIVE, points=points))


def in_pieces(
    task: Task, durations: FloatArray, units: Units, points: FloatArray, knots: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Cut one polynomial per leg into pieces.

    Parameters
    ----------
    durations : ndarray, shape (legs * pieces,)
        [s].
    points : ndarray, shape (legs, 2k, dim)
        Control points [m].
    knots : ndarray, shape (legs + 1, k, dim)
        Normalised knot values.

    Returns
    -------
    points : ndarray, shape (legs * pieces, 2k, dim)
    knots : ndarray, shape (legs * pieces + 1, k, dim)
    """
    if task.pieces == 1:
        return points, knots
    times = durations.reshape(task.legs, task.pieces)
    parts, unit = parted(points, times)
    every = np.zeros((len(durations) + 1, task.half, task.dim))
    every[:: task.pieces] = knots
    inner = np.arange(len(durations)).reshape(times.shape)[:, 1:]
    every[inner, 0] = from_whole(parts[:, 1:, 0] - to_whole(task.positions[inner], unit), unit) / units.length
    for order in range(1, task.half):
        scale = perm(2 * task.half - 1, order) / times[:, 1:, None] ** order / units.of_order(order)
        every[inner, order] = from_whole(np.diff(parts[:, 1:], order, axis=2)[:, :, 0], unit) * scale
    return from_whole(parts.reshape(-1, *parts.shape[2:]), unit), every
