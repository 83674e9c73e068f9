r"""The control loop of a vehicle from a disturbance to its position error, and the largest error that one can cause.

The loop is a position loop around a velocity loop around the attitude, as PX4 and ArduPilot have it. Of one axis, with
setpoints :math:`r_s`, the command is

.. math:: u = \ddot r_s + \hat k\,\dot r_s + K_v\,(\dot r_s + K_p (r_s - p) - v)
          + K_i \int (\dot r_s + K_p (r_s - p) - v)\,dt - K_d\,\dot v,

the thrust follows it with a lag :math:`\tau` after a delay :math:`\theta`, and drag k acts on the velocity through the
air, so that wind w is a disturbance :math:`k w` (docs/tracking.rst says what is assumed).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from math import cos, inf, pi, sin
from pathlib import Path as FilePath
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray, numbers, plain, set_fields
from minsnap.basics.cached import cached_property
from minsnap.basics.checks import check_kind, check_number, check_switch
from minsnap.basics.messages import shown
from minsnap.basics.schema import ANY, FLAG, NUMBER, Key, mapping
from minsnap.basics.storage.text import FileName, load_yaml
from minsnap.errors import FileError, VehicleError
from minsnap.vehicle.autopilot_gains import gains_of
from minsnap.vehicle.loop_response import AxisLoop, Response, cell_of, response_of

Pair = tuple[float, float]
"""Of both horizontal axes, and of the vertical one."""

DIRECTIONS = 64
"""Directions in which the error is bounded, within a right angle from the horizontal to the vertical."""

TYPICAL_DRAG = 0.3
"""Linear drag over mass of a multirotor where none is given [1/s]."""

_PAIRS = {
    "position_gain": ("1/s", 1e-3),
    "velocity_gain": ("1/s", 1e-3),
    "velocity_integral": ("1/s^2", 0.0),
    "velocity_derivative": ("", 0.0),
    "lag": ("s", 1e-3),
    "drag": ("1/s", 0.0),
    "drag_error": ("1/s", 0.0),
    "offset_drag": ("1/s", 0.0),
}
"""Fields that are pairs: their unit, and the least value."""


@dataclass(frozen=True)
class Loop:
    """A control loop; what is a pair is of the horizontal axes and of the vertical one, and one number is of both.

    Parameters
    ----------
    position_gain, velocity_gain, velocity_integral : tuple of 2 floats, or float
        [1/s], [1/s], [1/s^2].
    velocity_derivative : tuple of 2 floats, or float
        Of the measured acceleration, or of the velocity's error [1].
    lag : tuple of 2 floats, or float
        Time constant with which the acceleration follows its command: that of the attitude, and that of the motors [s].
    delay : float
        From a measurement to its effect on the thrust [s].
    latency : float
        From a setpoint's instant to its arrival, half the period of setpoints included [s].
    lead : float
        How much earlier than planned setpoints are sent [s].
    drag : tuple of 2 floats, or float
        Linear drag over mass [1/s].
    drag_error : tuple of 2 floats, or float
        By how much the true one may differ [1/s].
    offset_drag : tuple of 2 floats, or float
        Drag that is offset by feed-forward [1/s].
    tilt : float or None
        Greatest tilt that the autopilot commands [rad].
    max_thrust, min_thrust : float or None
        Greatest and least thrust that it commands, in weights.
    speed, climb_speed, descent_speed : float or None
        Greatest velocities that its position loop asks for [m/s].
    of_error : bool
        Whether the derivative part is of the velocity's error, as ArduPilot's is.
    model_error : float
        Share of its lag by which a flight in still air may differ from this model, as simulated ones do.

    Raises
    ------
    VehicleError
        If a number is malformed, or the loop is not stable.
    """

    position_gain: Pair
    velocity_gain: Pair
    velocity_integral: Pair = (0.0, 0.0)
    velocity_derivative: Pair = (0.0, 0.0)
    lag: Pair = (0.1, 0.05)
    delay: float = 0.03
    latency: float = 0.0
    lead: float = 0.0
    drag: Pair = (TYPICAL_DRAG, TYPICAL_DRAG)
    drag_error: Pair = (0.0, 0.0)
    offset_drag: Pair = (0.0, 0.0)
    tilt: float | None = None
    max_thrust: float | None = None
    min_thrust: float | None = None
    speed: float | None = None
    climb_speed: float | None = None
    descent_speed: float | None = None
    of_error: bool = False
    model_error: float = 0.03

    def __post_init__(self) -> None:
        for name, (unit, least) in _PAIRS.items():
            set_fields(self, **{name: _pair(name, getattr(self, name), unit, least)})
        for name in ("delay", "latency", "lead"):
            least = -10.0 if name == "lead" else 0.0
            give = f"give seconds from {least:g} to 10"
            set_fields(
                self, **{name: check_number(f"the {name}", getattr(self, name), least, 10.0, give, VehicleError)}
            )
        for name, (least, most, unit) in _CAPS.items():
            value = getattr(self, name)
            if value is not None:
                give = f"give a number from {least:g} to {most:.4g}{unit}, or None"
                set_fields(self, **{name: check_number(f"the {name}", value, least, most, give, VehicleError)})
        share = check_number("the model_error", self.model_error, 0.0, 1.0, "give a share from 0 to 1", VehicleError)
        set_fields(self, model_error=share, of_error=check_switch("of_error", self.of_error))
        _ = self.responses

    @classmethod
    def px4(cls, parameters: Mapping[str, float] | None = None, **changed: Any) -> Loop:
        """Return the loop of PX4 (``mc_pos_control``, ``mc_att_control``).

        Parameters
        ----------
        parameters : mapping of str to float, optional
            By PX4's names and in its units; those that are missing have PX4's defaults.
        **changed
            Fields of the loop that are known otherwise, such as ``drag=0.5``.

        Raises
        ------
        VehicleError
            If a number is not one of a loop.
        """
        return cls._of("px4", parameters, changed)

    @classmethod
    def ardupilot(cls, parameters: Mapping[str, float] | None = None, **changed: Any) -> Loop:
        """Return the loop of ArduCopter (``AC_PosControl``), as :meth:`px4`; both names of 4.7's parameters are known.

        Its input shaping follows setpoints without error as long as they keep its limits.
        """
        return cls._of("ardupilot", parameters, changed)

    @classmethod
    def _of(cls, autopilot: str, parameters: Any, changed: Mapping[str, Any]) -> Loop:
        """Return the loop of an autopilot's parameters, with some fields given otherwise."""
        known = gains_of(autopilot, parameters)
        names = [entry.name for entry in fields(cls)]
        unknown = next((name for name in changed if name not in names), None)
        if unknown is not None:
            raise VehicleError(f"a loop has no {unknown}: it has {', '.join(names)}")
        return cls(**known | dict(changed))

    @classmethod
    def from_fit(cls, fit: Any, base: Loop | None = None) -> Loop:
        """Return a loop with the drag, the response and the lead of a fitted flight (``fit_flight``).

        Parameters
        ----------
        fit : FlightFit
        base : Loop, optional
            Where all else is from: by default that of the autopilot that logged it, with its default gains.

        Raises
        ------
        VehicleError
            If the fit does not tell the horizontal drag.
        """
        usual = cls.ardupilot if fit.autopilot == "ardupilot" else cls.px4
        return replace(usual() if base is None else base, **fit.of_loop())

    @cached_property
    def axes(self) -> tuple[AxisLoop, AxisLoop]:
        """The loops of a horizontal axis and of the vertical one, with cells of one length."""
        cell = cell_of(self.delay, self.lag)
        names = ("position_gain", "velocity_gain", "velocity_integral", "velocity_derivative", "lag", "drag")
        across, upright = (
            AxisLoop(**{name: getattr(self, name)[axis] for name in names}, delay=self.delay, cell=cell)
            for axis in (0, 1)
        )
        return across, upright

    @cached_property
    def responses(self) -> tuple[Response, Response]:
        """What the two loops answer to an impulse of acceleration."""
        across, upright = map(response_of, self.axes)
        return across, upright

    @cached_property
    def error_gain(self) -> float:
        """Largest error [m] by accelerations of at most 1 m/s^2 in any direction [s^2]: an upper bound."""
        return self._largest("error", (1.0, 1.0))

    @cached_property
    def wind_gain(self) -> float:
        """Largest error [m] by changes of the wind of at most 1 m/s in any direction [s]: an upper bound."""
        return self._largest("error", self.drag)

    def widths(self, wind: float, speed: float) -> Widths:
        """Return how far the vehicle can be from where it is without wind, and what its feedback needs.

        Parameters
        ----------
        wind : float
            Largest change of the wind from what it is at the start [m/s].
        speed : float
            Largest speed without wind [m/s].

        Raises
        ------
        VehicleError
            If one is no number of 0 or more.
        """
        wind, speed = (
            check_number(f"the {what}", value, 0.0, 1e6, "give a number of 0 or more [m/s]", VehicleError)
            for what, value in (("wind", wind), ("speed", speed))
        )
        unknown, ones = max(self.drag_error), (1.0, 1.0)
        shaken = {kind: (self._largest(kind, self.drag), self._largest(kind, ones)) for kind in _KINDS}
        moved, free = shaken["rate"]
        if unknown * free >= 1.0:
            return Widths(inf, inf, inf)
        rate = (moved * wind + unknown * free * (speed + wind)) / (1.0 - unknown * free)
        doubt = unknown * (speed + wind + rate)
        error, command = (
            by_wind * wind + by_doubt * doubt for by_wind, by_doubt in (shaken["error"], shaken["command"])
        )
        return Widths(error, rate, command)

    def _largest(self, kind: str, push: Pair) -> float:
        """Return the largest answer to accelerations within ``push`` along and across, in any direction.

        In the direction at an angle a it is the integral of hypot(cos a h, sin a h'), which is convex on rays: between
        two angles it is at most the larger one of both over the cosine of half their difference.
        """
        key = f"_{kind}_{push}"
        if key not in self.__dict__:
            self.__dict__[key] = self._most(kind, push)
        return float(self.__dict__[key])

    def _most(self, kind: str, push: Pair) -> float:
        points = [force * getattr(each, kind) for force, each in zip(push, self.responses, strict=True)]
        size = max(map(len, points))
        wide, high = (np.concatenate((each, np.zeros((size - len(each), 6)))) for each in points)
        rest = [
            force * (each.excess[_KINDS.index(kind)] + (each.loop.velocity_derivative if kind == "command" else 0.0))
            for force, each in zip(push, self.responses, strict=True)
        ]
        angles = np.linspace(0.0, 0.5 * pi, DIRECTIONS + 1)
        cell = self.axes[0].cell
        sums = [
            cell * np.hypot(cos(a) * wide, sin(a) * high).mean(axis=1).sum() + cos(a) * rest[0] + sin(a) * rest[1]
            for a in angles
        ]
        return float(max(sums)) / cos(0.25 * pi / DIRECTIONS)

    def worst_gust(self, seconds: float, rate: float = 200.0) -> tuple[FloatArray, FloatArray]:
        """Return the change of a horizontal wind that makes the largest error at its end.

        It blows at full strength along the sign of the response, backwards in time (Desoer and Vidyasagar).

        Parameters
        ----------
        seconds : float
            For how long it blows.
        rate : float
            Instants a second [Hz].

        Returns
        -------
        t : ndarray, shape (m,)
            Instants from 0 [s].
        gust : ndarray, shape (m,)
            1 or -1, in units of the strongest change.

        Raises
        ------
        VehicleError
            If the time or the rate is none, or there are more than a million instants.
        """
        seconds = check_number("the time of a gust", seconds, 1e-3, 1e5, "give seconds from 0.001 to 1e5", VehicleError)
        most = 1e6 / seconds
        rate = check_number("the rate", rate, 1.0, most, f"give 1 to {most:.4g} Hz for this time", VehicleError)
        count = max(2, round(seconds * rate) + 1)
        t = np.linspace(0.0, seconds, count)
        points, cell = self.responses[0].error, self.axes[0].cell
        known = np.concatenate((points[:, 0], np.zeros(1)))
        answer = np.interp(seconds - t, cell * np.arange(len(known)), known, right=0.0)
        return t, np.where(answer < 0.0, -1.0, 1.0)

    def to_yaml(self, path: FileName) -> None:
        """Write the loop as YAML in one atomic step; reading it returns the same numbers."""
        import yaml

        from minsnap.basics.storage.atomic import write_file

        write_file(path, yaml.safe_dump(self.description(), sort_keys=False))

    def description(self) -> dict[str, Any]:
        """Return the fields that are set, as plain numbers and lists."""
        values = {entry.name: getattr(self, entry.name) for entry in fields(self)}
        return {name: plain(np.array(v)) if isinstance(v, tuple) else v for name, v in values.items() if v is not None}

    @classmethod
    def from_yaml(cls, path: FileName) -> Loop:
        """Read a loop: its fields by name, or the name of an autopilot and what differs from it.

        ``{autopilot: px4, parameters: {MPC_XY_P: 1.2}, drag: 0.5}`` is :meth:`px4` with these.

        Raises
        ------
        FileError
            If the file cannot be read.
        VehicleError
            If it does not describe a loop.
        """
        return cls._described(f"{path}", load_yaml(path))

    @classmethod
    def _described(cls, where: str, content: Any) -> Loop:
        try:
            values = FILE.read(where, content)
        except FileError as error:
            raise VehicleError(f"{error}") from None
        kind, known = values.pop("autopilot", None), values.pop("parameters", None)
        if kind is None:
            missing = [name for name in ("position_gain", "velocity_gain") if name not in values]
            if missing or known is not None:
                what = missing[0] if missing else "autopilot"
                raise VehicleError(f"{where} does not say {what}: a loop has its gains, or autopilot: px4 or ardupilot")
            return cls(**values)
        return cls._of(kind, known, values)


