"""Setpoint CSV: a path at a uniform rate, numbers that read back exactly, and what such a file says of itself.

A CSV in another frame than ENU has a last column ``frame_ned`` of ones, which stays with the numbers wherever they go
and which readers of columns by name, and of the first twelve, do not notice. Further data are in ``NAME.csv.meta``:
JSON with frame, units and rate, the origin where it is known, how much earlier than planned its rows are to be sent,
the flight that they were learned from, and a checksum of the CSV to which it belongs. A CSV that says nothing is in the
frame that the reader names, by default ENU.
"""

from __future__ import annotations

import contextlib
import json
import math
import os
import zlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path as FilePath
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.checks import check_array, is_number
from minsnap.basics.messages import explains_names, shown
from minsnap.basics.storage.atomic import atomic_write, write_file
from minsnap.basics.storage.table import read_table
from minsnap.basics.storage.text import FileName, beginning, read_text, reading
from minsnap.errors import FileError, FrameError, TimingError
from minsnap.files.convert import Format
from minsnap.files.frames import FRAMES, get_frame, map_samples
from minsnap.files.sample_columns import has_usual_columns, read_columns
from minsnap.trajectory.path import Path
from minsnap.trajectory.samples import Samples, column_names

LEAST_RATE = 1.0
"""Setpoints per second below which a rate is a period by mistake [Hz]."""

WORKBOOKS = (".xlsx", ".xls", ".xlsm", ".ods")
"""Endings of spreadsheets, which take no CSV under these names."""

ENDING = ".meta"
UNITS = "m, s, rad"
LARGEST = 10_000
"""Bytes of the largest such file."""

COLUMN = "frame_"
"""How the name of the column begins that says a frame."""

FRAME_COLUMNS = tuple(COLUMN + name for name in FRAMES)
"""The names of that column."""


def note_frame(
    path: FileName,
    frame: str,
    rate: float,
    origin: Sequence[float] | None = None,
    lead: float = 0.0,
    learned: tuple[float, str] | None = None,
) -> None:
    """Write what there is to say of a CSV that has just been written; where there is nothing remove a note.

    Parameters
    ----------
    path : str or path
    frame : str
    rate : float
        [Hz].
    origin : sequence of 3 float, optional
        WGS 84 latitude and longitude [degrees] and altitude [m] of the point (0, 0, 0).
    lead : float
        How much earlier than planned the rows are to be sent [s].
    learned : tuple, optional
        What the flight that ``tune`` learned them from missed its plan by [m], and the name of what was sent in it.
    """
    if not FilePath(path).is_file():
        return
    beside = _beside(path)
    if frame == "enu" and origin is None and not lead and learned is None:
        with contextlib.suppress(OSError):  # a file with so long a name can have no note
            beside.unlink(missing_ok=True)
        return
    facts: dict[str, Any] = {"frame": frame, "units": UNITS, "rate": rate, "crc32": _checksum(path)}
    if origin is not None:
        facts["origin"] = [float(value) for value in origin]
    if lead:
        facts["lead"] = lead
    if learned is not None:
        facts["learned"] = {"missed": learned[0], "sent": learned[1]}
    write_file(beside, json.dumps(facts) + "\n")


def frame_of(path: FileName, wanted: str | None = None) -> str:
    """Return the frame of a CSV: that of its header or its note, else the requested one, else ENU.

    Raises
    ------
    FrameError
        If the caller, the file and the note name different frames.
    FileError
        If the note is damaged, or the CSV was changed after it was written.
    """
    name = get_frame("enu" if wanted is None else wanted).name
    kept = said_frame(path) or name
    if wanted is not None and kept != name:
        where = "its header" if _headed(path) else _beside(path)
        raise FrameError(f"{path} is in {kept}, as {where} says, not in {name}: leave the frame out")
    return kept


def said_frame(path: FileName) -> str | None:
    """Return the frame that a CSV says in its header, or in its note; None where neither does.

    Raises
    ------
    FrameError
        If they say different ones.
    FileError
        If the note is damaged, or the CSV was changed after it was written.
    """
    inside, beside = _headed(path), _noted(path).get("frame")
    if inside is not None and beside is not None and inside != beside:
        raise FrameError(f"{path} is in {inside} as its header says, and in {beside} as {_beside(path)} says")
    return inside or beside


def _headed(path: FileName) -> str | None:
    """Return the frame that the header of a CSV says, or None; what is wrong with a file is said by its reader."""
    header = beginning(path).partition("\n")[0]
    names = [cell.strip().strip('"') for cell in header.split(",")]
    return next((cell.removeprefix(COLUMN) for cell in names if cell in FRAME_COLUMNS), None)


