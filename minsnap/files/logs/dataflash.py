"""ArduPilot's dataflash log: the position controller's PSCN, PSCE, PSCD, or the estimator's XKF1 (extra ``logs``)."""

from __future__ import annotations

import contextlib
import io
import os
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.storage.reading import check_size, reading
from minsnap.errors import FileError
from minsnap.files.logs.flight_log import FlightLog, InertialLog, flight_log, from_euler, inertial_log
from minsnap.trajectory.samples import Samples

AXES = {"PSCN": "N", "PSCE": "E", "PSCD": "D"}
"""Messages of the position controller; their fields end in the axis (metres, ArduPilot's log messages)."""

HEADER = 3
"""Bytes before the fields of a message."""

_TYPES = [*AXES, "XKF1", "ATT"]
_INERTIAL = ["IMU", "CTUN"]


def read_dataflash(path: str | os.PathLike[str], inertial: bool = False) -> FlightLog:
    """Read an ArduPilot log.

    The position controller's targets are the reference, its positions the flight. For a log without them, the flight is
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
    try:
        from pymavlink.DFReader import DFReader_binary
    except ImportError:
        raise ImportError("reading dataflash logs needs pymavlink: pip install minsnap[logs]") from None
    if not check_size(path) or not Path(path).is_file():
        raise FileError(f"{path} is missing or empty")

    class PythonReader(DFReader_binary):  # type: ignore[misc]
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
            columns = _columns(PythonReader(os.fspath(path)), [*_TYPES, *(_INERTIAL if inertial else ())])
        except Exception as error:
            raise FileError(f"{path} is no dataflash log: {error or type(error).__name__}") from None
    damage = f"{path} is damaged" if complaints.getvalue() else None
    with reading(path, "a dataflash log that makes sense"):
        result = flight_log(*_tracks(columns), damage)
    if result.flight is None:
        raise FileError(f"{path} holds no positions (PSCN, PSCE, PSCD or XKF1)")
    with reading(path, "a dataflash log that makes sense"):
        return replace(result, inertial=_inertial_of(columns, result.start) if inertial else None)


class _Formats(dict[int, Any]):
    """Formats of messages by type, none shorter than its header: such a message would be read for ever."""

    def __setitem__(self, key: int, value: Any) -> None:
        if value.len < HEADER:
            raise ValueError(f"messages of type {key} have a length of {value.len} bytes")
        super().__setitem__(key, value)


def _inertial_of(columns: dict[str, dict[str, FloatArray]], start: float) -> InertialLog | None:
    """Return attitude, specific force and throttle; None where attitude or accelerometer was not logged."""
    attitude, felt, thrust = (columns.get(name, {}) for name in ("ATT", "IMU", "CTUN"))
    names = ("Roll", "Pitch", "Yaw"), ("AccX", "AccY", "AccZ")
    if not (all(name in attitude for name in names[0]) and all(name in felt for name in names[1])):
        return None
    turns = from_euler(*(np.radians(attitude[name]) for name in names[0]))
    force = np.stack([felt[name] for name in names[1]], axis=1)
    throttle = (thrust["TimeUS"] * 1e-6, thrust["ThO"]) if "ThO" in thrust else None
    hover = float(np.median(thrust["ThH"])) if "ThH" in thrust else None
    return inertial_log((attitude["TimeUS"] * 1e-6, turns), (felt["TimeUS"] * 1e-6, force), throttle, hover, start)


def _columns(reader: Any, types: list[str]) -> dict[str, dict[str, FloatArray]]:
    """Return every message type that is read as columns."""
    rows: dict[str, list[dict[str, float]]] = {name: [] for name in types}
    with reader:
        for message in iter(lambda: reader.recv_match(type=types), None):
            rows[message.get_type()].append(message.to_dict())
    for name, instance in (("XKF1", "C"), ("IMU", "I")):
        rows[name] = [row for row in rows.get(name, []) if not row.get(instance)]
    return {name: _table(entries) for name, entries in rows.items() if entries}


def _table(rows: list[dict[str, Any]]) -> dict[str, FloatArray]:
    names = [name for name, value in rows[0].items() if isinstance(value, (int, float))] if rows else []
    return {name: np.array([row.get(name, np.nan) for row in rows], dtype=np.float64) for name in names}


def _tracks(columns: dict[str, dict[str, FloatArray]]) -> tuple[Samples | None, Samples | None]:
    """Return the reference and the flight."""
    if all(name in columns for name in AXES):
        return _track(columns, "TP", "TV", "TA", "DesYaw"), _track(columns, "P", "V", "A", "Yaw")
    estimate = columns.get("XKF1", {})
    if not all(name in estimate for name in ("TimeUS", "PN", "PE", "PD", "VN", "VE", "VD")):
        return None, None
    position, velocity = (np.stack([estimate[kind + axis] for axis in "NED"], axis=1) for kind in "PV")
    t = estimate["TimeUS"] * 1e-6
    return None, Samples(t, position, velocity, yaw=_heading(columns, t, "Yaw"))


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
    unwrapped = np.unwrap(np.radians(attitude[name]))
    return np.interp(t, attitude["TimeUS"] * 1e-6, unwrapped)
