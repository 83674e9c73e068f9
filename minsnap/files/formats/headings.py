"""Headings in files: constants, polynomials, and rules by which a heading follows from the curve."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from minsnap.errors import FileError
from minsnap.files.formats.pieces import from_powers, yaw_powers
from minsnap.trajectory.heading import ConstantHeading, Heading
from minsnap.trajectory.look_at import LookAt
from minsnap.trajectory.planned_heading import PlannedHeading
from minsnap.trajectory.tilt_heading import TiltHeading
from minsnap.trajectory.trajectory import Trajectory
from minsnap.trajectory.velocity_heading import VelocityHeading


def yaw_description(trajectory: Trajectory) -> dict[str, Any]:
    """Return the heading of a trajectory as plain numbers, text and lists.

    Raises
    ------
    YawError
        If it is no constant, follows from the curve by no rule, and is no polynomial to a milliradian.
    """
    heading = trajectory.yaw
    if heading.constant is not None:
        return {"angle": heading.constant}
    rule = heading_rule(trajectory)
    if rule is not None:
        return rule
    planned = planned_yaw(trajectory)
    return {"durations": planned.durations.tolist(), "control_points": planned.control_points.tolist()}


def heading_rule(trajectory: Trajectory) -> dict[str, Any] | None:
    """Return the description of a heading that follows from the curve by a rule; None for any other."""
    return trajectory.yaw.rule(trajectory)


def planned_yaw(trajectory: Trajectory) -> Trajectory:
    """Return the yaw as polynomials: itself where it is one, else what follows it to a milliradian."""
    planned: Trajectory | None = trajectory.yaw.polynomial
    if planned is not None:
        return planned
    powers = yaw_powers(trajectory, max(trajectory.degree, 7))
    return from_powers(trajectory.durations, powers[:, :, None], None)


def headed(curve: Trajectory, content: Mapping[str, Any]) -> Trajectory:
    """Give a curve the heading that a file describes."""
    if "rule" not in content:
        return curve.with_yaw(_heading(content))
    if content["rule"] == "velocity":
        return curve.with_yaw(VelocityHeading(curve, content["yaw_rate"], content["hold_below"]))
    if content["rule"] == "tilt":
        linear, quadratic = content.get("drag", (0.0, 0.0))
        drag = float(linear), float(quadratic)
        return curve.with_yaw(TiltHeading(curve, float(content["angle_at_start"]), float(content["gravity"]), drag))
    if content["rule"] == "look at":
        return curve.with_yaw(LookAt(content["point"]).heading(curve))
    raise FileError(f"no heading is called {str(content['rule'])[:40]!r}: there are velocity, tilt and look at")


def _heading(content: Mapping[str, Any]) -> Heading:
    if "angle" in content:
        angle = float(content["angle"])
        if not np.isfinite(angle):
            raise FileError(f"the yaw is {angle}: it must be finite")
        return ConstantHeading(angle)
    points, durations = (np.array(content[name], dtype=np.float64) for name in ("control_points", "durations"))
    return PlannedHeading(Trajectory(points, durations))