def origin_of(path: FileName) -> tuple[float, ...] | None:
    """Return latitude and longitude [degrees] and altitude [m] of the origin of a CSV; None where its note has none.

    Raises
    ------
    FileError
        If the note is damaged, or the CSV was changed after it was written.
    """
    return _noted(path).get("origin")


def learned_of(path: FileName) -> tuple[float, str] | None:
    """Return what the flight that setpoints were learned from missed by [m], and the name of what was sent in it.

    Raises
    ------
    FileError
        If the note is damaged, or the CSV was changed after it was written.
    """
    return _noted(path).get("learned")


def _noted(path: FileName) -> dict[str, Any]:
    """Return frame, origin, lead and learning from the note of a CSV, as far as it has them; nothing without a note."""
    beside = _beside(path)
    try:
        if not beside.is_file():
            return {}
    except (OSError, ValueError):
        return {}
    with reading(beside, "a note on a setpoint file"):
        facts = json.loads(read_text(beside, LARGEST))
        facts_read: dict[str, Any] = {"frame": get_frame(facts["frame"]).name, "lead": float(facts.get("lead", 0.0))}
        if facts.get("origin") is not None:
            latitude, longitude, altitude = map(float, facts["origin"])
            facts_read["origin"] = (latitude, longitude, altitude)
        if facts.get("learned") is not None:
            facts_read["learned"] = (float(facts["learned"]["missed"]), str(facts["learned"]["sent"]))
        checksum, units = int(facts["crc32"]), facts.get("units")
    if not 0.0 <= facts_read["lead"] < math.inf:
        raise FileError(f"{beside} says a lead of {facts_read['lead']} s: it must be 0 or more")
    if units != UNITS or checksum != _checksum(path):
        raise FileError(f"{path} is not the file that {beside} was written for: write it again, or remove {beside}")
    return facts_read


def noted_beside(path: FileName) -> str | None:
    """Return the name of the note of a CSV, or None where it has none."""
    beside = _beside(path)
    return str(beside) if beside.is_file() else None


def _beside(path: FileName) -> FilePath:
    return FilePath(f"{_name(path)}{ENDING}")


def _name(path: FileName) -> str:
    try:
        return os.fspath(path)
    except TypeError:
        raise FileError(f"{shown(path)} is no name of a file") from None


def _checksum(path: FileName) -> int:
    """Return the CRC-32 of a file."""
    total = 0
    with reading(path, "a file"), open(path, "rb") as file:
        while chunk := file.read(1 << 20):
            total = zlib.crc32(chunk, total)
    return total


QUANTITIES = ("position", "velocity", "acceleration", "yaw", "yaw_rate", "feed_forward")
GROUPS = {name: column_names(name) for name in QUANTITIES}
"""Columns of each quantity of :class:`~minsnap.trajectory.samples.Samples`, in the order of the file, after ``t``."""

COLUMNS = ("t", *(name for group in GROUPS.values() for name in group))
"""The columns of a file of a path; those of feed-forward follow where it is stated."""

_CHUNK = 4096


@explains_names({"hz": "rate=", "frequency": "rate=", "dt": "rate=, 1 / dt"})
def write_csv(
    source: Path | Samples,
    path: FileName,
    rate: float = 20.0,
    frame: str = "enu",
    *,
    clobber: bool = True,
    origin: Sequence[float] | None = None,
) -> None:
    """Write setpoints in one atomic step.

    The header is ``t,x,y,z,vx,vy,vz,ax,ay,az,yaw,yaw_rate``: seconds, metres, m/s, m/s^2, rad, rad/s, and
    ``ffx,ffy,ffz`` [m/s^2] after it for samples with feed-forward. Every number is written with enough digits to be
    read back exactly. Quantities that the samples lack are left out.

    Parameters
    ----------
    source : Path or Samples
        What to write; samples are written as they are, in z-up world axes. Plane paths get the altitude 0.
    path : str or path
        Destination; replaced if it is there, unless ``clobber`` is False.
    rate : float
        Samples per second of a path [Hz].
    frame : str
        Axes of the file: ``"enu"``, ``"ned"`` or another name of :data:`minsnap.files.frames.FRAMES`. Axes other than
        ENU are named by a last column of ones, ``frame_ned``, and in ``NAME.csv.meta`` beside the file, which also has
        the lead of the samples. ENU is named if the path is below ground throughout.
    clobber : bool
        False: a destination that exists is an error.
    origin : sequence of 3 float, optional
        WGS 84 latitude and longitude [degrees] and altitude [m] of the point (0, 0, 0); also in that file.

    Raises
    ------
    FileError
        If a value is not finite, the path has other than 2 or 3 coordinates, or the destination cannot be written or
        has the ending of a spreadsheet.
    FrameError
        If the frame is unknown.
    TimingError
        If the rate is not positive, or so low that it is a period.

    Examples
    --------
    >>> import minsnap, pathlib, tempfile
    >>> file = pathlib.Path(tempfile.mkdtemp()) / "circle.csv"
    >>> minsnap.write_csv(minsnap.circle(radius=2.0), file)
    >>> minsnap.read_csv(file).position[0]
    array([2. , 0. , 1.5])
    """
    if not isinstance(source, (Samples, Path)):
        raise FileError(
            f"write_csv takes a path or samples first and the file's name second, not {shown(source)} first"
        )
    if origin is not None:
        give = "latitude and longitude [degrees] and altitude [m]"
        origin = check_array("the origin", origin, ((3,),), give, FileError).tolist()
    _refuse_workbook(path)
    lines = csv_lines(source, rate, frame)
    with atomic_write(path, clobber=clobber) as file:
        file.writelines(lines)
    rate, lead = (source.rate, source.lead) if isinstance(source, Samples) else (rate, 0.0)
    note_frame(path, get_frame(frame).name, rate, origin, lead)


