"""Plans as messages: a trajectory, a path to display, setpoints of PX4; and waypoints from a path."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

import numpy as np
from builtin_interfaces.msg import Duration
from geometry_msgs.msg import PoseStamped, Transform, Twist
from nav_msgs.msg import Path
from trajectory_msgs.msg import MultiDOFJointTrajectory, MultiDOFJointTrajectoryPoint

from minsnap import Samples
from minsnap.files import multidof

ELEMENTS = {
    "points": MultiDOFJointTrajectoryPoint,
    "transforms": Transform,
    "velocities": Twist,
    "accelerations": Twist,
    "time_from_start": Duration,
}
"""The types of what lies in a list, by the name of the field."""


def filled(message: Any, values: Mapping[str, Any]) -> Any:
    """Return a message with the fields that a nested dictionary names."""
    for name, value in values.items():
        if isinstance(value, Mapping):
            filled(getattr(message, name), value)
        elif isinstance(value, list) and value and isinstance(value[0], Mapping):
            setattr(message, name, [filled(ELEMENTS[name](), element) for element in value])
        else:
            setattr(message, name, value)
    return message


def trajectory_message(samples: Samples, stamp: Any, frame_id: str) -> MultiDOFJointTrajectory:
    """Return the plan; ``stamp`` is the instant of its time 0."""
    message = filled(MultiDOFJointTrajectory(), multidof(samples, frame_id))
    message.header.stamp = stamp
    return message


def path_message(samples: Samples, stamp: Any, frame_id: str) -> Path:
    """Return the plan's positions and headings."""
    message = Path()
    message.header.stamp, message.header.frame_id = stamp, frame_id
    for point in multidof(samples, frame_id)["points"]:
        pose = PoseStamped()
        pose.header.frame_id = frame_id
        filled(pose.pose.position, point["transforms"][0]["translation"])
        filled(pose.pose.orientation, point["transforms"][0]["rotation"])
        message.poses.append(pose)
    return message


def position_of(stamped: PoseStamped) -> list[float]:
    """Return a pose's position [m]."""
    position = stamped.pose.position
    return [position.x, position.y, position.z]


def px4_topic(way: str, kind: type) -> str:
    """Return the topic of a message of px4_msgs, ``in`` to PX4 or ``out`` of it; versions above 0 are in its name."""
    name = re.sub("(?<!^)(?=[A-Z])", "_", kind.__name__).lower()
    version = getattr(kind, "MESSAGE_VERSION", 0)
    return f"/fmu/{way}/{name}" + (f"_v{version}" if version else "")


def setpoint_message(message: Any, row: np.void, microseconds: int) -> Any:
    """Return a px4_msgs/TrajectorySetpoint with a row of :func:`minsnap.files.px4_setpoints`."""
    for name in row.dtype.names:
        setattr(message, name, microseconds if name == "timestamp" else np.asarray(row[name]).tolist())
    return message
