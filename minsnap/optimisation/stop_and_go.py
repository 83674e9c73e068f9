"""Stop-and-go along the straight legs: all free values zero, and strictly inside convex walls."""

from __future__ import annotations

import numpy as np

from minsnap.arrays import FloatArray
from minsnap.optimisation.rows import Curve
from minsnap.polynomials.extrema import maxima


def straight_inside(curve: Curve) -> bool:
    """Whether stop-and-go satisfies every pin and stays strictly inside the walls of a curve."""
    problem = curve.problem
    bounded = problem.values.any() or problem.jumps or any(block.order for block in curve.compiled.blocks)
    return not bounded and all((heights < 0.0).all() for heights in straight_heights(curve))


def straight_heights(curve: Curve) -> list[FloatArray]:
    """Largest excess of stop-and-go over each wall of a curve, in widths, block by block."""
    return heights(Curve(curve.problem, curve.compiled, np.zeros_like(curve.knots)))


def heights(curve: Curve) -> list[FloatArray]:
    """Largest excess over each wall, in widths, block by block."""
    return [maxima(points).values for points in curve.excess]


def least_share(curve: Curve) -> float:
    """Least share of stop-and-go that brings every exact extremum inside, up to rounding."""
    share = 0.0
    for bent, straight in zip(heights(curve), straight_heights(curve), strict=True):
        out = bent > 0.0
        share = max(share, float((bent[out] / (bent[out] - straight[out])).max(initial=0.0)))
    return min(1.0, share)
