"""Checks of samples: consistent with themselves, and inside a corridor.

The criterion for derivatives is the mean value theorem: over a time step, a coordinate changes by the step times a
value that its derivative takes inside the step. So the slope over every step must lie in the range of the derivative's
column around it: the range of the six samples nearest to the step, widened on either side by its own
length and by rounding. A smooth path sampled densely enough to be flown always passes; a column in other units, of
another axis, with the wrong sign or shifted in time does not. A single wrong number of the derivative would widen its
own range: so each must also be as near to the slopes of the steps around it as all slopes are apart. Where there are no
velocities, the acceleration implied by the positions must be one that can be flown.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from minsnap.basics.arrays import GRAVITY, BoolArray, FloatArray
from minsnap.corridors.constraint import walls_of
from minsnap.corridors.tubes import as_constraints
from minsnap.errors import WaypointError
from minsnap.trajectory.planned_heading import in_degrees
from minsnap.trajectory.samples import Samples, axis_names


@dataclass(frozen=True)
class Membership:
    """Least margin of samples inside a corridor.

    Parameters
    ----------
    margin : float
        Least distance to a wall over all samples [m]; negative outside.
    instant : float
        When it is least [s].
    leg : int
        The leg that sample was counted to, from 0.
    """

    margin: float
    instant: float
    leg: int

    @property
    def ok(self) -> bool:
        """True when no sample is outside."""
        return self.margin >= 0.0


def check_membership(
    samples: Samples, waypoints: FloatArray, corridor: Any, near: BoolArray | None = None
) -> Membership:
    """Return the least margin of samples in a corridor, with the most favourable assignment of samples to legs.

    Samples pass the legs in order, from the first to the last; of all assignments of samples to legs, the one with the
    largest least margin is used. Only the samples are checked, not the curve between them.

    Parameters
    ----------
    samples : Samples
        m of them.
    waypoints : ndarray, shape (n, dim)
        Ends of the legs [m].
    corridor : float, array_like, Constraint or sequence of Constraint
        As :func:`minsnap.plan` takes it.
    near : ndarray of bool, shape (n - 1, m), optional
        To which legs each sample may belong; by default to all.

    Raises
    ------
    WaypointError
        If the waypoints have other coordinates than the samples, or the samples are fewer than the legs.
    """
    points = np.asarray(waypoints, dtype=np.float64)
    if points.ndim != 2 or points.shape[1] != samples.dim or len(points) < 2:
        raise WaypointError(f"waypoints of shape {points.shape} do not go with samples of {samples.dim} coordinates")
    if len(samples) < len(points) - 1:
        raise WaypointError(f"{len(samples)} samples cannot run through {len(points) - 1} legs")
    margins = leg_margins(samples.position, points, corridor)
    if near is not None:
        margins = np.where(near, margins, -np.inf)
    leg = _assign(margins)
    chosen = margins[leg, np.arange(len(samples))]
    worst = int(chosen.argmin())
    return Membership(float(chosen[worst]), float(samples.t[worst]), int(leg[worst]))


def leg_margins(position: FloatArray, waypoints: FloatArray, corridor: Any) -> FloatArray:
    """Return the margin of every position, shape (m, dim), in every leg: (legs, m), infinite without walls."""
    margins = np.full((len(waypoints) - 1, len(position)), np.inf)
    for wall in walls_of(as_constraints(corridor), waypoints):
        if wall.order == 0:
            np.minimum.at(margins, wall.leg, wall.slack(position[None]))
    return margins


def _assign(margins: FloatArray) -> np.ndarray[tuple[int], np.dtype[np.intp]]:
    """Return the leg of each sample, non-decreasing, with the largest least margin, by dynamic programming."""
    legs, count = margins.shape
    best = np.full(legs, -np.inf)
    best[0] = margins[0, 0]
    moved = np.zeros((count, legs), dtype=bool)
    for i in range(1, count):
        before = np.concatenate([[-np.inf], best[:-1]])
        moved[i] = before > best
        best = np.minimum(margins[:, i], np.maximum(best, before))
    leg = np.empty(count, dtype=np.intp)
    leg[-1] = legs - 1
    for i in range(count - 1, 0, -1):
        leg[i - 1] = leg[i] - moved[i, leg[i]]
    return leg


LARGEST_ACCELERATION = 100.0
"""Implied acceleration beyond which a step in position is a jump, ten times gravity [m/s^2]."""


@dataclass(frozen=True)
class AxisFigures:
    """Statistics of one coordinate in a file.

    Parameters
    ----------
    name : str
        x, y, z, or yaw.
    lowest, highest : float
        Extremes [m, rad].
    fastest : float
        Largest magnitude of the first derivative, from its column or else from the steps [m/s, rad/s].
    hardest : float or None
        Largest magnitude of the acceleration column [m/s^2]; None without one.
    velocity_mismatch, acceleration_mismatch : float or None
        The most that a step's slope is outside what the derivative's column allows: 0 when consistent, None without it.
    """

    name: str
    lowest: float
    highest: float
    fastest: float
    hardest: float | None = None
    velocity_mismatch: float | None = None
    acceleration_mismatch: float | None = None


@dataclass(frozen=True)
class ConsistencyReport:
    """Result of :func:`check_samples`.

    Parameters
    ----------
    problems : tuple of str
        One plain sentence for each thing that is wrong; empty for a file that is fit to fly.
    rows : int
        Number of samples.
    duration, rate : float
        [s], [Hz].
    largest_jump, jump_time : float
        The longest way between two samples [m] and when it starts [s].
    axes : tuple of AxisFigures
        Per coordinate and for yaw; empty when a number is not finite.
    starts_at_rest, ends_at_rest : bool or None
        Whether the velocity there is zero (below 1 cm/s); None without velocities.
    feed_forward : float or None
        The most that is to be commanded in addition to the acceleration [m/s^2]; None where none is stated.
    lead : float
        How much earlier than planned the rows are to be sent [s].
    notes : tuple of str
        One sentence for each thing that is unusual, and may be meant.
    """

    problems: tuple[str, ...]
    rows: int
    duration: float
    rate: float
    largest_jump: float
    jump_time: float
    axes: tuple[AxisFigures, ...]
    starts_at_rest: bool | None
    ends_at_rest: bool | None
    feed_forward: float | None = None
    lead: float = 0.0
    notes: tuple[str, ...] = ()

    @property
    def ok(self) -> bool:
        """True when nothing is wrong."""
        return not self.problems


def check_samples(samples: Samples, *, resolution: float = 1e-3) -> ConsistencyReport:
    """Report whether samples are uniform in time, finite, and consistent with their own derivatives.

    Parameters
    ----------
    samples : Samples
        As read from a file, in any frame. Feed-forward is no part of the motion: the columns of the motion must be
        consistent without it.
    resolution : float
        What rounding may have done to a difference of two values [m, m/s, rad]; the default suits three decimals.

    Returns
    -------
    ConsistencyReport
        ``.ok`` tells; ``.problems`` says what and when.
    """
    problems = _infinities(samples)
    if problems or len(samples) < 2:
        problems += [] if problems else ["there is only one sample: a path needs two or more"]
        return ConsistencyReport(tuple(problems), len(samples), 0.0, 0.0, 0.0, 0.0, (), None, None)
    rows, advancing = len(samples), _advancing(samples.t)
    problems += _standing_still(samples, advancing)
    samples = samples[advancing]
    if len(samples) < 2:
        return ConsistencyReport(tuple(problems), rows, 0.0, 0.0, 0.0, 0.0, (), None, None)
    problems += _uneven_steps(samples.t) + _wrapped(samples)
    axes = tuple(_axes(samples, resolution, problems))
    problems += _leaps(samples, resolution) if samples.velocity is None else []
    jumps = np.linalg.norm(np.diff(samples.position, axis=0), axis=1)
    far = int(jumps.argmax())
    rests = _rest(samples)
    figures = (samples.duration, samples.rate, float(jumps[far]), float(samples.t[far]))
    feed_forward = None if samples.feed_forward is None else float(np.linalg.norm(samples.feed_forward, axis=1).max())
    if feed_forward is not None and feed_forward > LARGEST_ACCELERATION:  # no drag asks for it: other units, perhaps
        most = f"{feed_forward:.3g} m/s^2, more than {LARGEST_ACCELERATION:g}"
        problems.append(f"the feed-forward reaches {most}: it is an acceleration in m/s^2")
    found = (tuple(problems), rows, *figures, axes, *rests, feed_forward, samples.lead)
    return ConsistencyReport(*found, notes=_doubts(samples))


def _doubts(samples: Samples) -> tuple[str, ...]:
    """Return a sentence on a yaw of many turns, some of them within less than a second: laps turn more slowly."""
    if samples.yaw is None or np.abs(np.diff(samples.yaw) / np.diff(samples.t)).max(initial=0.0) <= 2.0 * np.pi:
        return ()
    return tuple(filter(None, [in_degrees(samples.yaw)]))


def _infinities(samples: Samples) -> list[str]:
    problems = []
    for name, values in samples.columns().items():
        bad = np.flatnonzero(~np.isfinite(values))
        if bad.size:
            problems.append(f"{name} is {values[bad[0]]} in sample {bad[0]}: every number must be finite")
    return problems


def _advancing(t: FloatArray) -> BoolArray:
    """Tell the instants that come after all before them."""
    return np.concatenate([[True], t[1:] > np.maximum.accumulate(t)[:-1]])


def _standing_still(samples: Samples, advancing: BoolArray) -> list[str]:
    """Say where time does not go on: the rest of the samples is judged without these."""
    late = np.flatnonzero(~advancing)
    if not late.size:
        return []
    row, t = int(late[0]), samples.t
    more = f" ({late.size} such samples)" if late.size > 1 else ""
    jump = float(np.linalg.norm(samples.position[row] - samples.position[row - 1]))
    far = f", {jump:.4g} m apart" if jump else ""
    return [f"time goes from {t[row - 1]} s to {t[row]} s at sample {row}{far}: it must increase{more}"]


def _uneven_steps(t: FloatArray) -> list[str]:
    """Compare with the uniform grid to 2 % of a step, which allows rounding to milliseconds at 30 Hz."""
    even = (t[-1] - t[0]) / (len(t) - 1)
    astray = np.abs(t - (t[0] + even * np.arange(len(t))))
    worst = int(astray.argmax())
    if astray[worst] <= 0.02 * even:
        return []
    return [f"the rate is not uniform: sample {worst} is at {t[worst]:.6g} s, {astray[worst]:.3g} s off the even grid"]


def _wrapped(samples: Samples) -> list[str]:
    """Find steps of the yaw that are half a turn or more away from what its rate says, or from none without a rate."""
    if samples.yaw is None:
        return []
    rate = np.zeros(len(samples)) if samples.yaw_rate is None else samples.yaw_rate
    astray = np.diff(samples.yaw) - np.diff(samples.t) * (rate[:-1] + rate[1:]) / 2.0
    worst = int(np.abs(astray).argmax())
    if abs(astray[worst]) < np.pi:
        return []
    return [
        f"yaw jumps from {samples.yaw[worst]:.4g} to {samples.yaw[worst + 1]:.4g} rad at t = {samples.t[worst]:.6g} s: "
        "in a file it is continuous, so unwrap it (numpy.unwrap)"
    ]


def _axes(samples: Samples, resolution: float, problems: list[str]) -> Iterator[AxisFigures]:
    """Yield the figures of each coordinate, and of the yaw where it is known, and record what is wrong."""
    columns, t = samples.columns(), samples.t
    for names in (*((axis, f"v{axis}", f"a{axis}") for axis in axis_names(samples.dim)), ("yaw", "yaw_rate", "")):
        place, speed, acceleration = map(columns.get, names)
        if place is not None:
            fastest = np.abs(speed if speed is not None else np.diff(place) / np.diff(t)).max()
            hardest = None if acceleration is None else float(np.abs(acceleration).max())
            turns = _thrust_turns(samples) if names[0] == "yaw" else 0.0
            mismatches = [_mismatch(*pair, columns, t, resolution + turns, problems) for pair in pairwise(names)]
            lowest, highest = float(place.min()), float(place.max())
            yield AxisFigures(names[0], lowest, highest, float(fastest), hardest, *mismatches)


def _thrust_turns(samples: Samples) -> float | FloatArray:
    """Return by what angle the thrust turns in each step, (m - 1,) [rad]: a heading from the tilt may turn with it.

    Where a plan has no limit on its jerk the thrust tilts, and such a heading turns, between two samples.
    """
    pull = samples.acceleration
    if pull is None or samples.dim != 3:
        return 0.0
    thrust = pull + np.array([0.0, 0.0, GRAVITY])
    size = np.linalg.norm(thrust, axis=1)
    along = np.einsum("md,md->m", thrust[1:], thrust[:-1]) / np.maximum(size[1:] * size[:-1], 1e-9)
    return np.asarray(np.arccos(np.clip(along, -1.0, 1.0)))


def _mismatch(
    name: str,
    derivative: str,
    columns: Mapping[str, FloatArray],
    t: FloatArray,
    resolution: float | FloatArray,
    problems: list[str],
) -> float | None:
    """Return by how much slopes are outside the range that the derivative's column allows, and record the worst."""
    values, slopes = columns.get(name), columns.get(derivative)
    if values is None or slopes is None:
        return None
    steps = np.diff(t)
    slope = np.diff(values) / steps
    low, high = allowed_slopes(slopes)
    excess = np.maximum(low - slope, slope - high) - (resolution + 1e-12 * np.abs(values).max()) / steps
    worst = int(excess.argmax())
    if excess[worst] > 0:
        problems.append(
            f"{name} and {derivative} disagree at t = {t[worst]:.6g} s: {name} changes by {slope[worst]:.4g} a second, "
            f"{derivative} there goes from {slopes[worst]:.4g} to {slopes[worst + 1]:.4g}"
        )
        return float(excess[worst])
    astray = _astray(slopes, slope) - (np.max(resolution) + 1e-12 * np.abs(values).max()) / steps.min()
    worst = int(astray.argmax())
    if astray[worst] > 0:
        problems.append(
            f"{derivative} is {slopes[worst]:.4g} at t = {t[worst]:.6g} s, where {name} changes by "
            f"{slope[max(worst - 1, 0)]:.4g} and {slope[min(worst, len(slope) - 1)]:.4g} a second before and after"
        )
    return float(max(astray[worst], 0.0))


