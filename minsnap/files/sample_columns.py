"""Samples in tables of other programs: their columns by name or by the names and units that are usual.

Names are compared without case, spaces, dots, underscores and what brackets hold, which is the unit: ``p_x``, ``px``,
``x [m]``, ``Pos X (m)`` and ``stateEstimate.x`` are one column. Positions may be latitude, longitude and altitude, with
an origin. What is in no known column is left out.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.checks import check_array
from minsnap.basics.messages import shown
from minsnap.basics.storage.table import number_row, read_cells
from minsnap.basics.storage.text import FileName
from minsnap.errors import FileError
from minsnap.files.geodesy import local_positions

TIMES = {"s": 1.0, "sec": 1.0, "secs": 1.0, "second": 1.0, "seconds": 1.0, "ms": 1e-3, "msec": 1e-3, "us": 1e-6}
TIMES |= {"usec": 1e-6, "µs": 1e-6, "μs": 1e-6, "ns": 1e-9, "nsec": 1e-9, "min": 60.0}
LENGTHS = {"m": 1.0, "meter": 1.0, "meters": 1.0, "metre": 1.0, "metres": 1.0, "cm": 1e-2, "mm": 1e-3, "km": 1e3}
LENGTHS |= {"ft": 0.3048}
ANGLES = {"rad": 1.0, "radians": 1.0, "deg": math.radians(1.0), "degree": math.radians(1.0)}
ANGLES |= {"degrees": math.radians(1.0), "°": math.radians(1.0)}
PLACES = {"deg": 1.0, "degrees": 1.0, "°": 1.0}


def _rates(units: Mapping[str, float], power: str) -> dict[str, float]:
    """Return units of a derivative: with /s, s^-1 and so on behind them."""
    ends = {"": ("/s", "s^-1", " s^-1"), "2": ("/s2", "/s^2", "/s²", "/s/s", "s^-2")}[power]
    return {unit + end: factor for unit, factor in units.items() for end in ends}


_AXES = "xyz"


def _names(axis: str) -> dict[str, tuple[str, ...]]:
    """Return usual names, bare of case and separators, of the columns of an axis."""
    place = ("", "p", "pos", "position", "stateestimate", "poseposition", "ref", "t", "setpoint")
    speed = ("v", "vel", "velocity", "stateestimatev", "linearvelocity", "vlin", "linvel", "twistlinear")
    hard = ("a", "acc", "accel", "acceleration", "alin", "linearacceleration", "linacc")
    both = {axis: place, f"v{axis}": speed, f"a{axis}": hard}
    return {name: tuple(start + axis for start in starts) for name, starts in both.items()}


USUAL: dict[str, tuple[str, ...]] = {
    "t": ("t", "time", "timestamp", "times", "sec", "secs", "seconds", "timefromstart", "elapsedtime", "elapsed"),
    **{name: known for axis in _AXES for name, known in _names(axis).items()},
    "yaw": ("yaw", "psi", "stateestimateyaw", "stabilizeryaw"),
    "yaw_rate": ("yawrate", "yawspeed", "dyaw", "omegaz"),
    "lat": ("lat", "latitude"),
    "lon": ("lon", "lng", "long", "longitude"),
    "alt": ("alt", "altitude", "height", "elevation", "altitudemsl", "altmsl", "absolutealtitude"),
}
"""Columns, and the names under which other programs write them, bare of case and separators."""

UNITS: dict[str, dict[str, float]] = {
    "t": TIMES,
    **dict.fromkeys(("x", "y", "z", "alt"), LENGTHS),
    **dict.fromkeys(("vx", "vy", "vz"), _rates(LENGTHS, "")),
    **dict.fromkeys(("ax", "ay", "az"), _rates(LENGTHS, "2")),
    "yaw": ANGLES,
    "yaw_rate": _rates(ANGLES, ""),
    **dict.fromkeys(("lat", "lon"), PLACES),
}
"""Units of each column, and what they are in SI units (degrees for places)."""

CFLIB = "stateestimate"
"""How names of a Crazyflie's log begin: beside them, ``timestamp`` is in milliseconds and headings are in degrees."""

PLANE, GEODETIC = ("x", "y", "z"), ("lat", "lon", "alt")

_BRACKETS = re.compile(r"^(?P<name>[^\[\(]*)[\[\(](?P<unit>[^\]\)]*)[\]\)]\s*$")
_ENDING = re.compile(r"^(?P<name>.+)_(?P<unit>s|sec|ms|msec|us|usec|ns|m|cm|mm|deg|rad)$", re.IGNORECASE)


@dataclass(frozen=True)
class _Column:
    """A column of a file: where it stands, its name there and its unit, if it says one."""

    place: int
    name: str
    unit: str | None


