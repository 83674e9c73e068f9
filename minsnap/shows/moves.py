"""Moves of a formation: it turns about the vertical, grows or shrinks, and its center goes along a curve.

All vehicles share three polynomials, of the cosine, the sine and the scale, so that it keeps its shape: its distances
are those that it has, times the scale. At knots they have the exact values and three derivatives.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, pi

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.checks import LONGEST, point_text
from minsnap.basics.tolerances import EXACT
from minsnap.errors import FleetError
from minsnap.fleet import certify_fleet, slowed
from minsnap.limits import Limits
from minsnap.planning import plan
from minsnap.trajectory import Trajectory

PIECE = pi / 24.0
"""Angle of a piece: cosine and sine are then met to 2e-10."""

LEAST_PIECES = 4

FAINT = 1e-9
"""Time of a move that is none: what rounding makes of one that stays [s]."""


@dataclass(frozen=True, eq=False)
class Move:
    """How a formation moves, from rest to rest.

    Parameters
    ----------
    turn : float
        About the vertical through its center, counter-clockwise [rad].
    scale : float
        How many times as large it is in the end.
    along : ndarray, shape (n, 3), or None
        Way of its center, from where it is: ``[[0, 0, 0], [5, 0, 2]]`` [m].
    seconds : float or None
        How long it takes; by default as short as the limits allow [s].
    """

    turn: float = 0.0
    scale: float = 1.0
    along: FloatArray | None = None
    seconds: float | None = None


def moved(move: Move, points: FloatArray, limits: Limits) -> list[Trajectory]:
    """Return the curves of a formation (vehicles, 3), in its seconds or the shortest time; none if that is zero.

    Raises
    ------
    FleetError
        If it does not keep the limits in its seconds, or its way does not begin at the center.
    """
    if move.along is not None and move.along[:1].any():
        raise FleetError(
            f"the way of a move begins at {point_text(move.along[0])}: it is counted from the center of the formation, "
            "so begin it at (0, 0, 0)"
        )
    way = None if move.along is None else plan(move.along, total_time=1.0)
    count = max(LEAST_PIECES, ceil(abs(move.turn) / PIECE))
    breaks = np.union1d(np.linspace(0.0, 1.0, count + 1), [] if way is None else way.breaks[1:-1])
    curves = _pieces(breaks, np.stack(_shape(move, breaks), axis=2))
    center, durations = points.mean(axis=0), np.diff(breaks)
    shift = np.zeros((*curves.shape[:2], 3))
    if way is not None:
        shift = _pieces(breaks, np.stack([way(np.minimum(breaks, way.duration), q) for q in range(4)], axis=1))
    moves = []
    for x, y, z in points - center:
        x_y = curves[..., :1] * (x, y) + curves[..., 1:2] * (-y, x)
        moves.append(Trajectory(center + shift + np.concatenate((x_y, curves[..., 2:] * z), axis=2), durations))
    time = slowed(moves, limits) if move.seconds is None else move.seconds
    if time < FAINT and move.seconds is None:
        return []
    if not 0.0 < time <= LONGEST:
        raise FleetError(f"a move takes {time:g} s: give it a number of seconds up to {LONGEST:g}")
    flown = [Trajectory(curve.control_points, curve.durations * time) for curve in moves]
    for used in () if move.seconds is None else certify_fleet(flown, limits=limits).utilisation:
        if used.use.fraction > 1.0 + EXACT:
            beyond = f"{used.use.name} {used.use.value:.4g} of {used.use.limit:g}"
            raise FleetError(f"a move in {time:g} s does not keep the limits ({beyond}): give it more seconds")
    return flown


def _shape(move: Move, breaks: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return values and three derivatives of cosine, sine and scale at knots of a unit of time, (knots, 4) each."""
    rise = Trajectory(np.repeat([0.0, 1.0], 4)[None, :, None], np.ones(1)).states(breaks, 4)[..., 0]
    angle, scale = move.turn * rise, (move.scale - 1.0) * rise + (1.0, 0.0, 0.0, 0.0)
    ones = np.exp(1j * angle[:, 0])
    first, second, third = 1j * angle[:, 1], 1j * angle[:, 2], 1j * angle[:, 3]
    chain = (np.ones(len(ones)), first, first**2 + second, first**3 + 3.0 * first * second + third)
    turned = np.stack([ones * each for each in chain], axis=1)
    # the product with the scale is differentiated as a whole
    whole = np.zeros_like(turned)
    for order, weights in enumerate(((1,), (1, 1), (1, 2, 1), (1, 3, 3, 1))):
        for k, weight in enumerate(weights):
            whole[:, order] += weight * turned[:, k] * scale[:, order - k]
    return whole.real, whole.imag, scale


def _pieces(breaks: FloatArray, data: FloatArray) -> FloatArray:
    """Return the control points of degree 7 that have values and three derivatives at knots: (pieces, 8, dim)."""
    from scipy.interpolate import BPoly

    return np.asarray(BPoly.from_derivatives(breaks, data).c.transpose(1, 0, 2))
