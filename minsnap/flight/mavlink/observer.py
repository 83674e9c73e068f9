"""Observation of a flight: words, status, tracking error, and a log whose lines survive a kill."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Callable

import numpy as np

from minsnap.basics.storage.text import FileName
from minsnap.errors import FileError
from minsnap.flight.mavlink.sequence import Sequence, SetpointStep
from minsnap.flight.mavlink.setpoints import FIELDS, Setpoint, Setpoints
from minsnap.flight.mavlink.stream_options import Phase, StreamOptions, StreamStatus
from minsnap.flight.mavlink.vehicle_messages import Message, VehicleState, text_of
from minsnap.trajectory import column_names

MOTION = tuple(column for field in FIELDS for column in column_names(field))
COLUMNS = ("time", "kind", "index", *MOTION, "type_mask", "lateness", "armed", "custom_mode", "text")
"""``kind`` is setpoint, position, heartbeat or event; cells that do not apply are empty."""


class StreamLog:
    """The log of one flight.

    Every line is one write to the operating system, so written lines are kept if the process is killed.

    Parameters
    ----------
    path : str, path or None
        Where; a log that is there already is not replaced. None: nowhere.
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

    def __init__(self, path: FileName | None, frame: str, start: float, lead: float = 0.0) -> None:
        self._start, self._file = start, None if path is None else _opened(path)
        self.event(start, f"frame={frame}")
        if lead:
            self.event(start, f"lead={lead!r}")

    def setpoint(self, now: float, index: int | None, setpoint: Setpoint, mask: int, lateness: float) -> None:
        """Log a setpoint that was sent."""
        motion = dict(zip(MOTION, setpoint.numbers, strict=True))
        self._line(now, "setpoint", index=index, **motion, type_mask=mask, lateness=f"{lateness:.6f}")

    def position(self, now: float, vehicle: VehicleState) -> None:
        """Log a position that the vehicle reported."""
        numbers = (*(vehicle.position or ()), *(vehicle.velocity or ()))
        self._line(now, "position", **dict(zip(MOTION, numbers, strict=False)))

    def heartbeat(self, now: float, vehicle: VehicleState) -> None:
        """Log a heartbeat of the vehicle."""
        self._line(now, "heartbeat", armed=int(vehicle.armed), custom_mode=vehicle.custom_mode)

    def event(self, now: float, text: str) -> None:
        """Log any other event as text."""
        self._line(now, "event", text=text)

    def close(self) -> None:
        """Close the file; nothing is written from then on."""
        if self._file is not None:
            self._file.close()

    def _line(self, now: float, kind: str, **cells: object) -> None:
        if self._file is None or self._file.closed:
            return
        text = io.StringIO()
        row = {"time": f"{now - self._start:.6f}", "kind": kind, **cells}
        csv.DictWriter(text, COLUMNS, lineterminator="\n").writerow(row)
        self._file.write(text.getvalue().encode())


def _opened(path: FileName) -> io.FileIO:
    """Make the file of a log, whose writes go to the operating system at once, with its first line."""
    try:
        file = io.FileIO(path, "x")
    except FileExistsError:
        raise FileError(f"{path} is there already: logs are not replaced, choose another name") from None
    except OSError as error:
        raise FileError(f"{path} cannot be written: {error.strerror}") from None
    file.write((",".join(COLUMNS) + "\n").encode())
    return file


EventCallback = Callable[[str], None]
StatusCallback = Callable[[StreamStatus], None]

_STUBBORN = 5  # commands are repeated every second, and ArduPilot takes some only after a while


class StreamObserver:
    """Records the events of a flight and passes them to the callbacks.

    Parameters
    ----------
    table : SetpointTable or ChangingTable
        What is flown.
    options : StreamOptions
        Where to log, and in which frame.
    start : float
        The instant that counts as 0 in the log [s].
    on_event, on_status : callable or None
        Whom to tell.
    """

    def __init__(
        self,
        table: Setpoints,
        options: StreamOptions,
        start: float,
        on_event: EventCallback | None,
        on_status: StatusCallback | None,
    ) -> None:
        self._table, self._on_event, self._on_status = table, on_event, on_status
        self._log = StreamLog(options.log, table.frame, start, table.lead)
        self._phase = Phase.PRESTREAM
        self._error: float | None = None
        self._errors: list[float] = []
        self.flown = 0

    def close(self) -> None:
        """Close the log."""
        self._log.close()

    def silence(self) -> None:
        """Disable log and callbacks after one of them has failed."""
        self.close()
        self._on_event = self._on_status = None

    def say(self, now: float, text: str) -> None:
        """Pass an event on as a sentence."""
        self._log.event(now, text)
        if self._on_event is not None:
            self._on_event(text)

    def heard(self, now: float, message: Message, vehicle: VehicleState, sequence: Sequence | None) -> None:
        """Record a message of the vehicle: its position, the distance to where it is to be, its texts."""
        kind = message.get_type()
        if kind == "LOCAL_POSITION_NED":
            self._log.position(now, vehicle)
            if sequence is not None:
                self._error = vehicle.distance(sequence.planned, sequence.planned_at)
                if sequence.phase is Phase.FLYING and math.isfinite(self._error):
                    self._errors.append(self._error)
        elif kind == "HEARTBEAT":
            self._log.heartbeat(now, vehicle)
        elif kind == "STATUSTEXT":
            self.say(now, f"vehicle: {text_of(message)}")
        elif kind == "COMMAND_ACK" and vehicle.refusal is not None and vehicle.refusal.times == _STUBBORN:
            self.say(now, f"the vehicle has refused {vehicle.refusal} {_STUBBORN} times")

    def sent(self, now: float, step: SetpointStep, late: float, sequence: Sequence, vehicle: VehicleState) -> None:
        """Record the setpoint sent in a slot."""
        self.flown += step.index is not None
        if step.setpoint is not None:
            self._log.setpoint(now, step.index, step.setpoint, self._table.mask, late)
        self.announce(now, sequence)
        if self._on_status is not None:
            self._on_status(self._status(step, late, sequence, vehicle))

    def _status(self, step: SetpointStep, late: float, sequence: Sequence, vehicle: VehicleState) -> StreamStatus:
        duration = (len(self._table) - 1) / self._table.rate
        elapsed = duration if sequence.completed else 0.0
        if step.index is not None:
            elapsed = min(step.index / self._table.rate, duration)
        return StreamStatus(sequence.phase, elapsed, duration, step.setpoint, step.index, late, self._error, vehicle)

    def announce(self, now: float, sequence: Sequence) -> None:
        """Say in words when the phase has changed."""
        if sequence.phase is self._phase:
            return
        told, self._phase = self._phase is Phase.HOLDING or sequence.reason is None, sequence.phase
        stopped, over = f"stopped: {sequence.reason}; ", "nobody follows any more: done"
        after = sequence.after_stop
        ends = f"{stopped}the vehicle is told to {after}" if after else f"{stopped}holding"
        ends = "holding the end" if sequence.completed else ends
        words = {Phase.HOLDING: ends, Phase.DONE: over if told else stopped + over}
        self.say(now, words.get(sequence.phase, sequence.phase.value))

    def tracking(self) -> tuple[float, float] | None:
        """Return the root mean square and the largest tracking error [m], None when no position came in flight."""
        errors = np.array(self._errors)
        return (float(np.sqrt(np.mean(errors**2))), float(errors.max())) if errors.size else None
