"""A quadrotor as an immutable value: body, rotors, drag, and the quantities derived from them.

Rotors are numbered counter-clockwise seen from above. In the + layout they are left, rear, right and front; in the x
layout front-left, rear-left, rear-right and front-right. Rotors 1 and 3 turn the body counter-clockwise (+), 2 and 4
clockwise.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from minsnap.basics.arrays import (
    GRAVITY,
    SMALLEST,
    ArrayLike,
    FloatArray,
    ReadOnly,
    bounded,
    numbers,
    owned,
    plain,
    read_only,
    set_fields,
)
from minsnap.basics.cached import cached_property
from minsnap.basics.checks import check_array, has_method
from minsnap.basics.messages import SHOWN, shown
from minsnap.basics.schema import ANY, NUMBER, TEXT, WHOLE, Key, either, mapping, several, word
from minsnap.basics.storage.text import FileName, load_yaml
from minsnap.errors import FileError, VehicleError
from minsnap.vehicle.drag import BodyDrag, Drag, RotorSpeedDrag, Surface, SurfaceDrag

LAYOUTS: dict[str, tuple[float, float, float, float]] = {
    "x": (45.0, 135.0, 225.0, 315.0),
    "+": (90.0, 180.0, 270.0, 0.0),
}
"""Angle of each rotor's arm from the forward axis [deg]."""

SPINS = np.array([1.0, -1.0, 1.0, -1.0])
"""Sign of each rotor's reaction torque on the body about z."""

_SLACK = 1e-9
"""Relative rounding allowed in the symmetry and the triangle inequality of an inertia."""


