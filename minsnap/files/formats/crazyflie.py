"""Trajectories of the Crazyflie and of Crazyswarm, world axes, z up: rows of power coefficients, and compressed ones.

Rows (uav_trajectories, crazyswarm2): one per piece, its duration [s] and 8 ascending powers of x, y, z [m] and yaw
[rad], in seconds from the piece's start. The firmware evaluates degree 7 in float32 and keeps 4096 bytes, which is 31
pieces of 132 bytes (TRAJECTORY_MEMORY_SIZE).

Compressed: a start of 4 int16 (x, y, z in millimetres, yaw in tenths of a degree), then the pieces
(``bezier_segments``), then the header of a piece that lasts 0 ms: the firmware ends there and nowhere else, and flies
on without it into what lies behind in its memory.

A compressed curve has two forms: its own pieces of degree 7, 45 bytes each at constant yaw, or cubics
(``cubic_segments``), 21 bytes. Rounding a piece of degree 7 to millimetres adds up to 84 mm / h^2 an axis to its
acceleration, that of a cubic 15, but a cubic is not the curve. The form is taken whose acceleration is nearer to the
curve's, steps of the velocity at knots included: degree 7 for pieces of seconds, cubics for short ones.
"""

from __future__ import annotations

import struct

import numpy as np

from minsnap.basics.arrays import FloatArray, NDArray
from minsnap.basics.storage.atomic import write_file
from minsnap.basics.storage.table import number_row
from minsnap.basics.storage.text import FileName, beginning, read_bytes, read_text, reading
from minsnap.basics.warn import warn_caller
from minsnap.errors import FileError, FirmwareWarning, MinsnapError
from minsnap.files.convert import Format
from minsnap.files.formats.bezier_segments import (
    DEGREE,
    LARGEST,
    LONGEST,
    STEP_TIME,
    check_range,
    distance_bounds,
    packed,
    unpacked,
    velocity_steps,
)
from minsnap.files.formats.cubic_segments import CUBIC, CubicFit
from minsnap.files.formats.pieces import check_spatial, from_powers, polynomials_of, position_powers, yaw_powers
from minsnap.files.setpoint_csv import note_frame
from minsnap.polynomials.bernstein import elevate, powers_to_points
from minsnap.trajectory.path import Path
from minsnap.trajectory.planned_heading import PlannedHeading
from minsnap.trajectory.trajectory import Trajectory

MEMORY = 4096
"""Bytes of the firmware's memory of trajectories."""

END = bytes(3)
"""The header of a piece of 0 ms, which ends a trajectory."""

UNITS = np.array([1e-3, 1e-3, 1e-3, np.pi / 1800.0])
"""What one unit of x, y, z and yaw is worth [m], [rad]."""

REACH = "32767: that is 32.767 m or 3276.7 degrees from the origin"

EVEN = 1e-6
"""Difference of control points, in units, below which a polynomial is of a lower degree."""

MOST_PIECES = (MEMORY - 8 - len(END)) // 31
"""Pieces that fit at constant height and yaw."""

FIXED_YAW = "2026.08"
"""First firmware that flies a compressed yaw as it is written; older ones divide it wrongly."""


def compressed(trajectory: Trajectory) -> bytes:
    """Return a trajectory as the firmware's bytes.

    Of its pieces of degree 7, every control point is rounded by half a unit at most, and shared knots stay shared;
    instants of knots are rounded by half a millisecond at most; an axis whose curve is a line or a cubic is stored as
    one. Where cubics keep its acceleration better, it is stored as these.

    Raises
    ------
    FileError
        If it has other than 3 coordinates or too high a degree, leaves the range of int16, or does not fit the memory;
        says by how much.
    YawError
        If its heading is no polynomial.

    Warns
    -----
    FirmwareWarning
        If the yaw is not 0 throughout.
    """
    content = _content(trajectory)
    if len(content) > MEMORY:
        pieces, fits = len(trajectory.durations), pieces_that_fit(trajectory)
        raise FileError(
            f"{pieces} pieces take {len(content)} bytes, {len(content) - MEMORY} above the memory's {MEMORY}: "
            f"the first {fits} would fit; {_fewer(trajectory)}fly it in parts"
        )
    if unpacked(content[8:], struct.unpack_from("<4h", content))[1][:, 3].any():
        told = f"firmware before {FIXED_YAW} flies a compressed yaw wrongly: update it, or plan with yaw=0"
        warn_caller(told, FirmwareWarning)
    return content


