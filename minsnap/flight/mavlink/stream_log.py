"""The log of a flight in progress: comma-separated lines, each written by one system call, safe against a kill."""

from __future__ import annotations

import csv
import io
import os
from collections.abc import Iterable
from dataclasses import astuple

from minsnap.errors import FileError
from minsnap.flight.mavlink.setpoints import Setpoint
from minsnap.flight.mavlink.vehicle_state import VehicleState

COLUMNS = (
    "time",
    "kind",
    "index",
    *("x", "y", "z", "vx", "vy", "vz", "ax", "ay", "az", "yaw", "yaw_rate"),
    "type_mask",
    "lateness",
    "armed",
    "custom_mode",
    "text",
)
"""``kind`` is setpoint, position, heartbeat or event; cells that do not apply are empty."""


class StreamLog:
    """The log of one flight.

    Every line is one write to the operating system, so written lines are kept if the process is killed.

    Parameters
    ----------
    path : str or path
        Where; a log that is there already is not replaced.
    frame : str
        The vehicle's local frame, noted in the first event.
    start : float
        The instant that counts as 0 [s].
    lead : float
        How much earlier than planned setpoints are sent [s], noted in the second event where it is not 0.

    Raises
    ------
    FileError
        If the file is there already or cannot be made.
    """

    def __init__(self, path: str | os.PathLike[str], frame: str, start: float, lead: float = 0.0) -> None:
        try:
            self._file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_APPEND, 0o666)
        except FileExistsError:
            raise FileError(f"{path} is there already: logs are not replaced, choose another name") from None
        except OSError as error:
            raise FileError(f"{path} cannot be written: {error.strerror}") from None
        self._start = start
        self._write(COLUMNS)
        self.event(start, f"frame={frame}")
        if lead:
            self.event(start, f"lead={lead!r}")

    def setpoint(self, now: float, index: int | None, setpoint: Setpoint, mask: int, lateness: float) -> None:
        """Log a setpoint that was sent."""
        position, velocity, acceleration, *heading = astuple(setpoint)
        numbers = (*position, *velocity, *acceleration, *heading)
        self._line(now, "setpoint", "" if index is None else index, *numbers, mask, f"{lateness:.6f}", "", "", "")

    def position(self, now: float, vehicle: VehicleState) -> None:
        """Log a position that the vehicle reported."""
        self._line(now, "position", "", *(vehicle.position or ()), *(vehicle.velocity or ()), *("",) * 10)

    def heartbeat(self, now: float, vehicle: VehicleState) -> None:
        """Log a heartbeat of the vehicle."""
        self._line(now, "heartbeat", *("",) * 14, int(vehicle.armed), vehicle.custom_mode, "")

    def event(self, now: float, text: str) -> None:
        """Log any other event as text."""
        self._line(now, "event", *("",) * 16, text)

    def close(self) -> None:
        """Close the file."""
        os.close(self._file)

    def _line(self, now: float, *cells: object) -> None:
        self._write((f"{now - self._start:.6f}", *cells))

    def _write(self, cells: Iterable[object]) -> None:
        text = io.StringIO()
        csv.writer(text, lineterminator="\n").writerow(cells)
        os.write(self._file, text.getvalue().encode())
