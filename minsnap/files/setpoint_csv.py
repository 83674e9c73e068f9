"""Setpoint CSV: a path sampled at a uniform rate, one row per instant, with numbers that read back exactly."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.checks import check_array
from minsnap.basics.messages import shown
from minsnap.basics.storage.atomic import atomic_write
from minsnap.basics.storage.table import read_table
from minsnap.errors import FileError, FrameError
from minsnap.files.format import Format, Writing
from minsnap.files.frames import get_frame, map_samples
from minsnap.files.sidecar import COLUMN, FRAME_COLUMNS, frame_of, lead_of, note_frame, said_frame
from minsnap.trajectory.path import Path
from minsnap.trajectory.samples import Samples

GROUPS: dict[str, tuple[str, ...]] = {
    "position": ("x", "y", "z"),
    "velocity": ("vx", "vy", "vz"),
    "acceleration": ("ax", "ay", "az"),
    "yaw": ("yaw",),
    "yaw_rate": ("yaw_rate",),
    "feed_forward": ("ffx", "ffy", "ffz"),
}
"""Columns of each quantity of :class:`~minsnap.trajectory.samples.Samples`, in the order of the file, after ``t``."""

HEADER = ("t", *(name for quantity, group in GROUPS.items() if quantity != "feed_forward" for name in group))
"""The columns of a file of a path; those of feed-forward follow where it is stated."""

_CHUNK = 4096


def write_csv(
    source: Path | Samples,
    path: str | os.PathLike[str],
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
        Axes of the file: ``"enu"``, ``"ned"`` or another name of :data:`minsnap.files.frames.FRAMES`. One that is not
        ENU is said by a last column of ones, ``frame_ned``, and noted in ``NAME.csv.meta`` beside it, as a lead of the
        samples is. ENU is said so too where the path is below ground throughout.
    clobber : bool
        False: a destination that exists is an error.
    origin : sequence of 3 float, optional
        WGS 84 latitude and longitude [degrees] and altitude [m] of the point (0, 0, 0), where they are known; noted
        beside the file as well.

    Raises
    ------
    FileError
        If a value is not finite, the path has other than 2 or 3 coordinates, or the destination cannot be written.
    FrameError
        If the frame is unknown.
    TimingError
        If the rate is not positive.

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
    samples = source if isinstance(source, Samples) else source.sample(rate)
    axes, flat = get_frame(frame), in_space(samples)
    mapped = map_samples(flat, "enu", axes)
    names, values = ["t"], [mapped.t[:, None]]
    for quantity, columns in GROUPS.items():
        array = getattr(mapped, quantity)
        if array is not None:
            names += columns
            values.append(array.reshape(len(mapped), len(columns)))
    if axes.name != "enu" or _below_ground(flat.position[:, 2]):
        names, values = [*names, COLUMN + axes.name], [*values, np.ones((len(mapped), 1))]
    return _lines(names, _checked(names, np.hstack(values)))


def read_csv(path: str | os.PathLike[str], frame: str | None = None) -> Samples:
    """Read setpoints.

    Parameters
    ----------
    path : str or path
        A file with a header: ``t,x,y,z`` and, each wholly or not at all, ``vx,vy,vz``, ``ax,ay,az``, ``yaw``,
        ``yaw_rate`` and ``ffx,ffy,ffz``.
    frame : str or None
        Axes of the file; None: those that its header or the note beside it says (:mod:`minsnap.files.sidecar`), else
        ENU.

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
    axes = get_frame(frame_of(path, frame))
    table = read_table(path, HEADER[:4], (*HEADER[4:], *GROUPS["feed_forward"], *FRAME_COLUMNS))
    _check_frame_column(path, table)
    if frame is None and _below_ground(table["z"]) and said_frame(path) is None:
        low, high = table["z"].min(), table["z"].max()
        raise FrameError(
            f"{path} lies below ground throughout (z from {low:g} to {high:g} m) and does not say its frame: say it, "
            "frame=NAME here and --from-frame NAME on the command line, such as ned"
        )
    _check_groups(path, table)
    _check_increasing(path, table["t"])
    stacks = {q: np.stack([table[n] for n in names], axis=-1) for q, names in GROUPS.items() if names[0] in table}
    squeezed = {q: stack[:, 0] if len(GROUPS[q]) == 1 else stack for q, stack in stacks.items()}
    return map_samples(Samples(table["t"], **squeezed, lead=lead_of(path)), axes, "enu")


def in_space(samples: Samples) -> Samples:
    """Return samples with 3 coordinates; 2-D samples get altitude 0."""
    if samples.dim == 3:
        return samples
    if samples.dim != 2:
        raise FileError(f"a setpoint file holds 2 or 3 coordinates, and the path has {samples.dim}")
    padded: dict[str, Any] = {name: np.pad(array, ((0, 0), (0, 1))) for name, array in samples.vectors().items()}
    return replace(samples, **padded)


def _checked(names: list[str], values: FloatArray) -> FloatArray:
    finite = np.isfinite(values)
    if not finite.all():
        row, column = np.argwhere(~finite)[0]
        raise FileError(f"{names[column]} of sample {row} is {values[row, column]}: only finite numbers are written")
    return values


def _lines(names: list[str], values: FloatArray) -> Iterator[str]:
    yield ",".join(names) + "\n"
    for start in range(0, len(values), _CHUNK):
        for row in values[start : start + _CHUNK].tolist():
            yield ",".join(map(repr, row)) + "\n"


def _below_ground(z: FloatArray) -> bool:
    """Whether heights are nowhere above 0, as those of z-down axes, and somewhere below."""
    return bool(z.size and z.max() <= 0.0 and z.min() < 0.0)


def _check_frame_column(path: str | os.PathLike[str], table: dict[str, FloatArray]) -> None:
    columns = [name for name in FRAME_COLUMNS if name in table]
    if len(columns) > 1:
        raise FileError(f"{path}, line 1: {' and '.join(columns)} both say the frame: leave one of them out")
    if columns and not (table[columns[0]] == 1.0).all():
        line = int(np.flatnonzero(table[columns[0]] != 1.0)[0]) + 2
        raise FileError(f"{path}, line {line}: {columns[0]} says the frame of all rows, and is 1 in each")


def _check_groups(path: str | os.PathLike[str], table: dict[str, FloatArray]) -> None:
    for names in GROUPS.values():
        missing = [name for name in names if name not in table]
        if 0 < len(missing) < len(names):
            raise FileError(f"{path}, line 1: {', '.join(missing)} missing; give {', '.join(names)} or none of them")


def _check_increasing(path: str | os.PathLike[str], t: FloatArray) -> None:
    late = np.flatnonzero(np.diff(t) <= 0)
    if late.size:
        i = int(late[0]) + 1
        raise FileError(f"{path}, line {i + 2}: t is {t[i]}, not after the {t[i - 1]} of the line before")


def _write(content: Samples, path: str | os.PathLike[str], writing: Writing) -> None:
    write_csv(content, path, frame=writing.frame, clobber=writing.clobber)


FORMAT = Format("setpoints", "samples", (".csv",), _write, (".csv",), read_csv, frame="")
