"""A flight as a Lua script that ArduCopter runs itself: polynomials, and the rules by which it stops.

The script evaluates position, velocity and acceleration fifty times a second and passes them to GUIDED, relative to
the origin of the vehicle's estimate: north, east, down, and the heading in degrees from north. Its numbers are those
of ArduPilot's Lua, float32. Sources: ArduPilot's scripting bindings (``vehicle:set_target_posvelaccel_NED``) and its
documentation of Lua scripts; what it does stands in ``fly_polynomials.lua``.
"""

from __future__ import annotations

from importlib.resources import files

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.storage.atomic import write_file
from minsnap.basics.storage.text import FileName
from minsnap.errors import FileError
from minsnap.files.convert import Format
from minsnap.files.formats.pieces import check_spatial, position_powers, yaw_powers
from minsnap.files.frames import get_frame
from minsnap.trajectory.trajectory import Trajectory

AT_REST = 1e-3
"""Speed below which a flight begins and ends at rest [m/s]."""

LEAST_ABORT = 2.0
"""Distance from the plan up to which no flight is stopped [m]."""

LAG = 0.315
"""What is added for the lag: 1.5 times 1.4, in bends, times ArduCopter's 0.15 s, of the top speed [s]."""

HEAP = (40_000, 1_000)
"""Bytes of SCR_HEAP_SIZE: of the script, and of each polynomial."""


def write_script(trajectory: Trajectory, path: FileName, *, clobber: bool = True) -> str | None:
    """Write a trajectory as a script for ArduCopter.

    Parameters
    ----------
    trajectory : Trajectory
        3 coordinates, from rest to rest, in east, north, up of the estimate's origin.
    path : str or path
        Destination, a ``.lua``.
    clobber : bool
        False: a destination that exists is an error.

    Returns
    -------
    str
        A sentence on the memory that it takes.

    Raises
    ------
    FileError
        If it has other than 3 coordinates, or does not begin and end at rest.
    YawError
        If its heading is no polynomial to a milliradian.
    """
    check_spatial(trajectory, "a script")
    speeds = np.linalg.norm(trajectory(np.array([0.0, trajectory.duration]), order=1), axis=1)
    if speeds.max() > AT_REST:
        raise FileError(
            f"a script begins and ends at rest, and the path is {speeds[0]:.3g} m/s fast at its start and "
            f"{speeds[1]:.3g} at its end: plan it from rest to rest"
        )
    body = files(__package__).joinpath("fly_polynomials.lua").read_text(encoding="utf-8")
    write_file(path, "\n".join([*_head(trajectory), body]), clobber=clobber)
    wanted = HEAP[0] + HEAP[1] * len(trajectory.durations)
    where = "docs/ardupilot_script.rst"
    return f"the script flies when its switch says so ({where}); it takes SCR_HEAP_SIZE of {wanted} or more"


def _head(trajectory: Trajectory) -> list[str]:
    """Return the lines that hold the flight."""
    ned = get_frame("ned")
    powers = position_powers(trajectory, trajectory.degree) @ ned.matrix.T
    columns = [trajectory.durations[:, None], *np.moveaxis(powers, 2, 0)]
    constant = trajectory.yaw.constant
    if constant is None:
        columns.append(_headings(yaw_powers(trajectory, trajectory.degree)))
    rows = np.concatenate(columns, axis=1)
    far = max(LEAST_ABORT, LAG * trajectory.max_norm(1)[0])
    return [
        "-- A flight planned by minsnap. Each row is a polynomial: its seconds, then ascending powers of seconds",
        "-- of north, east and down [m], and of the heading where it turns [deg].",
        f"local DURATION, DEGREE = {trajectory.duration!r}, {trajectory.degree}",
        f"local ABORT_DISTANCE = {far:.3g} -- from the plan [m]",
        "local FROM_HERE = false -- true: the flight is moved so that it begins where the vehicle hovers",
        f"local HEADING = {np.degrees(ned.yaw_offset + ned.yaw_sign * (constant or 0.0)):.9g}",
        "local PIECES = {",
        *(f"  {{{', '.join(f'{value:.9g}' for value in row)}}}," for row in rows.tolist()),
        "}",
        "",
    ]


def _headings(yaw: FloatArray) -> FloatArray:
    """Return the powers of a yaw, shape (pieces, n) [rad], as those of a heading [deg from north, clockwise]."""
    ned = get_frame("ned")
    headings = ned.yaw_sign * yaw
    headings[:, 0] += ned.yaw_offset
    return np.degrees(headings)


FORMATS = (Format("ardupilot-lua", "polynomials", (".lua",), write_script, frame="ned"),)
