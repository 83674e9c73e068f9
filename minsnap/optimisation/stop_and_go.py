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
    bounded = problem.values.any() or problem.joined_orders or any(block.order for block in curve.walls.blocks)
    return not bounded and all((excess < 0.0).all() for excess in _heights(straight(curve)))


def straight(curve: Curve) -> Curve:
    """Return stop-and-go between the same walls."""
    return replace(curve, knots=np.zeros_like(curve.knots))


def _heights(curve: Curve) -> list[FloatArray]:
    """Largest excess over each wall, in widths, block by block."""
    return [maxima(points).values for points in curve.excess]


def least_share(curve: Curve, inner: Curve) -> float:
    """Least share of a curve with room to all walls that brings every exact extremum inside, up to rounding."""
    share = 0.0
    for bent, still in zip(_heights(curve), _heights(inner), strict=True):
        out = bent > 0.0
        if (still[out] >= 0.0).any():
            return 1.0
        share = max(share, float((bent[out] / (bent[out] - still[out])).max(initial=0.0)))
    return share


def leg_on_wall(task: Task, curve: Curve) -> CorridorError | None:
    """Return the error that names the first leg whose straight line touches a wall; None where none does."""
    for block, excess in zip(curve.walls.blocks, _heights(straight(curve)), strict=True):
        for wall in np.flatnonzero((excess >= -EXACT) & (block.order == 0)):
            leg = int(block.leg[wall]) // task.pieces
            return CorridorError(
                f"waypoint {leg} or {leg + 1} lies on a wall of leg {leg}, and the curve has no room to stay inside: "
                f"move the wall or the waypoint a little",
                leg=leg,
            )
    return None
