r"""Gradient of the optimal cost in waypoints and half-widths inside walls, by the envelope theorem.

A contact with a wall :math:`g \le 0` and multiplier :math:`\lambda` adds :math:`\lambda \, \partial g / \partial w` of
the waypoints w of its leg: the curve's point moves with them, and so does the wall of a tube. With u the unit vector of
the leg from :math:`w_0` to :math:`w_1`, l its length, :math:`P = I - u u^\top`, :math:`c = r - w_0` and a wall
:math:`g = e^\top P c - \delta` at a point r that is held,

.. math:: \partial g / \partial w_1 = -\frac{u^\top c}{l} P e - \frac{e^\top u}{l} P c, \qquad
          \partial g / \partial w_0 = -P e - \partial g / \partial w_1.

Each tube gives its own e (:meth:`~minsnap.corridors.tubes.LegTube.directions`).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.corridors.constraint import Constraint
from minsnap.corridors.named_constraints import TUBES
from minsnap.corridors.tubes import LegTube
from minsnap.optimisation.gradient import PressingRows, pressing_rows
from minsnap.optimisation.solved_task import SolvedTask
from minsnap.polynomials.bernstein import basis
from minsnap.trajectory.trajectories import free_slopes


class PlaceSlopes(NamedTuple):
    """Derivatives of the optimal cost.

    Parameters
    ----------
    waypoints : ndarray, shape (legs + 1, dim)
        [cost/m].
    widths : ndarray, shape (legs,)
        In the half-width of each leg's tube; zero where there is none [cost/m].
    """

    waypoints: FloatArray
    widths: FloatArray


def place_gradient(solved: SolvedTask, constraints: Sequence[Constraint]) -> PlaceSlopes:
    """Return the gradient of a task with one piece per leg, pinned waypoints and walls on positions.

    Parameters
    ----------
    solved : SolvedTask
        Found with a small gap: the error of the gradient goes as its square root.
    constraints : sequence of Constraint
        Those that the walls of the task come from, in their order.
    """
    task, curve = solved.task, solved.trajectory
    slopes = PlaceSlopes(np.zeros(task.waypoints.shape), np.zeros(task.legs))
    forces = free_slopes(curve.control_points, curve.durations)[1]
    slopes.waypoints[:-1] -= forces
    slopes.waypoints[1:] += forces
    unit = solved.units.length * solved.units.time ** (1.0 - 2.0 * task.half)
    owners = [one for one in constraints for walls in one.walls(task.waypoints) if len(walls.leg)]
    for rows in pressing_rows(solved):
        pushes, owner = rows.multiplier * unit, owners[rows.block]
        _add_curve(slopes, solved, rows, pushes)
        if isinstance(owner, TUBES):
            _add_tube(slopes, solved, rows, owner, pushes)
    return slopes


def _add_curve(slopes: PlaceSlopes, solved: SolvedTask, rows: PressingRows, pushes: FloatArray) -> None:
    """Add what the contacts change because the points of the curve move with the waypoints."""
    factors = solved.problem.row_factors(rows.piece, rows.s, 0)
    forces = pushes[:, None] * rows.normal
    np.add.at(slopes.waypoints, rows.piece, factors[:, :1] * forces)
    np.add.at(slopes.waypoints, rows.piece + 1, factors[:, solved.task.half, None] * forces)


def _add_tube(slopes: PlaceSlopes, solved: SolvedTask, rows: PressingRows, tube: LegTube, pushes: FloatArray) -> None:
    """Add what the contacts change because the walls move with the waypoints, and with the half-widths."""
    task, curve = solved.task, solved.trajectory
    start = task.waypoints[rows.piece]
    lengths = task.lengths[rows.piece, None]
    along = (task.waypoints[rows.piece + 1] - start) / lengths
    away = np.einsum("rj,rjd->rd", basis(curve.degree, rows.s), curve.control_points[rows.piece]) - start
    share = (along * away).sum(axis=1, keepdims=True) / lengths
    offset = away - share * lengths * along
    directions = tube.directions(task.waypoints, rows.wall, offset)
    turning = share * rows.normal + (directions * along).sum(axis=1, keepdims=True) / lengths * offset
    np.add.at(slopes.waypoints, rows.piece + 1, -pushes[:, None] * turning)
    np.add.at(slopes.waypoints, rows.piece, pushes[:, None] * (turning - rows.normal))
    np.add.at(slopes.widths, rows.piece, -pushes)
