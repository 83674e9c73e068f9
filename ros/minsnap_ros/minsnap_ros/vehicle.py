"""What an autopilot says of the vehicle: whether it follows setpoints, and is at rest where a plan begins."""

from __future__ import annotations

from typing import Any

import numpy as np

from minsnap.flight.mavlink.stream_options import SafetyRules

RULES = SafetyRules()
"""Distances, speed and times at the start of a flight, as ``minsnap stream`` has them."""


class Vehicle:
    """The last status and position of the vehicle, in ENU.

    Attributes
    ----------
    name : str
        Who reports them, for messages.
    follows : bool
        Whether it is armed and in the mode that follows setpoints.
    position : ndarray or None
        Its last valid position (3,) [m].
    """

    name = "the autopilot"

    def __init__(self) -> None:
        self.follows = False
        self.position: np.ndarray | None = None
        self._moving = True
        self._settled_since: float | None = None

    def take_status(self, status: Any) -> None:
        """Take a message of the autopilot's mode."""
        raise NotImplementedError

    def take_position(self, message: Any) -> None:
        """Take a message of the vehicle's position and velocity."""
        raise NotImplementedError

    def place(self, position: np.ndarray | None, speed: float) -> None:
        """Keep a position (3,) [m], None where it is not valid, and a speed [m/s]."""
        self.position, self._moving = position, speed > RULES.settled_speed

    def far(self, start: np.ndarray) -> str:
        """Return why no setpoint of a waiting plan may be sent, or nothing: the vehicle would fly to its start."""
        if self.position is None:
            return f"{self.name} reports no valid local position: no setpoint is sent"
        distance = float(np.linalg.norm(start[:2] - self.position[:2]))
        if distance <= RULES.max_start_distance:
            return ""
        return f"the vehicle is {distance:.2f} m beside the plan's first point: no setpoint is sent"

    def settled(self, start: np.ndarray, now: float) -> bool:
        """Return whether it follows setpoints and has been at rest at a plan's start for long enough [s]."""
        there = self.follows and self.position is not None and not self._moving
        if not there or np.linalg.norm(start - self.position) > RULES.settled_distance:
            self._settled_since = None
            return False
        self._settled_since = now if self._settled_since is None else self._settled_since
        return now - self._settled_since >= RULES.settle_time
