"""Logs of autopilots (extra ``logs``): PX4's ULog, read and written, and ArduPilot's dataflash log, read.

Of PX4 (docs.px4.io, ULog file format), ``vehicle_local_position`` is the flight, ``trajectory_setpoint`` the reference;
of ArduPilot, GUIP is what was sent, the position controller's PSCN, PSCE, PSCD are the flight, and the reference
without GUIP; or the estimator's XKF1 (EKF3) or NKF1 (EKF2) is the flight.
"""

from __future__ import annotations

import contextlib
import io
import os
import struct
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.optional_packages import optional
from minsnap.basics.storage.atomic import write_file
from minsnap.basics.storage.text import FileName, check_size, read_bytes, reading
from minsnap.errors import FileError, InputError
from minsnap.files.flight_log import (
    BODY,
    WORLD,
    FlightLog,
    InertialLog,
    clock_goes_back,
    flight_log,
    from_euler,
    inertial_log,
    rising,
)
from minsnap.files.frames import map_samples
from minsnap.trajectory.samples import Samples

POSITION = "vehicle_local_position"
SETPOINTS = ("trajectory_setpoint", "vehicle_local_position_setpoint")
"""Topics that hold setpoints: the current one, and the controller's own of older logs."""

ACCELEROMETERS = {
    "sensor_combined": [f"accelerometer_m_s2[{k}]" for k in range(3)],
    "vehicle_acceleration": [f"xyz[{k}]" for k in range(3)],
}
"""Topics with what the accelerometer measured, the better one first, and their fields."""

INERTIAL = (*ACCELEROMETERS, "vehicle_attitude", "vehicle_thrust_setpoint", "hover_thrust_estimate")
"""Topics that say what the body felt."""

READS = 2
"""Reads for each byte of a log after which its parser is stopped; a sound log takes less than one."""

_HEADER = 16
_MAGIC = b"ULog\x01\x12\x35"


def read_ulog(path: FileName, inertial: bool = False) -> FlightLog:
    """Read a PX4 log.

    Parameters
    ----------
    path : str or path
        A ``.ulg`` file.
    inertial : bool
        Read attitude, accelerometer and throttle too.

    Returns
    -------
    FlightLog
        With what could be read of a damaged one, which its ``damage`` says.

    Raises
    ------
    FileError
        If the file cannot be read, is no ULog, or holds neither positions nor setpoints.
    ImportError
        If pyulog is not installed.
    """
    pyulog = optional("pyulog", "reading ULog needs pyulog", "logs")
    raw = read_bytes(path)
    if len(raw) < _HEADER or not raw.startswith(_MAGIC):
        raise FileError(f"{path} is no ULog file")
    with contextlib.redirect_stdout(io.StringIO()):  # it prints messages about damage
        try:
            log = pyulog.ULog(_Patient(raw), [POSITION, *SETPOINTS, *(INERTIAL if inertial else ())])
        except Exception as error:
            raise FileError(f"{path} is too damaged to be read: {error or type(error).__name__}") from None
    with reading(path, "a ULog file that makes sense"):
        topics = {data.name: data.data for data in reversed(log.data_list)}
        reference = next((_setpoints(topics[name]) for name in SETPOINTS if name in topics), None)
        result = flight_log(reference, _positions(topics.get(POSITION)), _damage(path, raw, log.file_corruption))
        if result.reference is None and result.flight is None:
            logged = topics.get(POSITION)
            if logged is not None and len(logged["timestamp"]):
                what = f"{len(logged['timestamp'])} rows of {POSITION}"
                raise FileError(
                    f"{path} holds {what}, none with a valid horizontal position: the vehicle never had one"
                )
            raise FileError(f"{path} holds neither {POSITION} nor {SETPOINTS[0]}: log them")
        return replace(result, inertial=_inertial(topics, result.start), autopilot="px4")


def _inertial(topics: dict[str, dict[str, FloatArray]], start: float) -> InertialLog | None:
    """Return attitude, specific force and throttle; None where attitude or accelerometer was not logged."""
    attitude = topics.get("vehicle_attitude", {})
    turns = _some(attitude, *(f"q[{k}]" for k in range(4)))
    felt = [(topics[topic], names) for topic, names in ACCELEROMETERS.items() if topic in topics]
    if turns is None or not felt:
        return None
    force = _stack(felt[0][0], *felt[0][1])
    thrust = topics.get("vehicle_thrust_setpoint")
    throttle = None if thrust is None else (thrust["timestamp"] * 1e-6, -np.asarray(thrust["xyz[2]"], dtype=np.float64))
    hover = topics.get("hover_thrust_estimate")
    known = None if hover is None else float(np.median(hover["hover_thrust"]))
    times = (attitude["timestamp"] * 1e-6, felt[0][0]["timestamp"] * 1e-6)
    return inertial_log((times[0], turns), (times[1], force), throttle, known, start)


