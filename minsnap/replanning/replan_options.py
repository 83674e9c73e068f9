"""Checks of the questions of a Replanner."""

from __future__ import annotations

from typing import Any

from minsnap.basics.arrays import FloatArray
from minsnap.basics.checks import check_array, check_degree, is_number, is_whole
from minsnap.basics.messages import shown
from minsnap.errors import DegreeError, InputError, YawError
from minsnap.limits.limits import Limits, check_limits
from minsnap.optimisation.planned_yaw import ChosenHeading, chosen_heading
from minsnap.vehicle import Quadrotor

LEAST_HALF = 4
"""Jerk is taken over at the splice, so that polynomials have degree 7 at least."""


def check_half(degree: Any) -> int:
    """Return k of a degree 2k - 1; DegreeError for one that cannot take over the jerk."""
    half = check_degree(degree)
    if half < LEAST_HALF:
        raise DegreeError(f"degree {degree} cannot take over the jerk at a splice: use 7, 9 or 11")
    return half


def all_limits(limits: Limits | None, vehicle: Quadrotor | None) -> Limits | None:
    """Return limits with those of a vehicle."""
    if limits is not None:
        check_limits(limits)
    if vehicle is None:
        return limits
    others: dict[str, Any] = {} if limits is None else {**limits.given(), "norm": limits.norm}
    return Limits.of(vehicle, **others)


def replan_heading(yaw: Any, limits: Limits | None) -> ChosenHeading | None:
    """Return the function that gives a curve its heading; None where the heading is held."""
    if yaw is None:
        return None
    if not isinstance(yaw, str) and not is_number(yaw):
        raise YawError(f"yaw is {shown(yaw)}: give an angle [rad], 'velocity' or 'tilt', or nothing to hold it")
    return chosen_heading(yaw, 1, False, limits)


def waypoint_angles(yaw: Any, legs: int) -> FloatArray | None:
    """Return one angle for each waypoint ahead (legs,) [rad]; None without angles."""
    if yaw is None:
        return None
    give = (
        f"one finite angle [rad] for each of the {legs} waypoints ahead; the Replanner itself takes an angle, "
        "'velocity' or 'tilt'"
    )
    return check_array("yaw", yaw, ((legs,),), give, YawError)


def check_horizon(horizon: Any) -> int | None:
    """Return a number of legs, or None for all."""
    if horizon is not None and not (is_whole(horizon) and horizon >= 1):
        raise InputError(f"horizon is {shown(horizon)}: give a number of legs, 1 or more")
    return None if horizon is None else int(horizon)
