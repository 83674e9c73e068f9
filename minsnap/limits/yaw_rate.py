"""The largest yaw rate of a trajectory over all time: exact for the headings that plans have, however they were cut."""

from __future__ import annotations

import numpy as np

from minsnap.trajectory.heading import ConstantHeading, JoinedHeading, RemappedHeading
from minsnap.trajectory.look_at import LookAtHeading
from minsnap.trajectory.path import Heading
from minsnap.trajectory.planned_heading import PlannedHeading
from minsnap.trajectory.tilt_heading import TiltHeading
from minsnap.trajectory.trajectory import Trajectory
from minsnap.trajectory.turn_rates import largest_heading_rate, largest_look_rate
from minsnap.trajectory.velocity_heading import VelocityHeading

SAMPLES = 200
"""Samples per leg of a yaw rate that is no polynomial and no quotient of polynomials."""

Largest = tuple[float, float]
"""A rate [rad/s], and the instant at which it is reached [s]."""


def largest_yaw_rate(traj: Trajectory) -> tuple[float, float, str]:
    """Largest yaw rate [rad/s], its instant [s], and how it was found, ``"exact"`` or ``"sampled"``."""
    found = _largest(traj.yaw, 0.0, traj.duration)
    return _sampled(traj) if found is None else (*found, "exact")


def _largest(heading: Heading, start: float, end: float) -> Largest | None:
    """Largest rate of a heading between two instants of its clock; None where it has no exact measure."""
    if isinstance(heading, RemappedHeading):
        first, last = sorted(heading.start + heading.rate * t for t in (start, end))
        found = _largest(heading.heading, first, last)
        return None if found is None else (found[0] * abs(heading.rate), (found[1] - heading.start) / heading.rate)
    if isinstance(heading, JoinedHeading):
        return _largest_joined(heading, start, end)
    if isinstance(heading, (ConstantHeading, TiltHeading)):
        return 0.0, start
    if isinstance(heading, PlannedHeading):
        return _largest_planned(heading.trajectory, start, end)
    if isinstance(heading, VelocityHeading) and isinstance(heading.path, Trajectory):
        return largest_heading_rate(heading, heading.path, start, end)
    if isinstance(heading, LookAtHeading) and isinstance(heading.path, Trajectory):
        return largest_look_rate(heading, heading.path, start, end)
    return None


def _largest_joined(heading: JoinedHeading, start: float, end: float) -> Largest | None:
    switch, parts = heading.switch, []
    if start < switch:
        parts.append(_largest(heading.first, start, min(end, switch)))
    if end >= switch:
        after = _largest(heading.second, max(start - switch, 0.0), end - switch)
        parts.append(None if after is None else (after[0], after[1] + switch))
    known = [part for part in parts if part is not None]
    return max(known) if len(known) == len(parts) else None


def _largest_planned(yaw: Trajectory, start: float, end: float) -> Largest:
    """Of a polynomial yaw: of its rate's control points, which keep their digits where little of a piece is left."""
    if start <= 0.0 and end >= yaw.duration:
        return yaw.max_norm(1)
    first, last = (min(max(t, 0.0), yaw.duration) for t in (start, end))
    if first >= last:
        return float(np.abs(yaw(last, 1)).max()), last
    value, instant = yaw.derivative(1).between(first, last).max_norm(0)
    return value, first + instant


def _sampled(traj: Trajectory) -> tuple[float, float, str]:
    grid = traj.breaks[:-1, None] + traj.durations[:, None] * np.linspace(0.0, 1.0, SAMPLES)
    instants = np.minimum(grid.reshape(-1), traj.duration)
    rates = np.abs(traj.yaw(instants, 1))
    return float(rates.max()), float(instants[rates.argmax()]), "sampled"
