"""The content of a flight log: reference and flight, on one clock, in z-up world axes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from minsnap.basics.arrays import FloatArray
from minsnap.files.frames import map_samples
from minsnap.files.logs.inertial_log import InertialLog
from minsnap.trajectory.samples import Samples


@dataclass(frozen=True, eq=False)
class FlightLog:
    """A flight logged by an autopilot.

    Parameters
    ----------
    reference : Samples or None
        The setpoints with a position; None where the log has none.
    flight : Samples or None
        The estimated positions; None when none was logged.
    start : float
        Time since boot of the log's first instant, which is 0 in both [s].
    damage : str or None
        What was wrong with the file and what could be read all the same; None for a sound one.
    inertial : InertialLog or None
        What the body felt, if it was wanted and logged.
    """

    reference: Samples | None
    flight: Samples | None
    start: float
    damage: str | None = None
    inertial: InertialLog | None = None


@dataclass(frozen=True, eq=False)
class Track:
    """One quantity of a log, unconverted: z-down axes, time since boot.

    Parameters
    ----------
    t : ndarray, shape (m,)
        [s].
    position : ndarray, shape (m, 3)
    velocity, acceleration : ndarray, shape (m, 3), or None
    yaw : ndarray, shape (m,), or None
        [rad], in any interval.
    yaw_rate : ndarray, shape (m,), or None
    """

    t: FloatArray
    position: FloatArray
    velocity: FloatArray | None = None
    acceleration: FloatArray | None = None
    yaw: FloatArray | None = None
    yaw_rate: FloatArray | None = None


def flight_log(reference: Track | None, flight: Track | None, damage: str | None, frame: str = "ned") -> FlightLog:
    """Convert the tracks to one clock that starts with the first of them, and to z-up world axes.

    Their frame is ``ned``, or ``frd`` for a room's, which is mapped to its forward-left-up.
    """
    clean = [None if track is None else _cleaned(track) for track in (reference, flight)]
    starts = [track.t[0] for track in clean if track is not None]
    start = float(min(starts)) if starts else 0.0
    sentence = None if damage is None else f"{damage}; {_what_was_read(*clean)}"
    setpoints, flown = (None if track is None else _samples(track, start, frame) for track in clean)
    return FlightLog(setpoints, flown, start, sentence)


def _cleaned(track: Track) -> Track | None:
    """Drop rows without position or with decreasing times, then quantities with any non-finite value."""
    good = np.isfinite(track.position).all(axis=1) & np.isfinite(track.t)
    latest = np.maximum.accumulate(np.where(good, track.t, -np.inf))
    good[1:] &= track.t[1:] > latest[:-1]
    if not good.any():
        return None
    rest = (track.velocity, track.acceleration, track.yaw, track.yaw_rate)
    return Track(track.t[good], track.position[good], *(_controlled(values, good) for values in rest))


def _controlled(values: FloatArray | None, good: npt.NDArray[np.bool_]) -> FloatArray | None:
    kept = None if values is None else np.asarray(values, dtype=np.float64)[good]
    return kept if kept is not None and np.isfinite(kept).all() else None


def _samples(track: Track, start: float, frame: str) -> Samples:
    yaw = None if track.yaw is None else np.unwrap(track.yaw)
    samples = Samples(
        track.t - start, track.position, track.velocity, track.acceleration, yaw=yaw, yaw_rate=track.yaw_rate
    )
    return map_samples(samples, frame, "enu" if frame == "ned" else "flu")


def _what_was_read(reference: Track | None, flight: Track | None) -> str:
    counts = [0 if track is None else len(track.t) for track in (flight, reference)]
    last = max((float(track.t[-1]) for track in (reference, flight) if track is not None), default=0.0)
    return f"{counts[0]} positions and {counts[1]} setpoints could be read, up to {last:.3f} s after boot"
