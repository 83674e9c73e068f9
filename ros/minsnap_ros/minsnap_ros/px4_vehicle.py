"""PX4 over its DDS bridge, by px4_msgs."""

from __future__ import annotations

from typing import Any

import numpy as np

from minsnap.files.frames import map_vectors
from minsnap_ros.vehicle import Vehicle

OFFBOARD, ARMED = 14, 2
"""NAVIGATION_STATE_OFFBOARD and ARMING_STATE_ARMED of px4_msgs/VehicleStatus."""


class Px4Vehicle(Vehicle):
    """What PX4 says of the vehicle."""

    name = "PX4"

    def take_status(self, status: Any) -> None:
        """Take a px4_msgs/VehicleStatus."""
        self.follows = status.nav_state == OFFBOARD and status.arming_state == ARMED

    def take_position(self, message: Any) -> None:
        """Take a px4_msgs/VehicleLocalPosition."""
        valid = message.xy_valid and message.z_valid and message.v_xy_valid and message.v_z_valid
        ned = np.array([[message.x, message.y, message.z]], dtype=np.float64)
        speed = float(np.linalg.norm([message.vx, message.vy, message.vz]))
        self.place(map_vectors(ned, "ned", "enu")[0] if valid else None, speed)
