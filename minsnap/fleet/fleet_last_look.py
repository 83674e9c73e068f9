"""The last look at a fleet before it leaves: all conditions on its vehicles, alone and together.

It judges the trajectories that are returned, with their headings, by their control points alone. Of the knots and the
times that the search had in mind it takes nothing over.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from minsnap.basics.arrays import FloatArray, IntArray
from minsnap.basics.tolerances import EXACT
from minsnap.corridors.boxes import Boxes
from minsnap.fleet.common_clock import Fleet
from minsnap.fleet.fleet_certificate import FleetCertificate, certify_fleet
from minsnap.fleet.fleet_limits import extent_of
from minsnap.fleet.fleet_task import FleetTask
from minsnap.time_allocation.last_look import fault_as_one_leg
from minsnap.trajectory.trajectory import Trajectory

HALF = 4
"""Derivatives 0 ... k - 1 are continuous, and prescribed at both ends."""


def fleet_fault(task: FleetTask, fleet: Fleet, threads: int) -> str | None:
    """Return which condition a fleet does not keep, or None.

    Parameters
    ----------
    task : FleetTask
    fleet : Fleet
        With the headings; its first vehicles are those that were planned.
    threads : int
    """
    planned = [fleet[vehicle] for vehicle in range(len(task))]
    duration = planned[0].duration if task.total_time is None else task.total_time
    for vehicle, curve in enumerate(planned):
        wrong = next(_faults_alone(task, vehicle, curve, duration), None)
        if wrong is not None:
            return f"vehicle {vehicle}: {wrong}"
    together = certify_fleet(fleet, task.separation, None, task.room, task.avoid, threads=threads)
    return _broken_limit(task, fleet) or (None if together.ok else _fault_together(together))


def _faults_alone(task: FleetTask, vehicle: int, curve: Trajectory, duration: float) -> Iterator[str]:
    """Yield what one vehicle does not keep, but for limits."""
    points, holds = task.waypoints[vehicle], task.holds_of(vehicle)
    fault = fault_as_one_leg(curve, points[[0, -1]], task.states[vehicle], HALF, duration)
    boxes = task.corridors[vehicle] if task.corridors else None
    if fault is not None:
        yield fault
    if len(points) == 2 and boxes is None and not holds.any():
        return
    knots = passed_knots(curve, points)
    if knots is None:
        yield "it does not pass all of its waypoints in their order"
        return
    short = curve.breaks[knots[:, 1]] - curve.breaks[knots[:, 0]] < holds - EXACT * curve.duration
    if short.any():
        yield f"it does not rest at waypoint {int(short.argmax())} for {holds[short.argmax()]:.9g} s"
    for leg in () if boxes is None else _outside_of(boxes, curve, knots):
        yield f"it leaves the box of leg {leg}"


def passed_knots(curve: Trajectory, points: FloatArray) -> IntArray | None:
    """Return the knots at which a curve arrives at each waypoint and leaves it, (n, 2); None where it misses one."""
    resting = (curve.control_points == curve.control_points[:, :1]).all(axis=(1, 2))
    places = np.concatenate((curve.control_points[:, 0], curve.control_points[-1:, -1]))
    moves = np.append(np.flatnonzero(~resting), len(resting))
    knots, next_one = [], 0
    for point in points[:-1]:
        here = next_one + np.flatnonzero((places[next_one:] == point).all(axis=1))
        if not len(here):
            return None
        leaves = int(moves[np.searchsorted(moves, here[0])])
        knots.append((int(here[0]), leaves))
        next_one = leaves + 1
    arrives = int(moves[-2]) + 1 if len(moves) > 1 else 0
    return np.array([*knots, (arrives, len(resting))]) if (places[-1] == points[-1]).all() else None


def _outside_of(boxes: Boxes, curve: Trajectory, knots: IntArray) -> Iterator[int]:
    """Yield legs in which a curve is not proved to be inside of their box."""
    for leg in range(len(knots) - 1):
        least, most = extent_of(curve.control_points[knots[leg, 0] : knots[leg + 1, 0]])
        if (least < boxes.lower[leg] - EXACT).any() or (most > boxes.upper[leg] + EXACT).any():
            yield leg


def _broken_limit(task: FleetTask, fleet: Fleet) -> str | None:
    if task.limits is None:
        return None
    for used in certify_fleet(fleet[: len(task)], limits=task.limits).utilisation:
        if not used.kept:
            own = used.use
            return (
                f"vehicle {used.vehicle}: {own.name} reaches {own.value:.9g} at {own.instant:.4g} s where "
                f"{own.limit:.9g} is allowed"
            )
    return None


def _fault_together(certificate: FleetCertificate) -> str:
    if certificate.room_margin is not None and certificate.room_margin < -EXACT:
        return f"vehicle {int(np.argmin(certificate.room_margins))} leaves the room by {-certificate.room_margin:.3g} m"  # type: ignore[arg-type]
    if certificate.clearance is not None and certificate.clearance < -EXACT:
        return f"vehicle {int(np.argmin(certificate.clearances))} is {-certificate.clearance:.3g} m inside an obstacle"  # type: ignore[arg-type]
    return (
        f"vehicles {certificate.pair} come as near as {certificate.least_distance:.9g} m at {certificate.instant:.4g} s"
    )
