r"""Parameters of an autopilot, and the limits of a path that they set.

At a speed v the thrust leans against the drag k v as well as along the acceleration a, so that
:math:`a + k v \le g \tan\theta`, the horizontal thrust over the mass at the greatest tilt. At the greatest speed drag
may take half of it; the rest, less a tenth for feedback, is what a path may ask for.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from minsnap.basics.arrays import GRAVITY
from minsnap.basics.checks import check_number
from minsnap.errors import LinkError
from minsnap.flight.mavlink.link import Clock, Link
from minsnap.flight.mavlink.vehicle_messages import PX4, Message, load_dialect
from minsnap.limits import ORDINARY, Limits

_REAL32 = 9  # MAV_PARAM_TYPE_REAL32
_FORMATS = {1: "B", 2: "b", 3: "H", 4: "h", 5: "I", 6: "i"}  # MAV_PARAM_TYPE of integers, up to INT32


@dataclass(frozen=True)
class ParameterSettings:
    """How parameters are asked for, and which share of what they allow a path may use.

    Parameters
    ----------
    retry : float
        An unanswered request is repeated at this interval [s].
    tries : int
        How often a request is sent.
    for_path : float
        Share of what the parameters allow that a path may use: feedback corrects errors with the rest.
    for_drag : float
        Share of the horizontal thrust at the greatest tilt that drag may take at the greatest speed.
    """

    retry: float = 0.5
    tries: int = 4
    for_path: float = 0.9
    for_drag: float = 0.5


PARAMETER_SETTINGS = ParameterSettings()


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
        return f"{self.name} = {self.value:{'.7g' if self.kind == _REAL32 else '.0f'}}"


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

    def __init__(self, link: Link, clock: Clock, heard: Callable[[Message], None] = lambda _: None) -> None:
        self._link, self._clock, self._heard = link, clock, heard
        self._bytewise = link.vehicle.autopilot == PX4

    def read(self, names: Iterable[str]) -> dict[str, Parameter]:
        """Return those of the named parameters that the vehicle answers for with a number that is finite."""
        parameters: dict[str, Parameter] = {}
        wanted = list(dict.fromkeys(names))
        for _ in range(PARAMETER_SETTINGS.tries):
            missing = [name for name in wanted if name not in parameters]
            for name in missing:
                self._send("param_request_read", name, -1)
            self._collect(parameters, [{name} for name in missing])
        return {name: parameters[name] for name in wanted if name in parameters}

    def read_known(self, names: Iterable[str]) -> dict[str, Parameter]:
        """Return the parameters of these older names, whichever name the vehicle has for each (:data:`NEWER`)."""
        found: dict[str, Parameter] = {}
        wanted = list(dict.fromkeys(names))
        for _ in range(PARAMETER_SETTINGS.tries):
            missing = [name for name in wanted if not any(one in found for one in (name, *NEWER.get(name, ())))]
            for name in missing:
                for asked in (name, *NEWER.get(name, ())):
                    self._send("param_request_read", asked, -1)
            self._collect(found, [{name, *NEWER.get(name, ())} for name in missing])
        return found

    def write(self, name: str, value: float) -> Parameter:
        """Set a parameter and return the value that the vehicle reports.

        Raises
        ------
        LinkError
            If the vehicle has no such parameter, cannot hold the value, or does not confirm it.
        """
        before = self.read([name]).get(name)
        if before is None:
            raise LinkError(f"the vehicle has no parameter {name}, or did not answer{self._called(name, value)}")
        encoded = self._encoded(name, value, before.kind)
        wanted, told = Parameter(name, value, before.kind), None
        for _ in range(PARAMETER_SETTINGS.tries):
            self._send("param_set", name, encoded, before.kind)
            answer: dict[str, Parameter] = {}
            self._collect(answer, [{name}])
            told = answer.get(name, told)
            tolerance = 0.0 if before.kind in _FORMATS else 1e-6
            if told is not None and math.isclose(told.value, value, rel_tol=tolerance, abs_tol=1e-9):
                return told
        if told is None:
            raise LinkError(f"the vehicle did not confirm {wanted}: it may have that or {before}")
        raise LinkError(f"the vehicle did not take {wanted}, and has {told}")

    def _called(self, name: str, value: float) -> str:
        """Say under which other name the vehicle has a parameter, and which value that is there; empty where none."""
        meaning, scale = meaning_of(name)
        others = self.read_known([meaning]).values()
        return "".join(
            f"; it has {one.name}, and there that is {scale * value / meaning_of(one.name)[1]:g}" for one in others
        )

    def _send(self, message: str, name: str, *rest: float) -> None:
        vehicle, build = self._link.vehicle, getattr(load_dialect(), f"MAVLink_{message}_message")
        self._link.send(build(vehicle.system, vehicle.component, name.encode("ascii", "replace"), *rest))

    def _collect(self, parameters: dict[str, Parameter], awaited: Iterable[set[str]]) -> None:
        """Receive until one parameter of each set has arrived, for at most one interval."""
        until = self._clock.now() + PARAMETER_SETTINGS.retry
        while not all(names & parameters.keys() for names in awaited) and self._clock.now() < until:
            for message in self._link.pump(min(until, self._clock.now() + 0.05)):
                self._heard(message)
                if message.get_type() == "PARAM_VALUE":
                    parameter = self._decoded(message)
                    if math.isfinite(parameter.value):
                        parameters[parameter.name] = parameter

    def _decoded(self, message: Message) -> Parameter:
        kind, value = int(message.param_type), float(message.param_value)
        if self._bytewise and kind in _FORMATS:
            size = struct.calcsize(_FORMATS[kind])
            (value,) = struct.unpack(f"<{_FORMATS[kind]}", struct.pack("<f", message.param_value)[:size])
        return Parameter(str(message.param_id).rstrip("\0"), float(value), kind)

    def _encoded(self, name: str, value: float, kind: int) -> float:
        """Return a value as it is sent, or raise LinkError where a parameter of this kind cannot hold it."""
        if math.isfinite(value) and kind != _REAL32 and value != int(value):
            raise LinkError(f"{name} is an integer: it cannot be {value:g}")
        try:
            single, raw = struct.pack("<f", value), b""
            if kind not in _FORMATS:
                raw = single
            elif self._bytewise or struct.unpack("<f", single)[0] == value:
                raw = struct.pack(f"<{_FORMATS[kind]}", int(value))
        except (struct.error, OverflowError, ValueError):
            raw = b""
        if not raw or not math.isfinite(value):
            raise LinkError(f"{name} cannot hold {value:g}")
        return float(struct.unpack("<f", raw.ljust(4, b"\0"))[0]) if self._bytewise else value


_CENTI = 0.01
NEWER = {
    "WPNAV_SPEED": {"WP_SPD": 1 / _CENTI},
    "WPNAV_SPEED_UP": {"WP_SPD_UP": 1 / _CENTI},
    "WPNAV_SPEED_DN": {"WP_SPD_DN": 1 / _CENTI},
    "WPNAV_ACCEL": {"WP_ACC": 1 / _CENTI},
    "WPNAV_ACCEL_Z": {"WP_ACC_Z": 1 / _CENTI},
    "ANGLE_MAX": {"ATC_ANGLE_MAX": 1 / _CENTI},
    "ATC_SLEW_YAW": {"ATC_RATE_WPY_MAX": 1 / _CENTI},
    "PSC_JERK_XY": {"PSC_JERK_NE": 1.0, "PSC_NE_JERK": 1.0},
    "PSC_JERK_Z": {"PSC_JERK_D": 1.0, "PSC_D_JERK": 1.0},
}
"""What ArduPilot 4.7 and later call parameters of 4.6 and before, and the factor from the newer unit to the older one.