def has_usual_columns(path: FileName) -> bool:
    """Whether the first line of a table names instants and positions in a usual way."""
    try:
        found = _usual(_header(read_cells(path)[0][1]))
    except FileError:
        return False
    return "t" in found and (set(PLANE) <= set(found) or set(GEODETIC) <= set(found))


def read_columns(
    path: FileName, named: Mapping[str, str] | None = None, origin: Sequence[float] | None = None
) -> tuple[dict[str, FloatArray], list[str]]:
    """Read the columns of samples from a table of any program.

    Parameters
    ----------
    path : str or path
        Commas, semicolons, tabs or spaces between the cells; decimal commas between other separators.
    named : mapping of str to str, optional
        Of our columns (``t``, ``x``, ``vx``, ``yaw``, ``lat``, …), the names in the file, with ``:unit`` behind those
        whose header does not say it: ``{"t": "clock:ms"}``. What it does not name is found by usual names.
    origin : sequence of 3 float, optional
        Latitude, longitude [degrees] and altitude [m] of the point (0, 0, 0), for files of latitudes and longitudes.

    Returns
    -------
    columns : dict of str to ndarray, shape (m,)
        ``t``, ``x``, ``y``, ``z`` and what else the file has, in SI units and radians.
    left_out : list of str
        Names in the file of the columns that were not read.

    Raises
    ------
    FileError
        If the file is malformed, lacks instants or positions, a unit is not known, or an origin is missing or idle.
    """
    rows = read_cells(path)
    header = _header(rows[0][1])
    found = _usual(header) | _chosen(path, header, named or {})
    by_degrees = origin is not None or (not set(PLANE) <= set(found) and bool({"lat", "lon"} & set(found)))
    place = GEODETIC if by_degrees else PLANE
    missing = [name for name in ("t", *place) if name not in found]
    if missing:
        listed = ", ".join(column.name for column in header)[:160]
        raise FileError(
            f"{path}, line {rows[0][0]}: no column is known as {', '.join(missing)}; the columns are {listed}: name "
            f"them, such as {missing[0]}=NAME (--columns {missing[0]}=NAME)"
        )
    wanted = {name: found[name] for name in UNITS if name in found and name not in {*PLANE, *GEODETIC} - {*place}}
    values = _numbers(path, rows, header, wanted)
    columns = {name: values[:, i] * _factor(path, name, wanted[name], header) for i, name in enumerate(wanted)}
    _check_seconds(path, columns["t"], wanted["t"])
    if place == GEODETIC:
        columns = _local(path, columns, origin)
    for group in (("vx", "vy", "vz"), ("ax", "ay", "az")):
        if any(name not in columns for name in group):
            wanted = {name: column for name, column in wanted.items() if name not in group}
            columns = {name: column for name, column in columns.items() if name not in group}
    taken = {column.place for column in wanted.values()}
    return columns, [column.name for column in header if column.place not in taken]


BESIDE = {"speed": ("speed",), "mode": ("altitudemode",)}
"""What tables of places may have beside them: the speed there, and what Litchi's heights are counted from."""


def geodetic_columns(path: FileName) -> tuple[dict[str, FloatArray], FloatArray | None]:
    """Read a table of places by latitude, longitude and altitude.

    Returns
    -------
    columns : dict of str to ndarray, shape (m,)
        ``lat``, ``lon`` [degrees], ``alt`` [m] and, where the table has it, ``speed`` [m/s].
    modes : ndarray, shape (m,), or None
        Litchi's ``altitudemode``: 0 above the start, 1 above the ground; None of another table.

    Raises
    ------
    FileError
        If it is malformed or lacks one of the three; says which line.
    """
    rows = read_cells(path)
    header = _header(rows[0][1])
    found = {name: column for name, column in _usual(header).items() if name in GEODETIC}
    missing = [name for name in GEODETIC if name not in found]
    if missing:
        listed = ", ".join(column.name for column in header)[:160]
        raise FileError(
            f"{path}, line {rows[0][0]}: no column is known as {', '.join(missing)}; the columns are {listed}"
        )
    beside = {name: column for name, known in BESIDE.items() for column in header if _bare(column.name) in known}
    values = _numbers(path, rows, header, found | beside)
    columns = dict(zip(found | beside, values.T, strict=True))
    for name in found:
        columns[name] = columns[name] * _factor(path, name, found[name], header)
    return columns, columns.pop("mode", None)


def parse_columns(text: str) -> dict[str, str]:
    """Return the names of columns as the option gives them: ``t=time,x=px,y=py,z=pz``.

    Raises
    ------
    FileError
        If a part has no ``=``, or a name before it is not one of ours.
    """
    pairs = [part.partition("=") for part in text.split(",")]
    wrong = next(
        (name for name, equals, there in pairs if not (equals and there.strip() and name.strip() in UNITS)), None
    )
    if wrong is not None:
        raise FileError(f"the columns are {text!r}: give pairs such as t=time,x=px,y=py,z=pz of {', '.join(UNITS)}")
    return {name.strip(): there.strip() for name, _, there in pairs}