def pieces_that_fit(trajectory: Trajectory) -> int:
    """Return how many of its first pieces the memory holds in their own degree."""
    points = _control_points(trajectory)
    sizes = 8 + len(END) + np.cumsum([len(piece) for piece in _own_pieces(trajectory, points)])
    return int(np.searchsorted(sizes, MEMORY, side="right"))


def _content(trajectory: Trajectory) -> bytes:
    """Return the form that fits the memory and is nearest to the trajectory; that of its own pieces if none fits."""
    points, forms = _control_points(trajectory), []
    cubics = _cubics(trajectory, points)
    try:
        forms.append(b"".join(_own_pieces(trajectory, points)))
    except FileError:
        if len(cubics) > MEMORY - 8 - len(END):
            raise
    start = struct.pack("<4h", *np.round(points[0, :, 0] / UNITS).astype(np.int64).tolist())
    contents = [start + form + END for form in (*forms, cubics)]
    fitting = [content for content in contents if len(content) <= MEMORY] or contents[:1]
    return min(fitting, key=lambda content: _hardness(trajectory, content)) if len(fitting) > 1 else fitting[0]


def _hardness(trajectory: Trajectory, content: bytes) -> float:
    """Return by how much the acceleration of a file differs, its greatest step of velocity over a tenth of a second."""
    held = curve_of_bytes(content)
    return float(distance_bounds(trajectory, held, 3)[2] + velocity_steps(held).max(initial=0.0) / STEP_TIME)


def _own_pieces(trajectory: Trajectory, control_points: FloatArray) -> list[bytes]:
    """Return the bytes of each piece, in the least degree that holds it."""
    points, degrees = _lowest_degrees(control_points / UNITS[:, None])
    points[1:, :, 0] = np.take_along_axis(points, degrees[..., None], 2)[:-1, :, 0]
    milliseconds = np.diff(np.round(trajectory.breaks * 1e3)).astype(np.int64)
    wrong = (milliseconds < 1) | (milliseconds > LONGEST)
    if wrong.any():
        piece = int(wrong.argmax())
        raise FileError(f"piece {piece} takes {milliseconds[piece]} ms, and this format holds 1 to {LONGEST} ms")
    return [packed(int(time), *piece) for time, *piece in zip(milliseconds, points, degrees, strict=True)]


def _cubics(trajectory: Trajectory, control_points: FloatArray) -> bytes:
    """Return the bytes of the trajectory and its heading as cubics."""
    fit = CubicFit.of(Trajectory(control_points.transpose(0, 2, 1), trajectory.durations), UNITS)
    breaks = fit.knots(CUBIC.tolerance)
    points, lines = fit.whole(breaks, LARGEST)
    degrees = np.where((points == points[:, :1]).all(axis=1), 0, np.where(lines, 1, 3)[:, None])
    rows = np.zeros((*degrees.shape, DEGREE + 1), dtype=np.int64)
    rows[..., :4] = points.transpose(0, 2, 1)
    rows[..., 1] = np.where(degrees == 1, rows[..., 3], rows[..., 1])
    return b"".join(packed(int(time), *piece) for time, *piece in zip(np.diff(breaks), rows, degrees, strict=True))