def _astray(slopes: FloatArray, slope: FloatArray) -> FloatArray:
    """By how much samples of a derivative are outside the slopes of the four nearest steps and the range of all."""
    padded = np.concatenate([slope[:1], slope[:1], slope, slope[-1:], slope[-1:]])
    around = np.lib.stride_tricks.sliding_window_view(padded, 4)
    return np.asarray(np.maximum(around.min(axis=1) - slopes, slopes - around.max(axis=1)) - np.ptp(slope))


def allowed_slopes(slopes: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Bounds on the mean slope of each step, shapes (m-1,), from the derivative's column of shape (m,).

    The range of the six samples nearest to the step, widened by its own length on either side, or by a quarter of the
    greatest change over a step of the file: so much a mean differs that rises and falls again at that rate between two
    samples. The last step may cover less time than its column says, since a file ends with the last state of its path;
    its bounds include zero.
    """
    padded = np.pad(slopes, 2, "edge")
    around = np.lib.stride_tricks.sliding_window_view(padded, 6)
    low, high = around.min(axis=1), around.max(axis=1)
    span = np.maximum(high - low, 0.25 * np.abs(np.diff(slopes)).max(initial=0.0))
    low, high = low - span, high + span
    low[-1], high[-1] = min(low[-1], 0.0), max(high[-1], 0.0)
    return low, high


def _leaps(samples: Samples, resolution: float) -> list[str]:
    """Find second differences of the positions beyond the acceleration of any vehicle."""
    if len(samples) < 3:
        return []
    step = samples.duration / (len(samples) - 1)
    implied = np.linalg.norm(np.diff(samples.position, 2, axis=0), axis=1) / step**2
    worst = int(implied.argmax())
    if implied[worst] <= LARGEST_ACCELERATION + 2 * resolution / step**2:
        return []
    when = samples.t[worst + 1]
    return [f"the position jumps at t = {when:.6g} s: the acceleration implied there is {implied[worst]:.3g} m/s^2"]


def _rest(samples: Samples) -> tuple[bool | None, bool | None]:
    if samples.velocity is None:
        return None, None
    speed = np.linalg.norm(samples.velocity[[0, -1]], axis=1)
    return bool(speed[0] < 0.01), bool(speed[1] < 0.01)