class _Patient(io.BytesIO):
    """A byte stream with a bounded number of reads: pyulog does not terminate if a file ends in a damaged header."""

    def __init__(self, raw: bytes) -> None:
        super().__init__(raw)
        self.reads = READS * len(raw) + 1000

    def read(self, size: int | None = -1) -> bytes:
        """Read until the bound on the number of reads is reached."""
        self.reads -= 1
        if self.reads < 0:
            raise RuntimeError("its message definitions contain each other")
        return super().read(size)


def _positions(data: dict[str, FloatArray] | None) -> Samples | None:
    """Return the positions of the vehicle; rows that the estimator marked invalid are dropped."""
    if data is None or not all(name in data for name in ("timestamp", "x", "y", "z")):
        return None
    valid = np.asarray(data.get("xy_valid", 1), dtype=bool) & np.asarray(data.get("z_valid", 1), dtype=bool)
    position = np.where(np.broadcast_to(valid, data["x"].shape)[:, None], _stack(data, "x", "y", "z"), np.nan)
    velocity, acceleration = _some(data, "vx", "vy", "vz"), _some(data, "ax", "ay", "az")
    heading = data.get("heading", data.get("yaw"))
    return Samples(data["timestamp"] * 1e-6, position, velocity, acceleration, yaw=heading)


def _setpoints(data: dict[str, FloatArray]) -> Samples | None:
    """Return the setpoints, under either of the two names of the fields."""
    for place, speed, axes in (("position[{}]", "velocity[{}]", "012"), ("{}", "v{}", "xyz")):
        position, velocity = (_some(data, *map(name.format, axes)) for name in (place, speed))
        if position is not None:
            acceleration = _some(data, *(f"acceleration[{i}]" for i in range(3)))
            yaw, rate = data.get("yaw"), data.get("yawspeed")
            return Samples(data["timestamp"] * 1e-6, position, velocity, acceleration, yaw=yaw, yaw_rate=rate)
    return None


def _some(data: dict[str, FloatArray], *names: str) -> FloatArray | None:
    return _stack(data, *names) if all(name in data for name in names) else None


def _stack(data: dict[str, FloatArray], *names: str) -> FloatArray:
    return np.stack([np.asarray(data[name], dtype=np.float64) for name in names], axis=1)


def _damage(path: Any, raw: bytes, corrupt: bool) -> str | None:
    """Return a sentence if the parser reports damage or the file ends within a message."""
    if corrupt:
        return f"{path} is damaged"
    offset, header = _HEADER, struct.Struct("<HB")
    while offset + header.size <= len(raw):
        offset += header.size + header.unpack_from(raw, offset)[0]
    return None if offset == len(raw) else f"{path} ends in the middle of a message"


BOOT = 1.0
"""Time since boot of a log's instant 0 [s]."""

Topic = tuple[str, str, FloatArray, FloatArray]
"""Name, fields without the timestamp, instants (m,), values (m, k)."""


def write_ulog(log: FlightLog, path: FileName, *, clobber: bool = True) -> None:
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
    parts: Any = ((log.reference, _setpoint_topics), (log.flight, _flown), (log.inertial, _felt))
    topics = [topic for part, described in parts if part is not None for topic in described(part)]
    if not topics:
        raise InputError("the log has neither setpoints nor positions: there is nothing to write")
    write_file(path, _ulog(topics), clobber=clobber)


def _setpoint_topics(reference: Samples) -> list[Topic]:
    sent = map_samples(reference, "enu", "ned").commanded()
    fields = "float[3] position;float[3] velocity;float[3] acceleration;float yaw;"
    unknown = np.full((len(sent), 3), np.nan)
    motion = [unknown if each is None else each for each in (sent.velocity, sent.acceleration)]
    yaw = unknown[:, :1] if sent.yaw is None else sent.yaw[:, None]
    return [("trajectory_setpoint", fields, sent.t, np.hstack([sent.position, *motion, yaw]))]


