"""Independent proof of margins, in exact rational arithmetic on the stored numbers."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction

from minsnap.corridors.constraint import Walls
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
