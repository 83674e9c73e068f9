"""Options, status and report of a streamed flight."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from minsnap.errors import InputError, TimingError
from minsnap.flight.mavlink.autopilot import AUTOPILOTS
from minsnap.flight.mavlink.compensation import FeedForward
from minsnap.flight.mavlink.safety import SafetyRules
from minsnap.flight.mavlink.schedule import Lateness
from minsnap.flight.mavlink.sequence import Phase
from minsnap.flight.mavlink.setpoints import Setpoint
from minsnap.flight.mavlink.vehicle_state import VehicleState

ON_ABORT = ("hold", "land", "rtl")
"""What a flight may do after a rule has stopped it."""


@dataclass(frozen=True)
class StreamOptions:
    """Options of a flight: everything except path and link.

    Parameters
    ----------
    rate : float or None
        Setpoints a second [Hz]; None for the samples' own.
    fields : sequence of str or None
        Which of position, velocity, acceleration, yaw, yaw_rate; None for all that the source has.
    frame : str or None
        Of a file that does not say so itself (by default ``enu``), and with it the vehicle's: enu and ned fly in NED;
        flu, frd and optitrack in the room's z-down twin.
    laps : int
        How often.
    autopilot : str
        ``auto`` (by its heartbeat), ``px4``, ``ardupilot`` or ``generic``.
    trigger : str or callable
        ``mode``: go when the vehicle enters the mode in which it follows setpoints. ``now``: go as soon as it is in it.
        A callable is called once a slot and lets go, for good, by returning True; the vehicle must be in the mode as
        well.
    relative : bool
        Start where the vehicle is: its x and y are those of the first setpoint, at the source's own height.
    relative_height : bool
        Count the vehicle's height as well. Not with ``arm``: a vehicle on the ground has to climb first.
    arm : bool
        Change the vehicle's mode and arm it. Without it, neither is ever done.
    land : bool
        Land at the end instead of holding until stopped.
    on_abort : str
        When a rule has stopped the flight: ``hold`` until the mode is left, ``land``, or ``rtl`` (return to launch).
    rules : SafetyRules
        When to refuse and when to stop.
    prestream : float
        How long the start is streamed at least before the flight [s].
    wait : float
        For the first heartbeat, for the first position, and for arming [s].
    give_up : float
        A hold ends when the vehicle has been silent for so long [s].
    log : path or None
        Where to log.
    feed_forward : FeedForward
        What is added to the file's setpoints to offset drag and delay.
    delay : float or None
        Of the vehicle's position after its setpoint, as ``fit`` finds it [s]: tells how far it will lag behind. None:
        that of the feed-forward's vehicle, or what is usual for the autopilot.
    stays : bool
        Stay at the end for changes to come, until :meth:`~minsnap.flight.mavlink.streaming.Streamer.finish`.
    fastest : float
        Speed of changes to come [m/s]: the abort distance fits the lag at this speed too.

    Raises
    ------
    TimingError
        If the rate is one at which the autopilot would not stay in its mode, or the prestream is shorter than 2 s.
    InputError
        If ``on_abort`` is unknown, ``give_up`` is not positive, or ``relative_height`` goes with ``arm``.
    """

    rate: float | None = None
    fields: Sequence[str] | None = None
    frame: str | None = None
    laps: int = 1
    autopilot: str = "auto"
    trigger: str | Callable[[], bool] = "mode"
    relative: bool = False
    relative_height: bool = False
    arm: bool = False
    land: bool = False
    on_abort: str = "hold"
    rules: SafetyRules = field(default_factory=SafetyRules)
    prestream: float = 2.0
    wait: float = 30.0
    give_up: float = 30.0
    log: str | os.PathLike[str] | None = None
    feed_forward: FeedForward = field(default_factory=FeedForward)
    delay: float | None = None
    stays: bool = False
    fastest: float = 0.0

    def __post_init__(self) -> None:
        if not self.prestream >= 2.0:
            raise TimingError(
                f"prestream is {self.prestream} s: autopilots need the first setpoint for at least 2 s before"
            )
        if self.on_abort not in ON_ABORT:
            raise InputError(f"on_abort is {self.on_abort!r}: choose {', '.join(ON_ABORT[:-1])} or {ON_ABORT[-1]}")
        if self.delay is not None and not 0.0 <= self.delay < math.inf:
            raise InputError(f"the delay is {self.delay} s: it must be 0 or more")
        if not self.give_up > 0:
            raise InputError(f"give_up is {self.give_up} s: it must be positive")
        if self.relative_height and (self.arm or not self.relative):
            raise InputError("the vehicle's height is an origin only in flight: use it with relative, not with arm")

    def check_rate(self, rate: float) -> None:
        """Raise TimingError if setpoints at this rate would not keep the autopilot in its mode."""
        stacks = AUTOPILOTS.values() if self.autopilot == "auto" else [AUTOPILOTS[self.autopilot]]
        lowest = max(stack.lowest_rate for stack in stacks)
        if rate < lowest:
            name = "PX4" if self.autopilot in ("auto", "px4") else self.autopilot
            raise TimingError(f"{rate:g} Hz is too slow: {name} needs at least {lowest:g} setpoints per second")


@dataclass(frozen=True)
class StreamStatus:
    """Status of a flight, passed to a callback once per slot.

    Parameters
    ----------
    phase : Phase
        What is being done.
    elapsed, duration : float
        Of the flight itself [s]; elapsed is 0 before it and the duration after it.
    setpoint : Setpoint or None
        What was sent, in the vehicle's local z-down frame.
    index : int or None
        Which step of the flight it was.
    lateness : float
        How late it left [s].
    error : float or None
        Distance between the vehicle and where it is to be at its last report [m]; None before one.
    vehicle : VehicleState
        What the vehicle last said.
    """

    phase: Phase
    elapsed: float
    duration: float
    setpoint: Setpoint | None
    index: int | None
    lateness: float
    error: float | None
    vehicle: VehicleState


@dataclass(frozen=True)
class StreamReport:
    """Result of a flight.

    Parameters
    ----------
    completed : bool
        True when the last setpoint of the last lap was reached.
    reason : str or None
        Why it ended early.
    fields, missing : tuple of str
        What was sent, and what the source did not have.
    schedule : Lateness
        Of all setpoints, those before and after the flight included.
    flown : int
        Setpoints of the flight itself.
    rmse, worst_error : float or None
        Distance between reported positions and those planned for their instants during the flight [m]: with a lead,
        the setpoints sent that much before; None when none was reported.
    ignored, refused : int
        Messages of other systems; messages damaged or wrongly signed.
    """

    completed: bool
    reason: str | None
    fields: tuple[str, ...]
    missing: tuple[str, ...]
    schedule: Lateness
    flown: int
    rmse: float | None
    worst_error: float | None
    ignored: int
    refused: int
