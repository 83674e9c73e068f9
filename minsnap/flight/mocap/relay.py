"""Relay motion-capture poses to the autopilot, in the message type that its estimator reads."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from minsnap.errors import InputError
from minsnap.files.frames import get_frame, map_quaternions, map_vectors
from minsnap.flight.mavlink.link import Link
from minsnap.flight.mavlink.schedule import Clock, Schedule
from minsnap.flight.mavlink.setpoints import vehicle_frame
from minsnap.flight.mavlink.vehicle_messages import Message, load_dialect
from minsnap.flight.mocap.sources import Pose, PoseSource

_LOCAL_NED, _BODY_FRD, _LOCAL_FRD = 1, 12, 20
_VISION, _MOCAP = 2, 6  # MAV_ESTIMATOR_TYPE
_UNKNOWN = [math.nan] + [0.0] * 20  # a covariance whose first number is not one is unknown


def mocap_message(microseconds: int, position: list[float], attitude: list[float], frame: str) -> Message:
    """ATT_POS_MOCAP; PX4's default estimator does not read it."""
    return load_dialect().MAVLink_att_pos_mocap_message(microseconds, attitude, *position, _UNKNOWN)


def vision_message(microseconds: int, position: list[float], attitude: list[float], frame: str) -> Message:
    """VISION_POSITION_ESTIMATE, read by PX4's EKF2 and by ArduPilot."""
    return load_dialect().MAVLink_vision_position_estimate_message(
        microseconds, *position, *euler_angles(attitude), _UNKNOWN, 0
    )


def odometry_message(estimator: int) -> Callable[..., Message]:
    """ODOMETRY without velocities: as from vision, PX4's EKF2 fuses it; as from motion capture, it does not read it."""

    def build(microseconds: int, position: list[float], attitude: list[float], frame: str) -> Message:
        axes, unknown = _LOCAL_NED if frame == "ned" else _LOCAL_FRD, [math.nan] * 6
        return load_dialect().MAVLink_odometry_message(
            microseconds, axes, _BODY_FRD, *position, attitude, *unknown, _UNKNOWN, _UNKNOWN, 0, estimator, 0
        )

    return build


MESSAGES = {
    "vision": vision_message,
    "odometry": odometry_message(_VISION),
    "odometry-mocap": odometry_message(_MOCAP),
    "mocap": mocap_message,
}
"""What a pose can be sent as."""

RECENT = 3000
"""Poses of which the rate and the latency are told: a minute of them."""


def euler_angles(attitude: list[float]) -> tuple[float, float, float]:
    """Roll, pitch and yaw (about z, then y, then x) of a unit quaternion (w, x, y, z) [rad]."""
    w, x, y, z = attitude
    roll = math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
    pitch = math.asin(max(-1.0, min(1.0, 2 * (w * y - z * x))))
    return roll, pitch, math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))


@dataclass(frozen=True)
class RelayReport:
    """Statistics of a relay.

    Parameters
    ----------
    sent : int
        Poses passed on.
    stale : int
        Slots in which the newest pose was too old, or had been sent already.
    rejected : int
        Packets that held no usable pose.
    rate : float
        Poses passed on a second, of the last ``RECENT`` [Hz].
    latency, latency_p99 : float
        From a pose's arrival to its departure, of the same, median and 99th percentile [s].
    """

    sent: int
    stale: int
    rejected: int
    rate: float
    latency: float
    latency_p99: float


class Relay:
    """Poses from a source to a link, at a fixed rate.

    Parameters
    ----------
    source : PoseSource
        Where poses come from.
    link : Link
        Where they go; it sends our heartbeat as well.
    clock : Clock
        The same as the link's and the source's.
    message : str
        ``vision``, ``odometry``, ``odometry-mocap`` or ``mocap``.
    frame : str
        Of the source; poses leave in NED for compass frames, else in the room's forward-right-down.
    rate : float
        Poses a second at most [Hz].
    max_age : float
        A pose older than this is not sent [s].

    Raises
    ------
    InputError
        If there is no such message or the age is not positive.
    """

    def __init__(
        self,
        source: PoseSource,
        link: Link,
        clock: Clock,
        message: str = "vision",
        frame: str = "optitrack",
        rate: float = 50.0,
        max_age: float = 0.1,
    ) -> None:
        if message not in MESSAGES:
            raise InputError(f"no pose message is called {message!r}: choose {', '.join(MESSAGES)}")
        if not max_age > 0:
            raise InputError(f"the largest age is {max_age} s: it must be positive")
        self._source, self._link, self._clock = source, link, clock
        self._build, self._frame, self._target = MESSAGES[message], get_frame(frame).name, vehicle_frame(frame)
        self._max_age, self._rate = max_age, rate
        self._schedule = Schedule(rate, clock.now())
        self._last = -math.inf
        self._sent: deque[tuple[float, float]] = deque(maxlen=RECENT)
        self._count = 0
        self._stale = 0
        self._stopped = False

    def stop(self) -> None:
        """Request the end, from any thread or signal handler."""
        self._stopped = True

    def run(self, on_report: Callable[[RelayReport], None] | None = None) -> RelayReport:
        """Relay poses until stopped or until the source ends; ``on_report`` is called once per second."""
        last_line = self._clock.now()
        while not (self._stopped or self._source.ended):
            for _ in self._link.pump(self._schedule.due):
                pass
            now = self._clock.now()
            self._schedule.take(now)
            self._pass_on(self._source.latest(), now)
            if on_report is not None and now - last_line >= 1.0:
                last_line = now
                on_report(self.report())
        return self.report()

    def _pass_on(self, pose: Pose | None, now: float) -> None:
        """Send a pose if it is new and not too old."""
        if pose is None or pose.received <= self._last or now - pose.received > self._max_age:
            self._stale += pose is not None
            return
        self._last = pose.received
        position = map_vectors(pose.position, self._frame, self._target).tolist()
        attitude = map_quaternions(pose.attitude, self._frame, self._target).tolist()
        self._link.send(self._build(max(0, round(pose.received * 1e6)), position, attitude, self._target))
        self._count += 1
        self._sent.append((now, self._clock.now() - pose.received))

    def report(self) -> RelayReport:
        """Return the statistics so far."""
        if not self._sent:
            return RelayReport(0, self._stale, self._source.rejected, 0.0, 0.0, 0.0)
        when, late = np.array(self._sent).T
        rate = (len(when) - 1) / (when[-1] - when[0]) if len(when) > 1 else 0.0
        median, p99 = np.percentile(late, [50, 99])
        return RelayReport(self._count, self._stale, self._source.rejected, float(rate), float(median), float(p99))