@dataclass(frozen=True, eq=False)
class Quadrotor(ReadOnly):
    """Four rotors on a rigid body; SI units, body axes forward, left, up.

    Parameters
    ----------
    mass : float
        [kg], positive.
    inertia : array_like, shape (3,) or (3, 3)
        Moments about the body's axes, or the whole matrix [kg m^2]; positive definite, principal moments that obey the
        triangle inequality.
    arm_length : float
        From the center to a rotor's hub [m].
    thrust_coefficient : float
        Thrust over the square of rotor speed [N/(rad/s)^2].
    torque_coefficient : float
        Reaction torque over the square of rotor speed [N m/(rad/s)^2].
    rotor_speed_max, rotor_speed_min : float
        [rad/s].
    layout : {"x", "+"}
        See :mod:`minsnap.vehicle.quadrotor` for the numbering.
    drag : Drag
        Force of the air; none by default.
    motor_time_constant : float
        Of the first-order response of rotor speed to its command [s]; 0 is instantaneous.
    gravity : float
        [m/s^2].
    name : str
        What it is called.
    delay : float
        Of its position after a setpoint, under the controller that flies it [s]; 0 where it is not known.

    Raises
    ------
    VehicleError
        If a value is not that of a physical vehicle; says which.
    """

    mass: float
    inertia: FloatArray
    arm_length: float
    thrust_coefficient: float
    torque_coefficient: float
    rotor_speed_max: float
    rotor_speed_min: float = 0.0
    layout: str = "x"
    drag: Drag = field(default_factory=BodyDrag)
    motor_time_constant: float = 0.0
    gravity: float = GRAVITY
    name: str = "quadrotor"
    delay: float = 0.0

    if TYPE_CHECKING:  # which would not let an inertia be a list

        def __init__(
            self,
            mass: float,
            inertia: ArrayLike,
            arm_length: float,
            thrust_coefficient: float,
            torque_coefficient: float,
            rotor_speed_max: float,
            rotor_speed_min: float = 0.0,
            layout: str = "x",
            drag: Drag = ...,
            motor_time_constant: float = 0.0,
            gravity: float = GRAVITY,
            name: str = "quadrotor",
            delay: float = 0.0,
        ) -> None: ...

    def __post_init__(self) -> None:
        for name in ("mass", "arm_length", "thrust_coefficient", "torque_coefficient", "rotor_speed_max", "gravity"):
            set_fields(self, **{name: _number(name, getattr(self, name), SMALLEST, "a number above 0")})
        for name in ("rotor_speed_min", "motor_time_constant", "delay"):
            set_fields(self, **{name: _number(name, getattr(self, name), 0.0, "0 or more")})
        set_fields(self, inertia=_checked_inertia(self.inertia))
        _hubs(self.layout, self.arm_length)
        if self.rotor_speed_min >= self.rotor_speed_max:
            limits = f"{self.rotor_speed_min} and {self.rotor_speed_max} rad/s"
            raise VehicleError(f"the rotor speed limits are {limits}: the lower must be below the upper")
        if not has_method(self.drag, "force"):
            raise VehicleError(f"drag is {shown(self.drag)}: give a model with a force method, such as BodyDrag(...)")

    @cached_property
    def rotor_positions(self) -> FloatArray:
        """Rotor hubs in the body frame, shape (4, 3) [m]."""
        return read_only(_hubs(self.layout, self.arm_length))

    @cached_property
    def mixer(self) -> FloatArray:
        """Matrix from rotor thrusts to thrust [1] and torques about x, y, z [m], shape (4, 4): a column a rotor."""
        hubs, turning = self.rotor_positions, SPINS * (self.torque_coefficient / self.thrust_coefficient)
        return read_only(np.stack([np.ones(4), hubs[:, 1], -hubs[:, 0], turning]))

    @cached_property
    def inverse_mixer(self) -> FloatArray:
        """Matrix from thrust and torques to rotor thrusts, shape (4, 4)."""
        return read_only(np.asarray(np.linalg.inv(self.mixer), dtype=np.float64))

    @property
    def weight(self) -> float:
        """Mass times gravity [N]."""
        return self.mass * self.gravity

    @property
    def hover_thrust(self) -> float:
        """Thrust of each rotor in hover [N]."""
        return self.weight / 4.0

    @property
    def hover_rotor_speed(self) -> float:
        """Speed of each rotor in hover [rad/s]."""
        return math.sqrt(self.hover_thrust / self.thrust_coefficient)

    @property
    def rotor_thrust_limits(self) -> tuple[float, float]:
        """Least and most thrust of one rotor [N]."""
        least, most = self.rotor_speed_min, self.rotor_speed_max
        return self.thrust_coefficient * least**2, self.thrust_coefficient * most**2

    @property
    def max_thrust_to_weight(self) -> float:
        """Greatest total thrust divided by weight."""
        return 4.0 * self.rotor_thrust_limits[1] / self.weight

    @property
    def flat_drag(self) -> BodyDrag:
        """The drag if motion is flat with it, and none in place of any other model."""
        return self.drag if isinstance(self.drag, BodyDrag) else BodyDrag()

    def thrusts(self, rotor_speed: ArrayLike) -> FloatArray:
        """Return the thrust of each rotor at speeds of any shape [rad/s], [N]; downwards where it turns backwards."""
        speeds = owned(rotor_speed)
        return np.asarray(self.thrust_coefficient * (speeds * np.abs(speeds)))

    def wrench(self, rotor_speed: ArrayLike) -> FloatArray:
        """Total thrust [N] and torques about x, y, z [N m] of rotor speeds.

        Parameters
        ----------
        rotor_speed : array_like, shape (..., 4)
            [rad/s].

        Returns
        -------
        ndarray, shape (..., 4)
        """
        return np.asarray(self.thrusts(_fours("rotor_speed", rotor_speed)) @ self.mixer.T)

    def rotor_thrusts(self, wrench: ArrayLike) -> FloatArray:
        """Return the rotor thrusts [N] for a total thrust and torques, both of shape (..., 4)."""
        return np.asarray(_fours("wrench", wrench) @ self.inverse_mixer.T)

    def rotor_speeds(self, wrench: ArrayLike) -> FloatArray:
        """Return the rotor speeds [rad/s] for a total thrust and torques, both of shape (..., 4).

        No limit is applied; a negative thrust gives a negative speed.
        """
        thrusts = self.rotor_thrusts(wrench)
        return np.asarray(np.sign(thrusts) * np.sqrt(np.abs(thrusts) / self.thrust_coefficient))

    @staticmethod
    def dji_f330() -> Quadrotor:
        """Return a DJI F330; ``dji_f330.yaml`` beside this module names the source of each number."""
        return named_vehicle("dji_f330")

    @staticmethod
    def px4_sih() -> Quadrotor:
        """Return the quadrotor of PX4's simulation in hardware; ``px4_sih.yaml`` names the sources."""
        return named_vehicle("px4_sih")

    @staticmethod
    def crazyflie() -> Quadrotor:
        """Return a Crazyflie 2.x; ``crazyflie.yaml`` names the sources."""
        return named_vehicle("crazyflie")

    @staticmethod
    def from_yaml(path: FileName) -> Quadrotor:
        """Read a vehicle from a file; see :func:`minsnap.vehicle.read_vehicle`."""
        return read_vehicle(path)

    def to_yaml(self, path: FileName) -> None:
        """Write the vehicle to a file; see :func:`minsnap.vehicle.write_vehicle`."""
        write_vehicle(self, path)


