"""JSON shaped like ROS's trajectory_msgs/MultiDOFJointTrajectory, without ROS: one array element per point.

The MAV convention: transforms hold position and heading, velocities the first derivative, accelerations the second.
ENU, z up (REP 103), named in the header.
"""

from __future__ import annotations

import json
import math
import os
from typing import Any

from minsnap.basics.arrays import FloatArray
from minsnap.basics.storage.atomic import atomic_write
from minsnap.errors import FileError
from minsnap.files.format import Format, Writing
from minsnap.trajectory.samples import Samples


def multidof(samples: Samples, frame_id: str = "map", joint: str = "base_link") -> dict[str, Any]:
    """Return the message as nested dictionaries.

    Parameters
    ----------
    samples : Samples
        Three coordinates, z-up world axes; velocities and accelerations are left empty where there are none.
    frame_id, joint : str
        Names of the world frame and of the vehicle.

    Raises
    ------
    FileError
        If the samples do not have 3 coordinates.
    """
    if samples.dim != 3:
        raise FileError(f"this message holds 3 coordinates, and the samples have {samples.dim}")
    header = {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": frame_id}
    points = [_point(samples, row) for row in range(len(samples))]
    return {"header": header, "joint_names": [joint], "points": points}


def write_multidof(samples: Samples, path: str | os.PathLike[str], *, clobber: bool = True) -> None:
    """Write the message as JSON."""
    text = json.dumps(multidof(samples), allow_nan=False)
    with atomic_write(path, clobber=clobber) as file:
        file.write(text + "\n")


def _point(samples: Samples, row: int) -> dict[str, Any]:
    half = 0.0 if samples.yaw is None else float(samples.yaw[row]) / 2
    rotation = {"x": 0.0, "y": 0.0, "z": math.sin(half), "w": math.cos(half)}
    rate = 0.0 if samples.yaw_rate is None else float(samples.yaw_rate[row])
    return {
        "transforms": [{"translation": _vector(samples.position[row]), "rotation": rotation}],
        "velocities": _twists(samples.velocity, row, rate),
        "accelerations": _twists(samples.acceleration, row, 0.0),
        "time_from_start": _duration(float(samples.t[row] - samples.t[0])),
    }


def _twists(values: FloatArray | None, row: int, turning: float) -> list[dict[str, Any]]:
    if values is None:
        return []
    return [{"linear": _vector(values[row]), "angular": {"x": 0.0, "y": 0.0, "z": turning}}]


def _vector(values: FloatArray) -> dict[str, float]:
    return dict(zip("xyz", values.tolist(), strict=True))


def _duration(seconds: float) -> dict[str, int]:
    nanoseconds = round(seconds * 1e9)
    return {"sec": nanoseconds // 10**9, "nanosec": nanoseconds % 10**9}


def _write(content: Samples, path: str | os.PathLike[str], writing: Writing) -> None:
    write_multidof(content, path, clobber=writing.clobber)


FORMAT = Format("multidof", "samples", (), _write)