def _flown(flight: Samples) -> list[Topic]:
    flown = map_samples(flight, "enu", "ned")
    speed, fields = ([], "float x;float y;float z;")
    if flown.velocity is not None:
        speed, fields = [flown.velocity], fields + "float vx;float vy;float vz;"
    return [("vehicle_local_position", fields, flown.t, np.hstack([flown.position, *speed]))]


def _felt(inertial: InertialLog) -> list[Topic]:
    from minsnap.vehicle.attitude import quaternions, rotations

    quaternion = quaternions(WORLD.T @ rotations(inertial.quaternion) @ BODY)
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


AXES = {"PSCN": "N", "PSCE": "E", "PSCD": "D"}
"""Messages of the position controller; their fields end in the axis (metres, ArduPilot's log messages)."""

HEADER = 3
"""Bytes before the fields of a message."""

SENT, _WITH_PLACE = "GUIP", 3
"""What was sent to an ArduCopter in GUIDED, and the type of it that has a position (its log messages)."""

ESTIMATES = ("XKF1", "NKF1")
"""States of the estimator: of EKF3, or of EKF2, of which old logs have no number of the core."""

_TYPES = [*AXES, SENT, *ESTIMATES, "ATT"]
_INERTIAL = ["IMU", "CTUN"]


def read_dataflash(path: FileName, inertial: bool = False) -> FlightLog:
    """Read an ArduPilot log.

    What was sent in GUIDED is the reference (GUIP), or else the position controller's targets; its positions are the
    flight. For a log without them, the flight is
    the estimator's positions, and there is no reference.

    Parameters
    ----------
    path : str or path
        A ``.bin`` file.
    inertial : bool
        Read attitude, accelerometer and throttle too.

    Returns
    -------
    FlightLog
        With what could be read of a damaged one, which its ``damage`` says.

    Raises
    ------
    FileError
        If the file cannot be read, is no dataflash log, or holds no positions.
    ImportError
        If pymavlink is not installed.
    """
    dataflash: Any = optional("pymavlink.DFReader", "reading dataflash logs needs pymavlink", "logs")
    if not check_size(path) or not Path(path).is_file():
        raise FileError(f"{path} is missing or empty")

    class PythonReader(dataflash.DFReader_binary):  # type: ignore[misc]
        """Searches messages in Python: the compiled search prints its complaints past ``sys.stderr``."""

        formats: dict[int, Any]

        def __init__(self, name: str) -> None:
            try:
                super().__init__(name)
            except Exception:
                self.filehandle.close()
                raise

        def init_arrays_fast(self, progress_callback: Any = None) -> None:
            self.init_arrays(progress_callback)

        def init_arrays(self, progress_callback: Any = None) -> None:
            self.formats = _Formats(self.formats)
            super().init_arrays(progress_callback)

    complaints = io.StringIO()
    with contextlib.redirect_stderr(complaints), contextlib.redirect_stdout(complaints):
        try:
            columns, late = _columns(PythonReader(os.fspath(path)), [*_TYPES, *(_INERTIAL if inertial else ())])
        except Exception as error:
            raise FileError(f"{path} is no dataflash log: {error or type(error).__name__}") from None
    damage = f"{path} is damaged" if complaints.getvalue() else late
    with reading(path, "a dataflash log that makes sense"):
        result = flight_log(*_tracks(columns), damage)
        if result.flight is None:
            raise FileError(f"{path} holds no positions (PSCN, PSCE, PSCD, or {' or '.join(ESTIMATES)})")
        felt = _inertial_of(columns, result.start) if inertial else None
        return replace(result, inertial=felt, autopilot="ardupilot")


class _Formats(dict[int, Any]):
    """Formats of messages by type, none shorter than its header: such a message would be read for ever."""

    def __setitem__(self, key: int, value: Any) -> None:
        if value.len < HEADER:
            raise ValueError(f"messages of type {key} have a length of {value.len} bytes")
        super().__setitem__(key, value)


def _inertial_of(columns: dict[str, dict[str, FloatArray]], start: float) -> InertialLog | None:
    """Return attitude, specific force and throttle; None where attitude or accelerometer was not logged."""
    attitude, felt, thrust = (columns.get(name, {}) for name in ("ATT", "IMU", "CTUN"))
    angles, force = _some(attitude, "Roll", "Pitch", "Yaw"), _some(felt, "AccX", "AccY", "AccZ")
    if angles is None or force is None:
        return None
    turns = from_euler(*np.radians(angles).T)
    throttle = (thrust["TimeUS"] * 1e-6, thrust["ThO"]) if "ThO" in thrust else None
    hover = float(np.median(thrust["ThH"])) if "ThH" in thrust else None
    return inertial_log((attitude["TimeUS"] * 1e-6, turns), (felt["TimeUS"] * 1e-6, force), throttle, hover, start)