def _lowest_degrees(exact: FloatArray) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return rounded control points (pieces, 4, 8) in the least degree of the format, and that degree (pieces, 4)."""
    shown = np.round(exact)
    degrees = np.full(exact.shape[:2], DEGREE)
    slopes = (exact[..., [1, -2]] - exact[..., [0, -1]]) * DEGREE / 3.0
    for degree in (3, 1):
        lower = np.abs(np.diff(exact, degree + 1)).max(axis=2) < EVEN
        inner = exact[..., [0, -1]] + slopes if degree == 3 else exact[..., :0]
        row = np.concatenate([exact[..., :1], inner, exact[..., -1:]], axis=2)
        shown[..., : degree + 1][lower] = np.round(row[lower])
        degrees[lower] = degree
    within = np.arange(DEGREE + 1) <= degrees[..., None]
    degrees[(np.where(within, shown, shown[..., :1]) == shown[..., :1]).all(axis=2)] = 0
    return shown.astype(np.int64), degrees


def rounding_bounds(trajectory: Trajectory) -> FloatArray:
    """Return upper bounds of the distance between what the file holds and the trajectory at any instant, shape (3,).

    They are those of position, velocity and acceleration [m], [m/s], [m/s^2].

    From the control points of the difference, at equal instants: rounded times are part of it.
    """
    return distance_bounds(trajectory, curve_of_bytes(_content(trajectory)), 3)


def write_compressed(trajectory: Path, path: FileName, *, clobber: bool = True) -> None:
    """Write a trajectory or a shape as the firmware's bytes in one atomic step; errors as of :func:`compressed`."""
    write_file(path, compressed(polynomials_of(trajectory, MOST_PIECES)[0]), clobber=clobber)


def read_compressed(path: FileName) -> Trajectory:
    """Read a compressed trajectory.

    Raises
    ------
    FileError
        If it is none: too short, with a piece that is cut off, or without an end.
    """
    content = read_bytes(path)
    with reading(path, "a compressed trajectory"):
        return curve_of_bytes(content, str(path))


def curve_of_bytes(content: bytes, where: str = "the trajectory") -> Trajectory:
    """Return the trajectory of the firmware's bytes."""
    start = struct.unpack_from("<4h", content)
    milliseconds, points, length = unpacked(content[8:], start)
    if content[8 + length : 8 + length + len(END)] != END:
        raise FileError(
            f"{where} does not end with a piece of 0 ms (three zero bytes), and the vehicle would fly on into what "
            "lies behind it in memory: append them"
        )
    if not len(milliseconds):
        raise FileError(f"{where} is not a compressed trajectory: it has no piece")
    values = (points * UNITS[:, None]).transpose(0, 2, 1)
    durations = milliseconds / 1e3
    return Trajectory(values[:, :, :3], durations, PlannedHeading(Trajectory(values[:, :, 3:], durations)))


def _control_points(trajectory: Trajectory) -> FloatArray:
    """Return control points of degree 7 of x, y, z and yaw, shape (pieces, 4, 8)."""
    check_spatial(trajectory, "a Crazyflie file")
    position_powers(trajectory, DEGREE)  # refuses a higher degree
    place = elevate(trajectory.control_points.transpose(0, 2, 1), DEGREE + 1)
    powers = yaw_powers(trajectory, DEGREE) * trajectory.durations[:, None] ** np.arange(DEGREE + 1)
    points = np.concatenate([place, (powers @ powers_to_points(DEGREE).T)[:, None]], axis=1)
    check_range(np.round(points / UNITS[:, None]).astype(np.int64), REACH)
    return np.asarray(points)


def _write(content: Trajectory, path: FileName, *, clobber: bool) -> str:
    write_compressed(content, path, clobber=clobber)
    place, speed, push = rounding_bounds(content)
    return (
        f"the format moves the curve by {1e3 * place:.2g} mm at most, its velocity by {speed:.2g} m/s and its "
        f"acceleration by {push:.2g} m/s^2"
    )


def _resolution(content: Trajectory, step: float) -> float:
    """Return the rounding error of a difference of two values a step apart [m], [m/s], [rad].

    Two values of the velocity are each off by 2 n units over the shortest piece at most and by what a millisecond is of
    a piece; those of the acceleration by 4 n (n - 1) units over its square.
    """
    shortest = float(content.durations.min())
    faster = (2 * DEGREE + content.max_norm(1)[0]) / shortest
    harder = 2 * DEGREE * (DEGREE - 1) / shortest**2
    return float(2e-3 * (1.0 + faster + harder * step))


MAX_PIECES = 31
"""Pieces that fit the firmware's memory."""

COLUMNS = ("duration", *(f"{axis}^{power}" for axis in ("x", "y", "z", "yaw") for power in range(DEGREE + 1)))


