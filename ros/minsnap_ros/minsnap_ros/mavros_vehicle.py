"""PX4 or ArduPilot over MAVROS, by mavros_msgs: everything is in ENU, which MAVROS maps to the autopilot's axes."""

from __future__ import annotations

from typing import Any

import numpy as np

from minsnap import Samples
from minsnap_ros.vehicle import Vehicle

MODES = ("OFFBOARD", "GUIDED")
"""Names of the modes of PX4 and of ArduPilot that follow setpoints (mavros_msgs/State)."""

STATE, ODOMETRY, SETPOINT = "/mavros/state", "/mavros/local_position/odom", "/mavros/setpoint_raw/local"
"""Topics; remap them where MAVROS has another namespace."""

LOCAL = 1
"""FRAME_LOCAL_NED of mavros_msgs/PositionTarget: the local frame, which MAVROS takes in ENU."""


class MavrosVehicle(Vehicle):
    """What MAVROS says of the vehicle."""

    name = "MAVROS"

    def take_status(self, status: Any) -> None:
        """Take a mavros_msgs/State."""
        self.follows = bool(status.connected and status.armed and status.mode in MODES)

    def take_position(self, message: Any) -> None:
        """Take a nav_msgs/Odometry, whose velocity is in the body's axes: only its size is used."""
        place, speed = message.pose.pose.position, message.twist.twist.linear
        position = np.array([place.x, place.y, place.z], dtype=np.float64)
        known = bool(np.isfinite(position).all())
        self.place(position if known else None, float(np.linalg.norm([speed.x, speed.y, speed.z])))


def position_target(message: Any, state: Samples, frame_id: str, stamp: Any) -> Any:
    """Return a mavros_msgs/PositionTarget with all that a sample has, up to the acceleration."""
    message.header.frame_id, message.header.stamp = frame_id, stamp
    message.coordinate_frame, message.type_mask = LOCAL, 0
    parts = {"position": state.position, "velocity": state.velocity, "acceleration_or_force": state.acceleration}
    for name, rows in parts.items():
        vector = getattr(message, name)
        vector.x, vector.y, vector.z = (float(value) for value in rows[0])
    message.yaw, message.yaw_rate = float(state.yaw[0]), float(state.yaw_rate[0])
    return message
