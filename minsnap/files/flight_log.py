"""The content of a flight log, on one clock, in z-up world axes: reference, flight, and what the body felt."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields, replace
from itertools import pairwise
from typing import Any, TypeVar

import numpy as np

from minsnap.basics.arrays import BoolArray, FloatArray, OwnsArrays
from minsnap.errors import InputError
from minsnap.files.frames import FRAMES, map_samples
from minsnap.trajectory.samples import Samples

WORLD, BODY = FRAMES["ned"].matrix, FRAMES["ned"].body_matrix
"""From NED to ENU, and from forward-right-down to forward-left-up."""


Track = tuple[FloatArray, FloatArray]
"""Instants (m,) and values (m,) or (m, n)."""


@dataclass(frozen=True, eq=False)
class InertialLog(OwnsArrays):
    """Attitude, specific force and throttle of a flight, on the clock of its :class:`FlightLog`.

    Parameters
    ----------
    attitude_t : ndarray, shape (m,)
        [s].
    quaternion : ndarray, shape (m, 4)
        From body (forward, left, up) to world (z up), w, x, y, z; continuous in sign.
    force_t : ndarray, shape (n,)
        [s].
    specific_force : ndarray, shape (n, 3)
        What the accelerometer measured, in the body: gravity is not in it [m/s^2].
    throttle_t, throttle : ndarray, shape (k,), or None
        Collective thrust that was commanded, 0 to 1; None where none was logged.
    hover_throttle : float or None
        The autopilot's own estimate of the throttle in hover.
    """

    attitude_t: FloatArray
    quaternion: FloatArray
    force_t: FloatArray
    specific_force: FloatArray
    throttle_t: FloatArray | None = None
    throttle: FloatArray | None = None
    hover_throttle: float | None = None


def inertial_log(
    attitude: Track, force: Track, throttle: Track | None, hover: float | None, start: float
) -> InertialLog:
    """Convert from z-down axes and time since boot.

    Parameters
    ----------
    attitude : tuple
        Instants (m,) and quaternions (m, 4) from forward-right-down to NED.
    force : tuple
        Instants (n,) and specific forces (n, 3) in forward-right-down.
    throttle : tuple or None
        Instants (k,) and values (k,).
    hover : float or None
        The autopilot's estimate of the throttle in hover.
    start : float
        Time since boot that is 0 in the log [s].
    """
    from minsnap.vehicle.attitude import quaternions, rotations

    (t, turns), (force_t, pulls) = _finite(*attitude), _finite(*force)
    turned = quaternions(WORLD @ rotations(turns) @ BODY)
    felt = pulls @ BODY
    known = None if throttle is None else _finite(throttle[0] - start, throttle[1])
    thrust_t, thrust = known if known is not None and len(known[0]) else (None, None)
    told = hover if hover is not None and np.isfinite(hover) else None
    return InertialLog(t - start, turned, force_t - start, felt, thrust_t, thrust, told)


def from_euler(roll: FloatArray, pitch: FloatArray, yaw: FloatArray) -> FloatArray:
    """Return quaternions w, x, y, z of turns by yaw, then pitch, then roll [rad], shape (m, 4)."""
    from scipy.spatial.transform import Rotation

    return np.roll(Rotation.from_euler("ZYX", np.stack([yaw, pitch, roll], axis=1)).as_quat(), 1, axis=1)


def _finite(t: FloatArray, values: FloatArray) -> Track:
    """Leave out rows that are not finite, or whose time does not rise."""
    good = _good(t, values)
    return t[good], values[good]


def _good(t: FloatArray, values: FloatArray) -> BoolArray:
    """Tell the rows of finite values at times that rise."""
    good = np.isfinite(t) & np.isfinite(values).reshape(len(t), -1).all(axis=1)
    good[good] = rising(t[good])
    return np.asarray(good)


def rising(t: FloatArray) -> BoolArray:
    """Tell the most rows whose times rise, shape (m,): a wrong time costs its row, and not all that come after it."""
    if (np.diff(t) > 0.0).all():
        return np.ones(len(t), dtype=bool)
    ends: list[float] = []  # of the rising rows of each number, the least last time, and its row
    rows: list[int] = []
    before = []
    for row, instant in enumerate(t.tolist()):
        count = bisect_left(ends, instant)
        before.append(rows[count - 1] if count else -1)
        ends[count : count + 1], rows[count : count + 1] = [instant], [row]
    kept, row = np.zeros(len(t), dtype=bool), rows[-1]
    while row >= 0:
        kept[row], row = True, before[row]
    return kept


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
    autopilot : str or None
        ``px4`` or ``ardupilot``, by the kind of log; None where that does not tell.
    """

    reference: Samples | None
    flight: Samples | None
    start: float
    damage: str | None = None
    inertial: InertialLog | None = None
    autopilot: str | None = None

    @property
    def end(self) -> float:
        """Its last instant [s]."""
        return max((float(part.t[-1]) for part in (self.reference, self.flight) if part is not None), default=0.0)


