"""Flights in a log: where its setpoints follow a file, and each flight compared with it.

A log covers the time from before take-off until after landing, has its own clock, and may contain several flights. Its
setpoints are the rows that were sent, so the instants at which they match the file give offset and rate of the clocks:
exactly, or, where a log repeats setpoints, late by half the time of the repeats. The delay of the vehicle is not
removed and counts as error.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray, OwnsArrays
from minsnap.errors import InputError
from minsnap.flight.tracking.comparison import MAX_DELAY, Comparison, compare, jump_remarks, position_at
from minsnap.flight.tracking.own_takeoff import joins_at
from minsnap.trajectory import Samples


@dataclass(frozen=True)
class MatchSettings:
    """How setpoints of a log are taken for those of a file.

    Parameters
    ----------
    rate : float
        Rate of the grid on which setpoints and file are compared first [Hz].
    candidate : float
        Distance, in standard deviations of the file's positions, up to which a place in the log is looked at
        closely.
    matched : float
        Distance in root mean square below which setpoints are those of the file, where both are at rest [m].
    uneven : float
        What a log's instants may be off in root mean square, by setpoints that hold until the next and uneven
        clocks [s].
    parts : tuple of float
        Shares of the file, from its beginning, by which a flight is looked for that was not flown to its end.
    away : float
        Setpoints that are off the file for so long have left it [s].
    least_way : float
        Extent that such a share needs [m]: a smaller one would match anywhere.
    drift : float
        Largest difference between the rates of the two clocks.
    held : float
        Repeats of a setpoint for up to this long count as one, sent at the first of their instants [s].
    longest : float
        Setpoints that last longer are none of a flight: a time of the log is wrong [s].
    """

    rate: float = 50.0
    candidate: float = 0.4
    matched: float = 0.05
    uneven: float = 0.03
    parts: tuple[float, ...] = (0.5, 0.25, 0.125)
    away: float = 0.4
    least_way: float = 0.5
    drift: float = 0.05
    held: float = 0.5
    longest: float = 86400.0


MATCH = MatchSettings()


@dataclass(frozen=True, eq=False)
class LogFlight(OwnsArrays):
    """One flight of a file in a log.

    Parameters
    ----------
    start : float
        The log's time at which the file begins [s]; of setpoints sent ahead, the instant planned for its first.
    rate : float
        Seconds of the file for each second of the log: a simulator's clock may run slower than that of the streamer.
    shift : ndarray, shape (dim,)
        Where the setpoints lay less where the file lies [m]: zero, unless it was flown from another origin.
    mismatch : float
        Root mean square of the distance between setpoints and file that is left [m].
    lead : float
        How much earlier than planned its setpoints were sent [s].
    end : float or None
        Until when of the file's time the setpoints follow it [s]; None for all of it.
    begin : float
        From when of the file's time on they follow it [s]: after a take-off that the autopilot flew by itself.
    """

    start: float
    rate: float
    shift: FloatArray
    mismatch: float
    lead: float = 0.0
    end: float | None = None
    begin: float = 0.0

    def in_time_of_file(self, samples: Samples, duration: float) -> Samples:
        """Return the part of samples of the log during the flight, in the file's time and where the file lies.

        Raises
        ------
        InputError
            If fewer than two of them lie there.
        """
        t = (samples.t - self.start) * self.rate
        kept = (t >= max(0.0, self.begin - self.lead)) & (t <= (duration if self.end is None else self.end - self.lead))
        if np.count_nonzero(kept) < 2:
            raise InputError(f"the log holds no positions during the flight that begins at {self.start:.3f} s")
        velocity = None if samples.velocity is None else samples.velocity[kept] / self.rate
        return Samples(t[kept], samples.position[kept] - self.shift, velocity)

    def remarks(self, whole: float) -> list[str]:
        """Return a sentence for each respect in which it is no flight of the whole file, of a duration [s]."""
        sentences = []
        if self.lead:
            sentences.append(
                f"its setpoints were sent {self.lead:g} s ahead, and each instant is compared with its plan"
            )
        if self.begin:
            sentences.append(f"the autopilot took off by itself: it is compared from {self.begin:.2f} s on, in the air")
        if self.end is not None:
            part = f"the first {self.end:.2f} s of {whole:.2f} s ({100 * self.end / whole:.0f} %)"
            sentences.append(f"its setpoints follow the file for {part}: that part is compared")
        if self.shift.any():
            shift = ", ".join(f"{value:.2f}" for value in self.shift)
            sentences.append(f"it was flown ({shift}) m from where the file lies, and is moved there")
        if abs(self.rate - 1.0) > 1e-3:
            drift = f"{100 * abs(self.rate - 1.0):.1f} % {'slow' if self.rate > 1.0 else 'fast'}"
            sentences.append(f"the log's clock runs {drift}: flown times are those of the file")
        return sentences


def find_flights(reference: Samples, setpoints: Samples) -> list[LogFlight]:
    """Find every flight of a file in a log.

    Parameters
    ----------
    reference : Samples
        The file.
    setpoints : Samples
        What the log says that was asked for, in the same world axes.

    Returns
    -------
    list of LogFlight
        In the order of time: those of the whole file; if there is none, those of a part from its beginning.

    Raises
    ------
    InputError
        If the log's setpoints nowhere follow the file; says how near they come.
    """
    if reference.dim != setpoints.dim:
        raise InputError(f"the file has {reference.dim} coordinates and the log {setpoints.dim}: they must agree")
    if setpoints.duration > MATCH.longest:
        raise InputError(f"the log's setpoints last {setpoints.duration:.3g} s: one of its times is wrong")
    refined = [_refined(reference, setpoints, start) for start in _candidates(reference, setpoints)]
    whole = [flight for flight in refined if flight.mismatch <= _tolerance(reference)]
    join = joins_at(reference)
    if join and not any(_follows_from_the_ground(reference, setpoints, flight, join) for flight in whole):
        whole = _joined(reference, setpoints, join) or whole
    flights = [_cut(reference, setpoints, flight) for flight in whole] or _begun(reference, setpoints)
    if not flights:
        nearest = min((flight.mismatch for flight in refined), default=np.inf)
        near = f"at best {nearest:.2g} m apart" if np.isfinite(nearest) else "no setpoints are like it"
        which = "is it of another file or frame, or does it begin in flight?"
        raise InputError(f"the log's setpoints do not follow the file ({near}): {which}")
    return flights


def _follows_from_the_ground(reference: Samples, setpoints: Samples, flight: LogFlight, join: float) -> bool:
    """Return whether the setpoints follow the climb of a file, and not only what comes after it."""
    t = (setpoints.t - flight.start) * flight.rate
    inside = (t >= 0.0) & (t <= 0.5 * join)
    gap = setpoints.position[inside] - flight.shift - position_at(reference, reference.t[0] + t[inside])
    return not inside.any() or float(np.median(np.linalg.norm(gap, axis=1))) <= 3.0 * _tolerance(reference)


def _joined(reference: Samples, setpoints: Samples, join: float) -> list[LogFlight]:
    """Return the flights that joined the file at an instant of it [s], after a take-off of their own."""
    rest = reference[reference.t >= reference.t[0] + join]
    refined = [_refined(rest, setpoints, start) for start in _candidates(rest, setpoints)]
    found = [flight for flight in refined if flight.mismatch <= _tolerance(rest)]
    ahead = float(rest.t[0] - reference.t[0])
    return [replace(flight, start=flight.start - ahead / flight.rate, begin=ahead) for flight in found]


def _tolerance(reference: Samples) -> float:
    """Return up to which distance in root mean square setpoints are those of a file [m]; speed makes it larger."""
    way = np.linalg.norm(np.diff(reference.position, axis=0), axis=1)
    speed = float(np.sqrt(np.mean((way / np.diff(reference.t)) ** 2)))
    return float(np.hypot(MATCH.matched, MATCH.uneven * speed))


def _begun(reference: Samples, setpoints: Samples) -> list[LogFlight]:
    """Return the flights that were broken off: they follow the file from its beginning, but not to its end."""
    whole = reference.duration
    for share in MATCH.parts:
        head = reference[reference.t <= reference.t[0] + share * whole]
        if np.ptp(head.position, axis=0).max() < MATCH.least_way:
            break
        refined = [_refined(head, setpoints, start) for start in _candidates(head, setpoints)]
        flights = [flight for flight in refined if flight.mismatch <= _tolerance(head)]
        if flights:
            cut = [_cut(reference, setpoints, flight) for flight in flights]
            return _apart([_cut(reference, setpoints, _of_part(reference, setpoints, each)) for each in cut], whole)
    return []


def _of_part(reference: Samples, setpoints: Samples, flight: LogFlight) -> LogFlight:
    """Return the flight with the clocks of the part that it follows; later setpoints are ignored."""
    if flight.end is None:
        return flight
    part = setpoints[setpoints.t <= flight.start + flight.end / flight.rate]
    return _refined(reference[reference.t <= reference.t[0] + flight.end], part, flight.start)


def _apart(flights: list[LogFlight], duration: float) -> list[LogFlight]:
    """Return the longest flights of which none begins during another.

    Others may be found because a later part of a path looks like its start.
    """
    kept: list[LogFlight] = []
    for flight in sorted(flights, key=lambda one: -(one.end or duration)):
        if all(abs(flight.start - other.start) > (other.end or duration) / other.rate for other in kept):
            kept.append(flight)
    return sorted(kept, key=lambda one: one.start)


def _cut(reference: Samples, setpoints: Samples, flight: LogFlight) -> LogFlight:
    """Return the flight with its end, where setpoints leave the file for good: beyond three times the tolerance."""
    t = (setpoints.t - flight.start) * flight.rate
    inside = (t >= flight.begin) & (t <= reference.duration)
    t, place = t[inside], setpoints.position[inside] - flight.shift
    away = np.linalg.norm(place - position_at(reference, reference.t[0] + t), axis=1) > 3.0 * _tolerance(reference)
    lasting = max(1, int(MATCH.away / (reference.duration / max(len(t), 1))))
    gone = np.flatnonzero(np.convolve(away, np.ones(lasting), mode="valid") >= lasting)
    end = float(t[max(gone[0] - 1, 0)] if len(gone) else t[-1])  # the last that follows it: a pause may come after
    return flight if end > reference.duration - MATCH.away else replace(flight, end=end)


def _candidates(reference: Samples, setpoints: Samples) -> list[float]:
    """Return instants of the log from which the setpoints, up to a constant shift, nearly equal the file."""
    grid = np.arange(int(np.ceil(setpoints.duration * MATCH.rate)) + 1) / MATCH.rate + setpoints.t[0]
    setpoint_positions = position_at(setpoints, grid)
    file = position_at(reference, reference.t[0] + np.arange(int(reference.duration * MATCH.rate) + 1) / MATCH.rate)
    if len(file) > len(setpoint_positions):
        return [float(setpoints.t[0])]
    distance = np.sqrt(_centred_distances(setpoint_positions, file))
    spread = float(np.sqrt(np.sum(np.var(file, axis=0)))) or 1.0
    return [float(grid[k]) for k in _least(distance, MATCH.candidate * spread, len(file) // 2)]


def _centred_distances(setpoints: FloatArray, file: FloatArray) -> FloatArray:
    """Return mean squared distances of the file to every window of the setpoints, both with their mean removed."""
    from scipy.signal import correlate

    count = len(file)
    y = file - file.mean(axis=0)
    windows = np.array([correlate(column, np.ones(count), mode="valid") for column in setpoints.T])
    squares = correlate((setpoints**2).sum(axis=1), np.ones(count), mode="valid") / count
    cross = sum(correlate(a, b, mode="valid") for a, b in zip(setpoints.T, y.T, strict=True)) / count
    variance = squares - ((windows / count) ** 2).sum(axis=0)
    return np.asarray(np.maximum(variance - 2.0 * cross + (y**2).sum() / count, 0.0))


def _least(distance: FloatArray, most: float, apart: int) -> list[int]:
    """Return the indices of local minima below a bound, at least this number of steps apart."""
    minima: list[int] = []
    for k in np.argsort(distance, kind="stable")[: np.count_nonzero(distance <= most)].tolist():
        if all(abs(k - other) >= apart for other in minima):
            minima.append(k)
    return sorted(minima)


def _refined(reference: Samples, setpoints: Samples, start: float) -> LogFlight:
    """Return the clocks' offset and rate, and the shift, at which setpoints and file differ least."""
    from scipy.optimize import least_squares

    slack = MATCH.drift * reference.duration
    inside = (setpoints.t >= start - slack) & (setpoints.t <= start + reference.duration * (1.0 + MATCH.drift) + slack)
    t, position = setpoints.t[inside], setpoints.position[inside]

    def left(unknown: FloatArray) -> FloatArray:
        return np.asarray(position - position_at(reference, reference.t[0] + (t - unknown[0]) * unknown[1]))

    def residuals(unknown: FloatArray) -> FloatArray:
        gap = left(unknown)
        return np.asarray((gap - np.median(gap, axis=0)).ravel())

    bounds = ([start - 1.0 - slack, 1.0 - MATCH.drift], [start + 1.0 + slack, 1.0 + MATCH.drift])
    scales: dict[str, Any] = {"x_scale": [0.01, 0.001], "loss": "soft_l1", "f_scale": MATCH.matched}
    best = least_squares(residuals, [start, 1.0], bounds=bounds, **scales).x
    within = (t >= best[0]) & (t <= best[0] + reference.duration / best[1])
    gap = left(best)[within] if within.any() else left(best)
    shift = np.median(gap, axis=0)
    shift = np.where(np.abs(shift) < MATCH.matched, 0.0, shift)
    return LogFlight(float(best[0]), float(best[1]), shift, float(np.sqrt(((gap - shift) ** 2).sum(axis=1).mean())))


