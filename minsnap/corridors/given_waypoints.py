"""Waypoints as callers have them: tables with named columns, gates, and numbers that look like another unit."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from minsnap.basics.arrays import FloatArray, OwnsArrays, numbers
from minsnap.basics.checks import check_tolerance, check_waypoints
from minsnap.basics.messages import shown
from minsnap.basics.warn import warn_caller
from minsnap.corridors.gates import Ball, Gate, center_of
from minsnap.errors import MagnitudeWarning, MinsnapError, WaypointError

AXES = ("x", "y", "z")
BESIDE = ("yaw", "speed", "duration", "t", "time")
"""Columns that a table of waypoints may have beside its coordinates."""

LONG, HIGH = 1000.0, 500.0
"""Extent and altitude from which waypoints may be millimetres [m]."""

ORDINARY = LONG / 2.0
"""Coordinate of the first two waypoints below which all may be looked at no further [m]."""

NEAR = 1e-6
"""Share of the extent of waypoints within which the ends of a lap may be meant to be one point."""

DEGREES_EXTENT, DEGREES_SHARE = 0.02, 0.005
"""Extent below which waypoints may be latitudes and longitudes [m]; or as a share of their distance from zero."""


@dataclass(frozen=True, eq=False)
class Waypoints(OwnsArrays):
    """The columns of a table or file of waypoints; its fields are arguments of :func:`minsnap.plan`.

    Parameters
    ----------
    points : ndarray, shape (n, 2) or (n, 3)
        Waypoints [m].
    yaw : ndarray, shape (n,), or None
        Heading at each [rad].
    durations : ndarray, shape (n - 1,), or None
        Seconds of each leg.
    speeds : ndarray, shape (n - 1,), or None
        Greatest speed on each leg [m/s]; a column has it at the waypoint where the leg begins.
    """

    points: FloatArray
    yaw: FloatArray | None = None
    durations: FloatArray | None = None
    speeds: FloatArray | None = None

    @classmethod
    def of_columns(
        cls, columns: Mapping[str, FloatArray], where: str = "", error: type[MinsnapError] = WaypointError
    ) -> Waypoints:
        """Return waypoints from columns x, y and z, yaw [rad] and duration, t or time [s].

        Parameters
        ----------
        columns : mapping of str to ndarray, shape (n,)
            A duration is that of a leg, with the first or the last one not a number; t and time are instants.
        where : str
            What errors begin with.
        error : type
            What they are, if two columns say when waypoints are passed, or one says it wrongly.
        """
        timed = [name for name in BESIDE[2:] if name in columns]
        if len(timed) > 1:
            raise error(f"{where}{' and '.join(timed)} both say when waypoints are passed: leave one out")
        points = np.stack([columns[axis] for axis in AXES if axis in columns], axis=-1)
        try:
            durations = _durations(columns[timed[0]], timed[0]) if timed else None
        except ValueError as wrong:
            raise error(f"{where}{wrong}") from None
        return cls(points, columns.get("yaw"), durations, _speeds(columns.get("speed"), where, error))

    def closed(self) -> Waypoints:
        """Return the waypoints of a lap: those that do not end where they begin go on to the first one again.

        Durations are left out then, since none is known for the leg that closes the lap.
        """
        if np.array_equal(self.points[0], self.points[-1]):
            return self
        yaw = None if self.yaw is None else np.append(self.yaw, self.yaw[0])
        return Waypoints(np.concatenate((self.points, self.points[:1])), yaw)


def _speeds(column: FloatArray | None, where: str, error: type[MinsnapError]) -> FloatArray | None:
    """Return the speeds of legs from a column, of which the last waypoint's is not read."""
    if column is None:
        return None
    wrong = np.flatnonzero(~(np.isfinite(column[:-1]) & (column[:-1] > 0.0)))
    if wrong.size:
        said = f"the speed of leg {wrong[0]} is {column[wrong[0]]:g}"
        raise error(f"{where}{said}: give a positive number at each waypoint but the last [m/s]")
    return column[:-1]