@dataclass(frozen=True)
class Widths:
    """What wind can do to a vehicle in its loop.

    Parameters
    ----------
    error : float
        Largest distance from where it is without wind [m].
    rate : float
        Largest difference of its velocity [m/s].
    command : float
        Largest acceleration that its feedback commands for it [m/s^2].
    """

    error: float
    rate: float
    command: float


_KINDS = ("error", "rate", "command")
_CAPS = {
    "tilt": (0.01, 1.55, " rad"),
    "max_thrust": (1.0, 100.0, " weights"),
    "min_thrust": (0.0, 1.0, " weights"),
    "speed": (1e-3, 1e3, " m/s"),
    "climb_speed": (1e-3, 1e3, " m/s"),
    "descent_speed": (1e-3, 1e3, " m/s"),
}
"""Fields that are one number or None: least, greatest, unit."""


def _pair(name: str, value: Any, unit: str, least: float) -> Pair:
    """Return two floats, or raise VehicleError that names the field."""
    array = numbers(value)
    if array is None or array.shape not in ((), (2,)) or not (np.isfinite(array) & (array >= least)).all():
        what = f" [{unit}]" if unit else ""
        raise VehicleError(
            f"the {name} of the loop is {shown(value)}: give one number, or two for horizontal and vertical, "
            f"of at least {least:g}{what}"
        )
    across, upright = np.broadcast_to(array, (2,)).tolist()
    return float(across), float(upright)


