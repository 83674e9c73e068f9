"""certify: what holds of a trajectory at every instant, whoever made it.

Everything is judged from the stored numbers, with running error bounds on the very operations done: a margin is never
more than the exact one, a greatest speed never less.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from math import perm
from typing import TYPE_CHECKING, Any

import numpy as np

from minsnap.basics.arrays import ArrayLike, FloatArray, ReadOnly
from minsnap.basics.cards import Facts, card
from minsnap.basics.checks import check_number
from minsnap.basics.messages import explains_names
from minsnap.basics.tolerances import EXACT
from minsnap.corridors.constraint import Constraint, Walls, walls_of
from minsnap.corridors.gates import Ball
from minsnap.corridors.given_waypoints import as_knots, without_gates
from minsnap.corridors.keep_out import Avoided, as_obstacles
from minsnap.corridors.knot_regions import STORED, Placement, knot_positions, passing, place
from minsnap.corridors.margins import Margin, margin_holds, nearest_wall, norm_holds
from minsnap.corridors.obstacle_margins import ObstacleMargin, clearance_holds, nearest_obstacle
from minsnap.corridors.tubes import as_constraints
from minsnap.errors import InputError, WaypointError
from minsnap.native import proved_extrema as native
from minsnap.polynomials.bernstein import differentiate
from minsnap.polynomials.enclosures import UNIT
from minsnap.trajectory.path import Path
from minsnap.trajectory.report import norm_facts, path_drawings
from minsnap.trajectory.trajectory import Trajectory

if TYPE_CHECKING:
    from minsnap.limits.limits import Limits
    from minsnap.trajectory.report import Utilisation
    from minsnap.vehicle import Loop
    from minsnap.vehicle_tube import VehicleTube

STEPS_BELOW = 16.0 * 5e-324
"""Rounding of positions below the smallest normal number, which are whole steps of 5e-324 [m]."""


@dataclass(frozen=True, eq=False)
class Certificate(ReadOnly):
    """Bounds of a trajectory over all time, proved, and exact to rounding.

    Parameters
    ----------
    ok : bool
        All conditions hold.
    corridor_margin : float or None
        Least distance to a wall [m], negative outside; None without a corridor. The exact distance is not less.
    nearest : Margin or None
        Where and when the curve is that near.
    waypoint_error : float or None
        Largest distance to a waypoint at its instant [m], on either side of its knot; None without waypoints.
    max_speed, max_acceleration, max_jerk, max_snap : float
        Largest Euclidean norms over all time. The exact ones are not more.
    continuity : int
        Highest order up to which derivatives are continuous at all knots, to ``EXACT`` of their size.
    utilisation : tuple of Utilisation
        How far each limit is used; empty without limits.
    waypoint_excess : float or None
        Largest distance outside the box, ball or gate of a waypoint [m], 0 inside; None without waypoints.
    limits : Limits or None
        The limits that were checked.
    trajectory : Trajectory
        The trajectory that was checked.
    walls : tuple of Walls
        The walls of the corridor.
    waypoints : ndarray, shape (legs + 1, dim), or None
        The waypoints that were checked [m].
    nearest_obstacle : ObstacleMargin or None
        Which obstacle the curve comes nearest to, and when; None without obstacles.
    obstacles : tuple of Obstacle
        The obstacles that were checked.
    vehicle : VehicleTube or None
        Where the vehicle can be in its control loop; None without ``tracking``.
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
    utilisation: tuple[Utilisation, ...]
    waypoint_excess: float | None
    limits: Limits | None = field(repr=False)
    trajectory: Trajectory = field(repr=False)
    walls: tuple[Walls, ...] = field(repr=False)
    waypoints: FloatArray | None = field(repr=False)
    nearest_obstacle: ObstacleMargin | None = None
    obstacles: tuple[Avoided, ...] = field(default=(), repr=False)
    vehicle: VehicleTube | None = field(default=None, repr=False)

    @property
    def tube(self) -> float | None:
        """Largest tracking error that the loop can have [m], infinite where it saturates; None without ``tracking``.

        The sum of the lag behind the plan in still air and of what the wind can do: upper bounds of both.
        """
        return None if self.vehicle is None else self.vehicle.error

    @property
    def wind(self) -> float | None:
        """Largest change of the wind at which the vehicle keeps all that is asked [m/s]; None without ``tracking``.

        0 where it leaves even in still air.
        """
        return None if self.vehicle is None else self.vehicle.strongest

    @property
    def obstacle_margin(self) -> float | None:
        """Least distance to an obstacle [m], negative inside; None without obstacles. The exact distance is not less.

        Near edges and ellipsoids the exact one may be more.
        """
        return None if self.nearest_obstacle is None else self.nearest_obstacle.value

    @property
    def limits_from(self) -> float:
        """First instant from which all limits are kept to the end [s]; 0 where they always are, and without limits."""
        if self.limits is None:
            return 0.0
        from minsnap.limits.compliance import kept_from

        return kept_from(self.limits, self.trajectory)

    def verify(self) -> bool:
        """Prove margins, greatest norms and waypoint error again, in exact rational arithmetic of the stored numbers.

        Slow: some milliseconds per leg and wall. False means that a figure does not hold, or that the curve touches it
        at an instant that no halving reaches.
        """
        norms = (self.max_speed, self.max_acceleration, self.max_jerk, self.max_snap)
        margin, near = self.corridor_margin, self.nearest_obstacle
        return (
            (margin is None or all(margin_holds(self.trajectory, wall, margin) for wall in self.walls))
            and (near is None or all(clearance_holds(self.trajectory, each, near.value) for each in self.obstacles))
            and all(norm_holds(self.trajectory, order, norm) for order, norm in enumerate(norms, 1))
            and self._waypoints_hold()
        )

    def _repr_html_(self) -> str:
        """Return the card of a notebook: the path, and the figures of the certificate."""
        verdict = "Certificate: all conditions hold" if self.ok else "Certificate: not all conditions hold"
        return card(verdict, self._facts(), path_drawings(self.trajectory), good=self.ok)

    def _facts(self) -> Facts:
        near, error, excess = self.nearest, self.waypoint_error, self.waypoint_excess
        norms = (self.max_speed, self.max_acceleration, self.max_jerk, self.max_snap)
        where = "" if near is None else f", least on leg {near.leg} at {near.instant:.4g} s"
        beside = self.nearest_obstacle
        return [
            ("corridor margin", None if self.corridor_margin is None else f"{self.corridor_margin:.3g} m{where}"),
            ("obstacle margin", None if beside is None else f"{beside.value:.3g} m, least at {beside.instant:.4g} s"),
            ("waypoint error", None if error is None else f"{error:.3g} m"),
            ("outside of waypoints", f"{excess:.3g} m" if excess else None),
            *_vehicle_facts(self.vehicle),
            *norm_facts(norms),
            ("continuous derivatives", str(self.continuity)),
            *(used.fact for used in self.utilisation),
        ]

    def _waypoints_hold(self) -> bool:
        if self.waypoints is None or self.waypoint_error is None:
            return True
        square = Fraction(self.waypoint_error) ** 2
        pairs = zip(knot_positions(self.trajectory).tolist(), [self.waypoints.tolist()] * 2, strict=True)
        return all(
            sum((Fraction(a) - Fraction(b)) ** 2 for a, b in zip(position, point, strict=True)) <= square
            for positions, points in pairs
            for position, point in zip(positions, points, strict=True)
        )


