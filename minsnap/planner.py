"""plan: the one call that ties waypoints, durations, corridor and solver together."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from time import perf_counter

import numpy as np
import numpy.typing as npt

from minsnap.arrays import FloatArray
from minsnap.checks import (
    check_closing,
    check_continuity,
    check_degree,
    check_pieces,
    check_pins,
)
from minsnap.corridors.constraint import Constraint
from minsnap.corridors.gates import Ball, Gate
from minsnap.corridors.knot_regions import place
from minsnap.corridors.precheck import check_reach
from minsnap.corridors.room import Room, as_room
from minsnap.corridors.tubes import as_constraints
from minsnap.errors import YawError
from minsnap.limits.limits import Limits
from minsnap.optimisation.problem import Task
from minsnap.optimisation.qp import check_solver
from minsnap.optimisation.solve import solve
from minsnap.time_allocation.allocate import plan_timed
from minsnap.time_allocation.least_cost import Progress
from minsnap.time_allocation.timed import Timed, Timing
from minsnap.trajectory.heading import PlannedHeading, VelocityHeading, shortest_turns
from minsnap.trajectory.path import ConstantHeading, Heading
from minsnap.trajectory.report import Report
from minsnap.trajectory.trajectory import Trajectory


def plan(
    waypoints: npt.ArrayLike | Sequence[npt.ArrayLike | Gate] | None,
    durations: npt.ArrayLike | None = None,
    total_time: float | None = None,
    limits: Limits | None = None,
    corridor: npt.ArrayLike | Constraint | Sequence[Constraint] | None = None,
    continuity: int | None = None,
    degree: int = 7,
    yaw: float | str | npt.ArrayLike | None = None,
    start: Mapping[str, npt.ArrayLike] | None = None,
    end: Mapping[str, npt.ArrayLike] | None = None,
    closed: bool = False,
    solver: str = "auto",
    *,
    pins: Mapping[int, Mapping[str, npt.ArrayLike]] | None = None,
    split: str = "optimal",
    time_weight: float | None = None,
    enforce: str = "qp",
    progress: Progress | None = None,
    pieces: int = 1,
    room: Room | Sequence[npt.ArrayLike] | None = None,
    waypoint_tolerance: npt.ArrayLike | Ball | None = None,
    samples: int | None = None,
    certify: bool = True,
) -> Trajectory:
    r"""Plan the curve through waypoints that minimises the integral of the squared k-th derivative.

    With degree 2k - 1 = 7 that derivative is snap (D. Mellinger and V. Kumar, "Minimum snap trajectory generation and
    control for quadrotors", ICRA 2011).  A corridor holds at every instant, not only at samples.

    Parameters
    ----------
    waypoints : array_like, shape (n, dim), sequence with Gates among them, or None
        Positions to pass through [m], n >= 2; a ``Gate`` is passed anywhere in its opening. With None the curve
        passes from set to set through their overlaps; the corridor is then ``Boxes`` or ``Polytopes``, and ``start``
        and ``end`` give positions.
    durations : array_like, shape (n - 1,), optional
        Seconds a leg.
    total_time : float, optional
        Seconds for all legs, split by ``split``.
    limits : Limits, optional
        What must not be exceeded at any instant; alone, the shortest time found that keeps them.
    corridor : float, array_like, Constraint or sequence of Constraint, optional
        Half-width of a ``Tube`` around each leg [m], one or one a leg; or constraints, which all hold.
    continuity : int, optional
        Derivatives continuous at the knots; k - 1 unless given (3 for degree 7), at most 2k - 2.
    degree : int
        2k - 1: 3, 5, 7, 9 or 11.
    yaw : float, array_like of shape (n,), "velocity", optional
        Constant yaw [rad]; one a waypoint, turned the shortest way with least angular acceleration; or along the
        velocity.  Zero unless given.
    start, end : mapping, optional
        Derivatives at the ends, such as ``{"velocity": (1, 0, 0)}`` [m/s]; those up to order k - 1 that are not
        named are zero. Without waypoints also the ``"position"`` [m].
    closed : bool
        A closed lap: the state at the end is the state at the start, and free.
    solver : str
        A QP solver by its qpsolvers name, or ``"auto"``.
    pins : mapping, optional
        Derivatives at inner waypoints: ``{2: {"velocity": (1, 0, 0)}}``.
    split : {"optimal", "distance", "trapezoid"}
        How the time is split over the legs: so that the cost (with ``limits`` alone: the time) is least, by their
        lengths, or as a speed that rises and falls within limits.
    time_weight : float, optional
        Minimise cost + time_weight * time over the durations (Richter et al. 2013), instead of fixing a total.
    enforce : {"qp", "scaling"}
        How ``limits`` alone are kept: as walls of the QP, so that long legs cruise at the limit, or only by the time
        scale of plans that do not know them.
    progress : callable, optional
        Called with a ``Step`` at every evaluation of a search; Ctrl-C ends a search with the best plan it has.
    pieces : int
        Polynomials a leg.
    room : Room or (lower, upper), optional
        Two corners of a box that holds on all legs [m], such as ``((-4, -4, 0), (4, 4, 6))``.
    waypoint_tolerance : float, array_like of shape (n,) or (n, dim), or Ball, optional
        Half-width of the box around a waypoint within which the curve may pass [m], or the ball; one number is for the
        inner waypoints, the ends stay pinned.
    samples : int, optional
        With ``certify=False``: instants a leg at which the corridor holds, as in the thesis; 20 unless given.
    certify : bool
        Keep the corridor at every instant (the default) or at samples only.

    Returns
    -------
    Trajectory
        With a ``report`` of how it was found.

    Raises
    ------
    WaypointError, TimingError, CorridorError, DegreeError, YawError, UnknownSolverError
        If an argument is malformed; each is a ValueError.
    InfeasibleError
        If no curve meets everything: says which leg and the smallest width that would do.
    SolverError
        If every solver failed on a problem that has a solution.
    """
    began = perf_counter()
    constraints = as_constraints(corridor) + as_room(room)
    placement = place(waypoints, waypoint_tolerance, constraints, start, end, closed)
    points, half = placement.points, check_degree(degree)
    task = Task(
        points,
        placement.lower,
        placement.upper,
        pins=check_pins(pins, placement.start, placement.end, closed, half, points),
        half=half,
        continuity=check_continuity(continuity, half),
        closed=check_closing(closed, points),
        pieces=check_pieces(pieces),
        walls=[wall for constraint in constraints for wall in constraint.walls(points) if len(wall.leg)],
        solver=check_solver(solver),
        regions=placement.regions,
    )
    check_reach(placement, task.pins, task.walls, task.closed)
    timing = Timing(durations, total_time, limits, split, time_weight, enforce, progress)
    timed = plan_timed(task, timing, lambda curve: curve.told(_heading(yaw, curve, closed), None), samples, certify)
    return timed.trajectory.told(timed.trajectory.yaw, _report(timed, limits, 1e3 * (perf_counter() - began)))


def _report(timed: Timed, limits: Limits | None, milliseconds: float) -> Report:
    outcome = timed.solved.outcome
    return Report(
        outcome.solver,
        outcome.rounds,
        0 if outcome.rows is None else len(outcome.rows),
        timed.cost,
        timed.solved.corridor_margin,
        milliseconds,
        outcome.fallback,
        () if limits is None else limits.utilisation(timed.trajectory),
        timed.steps,
        timed.interrupted,
    )


def _heading(yaw: float | str | npt.ArrayLike | None, trajectory: Trajectory, closed: bool) -> Heading:
    if yaw is None:
        return ConstantHeading()
    if isinstance(yaw, str):
        if yaw != "velocity":
            raise YawError(f"yaw is {yaw!r}: give an angle [rad], one a waypoint, or 'velocity'")
        return VelocityHeading(trajectory)
    try:
        angles = np.array(yaw, dtype=np.float64)
    except (TypeError, ValueError):
        raise YawError(f"yaw is {yaw!r}: give an angle [rad], one a waypoint, or 'velocity'") from None
    if not np.isfinite(angles).all():
        raise YawError("yaw must be finite [rad]")
    if angles.ndim == 0:
        return ConstantHeading(float(angles))
    if angles.shape != (trajectory.legs + 1,):
        raise YawError(
            f"yaw has shape {angles.shape}: give one angle, or one for each of {trajectory.legs + 1} waypoints"
        )
    return PlannedHeading(_planned_yaw(shortest_turns(angles), np.diff(trajectory.leg_breaks), closed))


def _planned_yaw(angles: FloatArray, durations: FloatArray, closed: bool) -> Trajectory:
    """Yaw through angles (n,) with least integral of squared angular acceleration: a cubic spline."""
    column = angles[:, None]
    ends = {} if closed else {0: {1: np.zeros(1)}, len(angles) - 1: {1: np.zeros(1)}}
    zero = np.zeros(column.shape)
    return solve(Task(column, zero, zero, ends, 2, 1, closed, 1, (), "auto"), durations).trajectory