def _header(cells: Sequence[str]) -> list[_Column]:
    columns = []
    for place, cell in enumerate(cells):
        match = _BRACKETS.match(cell) or _ENDING.match(cell)
        name, unit = (cell, None) if match is None else (match["name"].strip(), match["unit"].strip())
        columns.append(_Column(place, cell, unit.lower() if unit else None) if name else _Column(place, cell, None))
    return columns


def _bare(name: str) -> str:
    match = _BRACKETS.match(name) or _ENDING.match(name)
    return re.sub(r"[\s._/\-^]", "", (match["name"] if match else name).lower())


def _usual(header: list[_Column]) -> dict[str, _Column]:
    """Return the columns with usual names; the first of several."""
    found: dict[str, _Column] = {}
    for name, known in USUAL.items():
        there = [column for usual in known for column in header if _bare(column.name) == usual]
        if there:
            found[name] = there[0]
    return found


def _chosen(path: FileName, header: list[_Column], named: Mapping[str, str]) -> dict[str, _Column]:
    found = {}
    for name, there in named.items():
        if name not in UNITS:
            raise FileError(f"no column is called {shown(name)}: there are {', '.join(UNITS)}")
        title, _, unit = str(there).partition(":")
        alike = [column for column in header if title.strip().lower() in (column.name.lower(), _named_alone(column))]
        if not alike:
            listed = ", ".join(column.name for column in header)[:160]
            raise FileError(f"{path} has no column {title.strip()[:40]!r}: the columns are {listed}")
        found[name] = _Column(alike[0].place, alike[0].name, unit.strip().lower() or alike[0].unit)
    return found


def _named_alone(column: _Column) -> str:
    match = _BRACKETS.match(column.name)
    return (match["name"].strip() if match else column.name).lower()


def _numbers(
    path: FileName, rows: list[tuple[int, list[str]]], header: list[_Column], wanted: Mapping[str, _Column]
) -> FloatArray:
    """Return the numbers of the columns that are read, shape (rows, columns)."""
    if len(rows) < 2:
        raise FileError(f"{path} has a header and no rows")
    values = []
    for number, cells in rows[1:]:
        where = f"{path}, line {number}"
        cells = cells[: len(header)] if not any(cells[len(header) :]) else cells
        if len(cells) != len(header):
            raise FileError(f"{where}: {len(cells)} cells, but there are {len(header)} columns")
        taken = [cells[column.place] for column in wanted.values()]
        values.append(number_row(where, ",".join(taken), taken, [column.name for column in wanted.values()]))
    return np.array(values, dtype=np.float64)


def _factor(path: FileName, name: str, column: _Column, header: list[_Column]) -> float:
    """Return what turns a column into SI units."""
    cflib = any(_bare(each.name).startswith(CFLIB) for each in header)
    if column.unit is None:
        usual = {"t": "ms", "yaw": "deg", "yaw_rate": "deg/s"} if cflib else {}
        return UNITS[name][usual[name]] if name in usual else 1.0
    if column.unit not in UNITS[name]:
        wanted = ", ".join(UNITS[name])
        raise FileError(f"{path}: {column.name} is in {column.unit[:40]!r}: convert it to one of {wanted}")
    return UNITS[name][column.unit]


def _check_seconds(path: FileName, t: FloatArray, column: _Column) -> None:
    """Raise FileError where instants are no seconds by the look of their steps, and the file says no unit."""
    steps = np.diff(t)
    usual = float(np.median(steps)) if len(steps) > 1 else 0.0
    if column.unit is None and usual >= 1.0 and float(t[-1] - t[0]) > 1000.0:
        raise FileError(
            f"{path}: {column.name} goes on by {usual:g} from row to row and says no unit: give it, such as "
            f"t={column.name}:ms (--columns t={column.name}:ms)"
        )


def _local(path: FileName, columns: dict[str, FloatArray], origin: Sequence[float] | None) -> dict[str, FloatArray]:
    """Return columns with x, y and z in place of latitude, longitude and altitude."""
    if origin is None:
        raise FileError(
            f"{path} has latitudes and longitudes: give the origin, latitude and longitude [degrees] and altitude [m] "
            "(--origin LAT LON ALT)"
        )
    home = check_array("the origin", origin, ((3,),), "latitude and longitude [degrees] and altitude [m]", FileError)
    places = np.column_stack([columns[name] for name in GEODETIC])
    if not (np.abs(places[:, :2]) <= (90.0, 180.0)).all():
        raise FileError(f"{path} has latitudes or longitudes beyond 90 and 180 degrees")
    local = dict(zip(PLANE, local_positions(places, home).T, strict=True))
    return {name: values for name, values in columns.items() if name not in GEODETIC} | local