def _vehicle_facts(vehicle: VehicleTube | None) -> Facts:
    """Return the facts of a vehicle in its loop; none without one."""
    if vehicle is None:
        return []
    kept = "keeps all of it" if vehicle.ok else str(vehicle.fault)
    return [
        ("tracking error", f"{vehicle.error:.3g} m at most in a wind that changes by {vehicle.wind:g} m/s: {kept}"),
        ("strongest wind", f"{vehicle.strongest:.3g} m/s of change"),
    ]


@explains_names({"obstacles": "avoid=", "gates": "waypoints=, with the gates among them"})
def certify(
    traj: Trajectory | Path,
    waypoints: ArrayLike | Sequence[object] | None = None,
    corridor: ArrayLike | Constraint | Sequence[object] | None = None,
    limits: Limits | None = None,
    tolerance: ArrayLike | Ball = 0.0,
    limits_from: float = 0.0,
    avoid: Avoided | Sequence[Avoided] | None = None,
    tracking: Loop | None = None,
    wind: float = 0.0,
) -> Certificate:
    """Check a trajectory at every instant, and return exact bounds.

    Parameters
    ----------
    traj : Trajectory or Path
        From ``plan`` or any other source. A shape is checked by polynomials within a micrometre of it.
    waypoints : array_like, shape (legs + 1, dim), or sequence with Gates among them, optional
        Waypoints to pass through; the corridor runs between them. By default the knots of the trajectory.
    corridor : float, array_like, Constraint or sequence of Constraint, optional
        Half-widths of a ``Tube`` [m], or constraints.
    limits : Limits, optional
        Limits to check.
    tolerance : float, array_like or Ball
        Allowed distance from the waypoints [m], as ``waypoint_tolerance`` of ``plan``.
    limits_from : float
        Instant from which the limits hold [s]: ``report.limits_from`` of a plan that starts outside of them.
    avoid : obstacle or sequence of obstacles, optional
        Obstacles to keep out of, as ``plan`` takes them.
    tracking : Loop, optional
        Control loop of the vehicle, which must then keep corridor, gates, obstacles, thrust and tilt, too.
    wind : float
        With ``tracking``: largest change of the wind from what it is at the start [m/s].

    Returns
    -------
    Certificate

    Raises
    ------
    VehicleError
        If ``tracking`` is no loop, or the wind is given without one.
    WaypointError
        If the number or the dimension of the waypoints is not that of the trajectory.
    CorridorError
        If an obstacle is none.
    """
    if not isinstance(traj, Path):
        raise InputError(f"certify takes a Trajectory or a shape, not {type(traj).__name__}")
    curve: Trajectory = traj.as_trajectory()
    placement = None if waypoints is None else _matching(curve, place(as_knots(waypoints, tolerance), ()))
    points = None if placement is None else placement.points
    walls = tuple(walls_of(as_constraints(corridor), knot_positions(curve)[1] if points is None else points))
    nearest = nearest_wall(curve, walls)
    margin = None if nearest is None else nearest.value
    error = None if points is None else _waypoint_error(curve, points)
    excess, met = (None, True) if placement is None else passing(curve, placement)
    utilisation = () if limits is None else _use(limits, curve, limits_from)
    if curve is not traj:
        utilisation = tuple(replace(used, leg=None) for used in utilisation)
    obstacles = as_obstacles(avoid)
    beside = nearest_obstacle(curve, obstacles) if obstacles else None
    holds = met and (margin is None or margin >= 0.0) and all(used.kept for used in utilisation)
    holds = holds and (beside is None or beside.value >= -EXACT)
    vehicle = None
    if tracking is not None or wind:
        vehicle = _in_loop(tracking, wind, curve, walls, without_gates(waypoints)[1], obstacles, limits)
        holds = holds and vehicle.ok
    speed, acceleration, jerk, snap = (norm for norm, _ in curve.max_norms((1, 2, 3, 4)))
    known = continuity(curve), utilisation, excess, limits, curve, walls, points, beside, obstacles, vehicle
    return Certificate(holds, margin, nearest, error, speed, acceleration, jerk, snap, *known)


