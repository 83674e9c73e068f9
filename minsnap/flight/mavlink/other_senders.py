"""Whether others send setpoints to a vehicle too, by what it says that it is asked for (POSITION_TARGET_LOCAL_NED)."""

from __future__ import annotations

import math
from collections import deque

from minsnap.flight.mavlink.stream_options import STREAM
from minsnap.flight.mavlink.vehicle_messages import Vector, VehicleState


class OtherSenders:
    """Compares what a vehicle is asked for with what was sent here.

    A vehicle that gets setpoints of two programs follows now one and now the other, so several that are not ours within
    a while are enough. Autopilots carry the position that they are asked for on with its velocity.
    """

    def __init__(self) -> None:
        self._sent: deque[tuple[float, Vector, float]] = deque()
        self._strange: deque[float] = deque()
        self._last = -math.inf

    def sent(self, now: float, position: Vector, speed: float) -> None:
        """Take note of a setpoint that has left, and of its speed [m/s]."""
        self._sent.append((now, position, speed))
        while now - self._sent[0][0] > STREAM.foreign_within:
            self._sent.popleft()

    def silent(self) -> None:
        """Take note that nothing is sent here: while an autopilot takes off, its targets are its own."""
        self._sent.clear()

    def heard(self, vehicle: VehicleState, follows: bool) -> str | None:
        """Return what others ask for, in words, or None; called whenever the vehicle has said something."""
        if vehicle.target is None or vehicle.targeted <= self._last:
            return None
        self._last = vehicle.targeted
        while self._strange and vehicle.targeted - self._strange[0] > STREAM.foreign_within:
            self._strange.popleft()
        away = self._away(vehicle.target)
        if not follows or not math.isfinite(away):  # of another mode, or nothing was sent lately
            self._strange.clear()
        elif away > 0.0:
            self._strange.append(vehicle.targeted)
        if len(self._strange) < STREAM.foreign_times or away <= 0.0:
            return None
        x, y, z = vehicle.target
        return f"another program sends setpoints to this vehicle too: it is asked for ({x:.1f}, {y:.1f}, {z:.1f})"

    def _away(self, target: Vector) -> float:
        """Return how far beyond what is allowed a position is from all that was sent [m]; infinite if nothing was."""
        beyond = [math.dist(place, target) - STREAM.foreign - STREAM.carried * speed for _, place, speed in self._sent]
        return min(beyond, default=math.inf)
