"""Setpoints shaped like messages of PX4 and ROS, without ROS.

px4_msgs/TrajectorySetpoint: NED, float32, yaw in [-pi, pi]; NaN marks values that are not controlled (PX4's message
definition).

trajectory_msgs/MultiDOFJointTrajectory as JSON, one array element per point. The MAV convention: transforms hold
position and heading, velocities the first derivative, accelerations the second. ENU, z up (REP 103), named in the
header.
"""

from __future__ import annotations

import io
import json
import math
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray, NDArray
from minsnap.basics.checks import check_kind
from minsnap.basics.storage.atomic import write_file
from minsnap.basics.storage.text import FileName
from minsnap.errors import FileError
from minsnap.files.convert import Format
from minsnap.files.frames import map_samples
from minsnap.trajectory.heading import wrap
from minsnap.trajectory.path import Path
from minsnap.trajectory.samples import Samples

MOTION = ("position", "velocity", "acceleration", "jerk")
_HEADING = [("yaw", np.float32), ("yawspeed", np.float32)]
DTYPE = np.dtype([("timestamp", np.uint64), *((name, np.float32, 3) for name in MOTION), *_HEADING])
"""The fields of the message, in its order."""


def px4_setpoints(samples: Samples | Path, start: int = 0) -> NDArray[np.void]:
    """Return one message per sample.

    Parameters
    ----------
    samples : Samples or Path
        Three coordinates, z-up world axes; feed-forward is added to the acceleration. A path is sampled at 20 Hz:
        give ``path.sample(50.0)`` for another rate.
    start : int
        Time stamp of the first sample [microseconds].

    Returns
    -------
    ndarray of :data:`DTYPE`, shape (m,)
        ``setpoints["position"]`` is (m, 3), in NED.

    Raises
    ------
    FrameError
        If the samples do not have 3 coordinates.
    InputError
        If they are neither samples nor a path.
    """
    check_kind("what PX4 is to fly", samples, (Samples, Path), "samples or a path")
    samples = samples.sample() if isinstance(samples, Path) else samples
    ned = map_samples(samples.commanded(), "enu", "ned")
    messages = np.zeros(len(ned), DTYPE)
    messages["timestamp"] = start + np.round((ned.t - ned.t[0]) * 1e6).astype(np.uint64)
    for name in MOTION:
        messages[name] = _or_nan(getattr(ned, name))
    yaw = _or_nan(ned.yaw)
    messages["yaw"] = np.where(np.abs(yaw) <= np.pi, yaw, wrap(yaw))
    messages["yawspeed"] = _or_nan(ned.yaw_rate)
    return messages


def offboard_control_mode(timestamp: int = 0) -> dict[str, int | bool]:
    """Return the px4_msgs/OffboardControlMode to send with them: position control, the rest is feed-forward."""
    rest = ("velocity", "acceleration", "attitude", "body_rate", "thrust_and_torque", "direct_actuator")
    return {"timestamp": timestamp, "position": True} | dict.fromkeys(rest, False)


def write_px4(samples: Samples | Path, path: FileName, *, clobber: bool = True) -> None:
    """Write the messages as a NumPy file of :data:`DTYPE`; ``numpy.load`` reads it."""
    content = io.BytesIO()  # numpy writes into a pipe or onto a full disk only through a file that is none
    np.save(content, px4_setpoints(samples), allow_pickle=False)
    write_file(path, content.getvalue(), clobber=clobber)


def _or_nan(values: FloatArray | None) -> FloatArray | float:
    return np.nan if values is None else values


def multidof(samples: Samples, frame_id: str = "map", joint: str = "base_link") -> dict[str, Any]:
    """Return the message as nested dictionaries.

    Parameters
    ----------
    samples : Samples
        Three coordinates, z-up world axes; velocities and accelerations are left empty where there are none, and
        feed-forward is added to the accelerations. That of the yaw is the slope of its rate between the samples.
    frame_id, joint : str
        Names of the world frame and of the vehicle.

    Raises
    ------
    FileError
        If the samples do not have 3 coordinates.
    """
    if samples.dim != 3:
        raise FileError(f"this message holds 3 coordinates, and the samples have {samples.dim}")
    samples = samples.commanded()
    header = {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": frame_id}
    turning = _turning(samples)
    points = [_point(samples, row, turning[row].tolist()) for row in range(len(samples))]
    return {"header": header, "joint_names": [joint], "points": points}


def write_multidof(samples: Samples, path: FileName, *, clobber: bool = True) -> None:
    """Write the message as JSON."""
    write_file(path, json.dumps(multidof(samples), allow_nan=False) + "\n", clobber=clobber)


def _turning(samples: Samples) -> FloatArray:
    """Return yaw rate and yaw acceleration, shape (m, 2) [rad/s], [rad/s^2]; zero where they are not known."""
    rate = np.zeros(len(samples)) if samples.yaw_rate is None else samples.yaw_rate
    return np.stack([rate, np.gradient(rate, samples.t) if len(samples) > 1 else 0.0 * rate], axis=1)


def _point(samples: Samples, row: int, turning: list[float]) -> dict[str, Any]:
    half = 0.0 if samples.yaw is None else float(samples.yaw[row]) / 2
    nanoseconds = round(float(samples.t[row] - samples.t[0]) * 1e9)
    rotation = {"x": 0.0, "y": 0.0, "z": math.sin(half), "w": math.cos(half)}
    return {
        "transforms": [{"translation": _vector(samples.position[row]), "rotation": rotation}],
        "velocities": _twists(samples.velocity, row, turning[0]),
        "accelerations": _twists(samples.acceleration, row, turning[1]),
        "time_from_start": dict(zip(("sec", "nanosec"), divmod(nanoseconds, 10**9), strict=True)),
    }


def _twists(values: FloatArray | None, row: int, turning: float) -> list[dict[str, Any]]:
    if values is None:
        return []
    return [{"linear": _vector(values[row]), "angular": {"x": 0.0, "y": 0.0, "z": turning}}]


def _vector(values: FloatArray) -> dict[str, float]:
    return dict(zip("xyz", values.tolist(), strict=True))


FORMATS = (
    Format("multidof", "samples", (), write_multidof, leaves_out=("t", "jerk", "snap", "lead")),
    Format("px4", "samples", (".npy",), write_px4, frame="ned", leaves_out=("t", "snap", "lead")),
)
