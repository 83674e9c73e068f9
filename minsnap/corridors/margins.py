"""Margins: proved lower bounds of the distance of a curve to walls over all time, in floats and in exact rationals."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from minsnap.basics.arrays import FloatArray, IntArray
from minsnap.corridors.constraint import Walls
from minsnap.native import proved_extrema as native
from minsnap.polynomials.enclosures import UNIT
from minsnap.polynomials.extrema import maxima, maximum
from minsnap.polynomials.rationals import (
    Curve,
    Scalar,
    along,
    derivative,
    exact,
    is_never_negative,
    relative,
    squared_norm,
)
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
    extremum = native.greatest_excess(wall.record, traj.control_points, traj.durations, traj.pieces)
    if extremum is not None:
        return _margin(traj, wall, extremum)
    slacks, row, piece, where = (_flat_slacks if wall.flat else _round_slacks)(traj, wall)
    if not len(row):
        return Margin(np.inf, 0, 0.0, wall.name)
    which = int(np.argmin(slacks))
    instant = _instant(traj, int(piece[which]), float(where[which]))
    return Margin(float(slacks[which]), int(wall.leg[row[which]]), instant, wall.name)


Slacks = tuple[FloatArray, IntArray, IntArray, FloatArray]
"""Least slacks, and of each the wall, the piece, and where on [0, 1] it is."""


def _flat_slacks(traj: Trajectory, wall: Walls) -> Slacks:
    """Least distance to all planes; one entry, or none."""
    excess, row, piece = wall.excess(traj)
    if not len(row):
        return np.zeros(0), row, piece, np.zeros(0)
    bound, which, s = maximum(excess.points, excess.errors)
    return np.array([0.0 - bound]), row[[which]], piece[[which]], np.array([s])


def _round_slacks(traj: Trajectory, wall: Walls) -> Slacks:
    """Least distances to balls or cones."""
    polynomials, row, piece = wall.excess(traj)
    highest = maxima(polynomials.points, polynomials.errors)
    slacks = _distances(wall.radius[row], highest.bounds)
    if wall.slope.any():  # the opposite nappe of the cone has the same squares
        reach = wall.reach(traj)
        slacks = np.minimum(slacks, -maxima(-reach.points, reach.errors).bounds)
    return slacks, row, piece, highest.where


def _distances(radius: FloatArray, excess: FloatArray) -> FloatArray:
    """Return radius - sqrt(radius^2 + excess), or what is a little less, without cancellation."""
    square = radius**2 + excess + 4.0 * UNIT * (radius**2 + np.abs(excess))
    slacks = -excess / (radius + np.sqrt(np.maximum(square, 0.0)))
    return np.minimum(slacks - 8.0 * UNIT * np.abs(slacks), radius)


def _margin(traj: Trajectory, wall: Walls, extremum: native.Extremum) -> Margin:
    """Margin from the native core's greatest excess."""
    if extremum.bound == -np.inf:
        return Margin(np.inf, 0, 0.0, wall.name)
    row, part = divmod(extremum.row, traj.pieces)
    leg = int(wall.leg[row])
    return Margin(0.0 - extremum.bound, leg, _instant(traj, leg * traj.pieces + part, extremum.where), wall.name)


def _instant(traj: Trajectory, piece: int, s: float) -> float:
    return float(traj.breaks[piece] + s * traj.durations[piece])


def margin_holds(traj: Trajectory, wall: Walls, margin: float) -> bool:
    """Whether a trajectory is proved to keep a margin to a block of walls over all time."""
    if margin == float("inf"):
        return not len(wall.leg)
    return all(is_never_negative(p) for p in (_planes if wall.flat else _rounds)(traj, wall, Fraction(margin)))


def norm_holds(traj: Trajectory, order: int, largest: float) -> bool:
    """Whether the norm of a derivative is proved never to exceed a value."""
    square = Fraction(largest) ** 2
    return all(
        is_never_negative([square - value for value in squared_norm(_derivative(traj, piece, order))])
        for piece in range(len(traj.durations))
    )


def _derivative(traj: Trajectory, piece: int, order: int) -> Curve:
    return derivative(exact(traj.control_points[piece]), Fraction(float(traj.durations[piece])), order)


def _on_pieces(traj: Trajectory, wall: Walls) -> Iterator[tuple[int, Curve]]:
    """Iterate over the walls on each piece of their legs: the wall and the derivative relative to its anchor."""
    for row, leg in enumerate(wall.leg.tolist()):
        for piece in range(leg * traj.pieces, (leg + 1) * traj.pieces):
            yield row, relative(_derivative(traj, piece, wall.order), wall.anchor[row])


def _planes(traj: Trajectory, wall: Walls, margin: Fraction) -> Iterator[Scalar]:
    """Distances to planes, less the margin."""
    for row, curve in _on_pieces(traj, wall):
        left = Fraction(float(wall.radius[row])) - margin
        yield [left + value for value in along(curve, wall.slope[row])]


def _rounds(traj: Trajectory, wall: Walls, margin: Fraction) -> Iterator[Scalar]:
    """Squared radii less the margin, less squared norms; for cones less what the radius grows by, and the reach."""
    for row, curve in _on_pieces(traj, wall):
        radius = Fraction(float(wall.radius[row]))
        square = squared_norm([along(curve, normal) for normal in wall.matrix[row]])
        yield [radius - margin]
        reach = [radius + value for value in along(curve, wall.slope[row])]
        if wall.slope.any():
            yield [value - margin for value in reach]
        grown = squared_norm([reach])
        yield [(radius - margin) ** 2 - radius**2 + a - b for a, b in zip(grown, square, strict=True)]