def _hubs(layout: str, arm_length: float) -> FloatArray:
    """Return the positions of the rotors in the body frame, shape (4, 3) [m].

    Raises
    ------
    VehicleError
        If the layout is not known.
    """
    if layout not in LAYOUTS:
        raise VehicleError(f"the layout is {shown(layout)}: it must be one of {', '.join(LAYOUTS)}")
    angle = np.radians(LAYOUTS[layout])
    unit = np.round(np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=-1), 15)
    return np.asarray(arm_length * unit)


def _number(name: str, value: Any, least: float, rule: str) -> float:
    """Return a finite number that is not below the least, or raise VehicleError."""
    number = numbers(value)
    if number is None or number.ndim or not bounded(number):
        raise VehicleError(f"{name} is {shown(value)}: it must be a finite number")
    if number < least:
        raise VehicleError(f"{name} is {shown(value)}: it must be {rule}")
    return float(number)


def _checked_inertia(value: ArrayLike) -> FloatArray:
    """Return an inertia as a read-only matrix, shape (3, 3), or raise VehicleError.

    A rigid body's matrix is symmetric and positive definite, and none of its principal moments exceeds the sum of the
    other two.
    """
    values = check_array("inertia", value, ((3,), (3, 3)), "3 finite moments or a finite 3 x 3 matrix", VehicleError)
    matrix = np.diag(values) if values.ndim == 1 else values
    if np.abs(matrix - matrix.T).max() > _SLACK * np.abs(matrix).max():
        raise VehicleError("the inertia matrix is not symmetric: check its off-diagonal entries")
    least, middle, most = np.linalg.eigvalsh(matrix)
    if least <= 0:
        raise VehicleError(f"the inertia is not positive definite: its smallest principal moment is {least:g} kg m^2")
    if most > (least + middle) * (1 + _SLACK):
        raise VehicleError(
            f"the principal moments {least:g}, {middle:g} and {most:g} kg m^2 cannot be those of a rigid body: "
            "the largest must not exceed the sum of the others"
        )
    return read_only(0.5 * (matrix + matrix.T))


AXES = several(NUMBER, "three numbers, along the body's axes", 3, 3)
ROWS = several(ANY, "three moments, or three rows of a matrix", 3, 3)
"""An inertia, whose numbers the vehicle checks."""

SURFACE = mapping(
    {
        "name": Key(TEXT, "what it is called", needed=True),
        "variables": Key(several(TEXT, "a list of names"), "such as velocity, pitch_deg, speed_rpm", needed=True),
        "exponents": Key(several(several(WHOLE, "a list of whole numbers"), "a list of lists"), needed=True),
        "coefficients": Key(several(NUMBER, "a list of numbers"), "one for each term [N]", needed=True),
        "measured": Key(ANY, "least and greatest measured value of each variable"),
        "r_squared": Key(NUMBER, "part of the variance that it explains"),
    },
    "the fields of Surface",
)
DRAG = either(
    mapping(
        {
            "surface": Key(SURFACE, "a polynomial, measured in a wind tunnel", needed=True),
            "count": Key(WHOLE, "how many such bodies there are"),
        },
        "surface",
        ("surface",),
    ),
    mapping(
        {"per_rotor_speed": Key(AXES, "[N/(m/s)/(rad/s)] of each rotor", needed=True)},
        "per_rotor_speed",
        ("per_rotor_speed",),
    ),
    mapping(
        {"linear": Key(AXES, "[N/(m/s)]"), "quadratic": Key(AXES, "[N/(m/s)^2]")}, "a mapping with linear and quadratic"
    ),
)
VEHICLE = mapping(
    {
        "mass": Key(NUMBER, "[kg]", needed=True),
        "inertia": Key(ROWS, "about the body's axes [kg m^2]", needed=True),
        "arm_length": Key(NUMBER, "from the center to a rotor's hub [m]", needed=True),
        "thrust_coefficient": Key(NUMBER, "thrust over the square of rotor speed [N/(rad/s)^2]", needed=True),
        "torque_coefficient": Key(NUMBER, "torque over the square of rotor speed [N m/(rad/s)^2]", needed=True),
        "rotor_speed_max": Key(NUMBER, "[rad/s]", needed=True),
        "rotor_speed_min": Key(NUMBER, "[rad/s]"),
        "layout": Key(word("x", "+"), "of the rotors"),
        "drag": Key(DRAG, "force of the air"),
        "motor_time_constant": Key(NUMBER, "of rotor speed after its command [s]"),
        "gravity": Key(NUMBER, "[m/s^2]"),
        "name": Key(TEXT, "what it is called"),
        "delay": Key(NUMBER, "of its position after a setpoint [s]; 0 where it is not known"),
    },
    "the fields of a vehicle by name, such as mass: 1.0",
)
"""The whole file."""