def lap_of(waypoints: Any, durations: Any = None) -> Any:
    """Return the waypoints of a closed lap: those that do not end where they begin go on to the first one again.

    What is refused later stays: no waypoints, those that end within rounding of where they begin, and those whose
    durations leave out the leg that closes the lap.
    """
    try:
        rows = list(waypoints)
    except TypeError:
        return waypoints
    points = numbers([center_of(row) for row in rows])
    if points is None or points.ndim != 2 or len(points) < 3 or not np.isfinite(points).all():
        return waypoints
    times = numbers(durations) if durations is not None else None
    if times is not None and times.shape == (len(points) - 1,):
        return waypoints
    apart = float(np.abs(points[-1] - points[0]).max())
    return [*rows, rows[0]] if apart > NEAR * float(np.ptp(points, axis=0).max()) else waypoints


def is_table(waypoints: Any) -> bool:
    """Whether waypoints have named columns: a data frame, a structured array, or a mapping of columns."""
    names = _names(waypoints)
    return names is not None and not all(isinstance(name, (int, np.integer)) for name in names)


def read_columns(waypoints: Any) -> Waypoints:
    """Return waypoints by the names of their columns: x, y and z, yaw [rad], speed [m/s] and t, time or duration [s].

    Raises
    ------
    WaypointError
        If x or y is missing, a column is not known or not of numbers, or two say when waypoints are passed.
    """
    names = [str(name) for name in _names(waypoints) or ()]
    unknown = [name for name in names if name.lower() not in AXES + BESIDE]
    lower = [name.lower() for name in names]
    if unknown or not {"x", "y"} <= set(lower) or len(set(lower)) < len(lower):
        what = f"the column {shown(unknown[0])}" if unknown else f"the columns {', '.join(names)}"
        raise WaypointError(
            f"the table of waypoints has {what}: select x, y and z, and where meant yaw, speed and t or duration"
        )
    return Waypoints.of_columns({name.lower(): _column(waypoints, name) for name in names})


def _names(waypoints: Any) -> list[Any] | None:
    if isinstance(waypoints, np.ndarray):
        return list(waypoints.dtype.names) if waypoints.dtype.names else None
    if isinstance(waypoints, Mapping):
        return list(waypoints)
    columns = getattr(waypoints, "columns", None)
    return None if columns is None else list(columns)


def _column(waypoints: Any, name: str) -> FloatArray:
    try:
        values = np.array(waypoints[name], dtype=np.float64)
    except (TypeError, ValueError):
        values = np.zeros((0, 0))
    if values.ndim != 1:
        raise WaypointError(f"the column {name} of the waypoints must be numbers, one for each waypoint")
    return values


def _durations(values: FloatArray, name: str) -> FloatArray:
    if name != "duration":
        late = np.flatnonzero(~(np.diff(values) > 0.0))
        if len(late):
            at = int(late[0])
            raise ValueError(
                f"waypoint {at + 1} is passed at {name} = {values[at + 1]:g} s, not after waypoint {at} at "
                f"{values[at]:g} s"
            )
        return np.diff(values)
    blank = np.isnan(values)
    if blank.sum() == 1 and (blank[0] or blank[-1]):
        return values[~blank]
    raise ValueError(
        f"{len(values)} waypoints have {len(values) - 1} legs: leave the duration of the first or the last one empty; "
        f"{int(blank.sum())} are"
    )


class Knots(NamedTuple):
    """Waypoints as numbers: points (n, dim), half-widths of boxes (n, dim) and radii of balls (n,) around them [m]."""

    points: FloatArray
    widths: FloatArray
    radii: FloatArray
    gates: Mapping[int, Gate]