def csv_lines(source: Path | Samples, rate: float = 20.0, frame: str = "enu") -> Iterator[str]:
    """Return the lines that :func:`write_csv` writes, each with its newline; all checks precede the first line.

    Raises
    ------
    FileError, FrameError, TimingError
        As :func:`write_csv`.
    """
    if isinstance(source, Path):
        _refuse_period(rate)
    axes, flat = get_frame(frame), in_space(source.sample(rate))
    mapped = map_samples(flat, "enu", axes)
    columns = columns_of(mapped)
    if axes.name != "enu" or _below_ground(flat.position[:, 2]):
        columns[COLUMN + axes.name] = np.ones(len(mapped))
    names, values = list(columns), np.column_stack(list(columns.values()))
    if not np.isfinite(values).all():
        row, column = np.argwhere(~np.isfinite(values))[0]
        raise FileError(f"{names[column]} of sample {row} is {values[row, column]}: only finite numbers are written")
    return _lines(names, values)


def columns_of(samples: Samples) -> dict[str, FloatArray]:
    """Return the columns of samples of three coordinates by name, each of shape (m,)."""
    known = samples.columns()
    return {name: known[name] for name in COLUMNS if name in known}


def samples_of(columns: Mapping[str, FloatArray], lead: float) -> Samples:
    """Return the samples of columns by name, without the quantities that lack one."""
    known = {quantity: names for quantity, names in GROUPS.items() if all(name in columns for name in names)}
    stacks = {quantity: np.column_stack([columns[name] for name in names]) for quantity, names in known.items()}
    arrays = {quantity: stack[:, 0] if len(known[quantity]) == 1 else stack for quantity, stack in stacks.items()}
    return Samples(columns["t"], **arrays, lead=lead)


@explains_names({})
def read_csv(
    path: FileName,
    frame: str | None = None,
    *,
    columns: Mapping[str, str] | None = None,
    origin: Sequence[float] | None = None,
) -> Samples:
    """Read setpoints.

    Parameters
    ----------
    path : str or path
        A file with a header: ``t,x,y,z`` and, each wholly or not at all, ``vx,vy,vz``, ``ax,ay,az``, ``yaw``,
        ``yaw_rate`` and ``ffx,ffy,ffz``. A table of another program is read by the usual names and units of its
        columns: ``px``, ``p_x``, ``x [m]``, ``Time [msec]``, ``stateEstimate.x`` and the like; others are left out.
    frame : str or None
        Axes of the file; None: those named by its header or by the file beside it, else ENU.
    columns : mapping of str to str, optional
        Names of columns in the file, by those of ours: ``{"t": "clock:ms", "x": "north"}``; a unit after a colon.
    origin : sequence of 3 float, optional
        WGS 84 latitude and longitude [degrees] and altitude [m] of the point (0, 0, 0), for a file of latitudes,
        longitudes and altitudes (``lat``, ``lon``, ``alt``).

    Returns
    -------
    Samples
        In z-up world axes; None for the quantities that the file does not have.

    Raises
    ------
    FileError
        If the file is missing, empty, ragged, not numeric or not finite, lacks a column, or its instants do not
        increase; says which line.
    FrameError
        If the frame is unknown, or another than the file says, or no frame is said and the file lies below ground
        throughout.
    """
    samples = read_rows(path, frame, columns, origin)
    _check_increasing(path, samples.t)
    return samples


