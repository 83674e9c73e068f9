"""Options and report of a streamed flight, and the safety rules that refuse or stop it by the vehicle's messages."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from enum import Enum

from minsnap.basics.checks import check_number
from minsnap.basics.messages import shown
from minsnap.basics.storage.text import FileName
from minsnap.errors import InputError, TimingError
from minsnap.flight.mavlink.link import Lateness
from minsnap.flight.mavlink.setpoints import FeedForward, Setpoint
from minsnap.flight.mavlink.vehicle_messages import AUTOPILOTS, Autopilot, Vector, VehicleState


@dataclass(frozen=True)
class StreamSettings:
    """Times and distances of a stream that no option changes.

    Parameters
    ----------
    fresh : float
        A position older than this does not say where the vehicle is [s].
    least_abort : float
        Abort distance of slow flights [m].
    bends : float
        Lag in bends, in lags on straight ways: PX4 1.17 lagged by up to 0.68 s times its speed there.
    lag_room : float
        Abort distance of fast ones, in expected lags in bends: gusts add to it.
    linger : float
        How long the hold goes on after the vehicle has left the mode [s].
    climbed : float
        A take-off is complete within this distance of the start's height [m].
    takes_effect : float
        A heartbeat may have been on its way for so long [s].
    retry : float
        Commands are repeated at this interval until they have had their effect [s].
    position_rate : float
        Rate at which positions are asked for [Hz].
    heartbeat_rate : float
        The same of heartbeats: modes are seen in them alone, and a pilot's choice may last less than a second [Hz].
    mode_rate : float
        At which CURRENT_MODE is asked for [Hz]: PX4 sends it at changes, no more often than it was asked for.
    state_rate : float
        At which the landed state and the asked-for position are asked for [Hz].
    ground : float
        How far the estimate of a vehicle on the ground may be above or below the file's ground [m].
    least_climb : float
        Height to which a file climbs straight up, at least, that begins on the ground [m].
    lift : float
        Height to which an autopilot takes off by itself before it flies such a file, half of its climb at most [m].
    foreign : float
        Distance of what a vehicle is asked for from all that was sent here, beyond which others send too [m].
    foreign_times : int
        How often it was asked for that, within ``foreign_within``.
    foreign_within : float
        [s]
    carried : float
        For how long an autopilot may carry a setpoint on with its velocity [s].
    seen : float
        Heartbeats that come less often hide a mode that is chosen for a moment [s].
    blind_wait : float
        How long a flight that needs no position waits for one; the request is repeated so often [s].
    give_up : int
        Errors of this program after which a hold is given up.
    first_reminder, reminder : float
        What a waiting flight waits for is said after so long, and from then on at this interval [s].
    """

    fresh: float = 0.5
    least_abort: float = 2.0
    bends: float = 1.4
    lag_room: float = 1.5
    linger: float = 1.0
    climbed: float = 0.5
    takes_effect: float = 0.3
    retry: float = 1.0
    position_rate: float = 20.0
    heartbeat_rate: float = 5.0
    mode_rate: float = 20.0
    state_rate: float = 5.0
    ground: float = 0.6
    least_climb: float = 0.5
    lift: float = 0.5
    foreign: float = 0.5
    foreign_times: int = 3
    foreign_within: float = 2.0
    carried: float = 0.2
    seen: float = 0.5
    blind_wait: float = 3.0
    give_up: int = 5
    first_reminder: float = 2.0
    reminder: float = 10.0


STREAM = StreamSettings()


class Phase(Enum):
    """The phases of a flight."""

    PRESTREAM = "streaming the start"
    READY = "ready"
    FLYING = "flying"
    HOLDING = "holding"
    DONE = "done"


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
            if value is not None:
                if not isinstance(value, int | float) or not value > 0.0:
                    raise InputError(f"{name} is {shown(value)}: a safety bound must be positive")

    @property
    def farthest(self) -> float:
        """The abort distance; the least one by default [m]."""
        return STREAM.least_abort if self.abort_distance is None else self.abort_distance

    def fitting(self, lag: float) -> SafetyRules:
        """Return rules whose abort distance leaves room for a vehicle that lags behind by ``lag`` [m]."""
        if self.abort_distance is not None:
            return self
        return replace(self, abort_distance=max(STREAM.least_abort, STREAM.lag_room * lag))

    def lag_refusal(self, speed: float, delay: float) -> str | None:
        """Return why a flight that lags by ``delay`` [s] at a speed [m/s] would be stopped by its lag, or None."""
        lag = STREAM.bends * speed * delay
        if lag < self.farthest:
            return None
        text = f"this plan will lag {lag:.1f} m behind in bends at {speed:.1f} m/s ({delay:.2g} s)"
        give = f"allow {STREAM.lag_room * lag:.1f} m, or plan it slower"
        return f"{text}: an abort distance of {self.farthest:g} m would stop it; {give}"

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

    def unsettled(self, vehicle: VehicleState, start: Vector, gate: tuple[float, float] | None = None) -> str | None:
        """Return the reason why the vehicle is not at rest at the start yet, or None; None also without bounds.

        ``gate`` are the distance [m] and the speed [m/s] that count as there, if not those of the rules.
        """
        if math.isinf(self.max_start_distance):
            return None
        near, slow = gate or (self.settled_distance, self.settled_speed)
        distance, speed = vehicle.distance(start), vehicle.speed
        if distance > near:
            return f"the vehicle is {distance:.2f} m from the start, not within {near:.2g} m"
        return None if speed <= slow else f"the vehicle still moves at {speed:.2f} m/s"

    def stall(self, gap: float) -> str | None:
        """Return a message if the stream paused too long before a setpoint of the flight, else None."""
        if gap <= self.max_gap:
            return None
        return f"no setpoint left this program for {gap:.2f} s, more than the {self.max_gap:g} s allowed"

    def breach(
        self, now: float, vehicle: VehicleState, setpoint: Vector, autopilot: Autopilot, when: float | None = None
    ) -> str | None:
        """Return a message that names the rule broken at ``now``, or None; the setpoint is of the instant ``when``."""
        losses = autopilot.losses(vehicle)
        if losses:
            return losses[0]
        silence = self.heartbeat_timeout if vehicle.position is None else self.link_timeout
        if now - vehicle.heard > silence:
            return f"the link was silent for {silence:g} s"
        if now - vehicle.heartbeat > self.heartbeat_timeout:
            return f"no heartbeat for {self.heartbeat_timeout:g} s: the vehicle's mode is not known any more"
        if vehicle.position is None:
            return None
        if now - vehicle.positioned > self.link_timeout:
            return f"the vehicle's position was not reported for {self.link_timeout:g} s"
        error = vehicle.distance(setpoint, when) if now - vehicle.positioned <= STREAM.fresh else 0.0
        if error > self.farthest:
            return f"the vehicle was {error:.2f} m from its setpoint, more than the {self.farthest:g} m allowed"
        return None


ON_ABORT = ("hold", "land", "rtl", "hand-back")
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
        Count the vehicle's height as well. With ``arm`` for a path that climbs first alone: any other would be flown on
        the ground.
    arm : bool
        Change the vehicle's mode and arm it, each until it has taken effect once. Without it, neither is ever done.
    land : bool
        Land at the end instead of holding until stopped.
    on_abort : str or None
        When a rule has stopped the flight: ``hold`` until the mode is left, ``land``, ``rtl`` (return to launch), or
        ``hand-back``: to the mode in which the autopilot hovers by itself (PX4's HOLD, ArduCopter's BRAKE). None: land
        with ``land``, else hand back with ``arm``, else hold, for a pilot has the vehicle.
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
        If ``on_abort`` is unknown, ``give_up`` is not positive, or ``relative_height`` goes without ``relative``.
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
    on_abort: str | None = None
    rules: SafetyRules = field(default_factory=SafetyRules)
    prestream: float = 2.0
    wait: float = 30.0
    give_up: float = 30.0
    log: FileName | None = None
    feed_forward: FeedForward = field(default_factory=FeedForward)
    delay: float | None = None
    stays: bool = False
    fastest: float = 0.0

    def __post_init__(self) -> None:
        give = "autopilots need the first setpoint for at least 2 s before"
        check_number("prestream", self.prestream, 2.0, math.inf, give, TimingError, unit="s")
        if self.on_abort is not None and self.on_abort not in ON_ABORT:
            raise InputError(f"on_abort is {self.on_abort!r}: choose {', '.join(ON_ABORT[:-1])} or {ON_ABORT[-1]}")
        if self.delay is not None and not 0.0 <= self.delay < math.inf:
            raise InputError(f"the delay is {self.delay} s: it must be 0 or more")
        if not self.give_up > 0:
            raise InputError(f"give_up is {self.give_up} s: it must be positive")
        if self.relative_height and not self.relative:
            raise InputError("the vehicle's height is an origin beside its x and y: use it with relative")

    @property
    def after_stop(self) -> str:
        """What is done after a rule has stopped the flight, one of :data:`ON_ABORT`."""
        return self.on_abort or ("land" if self.land else "hand-back" if self.arm else "hold")

    def offset(self, start: Vector, here: Vector, from_ground: bool = False) -> Vector:
        """Return what a flight that begins where the vehicle is, ``here``, is moved by from its file's start [m].

        From the ground it is moved to the height of the ground, whatever the origin.
        """
        x, y, z = (there - before for there, before in zip(here, start, strict=True))
        aside = (x, y) if self.relative else (0.0, 0.0)
        return *aside, z if self.relative_height or from_ground else 0.0

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