FILE = mapping(
    {
        "autopilot": Key(ANY, "px4 or ardupilot, in place of gains"),
        "parameters": Key(ANY, "of the autopilot, by its own names and in its units"),
        **{name: Key(ANY, f"of the loop{f' [{unit}]' if unit else ''}") for name, (unit, _) in _PAIRS.items()},
        **{name: Key(NUMBER, "of setpoints and feedback [s]") for name in ("delay", "latency", "lead")},
        **{name: Key(NUMBER, f"that the autopilot commands [{unit.strip()}]") for name, (*_, unit) in _CAPS.items()},
        "model_error": Key(NUMBER, "share of the lag by which a flight may differ from the model"),
        "of_error": Key(FLAG, "whether the derivative part is of the velocity's error"),
    },
    "the fields of a loop by name, such as position_gain: 1.0, or autopilot: px4",
)
"""The whole file."""


def loop_of(name: Any, where: str = "--tracking", folder: FilePath = FilePath()) -> Loop:
    """Return the loop that a command or a file names: px4, ardupilot, a YAML file in a folder, or its fields.

    Raises
    ------
    FileError
        If a file cannot be read.
    VehicleError
        If it is none of them.
    """
    if isinstance(name, Mapping):
        return Loop._described(where, name)
    check_kind("the loop", name, str, "px4, ardupilot, or the name of a YAML file")
    if name in ("px4", "ardupilot"):
        return Loop.px4() if name == "px4" else Loop.ardupilot()
    if not FilePath(name).suffix and not (folder / name).exists():
        raise VehicleError(f"{where} is {name!r}: give px4, ardupilot, or a YAML file of a loop")
    return Loop.from_yaml(folder / name)
