"""mav_trajectory_generation's YAML (ETH Zurich's ASL): segments of ascending powers, times in nanoseconds.

World axes, z up; 3 dimensions, or 4 with yaw. Times are integers in nanoseconds, so the end of a piece is rounded by up
to half a nanosecond.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.storage.atomic import write_file
from minsnap.basics.storage.text import FileName, load_yaml, reading
from minsnap.errors import FileError
from minsnap.files.convert import Format
from minsnap.files.formats.pieces import from_powers, polynomials_of, position_powers, yaw_powers
from minsnap.trajectory.path import Path
from minsnap.trajectory.trajectory import Trajectory


def write_mav_yaml(trajectory: Path, path: FileName, *, clobber: bool = True) -> None:
    """Write a trajectory as segments, with its heading as a fourth dimension unless it is constantly zero.

    Parameters
    ----------
    trajectory : Path
        A trajectory of any degree, 1 to 3 coordinates; or a shape: its polynomials are within 1e-6 m of it.
    path : str or path
        Destination.
    clobber : bool
        False: a destination that exists is an error.

    Raises
    ------
    FileError
        If it has more than 3 coordinates, or a heading and fewer than 3.
    YawError
        If its heading is no polynomial.
    """
    trajectory = polynomials_of(trajectory)[0]
    powers = _powers(trajectory)
    head = "# mav_trajectory_generation segments; world axes, z up (frame: enu)\nsegments:\n"
    write_file(path, head + "".join(map(_segment, trajectory.durations.tolist(), powers)), clobber=clobber)


def _powers(trajectory: Trajectory) -> FloatArray:
    """Return the coefficients, shape (pieces, dimensions, N)."""
    if trajectory.dim > 3:
        raise FileError(f"a segment file holds 3 coordinates and yaw, and the trajectory has {trajectory.dim}")
    axes = position_powers(trajectory, trajectory.degree).transpose(0, 2, 1)
    if trajectory.yaw.constant == 0.0:
        return axes
    if trajectory.dim != 3:
        raise FileError("a segment file with yaw needs 3 coordinates")
    return np.concatenate([axes, yaw_powers(trajectory, trajectory.degree)[:, None]], axis=1)


def _segment(duration: float, piece: FloatArray) -> str:
    rows = "".join(f"      - [{', '.join(map(repr, row))}]\n" for row in piece.tolist())
    head = f"  - N: {piece.shape[1]}\n    D: {piece.shape[0]}\n    time: {round(duration * 1e9)}\n"
    return f"{head}    coefficients:\n{rows}"


def read_mav_yaml(path: FileName) -> Trajectory:
    """Read segments; their fourth dimension, if present, is the heading.

    Raises
    ------
    FileError
        If the file is not YAML, or a segment's sizes are not what it says; says which.
    ImportError
        If PyYAML is not installed.
    """
    content = load_yaml(path)
    segments = content.get("segments") if isinstance(content, dict) else None
    if not isinstance(segments, list) or not segments:
        raise FileError(f"{path} has no segments")
    read = [_read_segment(f"{path}, segment {number}", segment) for number, segment in enumerate(segments)]
    shapes = {piece.shape for _, piece in read}
    if len(shapes) > 1:
        raise FileError(f"{path}: its segments differ in N or D, {sorted(shapes)}: these must be the same for all")
    durations, powers = np.array([time for time, _ in read]), np.array([piece for _, piece in read])
    yaw = powers[:, 3] if powers.shape[1] == 4 else None
    with reading(path, "a file of segments"):
        return from_powers(durations, powers[:, :3].transpose(0, 2, 1), yaw)


def _read_segment(where: str, segment: Any) -> tuple[float, FloatArray]:
    """Return a segment's duration [s] and coefficients, shape (D, N)."""
    try:
        size, dimensions, time = int(segment["N"]), int(segment["D"]), int(segment["time"])
        piece = np.array(segment["coefficients"], dtype=np.float64)
    except (KeyError, TypeError, ValueError, OverflowError):
        raise FileError(f"{where}: it needs numbers N, D, time and a table of coefficients") from None
    if piece.shape != (dimensions, size) or not 1 <= dimensions <= 4 or size < 2:
        raise FileError(f"{where}: D and N are {dimensions} and {size}, and the coefficients are {piece.shape}")
    if time <= 0 or not np.isfinite(piece).all():
        raise FileError(f"{where}: its time must be positive and every coefficient finite")
    return time * 1e-9, piece


FORMATS = (Format("mav", "polynomials", (), write_mav_yaml, (".yaml", ".yml"), read_mav_yaml),)
