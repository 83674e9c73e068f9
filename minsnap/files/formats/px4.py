"""Setpoints shaped like px4_msgs/TrajectorySetpoint, for ROS 2 programs, without ROS.

NED, float32, yaw in [-pi, pi]; NaN marks values that are not controlled (PX4's message definition).
"""

from __future__ import annotations

import os

import numpy as np
import numpy.typing as npt

from minsnap.basics.arrays import FloatArray
from minsnap.basics.storage.atomic import atomic_write
from minsnap.files.format import Format, Writing
from minsnap.files.frames import map_samples
from minsnap.trajectory.heading import wrap
from minsnap.trajectory.samples import Samples

DTYPE = np.dtype(
    [
        ("timestamp", np.uint64),
        ("position", np.float32, 3),
        ("velocity", np.float32, 3),
        ("acceleration", np.float32, 3),
        ("jerk", np.float32, 3),
        ("yaw", np.float32),
        ("yawspeed", np.float32),
    ]
)
"""The fields of the message, in its order."""


def px4_setpoints(samples: Samples, start: int = 0) -> npt.NDArray[np.void]:
    """Return one message per sample.

    Parameters
    ----------
    samples : Samples
        Three coordinates, z-up world axes; feed-forward is added to the acceleration.
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
    """
    ned = map_samples(samples.commanded(), "enu", "ned")
    messages = np.zeros(len(ned), DTYPE)
    messages["timestamp"] = start + np.round((ned.t - ned.t[0]) * 1e6).astype(np.uint64)
    for name in ("position", "velocity", "acceleration", "jerk"):
        messages[name] = _or_nan(getattr(ned, name))
    yaw = _or_nan(ned.yaw)
    messages["yaw"] = np.where(np.abs(yaw) <= np.pi, yaw, wrap(yaw))
    messages["yawspeed"] = _or_nan(ned.yaw_rate)
    return messages


def offboard_control_mode(timestamp: int = 0) -> dict[str, int | bool]:
    """Return the px4_msgs/OffboardControlMode to send with them: position control, the rest is feed-forward."""
    rest = ("velocity", "acceleration", "attitude", "body_rate", "thrust_and_torque", "direct_actuator")
    return {"timestamp": timestamp, "position": True} | dict.fromkeys(rest, False)


def write_px4(samples: Samples, path: str | os.PathLike[str], *, clobber: bool = True) -> None:
    """Write the messages as a NumPy file of :data:`DTYPE`; ``numpy.load`` reads it."""
    messages = px4_setpoints(samples)
    with atomic_write(path, "wb", clobber=clobber) as file:
        np.save(file, messages, allow_pickle=False)


def _or_nan(values: FloatArray | None) -> FloatArray | float:
    return np.nan if values is None else values


def _write(content: Samples, path: str | os.PathLike[str], writing: Writing) -> None:
    write_px4(content, path, clobber=writing.clobber)


FORMAT = Format("px4", "samples", (".npy",), _write, frame="ned")
