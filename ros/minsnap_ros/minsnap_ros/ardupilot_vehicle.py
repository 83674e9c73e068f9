"""ArduCopter over its own DDS client (AP_DDS), by ardupilot_msgs: everything is in ENU about home.

ArduPilot 4.5 to 4.7 takes velocities and rates of yaw (``/ap/cmd_vel``), and positions by latitude and longitude alone.
So the velocity that is sent is that of the plan and, in proportion, what the position is off it, as in the autopilot's
own controller of positions. Where ardupilot_msgs has LocalPosition (ArduPilot's pull request 31812, not released by
July 2026), position, velocity and acceleration are sent as they are planned.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from minsnap import Samples
from minsnap_ros.vehicle import Vehicle

STATUS, POSE = "/ap/status", "/ap/pose/filtered"
VELOCITY, SETPOINT = "/ap/cmd_vel", "/ap/cmd_loc_pose"
"""Topics; remap them where the client has another namespace."""

COPTER, GUIDED = 2, 4
"""APM_ARDUCOPTER of ardupilot_msgs/Status, and the number of ArduCopter's mode that follows setpoints."""

WORLD = "map"
"""Frame that AP_DDS takes for ENU, whatever the plan's own is called."""

GAIN = 1.0
"""Velocity for each metre off the plan [1/s], as ArduCopter's PSC_NE_POS_P is by default, and for each radian."""

FASTEST = 1.0
"""Greatest velocity that is added to the plan's [m/s]."""

OLD = 0.5
"""Time between two poses after which they tell no speed [s]."""


class ArdupilotVehicle(Vehicle):
    """What AP_DDS says of the vehicle.

    Attributes
    ----------
    yaw : float
        [rad].
    """

    name = "ArduPilot"

    def __init__(self) -> None:
        super().__init__()
        self.yaw = 0.0
        self._stamp = -math.inf

    def take_status(self, status: Any) -> None:
        """Take an ardupilot_msgs/Status."""
        self.follows = bool(status.vehicle_type == COPTER and status.armed and status.mode == GUIDED)

    def take_position(self, message: Any) -> None:
        """Take a geometry_msgs/PoseStamped; it has no velocity, which is that from the pose before."""
        place, turn = message.pose.position, message.pose.orientation
        position = np.array([place.x, place.y, place.z], dtype=np.float64)
        stamp = message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec
        since, before = stamp - self._stamp, self.position
        if not np.isfinite(position).all():
            self.place(None, math.inf)
            return
        moved = math.inf if before is None else float(np.linalg.norm(position - before))
        self.place(position, moved / since if 0.0 < since <= OLD else math.inf)
        self._stamp = stamp
        self.yaw = math.atan2(2.0 * (turn.w * turn.z + turn.x * turn.y), 1.0 - 2.0 * (turn.y**2 + turn.z**2))


def velocity_command(message: Any, state: Samples, vehicle: ArdupilotVehicle, stamp: Any) -> Any:
    """Return a geometry_msgs/TwistStamped that leads the vehicle along the plan; at rest while its place is unknown."""
    speed, turning = np.zeros(3), 0.0
    if vehicle.position is not None:
        off = GAIN * (state.position[0] - vehicle.position)
        off *= min(1.0, FASTEST / max(float(np.linalg.norm(off)), 1e-9))
        speed = state.velocity[0] + off
        turning = float(state.yaw_rate[0]) + GAIN * math.remainder(float(state.yaw[0]) - vehicle.yaw, 2.0 * math.pi)
    message.header.frame_id, message.header.stamp = WORLD, stamp
    linear = message.twist.linear
    linear.x, linear.y, linear.z = (float(value) for value in speed)
    message.twist.angular.z = turning
    return message


def local_setpoint(message: Any, state: Samples, stamp: Any) -> Any:
    """Return an ardupilot_msgs/LocalPosition with all that a sample has, up to the acceleration."""
    message.header.frame_id, message.header.stamp, message.type_mask = WORLD, stamp, 0
    message.x, message.y, message.z = (float(value) for value in state.position[0])
    for name, rows in (("velocity", state.velocity), ("acceleration_or_force", state.acceleration)):
        linear = getattr(message, name).linear
        linear.x, linear.y, linear.z = (float(value) for value in rows[0])
    message.yaw, message.yaw_rate = float(state.yaw[0]), float(state.yaw_rate[0])
    return message
