"""Safety rules that refuse or stop a flight; each compares the vehicle's messages with the expected state."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from minsnap.errors import InputError
from minsnap.flight.mavlink.autopilot import Autopilot
from minsnap.flight.mavlink.vehicle_state import Vector, VehicleState

FRESH = 0.5
"""A position older than this does not say where the vehicle is [s]."""

LEAST_ABORT = 2.0
"""Abort distance of slow flights [m]."""

LAG_ROOM = 1.5
"""Abort distance of fast ones, in expected lags: gusts and corners add to it."""


@dataclass(frozen=True)
class SafetyRules:
    """Bounds beyond which a flight is refused or stopped.

    Parameters
    ----------
    max_start_distance : float
        Between the vehicle and the first setpoint [m]; infinity flies without knowing where the vehicle is.
    abort_distance : float or None
        Between the vehicle and where it is to be during the flight [m]; None: what fits its lag, 2 m at least.
    link_timeout : float
        Silence of the vehicle, or of its position once it has reported one [s]. A vehicle that sends nothing but
        heartbeats, one per second, is given ``heartbeat_timeout``.
    heartbeat_timeout : float
        Time without a heartbeat, and so without knowing the mode [s].
    max_gap : float
        Between two setpoints that leave here during the flight [s]. PX4 takes a stream that pauses for COM_OF_LOSS_T
        (1 s) for lost and follows it again when it comes back, so the rest must not be flown.
    settled_distance, settled_speed, settle_time : float
        The flight begins when the vehicle has been this near to the start [m] and this slow [m/s] for this long [s].

    Raises
    ------
    InputError
        If a bound is not positive.
    """

    max_start_distance: float = 1.0
    abort_distance: float | None = None
    link_timeout: float = 1.0
    heartbeat_timeout: float = 3.0
    max_gap: float = 0.5
    settled_distance: float = 0.15
    settled_speed: float = 0.2
    settle_time: float = 1.0

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if value is not None and not value > 0:
                raise InputError(f"{name} is {value}: a safety bound must be positive")

    @property
    def farthest(self) -> float:
        """The abort distance; the least one by default [m]."""
        return LEAST_ABORT if self.abort_distance is None else self.abort_distance

    def fitting(self, lag: float) -> SafetyRules:
        """Return rules whose abort distance leaves room for a vehicle that lags behind by ``lag`` [m]."""
        if self.abort_distance is not None:
            return self
        return replace(self, abort_distance=max(LEAST_ABORT, LAG_ROOM * lag))

    def lag_refusal(self, speed: float, delay: float) -> str | None:
        """Return why a flight that lags by ``delay`` [s] at a speed [m/s] would be stopped by its lag, or None."""
        lag = speed * delay
        if lag < self.farthest:
            return None
        return (
            f"this plan will lag {lag:.1f} m behind at {speed:.1f} m/s ({delay:.2g} s): an abort distance of "
            f"{self.farthest:g} m would stop it; allow {LAG_ROOM * lag:.1f} m, or plan it slower"
        )

    def start_refusal(self, vehicle: VehicleState, start: Vector, on_the_ground: bool = False) -> str | None:
        """Return the reason why the vehicle must not start, or None.

        Parameters
        ----------
        vehicle : VehicleState
            Where it is.
        start : tuple of 3
            The first setpoint.
        on_the_ground : bool
            True before it takes off: its height does not count yet.
        """
        if math.isinf(self.max_start_distance):
            return None
        if vehicle.position is None:
            return "the vehicle does not report LOCAL_POSITION_NED, so its distance to the start is unknown"
        place = (*start[:2], vehicle.position[2]) if on_the_ground else start
        distance = vehicle.distance(place)
        if distance <= self.max_start_distance:
            return None
        return f"the vehicle is {distance:.2f} m from the start, more than the {self.max_start_distance:g} m allowed"

    def unsettled(self, vehicle: VehicleState, start: Vector) -> str | None:
        """Return the reason why the vehicle is not at rest at the start yet, or None; None also without bounds."""
        if math.isinf(self.max_start_distance):
            return None
        distance, speed = vehicle.distance(start), vehicle.speed
        if distance > self.settled_distance:
            return f"the vehicle is {distance:.2f} m from the start, not within {self.settled_distance:g} m"
        return None if speed <= self.settled_speed else f"the vehicle still moves at {speed:.2f} m/s"

    def stall(self, gap: float) -> str | None:
        """Return a message if the stream paused too long before a setpoint of the flight, else None."""
        if gap <= self.max_gap:
            return None
        return f"no setpoint left this program for {gap:.2f} s, more than the {self.max_gap:g} s allowed"

    def breach(self, now: float, vehicle: VehicleState, setpoint: Vector, autopilot: Autopilot) -> str | None:
        """Return a message that names the rule broken at ``now``, or None."""
        if not autopilot.follows(vehicle):
            return f"the vehicle left {autopilot.mode}"
        silence = self.heartbeat_timeout if vehicle.position is None else self.link_timeout
        if now - vehicle.heard > silence:
            return f"the link was silent for {silence:g} s"
        if now - vehicle.heartbeat > self.heartbeat_timeout:
            return f"no heartbeat for {self.heartbeat_timeout:g} s: the vehicle's mode is not known any more"
        if vehicle.position is None:
            return None
        if now - vehicle.positioned > self.link_timeout:
            return f"the vehicle's position was not reported for {self.link_timeout:g} s"
        error = vehicle.distance(setpoint) if now - vehicle.positioned <= FRESH else 0.0
        if error > self.farthest:
            return f"the vehicle was {error:.2f} m from its setpoint, more than the {self.farthest:g} m allowed"
        return None
