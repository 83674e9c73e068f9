"""Crazyflie and Crazyswarm: one row per piece, 8 ascending powers of x, y, z and yaw (uav_trajectories, crazyswarm2).

World axes, z up; metres, radians, seconds from each piece's start. The firmware evaluates degree 7 in float32 and
keeps 4096 bytes, which is 31 pieces of 132 bytes (TRAJECTORY_MEMORY_SIZE).
"""

from __future__ import annotations

import math
import os

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.storage.atomic import atomic_write
from minsnap.basics.storage.reading import reading
from minsnap.basics.storage.text import read_text
from minsnap.errors import FileError, MinsnapError
from minsnap.files.format import Format, Writing
from minsnap.files.formats.crazyflie_compressed import pieces_that_fit
from minsnap.files.formats.pieces import check_spatial, from_powers, polynomials_of, position_powers, yaw_powers
from minsnap.trajectory.path import Path
from minsnap.trajectory.trajectory import Trajectory

DEGREE = 7
MAX_PIECES = 31
"""Pieces that fit the firmware's memory."""

COLUMNS = ("duration", *(f"{axis}^{power}" for axis in ("x", "y", "z", "yaw") for power in range(DEGREE + 1)))


def write_crazyflie(
    trajectory: Path,
    path: str | os.PathLike[str],
    *,
    max_pieces: int | None = MAX_PIECES,
    clobber: bool = True,
) -> None:
    """Write a trajectory for the Crazyflie.

    A lone piece is written as two halves, since crazyswarm2's reader fails on a single row. Numbers are written with
    enough digits to be read back exactly.

    Parameters
    ----------
    trajectory : Path
        Three coordinates; a trajectory of degree 7 at most, or a shape: its polynomials are within 1e-6 m of it, or
        within 1e-5, 1e-4 or 1e-3 m if only those are few enough.
    path : str or path
        Destination.
    max_pieces : int or None
        What the vehicle holds; None for players on a computer.
    clobber : bool
        False: a destination that exists is an error.

    Raises
    ------
    FileError
        If it has other than 3 coordinates, too high a degree, or too many pieces.
    YawError
        If its heading is no polynomial.
    """
    rows = crazyflie_rows(polynomials_of(trajectory, max_pieces)[0], max_pieces)
    with atomic_write(path, clobber=clobber) as file:
        file.write(",".join(COLUMNS) + "\n")
        file.writelines(",".join(map(repr, row)) + "\n" for row in rows.tolist())


def crazyflie_rows(trajectory: Trajectory, max_pieces: int | None = MAX_PIECES) -> FloatArray:
    """Return the rows of the file, shape (pieces, 33)."""
    check_spatial(trajectory, "a Crazyflie file")
    if len(trajectory.durations) == 1:
        half = trajectory.duration / 2
        trajectory = trajectory.between(0.0, half).then(trajectory.between(half, trajectory.duration))
    pieces = len(trajectory.durations)
    if max_pieces is not None and pieces > max_pieces:
        raise FileError(
            f"{pieces} pieces do not fit the Crazyflie's memory of {max_pieces}: {_smaller(trajectory)}fly it in parts"
        )
    axes = position_powers(trajectory, DEGREE).transpose(0, 2, 1).reshape(pieces, -1)
    return np.hstack([trajectory.durations[:, None], axes, yaw_powers(trajectory, DEGREE)])


def _smaller(trajectory: Trajectory) -> str:
    """Name the format in which more pieces fit, if it holds this trajectory at all."""
    try:
        fit = pieces_that_fit(trajectory)
    except MinsnapError:
        return ""
    return f"write the format crazyflie-compressed (.traj), in which {fit} of them fit, or "


def read_crazyflie(path: str | os.PathLike[str]) -> Trajectory:
    """Read a Crazyflie file: 33 numbers per row, a trailing comma allowed; the first line is taken as a header.

    Raises
    ------
    FileError
        If a row is ragged, not numeric or has no duration; says which line.
    """
    lines = read_text(path).rstrip().splitlines()
    if len(lines) < 2:
        raise FileError(f"{path} has no pieces: it needs a header and a row for each piece")
    rows = np.array([_row(path, number, line) for number, line in enumerate(lines[1:], 2)])
    powers = rows[:, 1:].reshape(len(rows), 4, DEGREE + 1)
    with reading(path, "a Crazyflie file"):
        return from_powers(rows[:, 0], powers[:, :3].transpose(0, 2, 1), powers[:, 3])


def _row(path: str | os.PathLike[str], number: int, line: str) -> list[float]:
    cells = line.rstrip().rstrip(",").split(",")
    if len(cells) != len(COLUMNS):
        raise FileError(f"{path}, line {number}: {len(cells)} numbers, but a piece has {len(COLUMNS)}")
    try:
        values = [float(cell) for cell in cells]
    except ValueError:
        raise FileError(f"{path}, line {number}: not all of its cells are numbers") from None
    if not all(map(math.isfinite, values)) or values[0] <= 0:
        raise FileError(f"{path}, line {number}: a duration must be positive and every coefficient finite")
    return values


def _is_crazyflie(path: str | os.PathLike[str]) -> bool:
    """Whether the second line has the numbers of a piece."""
    second = read_text(path).splitlines()[1:2]
    return bool(second) and len(second[0].rstrip().rstrip(",").split(",")) == len(COLUMNS)


def _write(content: Trajectory, path: str | os.PathLike[str], writing: Writing) -> None:
    write_crazyflie(content, path, clobber=writing.clobber)


def _read(path: str | os.PathLike[str], frame: str | None) -> Trajectory:
    return read_crazyflie(path)


FORMAT = Format("crazyflie", "polynomials", (), _write, (".csv",), _read, _is_crazyflie, most_pieces=MAX_PIECES)
