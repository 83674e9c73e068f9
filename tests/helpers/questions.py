"""Questions for the native corridor solver, made by hand."""

import numpy as np

from minsnap.corridors.constraint import Walls
from minsnap.native.corridor import CorridorQuestion


def tube_planes(points, half_widths):
    """Two planes for each leg and world axis: (I - u u') (r - start) between minus and plus the half-width."""
    steps = np.diff(points, axis=0)
    along = steps / np.linalg.norm(steps, axis=1)[:, None]
    legs, dim = steps.shape
    normal = np.eye(dim) - along[:, :, None] * along[:, None, :]
    leg, axis = np.nonzero(np.abs(normal).max(axis=2) > 1e-12)
    rows, width = normal[leg, axis], np.broadcast_to(half_widths, legs)[leg].astype(float)
    return Walls.planes(leg, rows, points[leg], -width, width, width)


def tube_question(points, durations, half_widths, half=4, **others):
    """Rest to rest through points in tubes."""
    points, durations = np.array(points, float), np.array(durations, float)
    length = float(np.linalg.norm(np.diff(points, axis=0), axis=1).mean())
    time = float(np.exp(np.log(durations).mean()))
    walls = [tube_planes(points, half_widths).record]
    return CorridorQuestion(half, points, durations, walls, length, time, **others)


def real_cost(question, cost):
    """Cost in metres and seconds of a normalised one."""
    return cost * question.length**2 * question.time ** (1 - 2 * question.half)
