"""Parameters of an autopilot: read and written by name through MAVLink's parameter protocol."""

from __future__ import annotations

import math
import struct
from collections.abc import Callable, Iterable
from dataclasses import dataclass

from minsnap.errors import LinkError
from minsnap.flight.mavlink.dialect import Message, load_dialect
from minsnap.flight.mavlink.link import Link
from minsnap.flight.mavlink.schedule import Clock
from minsnap.flight.mavlink.vehicle_state import PX4

_REAL32 = 9  # MAV_PARAM_TYPE_REAL32
_FORMATS = {1: "B", 2: "b", 3: "H", 4: "h", 5: "I", 6: "i"}  # MAV_PARAM_TYPE of integers, up to INT32
_RETRY = 0.5  # an unanswered request is repeated at this interval [s]
_TRIES = 4


@dataclass(frozen=True)
class Parameter:
    """A parameter as the vehicle has it.

    Parameters
    ----------
    name : str
    value : float
        An integer's value is exact.
    kind : int
        MAV_PARAM_TYPE, which a new value must have as well.
    """

    name: str
    value: float
    kind: int = _REAL32

    def __str__(self) -> str:
        return f"{self.name} = {self.value:g}"


class Parameters:
    """The parameters of one vehicle over a link.

    PX4 sends the bytes of an integer in the place of the float, ArduPilot its value (MAVLink's parameter protocol,
    "parameter encoding").

    Parameters
    ----------
    link : Link
        With a vehicle that has been heard.
    clock : Clock
        The same as the link's.
    heard : callable, optional
        Called with every message that comes meanwhile.
    """

    def __init__(self, link: Link, clock: Clock, heard: Callable[[Message], None] | None = None) -> None:
        self._link, self._clock, self._heard = link, clock, heard
        self._bytewise = link.vehicle.autopilot == PX4

    def read(self, names: Iterable[str]) -> dict[str, Parameter]:
        """Return those of the named parameters that the vehicle has; it does not answer for unknown names."""
        parameters: dict[str, Parameter] = {}
        wanted = list(dict.fromkeys(names))
        for _ in range(_TRIES):
            missing = [name for name in wanted if name not in parameters]
            if not missing:
                break
            for name in missing:
                self._request(name)
            self._collect(parameters, set(missing))
        return {name: parameters[name] for name in wanted if name in parameters}

    def write(self, name: str, value: float) -> Parameter:
        """Set a parameter and return the value that the vehicle reports.

        Raises
        ------
        LinkError
            If the vehicle has no such parameter, cannot hold the value, or does not confirm it.
        """
        before = self.read([name]).get(name)
        if before is None:
            raise LinkError(f"the vehicle has no parameter {name}, or did not answer")
        if before.kind != _REAL32 and value != int(value):
            raise LinkError(f"{name} is an integer: it cannot be {value:g}")
        for _ in range(_TRIES):
            self._send_value(name, value, before.kind)
            answer: dict[str, Parameter] = {}
            self._collect(answer, {name})
            if name in answer and math.isclose(answer[name].value, value, rel_tol=1e-6, abs_tol=1e-9):
                return answer[name]
        raise LinkError(f"the vehicle did not take {name} = {value:g}: it has {before.value:g}")

    def _request(self, name: str) -> None:
        vehicle = self._link.vehicle
        message = load_dialect().MAVLink_param_request_read_message(
            vehicle.system, vehicle.component, name.encode("ascii"), -1
        )
        self._link.send(message)

    def _send_value(self, name: str, value: float, kind: int) -> None:
        vehicle = self._link.vehicle
        message = load_dialect().MAVLink_param_set_message(
            vehicle.system, vehicle.component, name.encode("ascii"), self._encoded(value, kind), kind
        )
        self._link.send(message)

    def _collect(self, parameters: dict[str, Parameter], awaited: set[str]) -> None:
        """Receive until all requested parameters have arrived, for at most one interval."""
        until = self._clock.now() + _RETRY
        while awaited - parameters.keys() and self._clock.now() < until:
            for message in self._link.pump(min(until, self._clock.now() + 0.05)):
                if self._heard is not None:
                    self._heard(message)
                if message.get_type() == "PARAM_VALUE":
                    parameter = self._decoded(message)
                    parameters[parameter.name] = parameter

    def _decoded(self, message: Message) -> Parameter:
        kind, value = int(message.param_type), float(message.param_value)
        if self._bytewise and kind in _FORMATS:
            size = struct.calcsize(_FORMATS[kind])
            (value,) = struct.unpack(f"<{_FORMATS[kind]}", struct.pack("<f", message.param_value)[:size])
        return Parameter(str(message.param_id).rstrip("\0"), float(value), kind)

    def _encoded(self, value: float, kind: int) -> float:
        if not (self._bytewise and kind in _FORMATS):
            return value
        raw = struct.pack(f"<{_FORMATS[kind]}", int(value)).ljust(4, b"\0")
        return float(struct.unpack("<f", raw)[0])