def read_rows(
    path: FileName,
    frame: str | None = None,
    columns: Mapping[str, str] | None = None,
    origin: Sequence[float] | None = None,
) -> Samples:
    """Read setpoints as :func:`read_csv` does, from a file whose instants need not increase, as a check takes it."""
    axes = get_frame(frame_of(path, frame))
    if columns or origin is not None or (not _is_own(path) and has_usual_columns(path)):
        table, _ = read_columns(path, columns, origin)
    else:
        table = read_table(path, COLUMNS[:4], (*COLUMNS[4:], *FRAME_COLUMNS))
    _check_frame_column(path, table)
    if frame is None and _below_ground(table["z"]) and said_frame(path) is None:
        low, high = table["z"].min(), table["z"].max()
        raise FrameError(
            f"{path} lies below ground throughout (z from {low:g} to {high:g} m) and does not say its frame: say it, "
            "frame=NAME here and --from-frame NAME on the command line, such as ned"
        )
    _check_groups(path, table)
    return map_samples(samples_of(table, _noted(path).get("lead", 0.0)), axes, "enu")


def _is_own(path: FileName) -> bool:
    """Whether the first line of a CSV has the columns of a setpoint file by their very names."""
    return set(COLUMNS[:4]) <= {cell.strip() for cell in beginning(path).partition("\n")[0].split(",")}


def in_space(samples: Samples) -> Samples:
    """Return samples with 3 coordinates; 2-D samples get altitude 0."""
    if samples.dim == 3:
        return samples
    if samples.dim != 2:
        raise FileError(f"a setpoint file holds 2 or 3 coordinates, and the path has {samples.dim}")
    padded: dict[str, Any] = {name: np.pad(array, ((0, 0), (0, 1))) for name, array in samples.vectors().items()}
    return replace(samples, **padded)


def _lines(names: list[str], values: FloatArray) -> Iterator[str]:
    yield ",".join(names) + "\n"
    for start in range(0, len(values), _CHUNK):
        for row in values[start : start + _CHUNK].tolist():
            yield ",".join(map(repr, row)) + "\n"


def _below_ground(z: FloatArray) -> bool:
    """Whether heights are nowhere above 0, as those of z-down axes, and somewhere below."""
    return bool(z.size and z.max() <= 0.0 and z.min() < 0.0)


def _check_frame_column(path: FileName, table: dict[str, FloatArray]) -> None:
    columns = [name for name in FRAME_COLUMNS if name in table]
    if len(columns) > 1:
        raise FileError(f"{path}, line 1: {' and '.join(columns)} both say the frame: leave one of them out")
    if columns and not (table[columns[0]] == 1.0).all():
        line = int(np.flatnonzero(table[columns[0]] != 1.0)[0]) + 2
        raise FileError(f"{path}, line {line}: {columns[0]} says the frame of all rows, and is 1 in each")


def _check_groups(path: FileName, table: dict[str, FloatArray]) -> None:
    for names in GROUPS.values():
        missing = [name for name in names if name not in table]
        if 0 < len(missing) < len(names):
            raise FileError(f"{path}, line 1: {', '.join(missing)} missing; give {', '.join(names)} or none of them")


def _refuse_workbook(path: FileName) -> None:
    """Raise FileError where a name ends as those of spreadsheets do, which read CSV under its own ending alone."""
    stem, ending = os.path.splitext(_name(path))
    if ending.lower() in WORKBOOKS:
        raise FileError(
            f"{path} is a spreadsheet by its ending: write {os.path.basename(stem)}.csv, which spreadsheets open"
        )


def _refuse_period(rate: float) -> None:
    """Raise TimingError for a rate that is a period: less than one setpoint a second."""
    if is_number(rate) and 0.0 < rate < LEAST_RATE:
        raise TimingError(
            f"the rate is {rate:g} Hz, one setpoint every {1.0 / rate:g} s: if it is a period, give rate={1.0 / rate:g}"
        )


def _check_increasing(path: FileName, t: FloatArray) -> None:
    late = np.flatnonzero(np.diff(t) <= 0)
    if late.size:
        i = int(late[0]) + 1
        raise FileError(f"{path}, line {i + 2}: t is {t[i]}, not after the {t[i - 1]} of the line before")


LEFT_OUT = ("jerk", "snap")
"""What tables of setpoints leave out of samples."""

_CSV = ((".csv",), write_csv, (".csv",), read_csv)
FORMATS = (Format("setpoints", "samples", *_CSV, read_rows=read_rows, frame="", reads_frame=True, leaves_out=LEFT_OUT),)
