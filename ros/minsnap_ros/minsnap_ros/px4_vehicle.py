"""What PX4 says of the vehicle: whether it follows setpoints, and whether it is at rest where a plan begins."""

from __future__ import annotations

from typing import Any

import numpy as np

from minsnap.files.frames import map_vectors
from minsnap.flight.mavlink.stream_options import SafetyRules

OFFBOARD, ARMED = 14, 2
"""NAVIGATION_STATE_OFFBOARD and ARMING_STATE_ARMED of px4_msgs/VehicleStatus."""

RULES = SafetyRules()
"""Distances, speed and times at the start of a flight, as ``minsnap stream`` has them."""


class Px4Vehicle:
    """The last status and position of the vehicle.

    Attributes
    ----------
    follows : bool
        Whether it is armed and in offboard mode.
    """

    def __init__(self) -> None:
        self.follows = False
        self._position: np.ndarray | None = None
        self._moving = True
        self._settled_since: float | None = None

    def take_status(self, status: Any) -> None:
        """Take a px4_msgs/VehicleStatus."""
        self.follows = status.nav_state == OFFBOARD and status.arming_state == ARMED

    def take_position(self, message: Any) -> None:
        """Take a px4_msgs/VehicleLocalPosition."""
        valid = message.xy_valid and message.z_valid and message.v_xy_valid and message.v_z_valid
        ned = np.array([[message.x, message.y, message.z]], dtype=np.float64)
        self._position = map_vectors(ned, "ned", "enu")[0] if valid else None
        self._moving = np.linalg.norm([message.vx, message.vy, message.vz]) > RULES.settled_speed

    def far(self, start: np.ndarray) -> str:
        """Return why no setpoint of a waiting plan may be sent, or nothing: the vehicle would fly to its start."""
        if self._position is None:
            return "PX4 reports no valid local position: no setpoint is sent"
        distance = float(np.linalg.norm(start[:2] - self._position[:2]))
        if distance <= RULES.max_start_distance:
            return ""
        return f"the vehicle is {distance:.2f} m beside the plan's first point: no setpoint is sent"

    def settled(self, start: np.ndarray, now: float) -> bool:
        """Return whether it follows setpoints and has been at rest at a plan's start for long enough [s]."""
        there = self.follows and self._position is not None and not self._moving
        if not there or np.linalg.norm(start - self._position) > RULES.settled_distance:
            self._settled_since = None
            return False
        self._settled_since = now if self._settled_since is None else self._settled_since
        return now - self._settled_since >= RULES.settle_time