def as_knots(waypoints: Any, tolerance: Any = None) -> Knots | None:
    """Return the arguments ``waypoints`` and ``waypoint_tolerance`` as numbers; None without waypoints.

    Raises
    ------
    WaypointError
        If they are malformed, or there is a tolerance without waypoints.
    """
    if waypoints is None:
        if tolerance is not None:
            raise WaypointError(
                "waypoint_tolerance needs waypoints: without them the overlaps of the corridor bound them"
            )
        return None
    centers, gates = without_gates(waypoints)
    points = check_waypoints(centers)
    if isinstance(tolerance, Ball):
        return Knots(points, np.zeros(points.shape), tolerance.of_waypoints(len(points)), gates)
    return Knots(points, check_tolerance(tolerance, points), np.zeros(len(points)), gates)


def without_gates(waypoints: Any) -> tuple[Any, dict[int, Gate]]:
    """Return waypoints with centers in place of gates, and the gates by waypoint."""
    listed = waypoints if isinstance(waypoints, (list, tuple)) else ()
    gates = {index: entry for index, entry in enumerate(listed) if isinstance(entry, Gate)}
    return (list(map(center_of, listed)) if gates else waypoints), gates


def check_dimension(points: FloatArray) -> None:
    """Raise WaypointError if waypoints (n, dim) look like an array whose rows are x, y and z."""
    rows, columns = points.shape
    if is_transposed(rows, columns):
        raise WaypointError(
            f"waypoints have {rows} rows of {columns} coordinates: give rows of x, y, z (transpose an array whose rows "
            "are x, y and z); with more than three coordinates, give more than three waypoints"
        )


def is_transposed(rows: int, columns: int) -> bool:
    """Whether an array of waypoints has at most three rows, and more coordinates than space has."""
    return rows <= 3 < columns


def warn_magnitude(points: FloatArray) -> None:
    """Warn of waypoints (n, dim) that look like millimetres, or like latitudes and longitudes, in place of metres."""
    first, second = points[:2].tolist()
    for value in first + second:
        if not -ORDINARY < value < ORDINARY:
            break
    else:
        if not _beside(first, second):
            return
    degrees = in_degrees(points)
    extent = np.ptp(points, axis=0)
    whole = bool((points == np.round(points)).all())
    high = points.shape[1] == 3 and np.abs(points[:, 2]).max() >= HIGH
    if extent.max() >= LONG and (whole or high):
        warn_caller(
            f"waypoints extend over {extent.max():g} m: if they are millimetres, divide them by 1000, "
            "and by 100 if they are centimetres",
            MagnitudeWarning,
        )
    elif degrees is not None:
        warn_caller(degrees, MagnitudeWarning)


def in_degrees(points: FloatArray) -> str | None:
    """Return a sentence where waypoints (n, dim) look like latitudes and longitudes, else None.

    Raises
    ------
    WaypointError
        If they are malformed.
    """
    points = check_waypoints(points)
    first, second = points[0].tolist(), points[1].tolist()
    if points.shape[1] < 2 or not _beside(first, second):
        return None
    extent = float(np.ptp(points[:, :2], axis=0).max())
    if extent >= _degrees_extent(first):
        return None
    return (
        f"waypoints near ({first[0]:g}, {first[1]:g}) lie within {extent:.2g} m: if they are latitudes and longitudes, "
        "convert them to metres"
    )


def _beside(first: list[float], second: list[float]) -> bool:
    """Whether two points are so near to each other, and so far from zero, as degrees on the globe are."""
    if abs(second[0] - first[0]) >= _degrees_extent(first):
        return False
    steps = [abs(b - a) for a, b in zip(first[:2], second[:2], strict=True)]
    return 0.0 < max(steps) < _degrees_extent(first) and 1.0 < max(map(abs, first[:2])) <= 180.0


def _degrees_extent(point: list[float]) -> float:
    """Return the extent below which waypoints near a point may be latitudes and longitudes."""
    return max(DEGREES_EXTENT, DEGREES_SHARE * max(map(abs, point[:2])))