def read_vehicle(path: FileName) -> Quadrotor:
    """Read a vehicle from YAML.

    ``drag`` is a mapping with ``linear`` and ``quadratic``, with ``per_rotor_speed``, or with ``surface``: a mapping of
    the fields of :class:`~minsnap.vehicle.Surface`, and ``count``, how many such bodies there are.

    Raises
    ------
    FileError
        If the file cannot be read.
    VehicleError
        If a field is missing, unknown or not that of a physical vehicle.
    """
    return vehicle_from(load_yaml(path), f"{path}")


def write_vehicle(vehicle: Quadrotor, path: FileName) -> None:
    """Write a vehicle as YAML in one atomic step; reading it returns exactly the same numbers.

    Raises
    ------
    VehicleError
        If its drag is of a kind that has no description.
    """
    import yaml

    from minsnap.basics.storage.atomic import write_file

    write_file(path, yaml.safe_dump(description_of(vehicle), sort_keys=False))


def vehicle_from(content: Any, where: str = "the vehicle") -> Quadrotor:
    """Return the vehicle that a mapping of fields describes, or raise VehicleError, which says where it stands."""
    try:
        values = VEHICLE.read(where, content)
    except FileError as error:
        raise VehicleError(f"{error}") from None
    try:
        return Quadrotor(**values | ({"drag": _drag_from(values["drag"])} if "drag" in values else {}))
    except VehicleError as error:
        raise VehicleError(f"{where}: {error}") from None


def description_of(vehicle: Quadrotor) -> dict[str, Any]:
    """Return the fields of a vehicle as plain numbers, text and lists."""
    return {**plain(vehicle), "drag": _describe(vehicle.drag)}


def _drag_from(values: Mapping[str, Any]) -> Drag:
    if "surface" in values:
        return _surface_from(values["surface"], values.get("count", 1))
    return RotorSpeedDrag(values["per_rotor_speed"]) if "per_rotor_speed" in values else BodyDrag(**values)


def _surface_from(values: Mapping[str, Any], count: int) -> Drag:
    try:
        measured = {name: (low, high) for name, (low, high) in values.get("measured", {}).items()}
        drag = SurfaceDrag(Surface(**{**values, "measured": measured}), count)
        drag.force(np.ones(3))
    except (AttributeError, KeyError, TypeError, ValueError, IndexError) as error:
        text = f"the surface of the drag is malformed ({str(error)[:SHOWN]})"
        raise VehicleError(f"{text}: give the fields of Surface") from None
    return drag


def _describe(drag: Drag) -> dict[str, Any]:
    if isinstance(drag, (BodyDrag, SurfaceDrag)):
        return dict(plain(drag))
    if isinstance(drag, RotorSpeedDrag):
        return {"per_rotor_speed": plain(drag.coefficient)}
    raise VehicleError(f"drag of kind {type(drag).__name__} has no description: set it in Python")


VEHICLES = ("crazyflie", "dji_f330", "px4_sih")
"""Presets of :class:`~minsnap.vehicle.Quadrotor` by name."""

SHORT_NAMES = {"f330": "dji_f330", "px4-sih": "px4_sih"}
"""Names of presets on the command line, which files may use too."""


def _fours(what: str, values: ArrayLike) -> FloatArray:
    """Return an array of four numbers in its last axis, or refuse it."""
    array = numbers(values, copy=False)
    if array is None or array.shape[-1:] != (4,):
        raise VehicleError(f"{what} is {shown(values)}: give an array of shape (..., 4)")
    return array


@cache
def named_vehicle(name: str) -> Quadrotor:
    """Return the preset of that name, from its file beside this module.

    Raises
    ------
    VehicleError
        If there is none.
    """
    name = SHORT_NAMES.get(name, name)
    if name not in VEHICLES:
        raise VehicleError(f"no vehicle is called {name!r}: choose one of {', '.join(VEHICLES)}")
    return read_vehicle(Path(__file__).with_name(f"{name}.yaml"))


def preset_of(vehicle: Quadrotor) -> str | None:
    """Return the name of the preset that is the same vehicle, or None."""
    description = description_of(vehicle)
    return next((name for name in VEHICLES if description_of(named_vehicle(name)) == description), None)
