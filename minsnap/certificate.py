"""certify: what holds of a trajectory at every instant, whoever made it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import perm
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from minsnap.corridors.constraint import Constraint, Walls
from minsnap.corridors.gates import Ball, Gate
from minsnap.corridors.knot_regions import Placement, place
from minsnap.corridors.tubes import as_constraints
from minsnap.errors import InputError, WaypointError
from minsnap.polynomials.bernstein import differentiate
from minsnap.polynomials.extrema import maximum
from minsnap.trajectory.trajectory import Trajectory

if TYPE_CHECKING:
    from minsnap.limits.limits import Limits
    from minsnap.trajectory.report import Utilisation

EXACT = 1e-9
"""Error, relative to the size of the curve, below which a waypoint counts as met and a limit as kept."""

ROUNDING = 4.0 * float(np.finfo(np.float64).eps)
"""Error of a control point, relative to the largest, that differentiation magnifies."""


@dataclass(frozen=True)
class Margin:
    """How far a trajectory stays from a wall, at the place where it comes nearest.

    Parameters
    ----------
    value : float
        Least distance to the wall, in the wall's unit; negative outside.
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


@dataclass(frozen=True, eq=False)
class Certificate:
    """What holds of a trajectory over all time, exact to rounding.

    Parameters
    ----------
    ok : bool
        Everything that was asked holds.
    corridor_margin : float or None
        Least distance to a wall [m], negative outside; None if no corridor was asked about.
    nearest : Margin or None
        Where that is.
    waypoint_error : float or None
        Largest distance to a waypoint at its instant [m]; None without waypoints.
    max_speed, max_acceleration, max_jerk, max_snap : float
        Largest Euclidean norms over all time.
    continuity : int
        Highest order up to which derivatives are continuous at all knots, to ``EXACT`` of their size.
    utilisation : tuple of Utilisation
        How far each limit is used; empty without limits.
    waypoint_excess : float or None
        Largest distance outside of where a waypoint's box, ball or gate lets it pass [m], 0 inside; None without
        waypoints.
    """

    ok: bool
    corridor_margin: float | None
    nearest: Margin | None
    waypoint_error: float | None
    max_speed: float
    max_acceleration: float
    max_jerk: float
    max_snap: float
    continuity: int
    utilisation: tuple[Utilisation, ...] = ()
    waypoint_excess: float | None = None


def certify(
    traj: Trajectory,
    waypoints: npt.ArrayLike | Sequence[npt.ArrayLike | Gate] | None = None,
    corridor: npt.ArrayLike | Constraint | Sequence[Constraint] | None = None,
    limits: Limits | None = None,
    tolerance: npt.ArrayLike | Ball = 0.0,
) -> Certificate:
    """Say what holds, exactly, of any trajectory.

    Parameters
    ----------
    traj : Trajectory
        From ``plan`` or from anywhere else.
    waypoints : array_like, shape (legs + 1, dim), or sequence with Gates among them, optional
        What it should pass through; the corridor runs between them. Its own knots unless given.
    corridor : float, array_like, Constraint or sequence of Constraint, optional
        Half-widths of a ``Tube`` [m], or constraints.
    limits : Limits, optional
        What it should not exceed.
    tolerance : float, array_like or Ball
        How far from its waypoints it may be [m], as ``plan`` takes it for ``waypoint_tolerance``.

    Returns
    -------
    Certificate

    Raises
    ------
    WaypointError
        If the number or the dimension of the waypoints is not that of the trajectory.
    """
    if not isinstance(traj, Trajectory):
        raise InputError(f"certify takes a Trajectory, not {type(traj).__name__}")
    placement = None if waypoints is None else _matching(traj, place(waypoints, tolerance, (), None, None, False))
    positions = traj(traj.leg_breaks)
    points = positions if placement is None else placement.points
    walls = [wall for constraint in as_constraints(corridor) for wall in constraint.walls(points)]
    nearest = nearest_wall(traj, walls)
    error = None if placement is None else float(np.linalg.norm(positions - points, axis=1).max())
    excess = None if placement is None else float(placement.outside(positions).max())
    size = float(np.abs(points).max()) or 1.0
    utilisation = () if limits is None else limits.utilisation(traj)
    ok = (
        (nearest is None or nearest.value >= 0.0)
        and (placement is None or excess is None or (excess <= EXACT * size and _crossed(traj, placement)))
        and all(used.fraction <= 1.0 + EXACT for used in utilisation)
    )
    speed, acceleration, jerk, snap = (traj.max_norm(order)[0] for order in (1, 2, 3, 4))
    margin = None if nearest is None else nearest.value
    return Certificate(
        bool(ok), margin, nearest, error, speed, acceleration, jerk, snap, _continuity(traj), utilisation, excess
    )


def nearest_wall(traj: Trajectory, walls: Sequence[Walls]) -> Margin | None:
    """Exact least distance to the walls over all time; None where there are none."""
    return min((margin_to(traj, wall) for wall in walls if len(wall.leg)), key=lambda m: m.value, default=None)


def margin_to(traj: Trajectory, wall: Walls) -> Margin:
    """Exact least distance to one block of walls over all time."""
    cones = wall.cones
    excess, row, piece = cones.excess(traj)
    if not len(excess):
        return Margin(np.inf, 0, 0.0, wall.name)
    value, which, s = maximum(excess)
    slack = cones.least_slack(int(row[which]), float(value))
    return Margin(slack, int(cones.leg[row[which]]), _instant(traj, int(piece[which]), s), wall.name)


def _instant(traj: Trajectory, piece: int, s: float) -> float:
    return float(traj.breaks[piece] + s * traj.durations[piece])


def _continuity(traj: Trajectory) -> int:
    """Highest order up to which both sides of every knot agree, but for the rounding of their control points."""
    if len(traj.durations) == 1:
        return traj.degree
    size = np.abs(traj.control_points).max()
    shorter = np.minimum(traj.durations[1:], traj.durations[:-1])
    for order in range(traj.degree + 1):
        points = differentiate(traj.control_points, order) / traj.durations[:, None, None] ** order
        jump = np.abs(points[1:, 0] - points[:-1, -1]).max(axis=1)
        rounding = ROUNDING * size * perm(traj.degree, order) * (2.0 / shorter) ** order
        if (jump > EXACT * np.abs(points).max() + rounding).any():
            return order - 1
    return traj.degree


def _crossed(traj: Trajectory, placement: Placement) -> bool:
    """Whether every gate that asks for a direction is crossed in it, to rounding."""
    velocity = traj(traj.leg_breaks, 1)
    size = float(np.linalg.norm(velocity, axis=1).max())
    asked = ((k, region.crossing) for k, region in placement.regions.items() if region.crossing is not None)
    return all(float(velocity[k] @ crossing) >= -EXACT * size for k, crossing in asked)


def _matching(traj: Trajectory, placement: Placement) -> Placement:
    if placement.points.shape != (traj.legs + 1, traj.dim):
        raise WaypointError(
            f"a trajectory of {traj.legs} legs and {traj.dim} coordinates has waypoints of shape "
            f"({traj.legs + 1}, {traj.dim}), not {placement.points.shape}"
        )
    return placement