def _in_loop(tracking: Any, wind: float, curve: Trajectory, *kept: Any) -> VehicleTube:
    """Return the tube of a vehicle in its loop; ``kept`` are walls, gates, obstacles and limits."""
    from minsnap.vehicle_tube import check_dimensions, check_tracking, vehicle_tube

    change = check_tracking(tracking, wind)
    check_dimensions(curve)
    return vehicle_tube(tracking, change, curve, *kept)


def _use(limits: Limits, traj: Trajectory, limits_from: float) -> tuple[Utilisation, ...]:
    """Use of the limits from an instant on."""
    from minsnap.limits.compliance import use_from
    from minsnap.limits.limits import check_limits

    give = f"give an instant from 0 to below {traj.duration:g} s"
    start = check_number("limits_from", limits_from, 0.0, float(np.nextafter(traj.duration, 0.0)), give)
    check_limits(limits)
    return use_from(limits, traj, start)


def _waypoint_error(traj: Trajectory, points: FloatArray) -> float:
    """Largest distance to a waypoint, not less than the exact one."""
    offset = np.abs(knot_positions(traj) - points)
    size = float(offset.max())
    if size == 0.0:
        return 0.0
    distance = np.sqrt(((offset / size) ** 2).sum(axis=2)).max()
    return float(np.nextafter(size * distance * (1.0 + (traj.dim + 10) * UNIT), np.inf))


def continuity(traj: Trajectory) -> int:
    """Highest order up to which both sides of every knot agree, but for the rounding of their control points."""
    orders = native.continuity(traj.control_points, traj.durations, EXACT, STORED)
    return _continuity(traj) if orders is None else orders


def _continuity(traj: Trajectory) -> int:
    """Highest order up to which both sides of every knot agree, but for the rounding of their control points."""
    if len(traj.durations) == 1:
        return traj.degree
    least, relative = STORED * np.abs(traj.control_points).max(), traj.control_points - traj.control_points[0, 0]
    shorter = np.minimum(traj.durations[1:], traj.durations[:-1])
    for order in range(traj.degree + 1):
        points = differentiate(relative, order) / traj.durations[:, None, None] ** order
        jump = np.abs(points[1:, 0] - points[:-1, -1]).max(axis=1)
        rounding = max(least, STEPS_BELOW) * perm(traj.degree, order) * (2.0 / shorter) ** order
        if (jump > EXACT * np.abs(points).max() + rounding).any():
            return order - 1
    return traj.degree


def _matching(traj: Trajectory, placement: Placement) -> Placement:
    if placement.points.shape != (traj.legs + 1, traj.dim):
        raise WaypointError(
            f"a trajectory of {traj.legs} legs and {traj.dim} coordinates has waypoints of shape "
            f"({traj.legs + 1}, {traj.dim}), not {placement.points.shape}"
        )
    return placement