APART = 10.0
"""Time put between logs whose clocks do not go on from one to the next [s]."""


def joined_logs(logs: Sequence[FlightLog]) -> FlightLog:
    """Return logs as one: parts into which an autopilot split a flight, or several flights of one vehicle.

    Where the times since boot go on from each to the next, in the order of time or as given, they stand on that clock;
    a log of another boot begins ten seconds after the one before it.

    Parameters
    ----------
    logs : sequence of FlightLog
        One or more.

    Raises
    ------
    InputError
        If there is none.
    """
    if not logs:
        raise InputError("there is no log to join: give one or more")
    if len(logs) == 1:
        return logs[0]
    ordered = sorted(logs, key=lambda log: log.start)
    ordered = ordered if all(a.start + a.end <= b.start for a, b in pairwise(ordered)) else list(logs)
    shifts = [0.0]
    for before, log in pairwise(ordered):
        last, since = shifts[-1] + before.end, log.start - ordered[0].start
        shifts.append(since if since >= last else last + APART)
    parts = [[getattr(log, name) for log in ordered] for name in ("reference", "flight", "inertial")]
    reference, flight, inertial = (_end_to_end(part, shifts) for part in parts)
    damage = "; ".join(log.damage for log in ordered if log.damage is not None)
    return FlightLog(reference, flight, ordered[0].start, damage or None, inertial, ordered[0].autopilot)


Part = TypeVar("Part", Samples, InertialLog)


def _end_to_end(parts: Sequence[Part | None], shifts: Sequence[float]) -> Part | None:
    """Return parts one after the other, each later by its shift, with what all of them have; None without any."""
    known = [(part, shift) for part, shift in zip(parts, shifts, strict=True) if part is not None]
    if not known:
        return None
    values: dict[str, Any] = {}
    for name in (entry.name for entry in fields(known[0][0])):
        each = [(getattr(part, name), shift) for part, shift in known]
        if all(isinstance(value, np.ndarray) for value, _ in each):
            later = name == "t" or name.endswith("_t")
            values[name] = np.concatenate([value + shift if later else value for value, shift in each])
        elif any(isinstance(value, np.ndarray) for value, _ in each):
            values[name] = None
    if values.get("yaw") is not None:
        values["yaw"] = np.unwrap(values["yaw"])
    return replace(known[0][0], **values)


def flight_log(reference: Samples | None, flight: Samples | None, damage: str | None, frame: str = "ned") -> FlightLog:
    """Clean what a log holds, and convert it to one clock that starts with the first, and to z-up world axes.

    Times are those since boot, headings in any interval, numbers perhaps not finite. The frame is ``ned``, or ``frd``
    for a room's, which is mapped to its forward-left-up.
    """
    clean = [None if raw is None else _cleaned(raw) for raw in (reference, flight)]
    start = min((float(samples.t[0]) for samples in clean if samples is not None), default=0.0)
    late = clock_goes_back([raw.t for raw in (reference, flight) if raw is not None])
    wrong = "; ".join(each for each in (damage, late) if each)
    sentence = f"{wrong}; {_what_was_read(*clean)}" if wrong else None
    upright = "enu" if frame == "ned" else "flu"
    setpoints, flown = (
        None if samples is None else map_samples(replace(samples, t=samples.t - start), frame, upright)
        for samples in clean
    )
    return FlightLog(setpoints, flown, start, sentence)


def _cleaned(raw: Samples) -> Samples | None:
    """Drop rows without position or with decreasing times, then quantities with any non-finite value."""
    kept = raw[_good(raw.t, raw.position)]
    if not len(kept):
        return None
    changed: dict[str, Any] = {name: None for name, each in kept.arrays().items() if not np.isfinite(each).all()}
    if kept.yaw is not None and "yaw" not in changed:
        changed["yaw"] = np.unwrap(kept.yaw)
    return replace(kept, **changed)


def clock_goes_back(clocks: Iterable[FloatArray]) -> str | None:
    """Return a sentence on how many rows are left out, of the times of several topics, where some fall; else None."""
    late = sum(len(t) - int(rising(t).sum()) for t in clocks if (np.diff(t) < 0.0).any())
    return f"the clock of the log goes back: {late} of its rows are left out" if late else None


def _what_was_read(reference: Samples | None, flight: Samples | None) -> str:
    counts = [0 if samples is None else len(samples.t) for samples in (flight, reference)]
    last = max((float(samples.t[-1]) for samples in (reference, flight) if samples is not None), default=0.0)
    return f"{counts[0]} positions and {counts[1]} setpoints could be read, up to {last:.3f} s after boot"
