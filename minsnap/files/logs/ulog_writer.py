"""A flight log as PX4's ULog, the topics and fields of its own logs (format: docs.px4.io, ULog file format)."""

from __future__ import annotations

import os
import struct

import numpy as np
from scipy.spatial.transform import Rotation

from minsnap.basics.arrays import FloatArray
from minsnap.basics.storage.atomic import atomic_write
from minsnap.errors import InputError
from minsnap.files.frames import map_samples
from minsnap.files.logs.flight_log import FlightLog
from minsnap.files.logs.inertial_log import BODY, WORLD, InertialLog
from minsnap.trajectory.samples import Samples

BOOT = 1.0
"""Time since boot of a log's instant 0 [s]."""

Topic = tuple[str, str, FloatArray, FloatArray]
"""Name, fields without the timestamp, instants (m,), values (m, k)."""


def write_ulog(log: FlightLog, path: str | os.PathLike[str], *, clobber: bool = True) -> None:
    """Write a flight log as ULog, as PX4's own tools, ``fit``, ``compare`` and ``tune`` read it.

    Parameters
    ----------
    log : FlightLog
        Such as :func:`minsnap.flight.simulated_log` returns.
    path : str or path
        A ``.ulg`` file.
    clobber : bool
        Replace a file that is there.

    Raises
    ------
    InputError
        If the log has neither setpoints nor positions.
    FileError
        If the file cannot be written.
    """
    topics = [*_setpoint_topics(log.reference), *_flown(log.flight), *_felt(log.inertial)]
    if not topics:
        raise InputError("the log has neither setpoints nor positions: there is nothing to write")
    with atomic_write(path, "wb", clobber=clobber) as file:
        file.write(_ulog(topics))


def _setpoint_topics(reference: Samples | None) -> list[Topic]:
    if reference is None:
        return []
    sent = map_samples(reference, "enu", "ned").commanded()
    fields = "float[3] position;float[3] velocity;float[3] acceleration;float yaw;"
    unknown = np.full((len(sent), 3), np.nan)
    motion = [unknown if each is None else each for each in (sent.velocity, sent.acceleration)]
    yaw = unknown[:, :1] if sent.yaw is None else sent.yaw[:, None]
    return [("trajectory_setpoint", fields, sent.t, np.hstack([sent.position, *motion, yaw]))]


def _flown(flight: Samples | None) -> list[Topic]:
    if flight is None:
        return []
    flown = map_samples(flight, "enu", "ned")
    speed, fields = ([], "float x;float y;float z;")
    if flown.velocity is not None:
        speed, fields = [flown.velocity], fields + "float vx;float vy;float vz;"
    return [("vehicle_local_position", fields, flown.t, np.hstack([flown.position, *speed]))]


def _felt(inertial: InertialLog | None) -> list[Topic]:
    if inertial is None:
        return []
    turns = WORLD.T @ Rotation.from_quat(np.roll(inertial.quaternion, -1, axis=1)).as_matrix() @ BODY
    quaternion = np.roll(Rotation.from_matrix(turns).as_quat(), 1, axis=1)
    topics = [
        ("vehicle_attitude", "float[4] q;", inertial.attitude_t, quaternion),
        ("sensor_combined", "float[3] accelerometer_m_s2;", inertial.force_t, inertial.specific_force @ BODY),
    ]
    if inertial.throttle is not None and inertial.throttle_t is not None:
        up = inertial.throttle[:, None] * np.array([0.0, 0.0, -1.0])
        topics.append(("vehicle_thrust_setpoint", "float[3] xyz;", inertial.throttle_t, up))
    return topics


def _ulog(topics: list[Topic]) -> bytes:
    """Return header, flag bits, formats, subscriptions, then data in the order of time."""
    formats = [_message("F", f"{name}:uint64_t timestamp;{fields}".encode()) for name, fields, _, _ in topics]
    names = [_message("A", struct.pack("<BH", 0, key) + name.encode()) for key, (name, *_) in enumerate(topics)]
    rows = [row for key, (_, _, t, values) in enumerate(topics) for row in _rows(key, t, values)]
    data = [_message("D", payload) for _, payload in sorted(rows, key=lambda row: row[0])]
    head = b"ULog\x01\x12\x35\x01" + struct.pack("<Q", round(BOOT * 1e6))
    return b"".join([head, _message("B", bytes(40)), *formats, *names, *data])


def _rows(key: int, t: FloatArray, values: FloatArray) -> list[tuple[int, bytes]]:
    stamps = np.round((t + BOOT) * 1e6).astype(int).tolist()
    cells = values.astype("<f4")
    return [(stamp, struct.pack("<HQ", key, stamp) + row.tobytes()) for stamp, row in zip(stamps, cells, strict=True)]


def _message(kind: str, payload: bytes) -> bytes:
    return struct.pack("<HB", len(payload), ord(kind)) + payload
