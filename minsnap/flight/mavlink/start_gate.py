"""Where a flight may begin: from the ground, or at rest at its start, as nearly as the vehicle hovers there.

A vehicle whose estimate is noisy wanders in its hover. One that has stayed around its start for a while without leaving
is as near to it as it will ever be, and how far it wanders is what it is given.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

import numpy as np

from minsnap.flight.mavlink.setpoints import Setpoints
from minsnap.flight.mavlink.stream_options import STREAM, SafetyRules
from minsnap.flight.mavlink.vehicle_messages import Vector, VehicleState


@dataclass(frozen=True)
class HoverSettings:
    """What is taken for a hover that gets no nearer to the start, and how far it may be from it.

    Parameters
    ----------
    time : float
        How long it has lasted [s].
    least : int
        Positions that have come meanwhile, at least.
    off : float
        Greatest distance of their mean from the start [m].
    drift : float
        Greatest mean velocity [m/s].
    spread : float
        How many times its root mean square distance from the mean the vehicle may be from it.
    distance, speed : float
        Beyond which no hover is wide enough [m], [m/s].
    """

    time: float = 5.0
    least: int = 20
    off: float = 0.3
    drift: float = 0.1
    spread: float = 2.0
    distance: float = 0.5
    speed: float = 0.6


HOVER = HoverSettings()


class Hover:
    """How a vehicle hovers around its start, from what it reports."""

    def __init__(self) -> None:
        self._seen: deque[tuple[float, Vector, Vector]] = deque()

    def see(self, now: float, vehicle: VehicleState) -> None:
        """Take note of a position, if a new one has come."""
        if vehicle.position is None or vehicle.velocity is None:
            return
        if not self._seen or vehicle.positioned > self._seen[-1][0]:
            self._seen.append((vehicle.positioned, vehicle.position, vehicle.velocity))
        while self._seen and now - self._seen[1 if len(self._seen) > 1 else 0][0] > HOVER.time:
            self._seen.popleft()

    def forget(self) -> None:
        """Begin anew, for a vehicle that does not follow."""
        self._seen.clear()

    def gate(self, rules: SafetyRules, start: Vector) -> tuple[float, float]:
        """Return within which distance of the start [m] and below which speed [m/s] the flight may begin."""
        narrow = rules.settled_distance, rules.settled_speed
        lasted = self._seen[-1][0] - self._seen[0][0] if self._seen else 0.0
        if len(self._seen) < HOVER.least or lasted < 0.9 * HOVER.time:
            return narrow
        places, speeds = np.array([row[1] for row in self._seen]), np.array([row[2] for row in self._seen])
        off, drift = math.dist(places.mean(axis=0), start), float(np.linalg.norm(speeds.mean(axis=0)))
        if off > HOVER.off or drift > HOVER.drift:
            return narrow
        wander = HOVER.spread * math.sqrt(float(((places - places.mean(axis=0)) ** 2).sum(axis=1).mean()))
        haste = HOVER.spread * math.sqrt(float((speeds**2).sum(axis=1).mean()))
        return min(max(narrow[0], off + wander), HOVER.distance), min(max(narrow[1], haste), HOVER.speed)


def begins_on_ground(table: Setpoints, vehicle: VehicleState) -> bool:
    """Return whether a flight begins on the ground: it climbs first, and the vehicle stands there.

    How high the ground is says the vehicle's estimate, which may be off the file's by some decimetres.
    """
    if vehicle.position is None or not vehicle.landed or table.climb < STREAM.least_climb:
        return False
    return abs(vehicle.position[2] - table.start.position[2]) <= STREAM.ground