OFFSET_NOTED = 1.0
"""Constant offset from which on a comparison says more of origin and frame than of tracking [m]."""


@dataclass(frozen=True, eq=False)
class ComparedFlight:
    """Comparison of one flight with its file.

    Parameters
    ----------
    comparison : Comparison
        Over the flight alone; lateness counts as error, and its delay is that of the vehicle.
    reference, flight : Samples
        What was to be flown, and what was flown, in the file's time and where the file lies.
    place : LogFlight or None
        Where in the log it is; None for a flight that is not from a log.
    sent : Samples or None
        What was sent, if that is not the reference itself.
    """

    comparison: Comparison
    reference: Samples
    flight: Samples
    place: LogFlight | None = None
    sent: Samples | None = None

    @property
    def whole(self) -> float:
        """Duration of the file [s]."""
        return self.reference.duration

    def remarks(self) -> list[str]:
        """Return warnings about the validity of the figures, one sentence per warning."""
        sentences = self.comparison.remarks() + ([] if self.place is None else self.place.remarks(self.whole))
        begin, end = (float(self.comparison.t[k] - self.reference.t[0]) for k in (0, -1))
        planned = self.whole if self.place is None or self.place.end is None else self.place.end
        if begin > MATCH.away + (0.0 if self.place is None else self.place.begin) or end < planned - MATCH.away:
            sentences.append(f"positions are known from {begin:.2f} to {end:.2f} s alone: that part is compared")
        jumps = jump_remarks(self.flight)
        offset = self.comparison.constant_offset
        if not jumps and float(np.linalg.norm(offset)) > OFFSET_NOTED:
            words = ", ".join(f"{value:.2f}" for value in offset)
            sentences.append(f"the whole flight lies ({words}) m from its reference: do origin and frame agree?")
        return sentences + jumps


