"""Margins: proved lower bounds of the distance of a curve to walls over all time, in floats and in exact rationals."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.corridors.constraint import Walls
from minsnap.native import proved_extrema as native
from minsnap.polynomials import rationals
from minsnap.polynomials.enclosures import UNIT
from minsnap.polynomials.extrema import maxima, maximum
from minsnap.trajectory.trajectory import Trajectory


@dataclass(frozen=True)
class Margin:
    """Least distance of a trajectory to a wall, and the place where it occurs.

    Parameters
    ----------
    value : float
        Least distance to the wall, in the wall's unit; negative outside. The exact distance between the stored
        numbers is not less, and more by rounding alone.
    leg : int
        Leg where it comes nearest.
    instant : float
        When [s].
    name : str
        Which constraint.
    """

    value: float
    leg: int
    instant: float
    name: str


def nearest_wall(traj: Trajectory, walls: Sequence[Walls]) -> Margin | None:
    """Proved least distance to the walls over all time; None where there are none."""
    return min((margin_to(traj, wall) for wall in walls if len(wall.leg)), key=lambda m: m.value, default=None)


def margin_to(traj: Trajectory, wall: Walls) -> Margin:
    """Proved least distance to one block of walls over all time."""
    found = native.greatest_excess(wall.record, traj.control_points, traj.durations, traj.pieces)
    bound, which, where = _greatest_excess(traj, wall) if found is None else found[1:]
    if bound == -np.inf:
        return Margin(np.inf, 0, 0.0, wall.name)
    row, part = divmod(which, traj.pieces)
    piece = int(wall.leg[row]) * traj.pieces + part
    instant = float(traj.breaks[piece] + where * traj.durations[piece])
    return Margin(0.0 - bound, int(wall.leg[row]), instant, wall.name)


def _greatest_excess(traj: Trajectory, wall: Walls) -> tuple[float, int, float]:
    """Return by how much a curve is outside at most, in which row and piece of it, and where on [0, 1]."""
    excess, row, _ = wall.excess(traj)
    if not len(row):
        return -np.inf, 0, 0.0
    if wall.flat:
        return maximum(excess.points, excess.errors)
    highest = maxima(excess.points, excess.errors)
    slacks = _distances(wall.radius[row], highest.bounds)
    if wall.slope.any():  # the opposite nappe of the cone has the same squares
        reach = wall.reach(traj)
        slacks = np.minimum(slacks, -maxima(-reach.points, reach.errors).bounds)
    which = int(np.argmin(slacks))
    return -float(slacks[which]), which, float(highest.where[which])


def _distances(radius: FloatArray, excess: FloatArray) -> FloatArray:
    """Return radius - sqrt(radius^2 + excess), or what is a little less, without cancellation."""
    square = radius**2 + excess + 4.0 * UNIT * (radius**2 + np.abs(excess))
    slacks = -excess / (radius + np.sqrt(np.maximum(square, 0.0)))
    return np.minimum(slacks - 8.0 * UNIT * np.abs(slacks), radius)


def margin_holds(traj: Trajectory, wall: Walls, margin: float) -> bool:
    """Whether a trajectory is proved to keep a margin to a block of walls over all time."""
    if margin == float("inf"):
        return not len(wall.leg)
    return all(map(rationals.is_never_negative, _room_left(traj, wall, Fraction(margin))))


def norm_holds(traj: Trajectory, order: int, largest: float) -> bool:
    """Whether the norm of a derivative is proved never to exceed a value."""
    square = Fraction(largest) ** 2
    norms = (rationals.squared_norm(_derivative(traj, piece, order)) for piece in range(len(traj.durations)))
    return all(rationals.is_never_negative([square - value for value in norm]) for norm in norms)


def _derivative(traj: Trajectory, piece: int, order: int) -> rationals.Curve:
    points, duration = rationals.exact(traj.control_points[piece]), Fraction(float(traj.durations[piece]))
    return rationals.derivative(points, duration, order)


def _room_left(traj: Trajectory, wall: Walls, margin: Fraction) -> Iterator[rationals.Scalar]:
    """Yield what is not negative on each piece of a wall's leg where the margin is kept.

    Of planes and cones the reach less the margin; of what is round the radius less the margin, and its square less
    what the squared norm exceeds what the radius grows by.
    """
    for row, piece in zip(*wall.on_pieces(traj.pieces), strict=True):
        curve = rationals.relative(_derivative(traj, piece, wall.order), wall.anchor[row])
        radius = Fraction(float(wall.radius[row]))
        reach = [radius + value for value in rationals.along(curve, wall.slope[row])]
        if wall.flat or wall.slope.any():
            yield [value - margin for value in reach]
        if not wall.flat:
            yield [radius - margin]
            square = rationals.squared_norm([rationals.along(curve, normal) for normal in wall.matrix[row]])
            both = zip(rationals.squared_norm([reach]), square, strict=True)
            yield [(radius - margin) ** 2 - radius**2 + a - b for a, b in both]
