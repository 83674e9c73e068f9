"""Stop-and-go along the straight legs: all free values zero, and strictly inside convex walls."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.tolerances import EXACT
from minsnap.errors import CorridorError
from minsnap.optimisation.rows import Curve
from minsnap.optimisation.task import Task
from minsnap.polynomials.extrema import maxima


def straight_inside(curve: Curve) -> bool:
    """Whether stop-and-go satisfies every pin and stays strictly inside the walls of a curve."""
    problem = curve.problem
    bounded = problem.values.any() or problem.jumps or any(block.order for block in curve.compiled.blocks)
    return not bounded and all((excess < 0.0).all() for excess in _excess(curve))


def _excess(curve: Curve) -> list[FloatArray]:
    """Largest excess of stop-and-go over each wall of a curve, in widths, block by block."""
    straight = replace(curve, knots=np.zeros_like(curve.knots))
    return [maxima(points).values for points in straight.excess]


def leg_on_wall(task: Task, curve: Curve) -> CorridorError | None:
    """Return the error that names the first leg whose straight line touches a wall; None where none does."""
    for block, excess in zip(curve.compiled.blocks, _excess(curve), strict=True):
        for wall in np.flatnonzero((excess >= -EXACT) & (block.order == 0)):
            leg = int(block.leg[wall]) // task.pieces
            return CorridorError(
                f"waypoint {leg} or {leg + 1} lies on a wall of leg {leg}, and the curve has no room to stay inside: "
                f"move the wall or the waypoint a little",
                leg=leg,
            )
    return None
