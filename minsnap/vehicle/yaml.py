"""Vehicles as YAML: each field of :class:`~minsnap.vehicle.Quadrotor` under its name, in SI units."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import fields
from typing import Any, TypeVar

import numpy as np

from minsnap.basics.messages import SHOWN
from minsnap.basics.schema import ANYTHING, NUMBER, TEXT, WHOLE, Key, either, mapping, several, word
from minsnap.errors import FileError, VehicleError
from minsnap.vehicle.drag import BodyDrag, Drag, RotorSpeedDrag
from minsnap.vehicle.surface import Surface, SurfaceDrag

Vehicle = TypeVar("Vehicle")
"""The class of a vehicle: a dataclass."""

AXES = several(NUMBER, "three numbers, along the body's axes", 3, 3)
ROWS = several(ANYTHING, "three moments, or three rows of a matrix", 3, 3)
"""An inertia, whose numbers the vehicle checks."""

SURFACE = mapping(
    {
        "name": Key(TEXT, "what it is called", needed=True),
        "variables": Key(several(TEXT, "a list of names"), "such as velocity, pitch_deg, speed_rpm", needed=True),
        "exponents": Key(several(several(WHOLE, "a list of whole numbers"), "a list of lists"), needed=True),
        "coefficients": Key(several(NUMBER, "a list of numbers"), "one for each term [N]", needed=True),
        "measured": Key(ANYTHING, "least and greatest measured value of each variable"),
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


def read_described(kind: type[Vehicle], path: str | os.PathLike[str]) -> Vehicle:
    """Read a vehicle of a class from YAML.

    ``drag`` is a mapping with ``linear`` and ``quadratic``, with ``per_rotor_speed``, or with ``surface``: a mapping of
    the fields of :class:`~minsnap.vehicle.Surface`, and ``count``, how many such bodies there are.

    Raises
    ------
    FileError
        If the file cannot be read.
    VehicleError
        If a field is missing, unknown or not that of a physical vehicle.
    """
    from minsnap.basics.storage.text import load_yaml

    return vehicle_from(kind, load_yaml(path), f"{path}")


def write_description(vehicle: Any, path: str | os.PathLike[str]) -> None:
    """Write a vehicle as YAML in one atomic step; reading it returns exactly the same numbers.

    Raises
    ------
    VehicleError
        If its drag is of a kind that has no description.
    """
    import yaml

    from minsnap.basics.storage.atomic import atomic_write

    with atomic_write(path) as file:
        file.write(yaml.safe_dump(description_of(vehicle), sort_keys=False))


def vehicle_from(kind: type[Vehicle], content: Any, where: str = "the vehicle") -> Vehicle:
    """Return the vehicle that a mapping of fields describes, or raise VehicleError, which says where it stands."""
    try:
        values = VEHICLE.read(where, content)
    except FileError as error:
        raise VehicleError(f"{error}") from None
    try:
        return kind(**values | ({"drag": _drag_from(values["drag"])} if "drag" in values else {}))
    except VehicleError as error:
        raise VehicleError(f"{where}: {error}") from None


def description_of(vehicle: Any) -> dict[str, Any]:
    """Return the fields of a vehicle as plain numbers, text and lists."""
    plain = {field.name: getattr(vehicle, field.name) for field in fields(vehicle)}
    return plain | {"inertia": vehicle.inertia.tolist(), "drag": _describe(vehicle.drag)}


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
        raise VehicleError(
            f"the surface of the drag is malformed ({str(error)[:SHOWN]}): give the fields of Surface"
        ) from None
    return drag


def _describe(drag: Drag) -> dict[str, Any]:
    match drag:
        case BodyDrag():
            return {"linear": drag.linear.tolist(), "quadratic": drag.quadratic.tolist()}
        case RotorSpeedDrag():
            return {"per_rotor_speed": drag.coefficient.tolist()}
        case SurfaceDrag(surface=surface):
            plain = {entry.name: getattr(surface, entry.name) for entry in fields(Surface)}
            plain |= {"variables": list(surface.variables), "exponents": [list(e) for e in surface.exponents]}
            measured = {name: list(span) for name, span in surface.measured.items()}
            plain |= {"coefficients": surface.coefficients.tolist(), "measured": measured}
            return {"surface": plain, "count": drag.count}
    raise VehicleError(f"drag of kind {type(drag).__name__} has no description: set it in Python")