def compare_in_log(
    reference: Samples, setpoints: Samples, flown: Samples, max_delay: float = MAX_DELAY, planned: Samples | None = None
) -> list[ComparedFlight]:
    """Find every flight of a file in a log and compare it with the file.

    Parameters
    ----------
    reference : Samples
        The file. The flight is compared with what it plans for each instant. The row for an instant was sent by the
        lead earlier: that of the log's setpoints where they have one, else that of the file.
    setpoints, flown : Samples
        What the log says was asked for, and where the vehicle was, in the same world axes and on the log's clock.
    max_delay : float
        Longest delay that is looked for [s].
    planned : Samples, optional
        What the file was sent for, at the same instants, if it is not the plan itself: corrected by ``tune``.

    Raises
    ------
    InputError
        If the log's setpoints nowhere follow the file, or positions are missing there.
    """
    flights, lead = [], setpoints.lead or reference.lead
    setpoints = _as_sent(setpoints)
    reference, planned = replace(reference, lead=0.0), None if planned is None else replace(planned, lead=0.0)
    for match in find_flights(reference, setpoints):
        place = replace(match, start=match.start + lead / match.rate, lead=lead)
        wanted, flight = planned or reference, place.in_time_of_file(flown, reference.duration)
        sent = None if planned is None else reference
        flights.append(ComparedFlight(compare(wanted, flight, max_delay=max_delay), wanted, flight, place, sent))
    return flights


def _as_sent(setpoints: Samples) -> Samples:
    """Return setpoints without repeats, which seem to follow the file half the time of a repeat later."""
    begins = np.append(True, (np.diff(setpoints.position, axis=0) != 0.0).any(axis=1))
    starts = setpoints.t[begins]
    short = np.diff(starts, append=setpoints.t[-1]) <= MATCH.held
    return setpoints[begins | ~short[np.cumsum(begins) - 1]]