Source: ArduPilot's wiki, "Parameter Name Changes" (4.6 to 4.7), and AC_PosControl.cpp of the branches 4.7 and master,
which disagree on the names of the jerk. Rules and limits go by the older name. A vehicle is asked for all names, and
has those that it answers for.
"""

_MEANING = {new: (old, scale) for old, names in NEWER.items() for new, scale in names.items()}


def meaning_of(name: str) -> tuple[str, float]:
    """Return the older name of a parameter, by which rules know it, and the factor to the unit of that name."""
    return _MEANING.get(name, (name, 1.0))


_SI, _DEGREES = 1.0, math.radians(1.0)
_MEANINGS = {
    "px4": (
        ("MPC_XY_VEL_MAX", "horizontal_speed", _SI),
        ("MPC_Z_VEL_MAX_UP", "climb_speed", _SI),
        ("MPC_Z_VEL_MAX_DN", "descent_speed", _SI),
        ("MPC_ACC_UP_MAX", "vertical_acceleration", _SI),
        ("MPC_ACC_DOWN_MAX", "vertical_acceleration", _SI),
        ("MPC_TILTMAX_AIR", "tilt", _DEGREES),
        ("MC_YAWRATE_MAX", "yaw_rate", _DEGREES),
        ("MC_ROLLRATE_MAX", "body_rate", _DEGREES),
        ("MC_PITCHRATE_MAX", "body_rate", _DEGREES),
    ),
    "ardupilot": (
        ("WPNAV_SPEED", "horizontal_speed", _CENTI),
        ("WPNAV_SPEED_UP", "climb_speed", _CENTI),
        ("WPNAV_SPEED_DN", "descent_speed", _CENTI),
        ("WPNAV_ACCEL", "horizontal_acceleration", _CENTI),
        ("WPNAV_ACCEL_Z", "vertical_acceleration", _CENTI),
        ("PSC_JERK_XY", "jerk", _SI),
        ("ANGLE_MAX", "tilt", _CENTI * _DEGREES),
        ("PSC_ANGLE_MAX", "tilt", _DEGREES),
        ("ATC_SLEW_YAW", "yaw_rate", _CENTI * _DEGREES),
    ),
}
"""What each parameter limits, and its unit in SI units."""

PARAMETERS = {name: tuple(key for key, _, _ in rows) for name, rows in _MEANINGS.items()}
"""Names of the parameters to read from each autopilot, the older ones."""


def autopilot_limits(autopilot: str, values: Mapping[str, float], drag: float = 0.0) -> Limits:
    """Return the limits that an autopilot's parameters leave to a path.

    Parameters
    ----------
    autopilot : str
        ``px4`` or ``ardupilot``.
    values : mapping of str to float
        Its parameters, by its own names and in its own units; those that are missing limit nothing.
    drag : float
        Linear drag of the vehicle over its mass [1/s].

    Raises
    ------
    InputError
        If the drag is below 0 or not finite.
    LinkError
        If the autopilot is another, or lacks its greatest speed or its tilt.
    """
    check_number("the drag", drag, 0.0, math.inf, "it must be 0 or more", unit="1/s")
    if autopilot not in PARAMETERS:
        raise LinkError("the autopilot is neither PX4 nor ArduPilot: its limits are not known")
    known = {meaning_of(name)[0]: meaning_of(name)[1] * value for name, value in values.items()}
    limits = _limits_of(_MEANINGS[autopilot], known)
    if "horizontal_speed" not in limits or "tilt" not in limits:
        raise LinkError("the vehicle did not answer with its greatest speed and tilt")
    rounded: dict[str, Any] = {name: _rounded(value) for name, value in _with_drag(limits, drag).items()}
    return Limits(**rounded)


def _limits_of(rows: Iterable[tuple[str, str, float]], values: Mapping[str, float]) -> dict[str, float]:
    """Return the limits in SI units; the least where several parameters limit the same.

    ``PSC_ANGLE_MAX``, where it is set, replaces ``ANGLE_MAX`` in ArduPilot's position controller.
    """
    replaced = "ANGLE_MAX" if values.get("PSC_ANGLE_MAX") else None
    limits: dict[str, float] = {}
    for key, name, scale in rows:
        if values.get(key, 0.0) > 0.0 and key != replaced:
            limits[name] = min(scale * values[key], limits.get(name, math.inf))
    return limits


def _with_drag(values: dict[str, float], drag: float) -> dict[str, Any]:
    """Return limits with the reserve of feedback taken off, and with room in the tilt for drag.

    A vehicle that tells no vertical speeds or acceleration has those of ordinary flight, which its tilt does not bound.
    """
    horizontal_thrust = GRAVITY * math.tan(min(values["tilt"], math.radians(85.0)))  # over the mass
    limits = {name: PARAMETER_SETTINGS.for_path * value for name, value in values.items()}
    if drag > 0.0:
        most = PARAMETER_SETTINGS.for_drag * horizontal_thrust / drag
        limits["horizontal_speed"] = min(limits["horizontal_speed"], most)
    left = PARAMETER_SETTINGS.for_path * horizontal_thrust - drag * limits["horizontal_speed"]
    limits["horizontal_acceleration"] = min(limits.get("horizontal_acceleration", math.inf), left)
    limits["tilt"] = min(limits["tilt"], math.atan(left / GRAVITY))
    if "jerk" not in limits and "body_rate" in limits:  # the jerk that turns the thrust at hover at the body rate
        limits["jerk"] = GRAVITY * limits["body_rate"]
    for name in ("climb_speed", "descent_speed", "vertical_acceleration"):
        limits.setdefault(name, ORDINARY["acceleration" if name == "vertical_acceleration" else "speed"])
    return limits


def _rounded(value: float) -> float:
    """Return a limit rounded down to four digits."""
    step = 10.0 ** (math.floor(math.log10(value)) - 3)
    return round(math.floor(value / step) * step, 9)
