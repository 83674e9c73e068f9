"""A log as the motion of a body: velocity, attitude and specific force at common instants, while it flew."""

from __future__ import annotations

import os
from dataclasses import dataclass

import numpy as np

from minsnap.basics.arrays import FloatArray, interpolated, own_arrays
from minsnap.basics.storage.reading import check_size
from minsnap.errors import FileError, FitError
from minsnap.files.flights import read_log
from minsnap.files.logs.flight_log import FlightLog, InertialLog
from minsnap.trajectory.samples import Samples

RATE = 50.0
"""Instants a second at most [Hz]."""

MOVING = 0.3
"""A flight begins and ends with this speed [m/s]."""

LEAST = 5.0
"""Flight that a fit needs at least [s]."""


@dataclass(frozen=True, eq=False)
class FlightMotion:
    """Motion of a body in z-up world axes, at equal steps.

    Parameters
    ----------
    t : ndarray, shape (m,)
        [s].
    velocity : ndarray, shape (m, 3)
        In the world [m/s].
    rotation : ndarray, shape (m, 3, 3)
        From body (forward, left, up) to world.
    specific_force : ndarray, shape (m, 3)
        In the body, mean over each step [m/s^2].
    throttle : ndarray, shape (m,), or None
    """

    t: FloatArray
    velocity: FloatArray
    rotation: FloatArray
    specific_force: FloatArray
    throttle: FloatArray | None

    def __post_init__(self) -> None:
        own_arrays(self)

    @property
    def rate(self) -> float:
        """Instants a second [Hz]."""
        return float((len(self.t) - 1) / (self.t[-1] - self.t[0]))


def read_flight_log(path: str | os.PathLike[str]) -> FlightLog:
    """Read a ULog, a dataflash log or the log of a stream, with what the body felt where it was logged.

    Raises
    ------
    FileError
        If the file is none of these.
    """
    check_size(path)
    log = read_log(path, inertial=True)
    if log is None:
        raise FileError(f"{path} is no log of a flight: give a .ulg, a .bin, or the CSV that stream --log wrote")
    return log


def flown_span(flight: Samples) -> tuple[float, float]:
    """Return the first and the last instant at which the vehicle moves [s].

    Raises
    ------
    FitError
        If it never does, or for less than 5 s, or velocities were not logged.
    """
    if flight.velocity is None:
        raise FitError("the log has no velocities: log them")
    moving = flight.t[np.linalg.norm(flight.velocity, axis=1) > MOVING]
    if not len(moving) or moving[-1] - moving[0] < LEAST:
        raise FitError(f"the log has less than {LEAST:g} s of flight: fly a course at several speeds, such as a circle")
    return float(moving[0]), float(moving[-1])


def body_motion(flight: Samples, felt: InertialLog) -> FlightMotion:
    """Return the motion while the vehicle flew, at the instants of its velocities, at 50 Hz at most."""
    first, last = flown_span(flight)
    first = max(first, felt.attitude_t[0], felt.force_t[0] + 1.0 / RATE)
    last = min(last, felt.attitude_t[-1], felt.force_t[-1] - 1.0 / RATE)
    if last - first < LEAST:
        raise FitError(f"attitude, accelerometer and velocity were logged together for less than {LEAST:g} s")
    rate = min(RATE, (len(flight.t) - 1) / flight.duration)
    t = first + np.arange(int((last - first) * rate) + 1) / rate
    assert flight.velocity is not None
    return FlightMotion(
        t,
        interpolated(t, flight.t, flight.velocity),
        _attitudes(t, felt),
        _means(t, 1.0 / rate, felt.force_t, felt.specific_force),
        None if felt.throttle is None or felt.throttle_t is None else np.interp(t, felt.throttle_t, felt.throttle),
    )


def _attitudes(t: FloatArray, felt: InertialLog) -> FloatArray:
    from scipy.spatial.transform import Rotation

    turns = interpolated(t, felt.attitude_t, felt.quaternion)
    return np.asarray(Rotation.from_quat(np.roll(turns, -1, axis=1)).as_matrix())


def _means(t: FloatArray, width: float, known: FloatArray, values: FloatArray) -> FloatArray:
    """Return means over [t - width/2, t + width/2] of values interpolated linearly."""
    steps = np.diff(known)[:, None]
    total = np.vstack([np.zeros(values.shape[1]), np.cumsum(0.5 * steps * (values[1:] + values[:-1]), axis=0)])
    ends = [interpolated(np.clip(t + side * width / 2, known[0], known[-1]), known, total) for side in (-1.0, 1.0)]
    return np.asarray((ends[1] - ends[0]) / width)
