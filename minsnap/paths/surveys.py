r"""Surveys of areas and facades: parallel lines at constant speed, and turns outside as quick as the limits allow.

A line is flown exactly straight and exactly at its speed: a polynomial of degree 1. Each turn is a plan of its own,
from the velocity of one line to that of the next with no acceleration and no jerk at both ends, so that all three are
continuous; it stays on the far side of the end of its lines, which is proved. The first line is flown towards from rest
along itself, and so is left the last one.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from minsnap.basics.arrays import ArrayLike, FloatArray, ReadOnly, bounded, numbers
from minsnap.basics.checks import check_number, check_positive
from minsnap.basics.messages import explains_names, shown
from minsnap.errors import ShapeError
from minsnap.limits.limits import Limits
from minsnap.limits.ordinary import ordinary_limits
from minsnap.planning.planner import plan
from minsnap.trajectory.norm_maxima import extent_along
from minsnap.trajectory.planned_heading import Yaw, chosen_heading
from minsnap.trajectory.planned_path import PlannedPath
from minsnap.trajectory.trajectory import Trajectory, concatenate

if TYPE_CHECKING:
    from minsnap.paths.ground_lines import GroundLines
    from minsnap.paths.routes.terrain import Terrain


@dataclass(frozen=True)
class SurveySettings:
    """How a survey is laid out.

    Parameters
    ----------
    most : int
        Most lines.
    speed : float
        Speed on the lines unless it is said [m/s].
    run_up : float
        How much longer the way to the first line is than the one in which its speed is just reached.
    inside : float
        How far a turn may lie on the near side of the end of its lines, for rounding [m].
    climbing : float
        Limit of the speed where lines climb with the ground, over their speed as seen from above.
    """

    most: int = 2000
    speed: float = 3.0
    run_up: float = 1.25
    inside: float = 1e-6
    climbing: float = 1.25


SURVEY = SurveySettings()
"""The usual ones."""


@dataclass(frozen=True, eq=False)
class Survey(ReadOnly, PlannedPath):
    """A planned survey; a path like any other.

    Parameters
    ----------
    trajectory : Trajectory
        The whole flight, from rest to rest.
    lines : ndarray, shape (k, 2, 3)
        Where each line begins and ends [m].
    spans : ndarray, shape (k, 2)
        When [s].
    outline : ndarray, shape (n, 3)
        Corners of what is covered [m].
    speed : float
        On the lines [m/s].
    limits : Limits
        Of the turns.
    outside : float
        No turn comes nearer to the area than this beyond the ends of its two lines [m]; proved; negative by rounding.
    terrain : Terrain or None
        The ground below.
    """

    trajectory: Trajectory
    lines: FloatArray
    spans: FloatArray
    outline: FloatArray
    speed: float
    limits: Limits
    outside: float
    terrain: Terrain | None = None

    @property
    def on_lines(self) -> float:
        """Share of the flight that is on lines."""
        return float(np.diff(self.spans).sum() / self.trajectory.duration)


@explains_names({"altitude": "height="})
def plan_survey(
    outline: ArrayLike,
    spacing: float,
    height: float,
    *,
    angle: float | None = None,
    speed: float | None = None,
    limits: Limits | None = None,
    margin: float = 0.0,
    yaw: Yaw = "velocity",
    terrain: Terrain | None = None,
    within: float | None = None,
) -> Survey:
    """Plan parallel lines over an area, at a constant height and speed; or above the ground, which lines follow then.

    Parameters
    ----------
    outline : array_like, shape (n, 2)
        Corners of the area in order, three or more [m]. A line goes as far as the area does in its strip, half a
        spacing to both sides, over notches too.
    spacing : float
        Distance of neighbouring lines [m]; the outer ones are half of it inside.
    height : float
        z of all lines [m].
    angle : float, optional
        Direction of the lines, counter-clockwise from x [rad]; by default along the side for which they are fewest.
    speed : float, optional
        On the lines [m/s]; by default that of the limits, or 3.
    limits : Limits, optional
        Of the turns; by default the ordinary ones, with the speed of the lines.
    margin : float
        How far lines go on beyond the area, at both ends [m].
    yaw
        As :func:`minsnap.plan` takes it; by default along the flight.
    terrain : Terrain, optional
        The ground (:func:`minsnap.paths.routes.read_terrain`). The height is above it then, and a line follows it:
        straight as seen from above and at its speed over the ground, while it climbs and descends.
    within : float, optional
        With ``terrain``: how far lines may be above and below their height over the ground [m], which is proved.

    Returns
    -------
    Survey

    Raises
    ------
    ShapeError
        If the outline is no area, or a number makes no sense.
    WaypointError
        If the ground is not known below the flight, or too steep for the turns.
    InfeasibleError
        If no turn within the limits was found, or no line.

    Examples
    --------
    >>> import minsnap
    >>> found = minsnap.plan_survey([(0, 0), (60, 0), (60, 40), (0, 40)], spacing=10, height=30, speed=5)
    >>> len(found.lines), minsnap.certify(found.trajectory, limits=found.limits).ok
    (4, True)
    """
    corners = _corners(outline)
    check_positive("the spacing", spacing, "m", ShapeError)
    z = float(check_number("the height", height, -math.inf, math.inf, "give a finite number [m]", ShapeError))
    if angle is not None:
        check_number("the angle", angle, -math.inf, math.inf, "give a finite number [rad]", ShapeError)
    along = _direction(corners) if angle is None else np.array([math.cos(angle), math.sin(angle)])
    across = np.array([-along[1], along[0]])
    frame = np.array([[*along, 0.0], [*across, 0.0]])
    lines = _lines(corners @ np.array([along, across]).T, float(spacing), float(margin))
    base = np.array([0.0, 0.0, z])
    outline = np.column_stack([corners, np.full(len(corners), z)])
    if terrain is None and within is None:
        return _flown(lines, frame, base, outline, speed, limits, yaw)
    from minsnap.paths.ground_lines import GroundLines

    return _flown(lines, frame, base, outline, speed, limits, yaw, GroundLines.of(terrain, z, within))


@explains_names({})
def plan_facade(
    start: Sequence[float],
    end: Sequence[float],
    low: float,
    high: float,
    spacing: float,
    *,
    distance: float = 0.0,
    speed: float | None = None,
    limits: Limits | None = None,
    margin: float = 0.0,
) -> Survey:
    """Plan level lines in front of a wall, from the lowest up, with the nose at the wall.

    Parameters
    ----------
    start, end : sequence of 2 float
        Ends of the wall's base [m].
    low, high : float
        Heights between which it is covered [m].
    spacing : float
        Distance of neighbouring lines [m]; the outer ones are half of it inside.
    distance : float
        Of the vehicle from the wall [m]: to the left of the way from start to end; to its right where it is negative.
    speed, limits, margin
        As :func:`plan_survey` takes them.

    Returns
    -------
    Survey

    Raises
    ------
    ShapeError
        If the wall has no length or no height, or a number makes no sense.
    InfeasibleError
        If no turn within the limits was found.
    """
    ends = numbers([start, end])
    if ends is None or ends.shape != (2, 2) or not bounded(ends).all() or (ends[0] == ends[1]).all():
        raise ShapeError(f"the wall is from {shown(start)} to {shown(end)}: give two different places x, y [m]")
    for name, value in (("low", low), ("high", high), ("distance", distance)):
        check_number(f"the number {name}", value, -math.inf, math.inf, "give a finite number [m]", ShapeError)
    if not low < high:
        raise ShapeError(f"the wall is from {low:g} to {high:g} m: give the lower height first")
    check_positive("the spacing", spacing, "m", ShapeError)
    away = ends[1] - ends[0]
    length = float(np.linalg.norm(away))
    along = away / length
    left = np.array([-along[1], along[0]])
    frame = np.array([[*along, 0.0], [0.0, 0.0, 1.0]])
    corners = np.array([(0.0, low), (length, low), (length, high), (0.0, high)])
    base = np.array([*(ends[0] + distance * left), 0.0])
    side = -math.copysign(1.0, distance) * left
    heading = math.atan2(side[1], side[0])
    outline = corners @ frame + np.array([*ends[0], 0.0])
    return _flown(_lines(corners, float(spacing), float(margin)), frame, base, outline, speed, limits, heading)


def _corners(outline: ArrayLike) -> FloatArray:
    corners = numbers(outline)
    if corners is None or corners.ndim != 2 or corners.shape[1] not in (2, 3) or not bounded(corners).all():
        raise ShapeError(f"the outline is {shown(outline)}: give the corners of an area, one row x, y for each [m]")
    corners = corners[:, :2]
    corners = corners[:-1] if len(corners) > 3 and (corners[0] == corners[-1]).all() else corners
    x, y = corners.T
    area = 0.5 * float(x @ np.roll(y, -1) - y @ np.roll(x, -1)) if len(corners) > 2 else 0.0
    if abs(area) <= 1e-9 * max(float(np.ptp(corners)), 1e-9) ** 2:
        raise ShapeError(f"the outline of {len(corners)} corners has no area: give three corners or more, in order")
    return corners


def _direction(corners: FloatArray) -> FloatArray:
    """Return the direction of the side across which the area is narrowest: lines along it are fewest."""
    sides = np.roll(corners, -1, axis=0) - corners
    sides = sides[np.linalg.norm(sides, axis=1) > 0.0]
    sides = sides / np.linalg.norm(sides, axis=1)[:, None]
    widths = [float(np.ptp(corners @ (-side[1], side[0]))) for side in sides]
    return np.asarray(sides[int(np.argmin(np.round(widths, 9)))])


def _lines(corners: FloatArray, spacing: float, margin: float) -> FloatArray:
    """Return lines along the first axis, in turn there and back: shape (k, 2, 2), evenly at most a spacing apart.

    Each reaches as far as the outline does in its strip. Two neighbours go as far as the farther one where they turn.
    """
    low, high = float(corners[:, 1].min()), float(corners[:, 1].max())
    count = max(1, math.ceil((high - low) / spacing - 1e-9))
    if count > SURVEY.most:
        raise ShapeError(f"the area takes {count} lines, and at most {SURVEY.most} are planned: give a larger spacing")
    if not math.isfinite(margin) or margin < 0.0:
        raise ShapeError(f"the margin is {margin:g}: give a length of 0 or more [m]")
    places = low + (np.arange(count) + 0.5) * (high - low) / count
    half = 0.5 * (high - low) / count
    ends = np.array([_extent(corners, y - half, y + half) for y in places])
    for i in range(count - 1):
        side = 1 - i % 2  # 1: line i ends at its greater end, where the next one begins
        ends[i : i + 2, side] = (np.max if side else np.min)(ends[i : i + 2, side])
    ends += margin * np.array([-1.0, 1.0])
    lines = np.stack([ends, np.repeat(places[:, None], 2, axis=1)], axis=2)
    lines[1::2] = lines[1::2, ::-1]
    return lines


def _extent(corners: FloatArray, low: float, high: float) -> tuple[float, float]:
    """Return from where to where the outline reaches along the first axis, in a strip between two level lines."""
    after = np.roll(corners, -1, axis=0)
    found = [*corners[(corners[:, 1] >= low) & (corners[:, 1] <= high), 0]]
    for y in (low, high):
        passes = (corners[:, 1] - y) * (after[:, 1] - y) < 0.0
        one, two = corners[passes], after[passes]
        found += list(one[:, 0] + (y - one[:, 1]) / (two[:, 1] - one[:, 1]) * (two[:, 0] - one[:, 0]))
    return min(found), max(found)


def _flown(
    lines: FloatArray,
    frame: FloatArray,
    base: FloatArray,
    outline: FloatArray,
    speed: float | None,
    limits: Limits | None,
    yaw: Any,
    ground: GroundLines | None = None,
) -> Survey:
    """Return the survey of lines (k, 2, 2) in a plane: at a base, along the two rows of a frame; or over the ground."""
    if limits is None:
        chosen = SURVEY.speed if speed is None else speed
        check_positive("the speed", chosen, "m/s", ShapeError)
        limits = replace(ordinary_limits(), speed=(1.0 if ground is None else SURVEY.climbing) * float(chosen))
        speed = float(chosen)
    own = limits.speed if limits.speed is not None else SURVEY.speed
    pace = float(own if speed is None else speed)
    check_positive("the speed", pace, "m/s", ShapeError)
    if limits.speed is not None and pace > limits.speed:
        raise ShapeError(f"the speed on the lines is {pace:g} m/s, above the limit of {limits.speed:g}")
    placed = lines @ frame + base
    ways = np.diff(placed, axis=1)[:, 0]
    lengths = np.linalg.norm(ways, axis=1)
    if (lengths <= 0.0).any():
        raise ShapeError("a line has no length: give a margin, or another angle")
    ways = ways / lengths[:, None]
    flown = [Trajectory(line[None], [length / pace]) for line, length in zip(placed, lengths, strict=True)]
    if ground is not None:
        flown = [ground.line(line, pace, limits) for line in placed]
        placed = np.array([[line(0.0), line(line.duration)] for line in flown])
    parts, spans, outside, now = [], [], [], 0.0
    # A run-up to the first line, then every line at its pace with a turn to the next one, and a run-out. A turn must
    # not come back over the line: `outside` is how far beyond the line's end the nearest place of each turn is.
    parts.append(_run(placed[0, 0], ways[0], pace, limits))
    for i, line in enumerate(placed):
        now = sum(part.duration for part in parts)
        parts.append(flown[i])
        spans.append((now, now + lengths[i] / pace))
        if i + 1 < len(placed):
            turn = _turn(line[1], placed[i + 1, 0], ways[i], ways[i + 1], pace, limits)
            beyond = extent_along(turn.control_points, turn.durations, ways[i], 0)[0] - float(line[1] @ ways[i])
            outside.append(beyond)
            parts.append(turn)
    parts.append(_run(placed[-1, 1], -ways[-1], pace, limits, reverse=True))
    if ground is not None:
        ground.check(parts)
    curve = concatenate([_plain(part) for part in parts])
    curve = curve.with_yaw(chosen_heading(yaw, curve.dim, False)(curve)) if yaw is not None else curve
    below = None if ground is None else ground.terrain
    return Survey(curve, placed, np.array(spans), outline, pace, limits, min(outside, default=math.inf), below)


def _plain(curve: Trajectory) -> Trajectory:
    """Return a part as polynomials of degree 7, one a leg and without a heading."""
    from minsnap.trajectory.norm_maxima import elevated_points

    points = elevated_points(curve.control_points, 7)
    return Trajectory(points, curve.durations)


def _turn(
    start: FloatArray, end: FloatArray, leaving: FloatArray, arriving: FloatArray, pace: float, limits: Limits
) -> Trajectory:
    """Return the quickest turn found from the end of a line to the start of the next."""
    pinned: dict[str, Any] = {"start": {"velocity": pace * leaving}, "end": {"velocity": pace * arriving}}
    return plan([start, end], limits=limits, **pinned)


def _run(place: FloatArray, way: FloatArray, pace: float, limits: Limits, reverse: bool = False) -> Trajectory:
    """Return the way from rest to a line's speed at its first place, or with ``reverse`` from its last one to rest."""
    build = pace / math.sqrt(limits.jerk) if limits.jerk is not None else 0.0
    braking = pace * pace / (2.0 * limits.acceleration) if limits.acceleration is not None else 0.0
    rest = place - SURVEY.run_up * max(braking + build * math.sqrt(pace), pace * 0.5) * way
    if reverse:
        return plan([place, rest], limits=limits, start={"velocity": -pace * way})
    return plan([rest, place], limits=limits, end={"velocity": pace * way})