def _columns(reader: Any, types: list[str]) -> tuple[dict[str, dict[str, FloatArray]], str | None]:
    """Return every message type that is read as columns, and a sentence on rows left out for their times."""
    rows: dict[str, list[dict[str, float]]] = {name: [] for name in types}
    with reader:
        for message in iter(lambda: reader.recv_match(type=types), None):
            rows[message.get_type()].append(message.to_dict())
    for name, instance in (*((each, "C") for each in ESTIMATES), ("IMU", "I")):
        rows[name] = [row for row in rows.get(name, []) if not row.get(instance)]
    tables = {name: _table(entries) for name, entries in rows.items() if entries}
    late = clock_goes_back(table["TimeUS"] for table in tables.values())
    kept = {name: rising(table["TimeUS"]) for name, table in tables.items()}
    return {name: {key: values[kept[name]] for key, values in table.items()} for name, table in tables.items()}, late


def _table(rows: list[dict[str, Any]]) -> dict[str, FloatArray]:
    names = [name for name, value in rows[0].items() if isinstance(value, (int, float))] if rows else []
    return {name: np.array([row.get(name, np.nan) for row in rows], dtype=np.float64) for name in names}


def _tracks(columns: dict[str, dict[str, FloatArray]]) -> tuple[Samples | None, Samples | None]:
    """Return the reference and the flight."""
    if all(name in columns for name in AXES):
        targets, flown = _track(columns, "TP", "TV", "TA", "DesYaw"), _track(columns, "P", "V", "A", "Yaw")
        return _sent(columns, targets) or targets, flown
    estimate = next((columns[name] for name in ESTIMATES if name in columns), {})
    position, velocity = (_some(estimate, *(kind + axis for axis in "NED")) for kind in "PV")
    if position is None or velocity is None:
        return None, None
    t = estimate["TimeUS"] * 1e-6
    return None, Samples(t, position, velocity, yaw=_heading(columns, t, "Yaw"))


def _sent(columns: dict[str, dict[str, FloatArray]], targets: Samples) -> Samples | None:
    """Return the setpoints that were sent; None where none was logged.

    The autopilot's own targets may be half a metre off them. Up is positive until 4.6, and down from 4.7 on, as in the
    targets: of the two signs it is that which is nearer to them.
    """
    rows = columns.get(SENT, {})
    parts = [_some(rows, *(kind + axis for axis in "XYZ")) for kind in "pva"]
    placed = rows.get("Type", np.zeros(0)) == _WITH_PLACE
    if parts[0] is None or placed.sum() < 2:
        return None
    t = rows["TimeUS"][placed] * 1e-6
    height, target = parts[0][placed, 2], np.interp(t, targets.t, targets.position[:, 2])
    up = bool(np.nanmedian(np.abs(height + target)) < np.nanmedian(np.abs(height - target)))
    place, speed, push = (None if each is None else each[placed] * [1.0, 1.0, -1.0 if up else 1.0] for each in parts)
    assert place is not None
    return Samples(t, place, speed, push)


def _track(columns: dict[str, dict[str, FloatArray]], place: str, speed: str, push: str, heading: str) -> Samples:
    """Interpolate the three axes, logged microseconds apart, to the instants of the first."""
    t = columns["PSCN"]["TimeUS"] * 1e-6
    position, velocity, acceleration = (_stacked(columns, t, prefix) for prefix in (place, speed, push))
    nowhere = np.full((len(t), 3), np.nan)
    yaw = _heading(columns, t, heading)
    return Samples(t, nowhere if position is None else position, velocity, acceleration, yaw=yaw)


def _stacked(columns: dict[str, dict[str, FloatArray]], t: FloatArray, prefix: str) -> FloatArray | None:
    parts = [(columns[message], prefix + axis) for message, axis in AXES.items()]
    if not all(name in table for table, name in parts):
        return None
    return np.stack([np.interp(t, table["TimeUS"] * 1e-6, table[name]) for table, name in parts], axis=1)


def _heading(columns: dict[str, dict[str, FloatArray]], t: FloatArray, name: str) -> FloatArray | None:
    """Interpolate a heading, which is logged in degrees."""
    attitude = columns.get("ATT", {})
    if name not in attitude:
        return None
    return np.interp(t, attitude["TimeUS"] * 1e-6, np.unwrap(np.radians(attitude[name])))