def write_crazyflie(
    trajectory: Path, path: FileName, *, max_pieces: int | None = MAX_PIECES, clobber: bool = True
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
    write_file(path, crazyflie_text(polynomials_of(trajectory, max_pieces)[0], max_pieces), clobber=clobber)
    note_frame(path, "enu", 0.0)  # removes the note of setpoints that had this name


def crazyflie_text(trajectory: Trajectory, max_pieces: int | None = MAX_PIECES) -> str:
    """Return the content of the file; raises as :func:`write_crazyflie`."""
    lines = [COLUMNS, *([repr(value) for value in row] for row in crazyflie_rows(trajectory, max_pieces).tolist())]
    return "".join(",".join(line) + "\n" for line in lines)


def crazyflie_rows(trajectory: Trajectory, max_pieces: int | None = MAX_PIECES) -> FloatArray:
    """Return the rows of the file, shape (pieces, 33)."""
    check_spatial(trajectory, "a Crazyflie file")
    if len(trajectory.durations) == 1:
        half = trajectory.duration / 2
        trajectory = trajectory.between(0.0, half).then(trajectory.between(half, trajectory.duration))
    pieces = len(trajectory.durations)
    if max_pieces is not None and pieces > max_pieces:
        remedies = _smaller(trajectory) + _fewer(trajectory)
        raise FileError(f"{pieces} pieces do not fit the Crazyflie's memory of {max_pieces}: {remedies}fly it in parts")
    axes = position_powers(trajectory, DEGREE).transpose(0, 2, 1).reshape(pieces, -1)
    return np.hstack([trajectory.durations[:, None], axes, yaw_powers(trajectory, DEGREE)])


def _smaller(trajectory: Trajectory) -> str:
    """Name the format in which more pieces fit, if it holds this trajectory at all."""
    try:
        fit = pieces_that_fit(trajectory)
    except MinsnapError:
        return ""
    return f"write the format crazyflie-compressed (.traj), in which {fit} of them fit, or "


def _fewer(trajectory: Trajectory) -> str:
    """Name the plan of fewer pieces, where legs have several."""
    said = f"plan it with one polynomial a leg (pieces=1, --pieces 1), which makes {trajectory.legs}, more around "
    said += "obstacles, or fewer laps, or "
    return said if trajectory.pieces > 1 else ""


def read_crazyflie(path: FileName) -> Trajectory:
    """Read a Crazyflie file: 33 numbers per row, a trailing comma allowed; the first line is taken as a header.

    Raises
    ------
    FileError
        If a row is ragged, not numeric or has no duration; says which line.
    """
    lines = read_text(path).rstrip().splitlines()
    if len(lines) < 2:
        raise FileError(f"{path} has no pieces: it needs a header and a row for each piece")
    rows = np.array([_row(f"{path}, line {number}", line) for number, line in enumerate(lines[1:], 2)])
    with reading(path, "a Crazyflie file"):
        return curve_of_rows(rows)


def curve_of_rows(rows: FloatArray) -> Trajectory:
    """Return the trajectory of the rows of a file, shape (pieces, 33)."""
    powers = rows[:, 1:].reshape(len(rows), 4, DEGREE + 1)
    return from_powers(rows[:, 0], powers[:, :3].transpose(0, 2, 1), powers[:, 3])


def _row(where: str, line: str) -> list[float]:
    values = number_row(where, line, line.rstrip().rstrip(",").split(","), COLUMNS)
    if values[0] <= 0.0:
        raise FileError(f"{where}: the duration is {values[0]:g} s: it must be positive")
    return values


def _is_crazyflie(path: FileName) -> bool:
    """Whether the second line has the numbers of a piece."""
    second = beginning(path).splitlines()[1:2]
    return bool(second) and len(second[0].rstrip().rstrip(",").split(",")) == len(COLUMNS)


_RAW = ((), write_crazyflie, (".csv",), read_crazyflie, _is_crazyflie)
_COMPRESSED = ((".traj",), _write, (".traj",), read_compressed)
FORMATS = (
    Format("crazyflie", "polynomials", *_RAW, most_pieces=MAX_PIECES),
    Format("crazyflie-compressed", "polynomials", *_COMPRESSED, most_pieces=MOST_PIECES, rounding=_resolution),
)
