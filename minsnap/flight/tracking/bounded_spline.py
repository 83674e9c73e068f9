r"""The smooth curve nearest to samples whose derivatives, added to those of a plan, stay within limits.

Of all quintic splines c that begin and end with no offset, velocity and acceleration, the one of least

.. math:: \sum_i |c(t_i) - x_i|^2 + \omega^{-6} \sum_i |\dddot c(t_i)|^2

is what a low-pass filter without phase makes of x, of half gain at the frequency :math:`\omega`. With the limits it is
a convex problem; solved by the alternating direction method of multipliers (S. Boyd et al., Foundations and Trends in
Machine Learning 3, 2011, section 5), with one factorisation.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import ceil, pi
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.flight.tracking.setpoint_limits import SetpointLimit, within_ball


@dataclass(frozen=True)
class SplineSettings:
    """How the curve is found.

    Parameters
    ----------
    knots : float
        Time from one knot to the next, in periods of the frequency of half gain.
    fewest : int
        Least number of intervals between knots.
    penalty : float
        Of the method of multipliers, in units of the sum of squares and of the frequency.
    relaxed : float
        Its factor of relaxation.
    steps : int
        Of it, at most.
    settled : float
        Change of the curve [m], and what is left of a bound in these units, at which it ends before.
    precise : float
        Share of a limit by which it may be passed; from there on the curve is made smaller as a whole.
    """

    knots: float = 0.12
    fewest: int = 8
    penalty: float = 25.0
    relaxed: float = 1.6
    steps: int = 1000
    settled: float = 3e-4
    precise: float = 0.01


SPLINE = SplineSettings()
_DEGREE, _RESTS = 5, 3


def bounded_spline(
    t: FloatArray, values: FloatArray, limits: Sequence[SetpointLimit], largest: float, cutoff: float
) -> list[FloatArray]:
    """Return a smooth change of setpoints and its first three derivatives at the instants, each (m, dim).

    Parameters
    ----------
    t : ndarray, shape (m,)
        Instants [s].
    values : ndarray, shape (m, dim)
        What it is to be near to [m].
    limits : sequence of SetpointLimit
        Which the plan and the change together keep, to within a hundredth.
    largest : float
        Greatest length of the change [m].
    cutoff : float
        Frequency of half gain [Hz].
    """
    designs = _designs(t, SPLINE.knots / cutoff)
    bounds = [(0, np.zeros_like(values), lambda x: within_ball(x, np.full(len(x), 0.99 * largest)))]
    bounds += [(each.order, each.own, each.nearest) for each in limits]
    parts = _nearest(designs, values, bounds, 2.0 * pi * cutoff)
    longest = float(np.linalg.norm(parts[0], axis=1).max()) / largest

    def fits(share: float) -> bool:
        used = (each.used(share * parts[each.order]) for each in limits)
        return share * longest <= 1.0 and all(one <= 1.0 + SPLINE.precise for one in used)

    share, step = 1.0, 0.5
    if not fits(share):
        share = 0.0
        while step > SPLINE.precise:
            share, step = (share + step if fits(share + step) else share), 0.5 * step
    return [share * part for part in parts]


Bound = tuple[int, FloatArray, Callable[[FloatArray], FloatArray]]
"""Derivative, that of the plan (m, dim), and the projection of their sum."""


def _nearest(designs: list[Any], values: FloatArray, bounds: Sequence[Bound], frequency: float) -> list[FloatArray]:
    """Return the curve and its derivatives near to what keeps the bounds."""
    from scipy.sparse.linalg import splu

    weights = [SPLINE.penalty / frequency ** (2 * order) for order, _, _ in bounds]
    wanted = designs[0].T @ values
    smooth = designs[0].T @ designs[0] + frequency**-6 * designs[3].T @ designs[3]
    points = splu(smooth.tocsc()).solve(wanted)
    for order, own, project in bounds:  # most curves keep all of them as they are
        moved = own + designs[order] @ points
        if np.abs(project(moved) - moved).max() > 1e-9:
            break
    else:
        return [np.asarray(design @ points) for design in designs]
    # The alternating direction method of multipliers (S. Boyd and others, 2011) repeats three steps: the curve nearest
    # to the values and to `kept`; `kept`, the projection of the curve onto its bound; and `over`, the sum of what the
    # two differ by, which pulls at the next curve. The matrix of the first step stays, and is factored once.
    pulls = sum((w * designs[k].T @ designs[k] for w, (k, _, _) in zip(weights, bounds, strict=True)), start=smooth)
    factor = splu(pulls.tocsc())
    rows, over = [design.tocsr() for design in designs], [np.zeros_like(values) for _ in bounds]
    columns, kept = [design.T.tocsr() for design in designs], [own + rows[k] @ points for k, own, _ in bounds]
    for _ in range(SPLINE.steps):
        right, farthest, parts = wanted, 0.0, [row @ points for row in rows]
        for k, (weight, (order, own, project)) in enumerate(zip(weights, bounds, strict=True)):
            moved = own + parts[order]
            sought = SPLINE.relaxed * moved + (1.0 - SPLINE.relaxed) * kept[k] + over[k]
            kept[k] = project(sought)
            farthest = max(farthest, float(np.abs(moved - kept[k]).max()) / frequency**order)
            over[k] = sought - kept[k]
            right = right + weight * (columns[order] @ (kept[k] - over[k] - own))
        before, points = points, factor.solve(right)
        if farthest < SPLINE.settled and np.abs(points - before).max() < SPLINE.settled:
            break
    return [np.asarray(design @ points) for design in designs]


def _designs(t: FloatArray, spacing: float) -> list[Any]:
    """Return sparse matrices from a spline's free control points to it and its first three derivatives at t."""
    from scipy.interpolate import BSpline
    from scipy.sparse import diags_array

    count = max(SPLINE.fewest, ceil((t[-1] - t[0]) / spacing))
    knots = np.pad(np.linspace(t[0], t[-1], count + 1), _DEGREE, mode="edge")
    designs, to_points = [], None
    for degree in range(_DEGREE, _DEGREE - 4, -1):
        design = BSpline.design_matrix(t, knots, degree)
        designs.append((design if to_points is None else design @ to_points).tocsc()[:, _RESTS:-_RESTS])
        rises = degree / (knots[degree + 1 : -1] - knots[1 : -degree - 1])
        slopes = diags_array([-rises, rises], offsets=[0, 1], shape=(len(rises), len(rises) + 1))
        to_points, knots = slopes if to_points is None else slopes @ to_points, knots[1:-1]
    return designs
