"""Vehicles as YAML: every field of :class:`~minsnap.vehicle.Quadrotor` by its name, in SI units."""

from __future__ import annotations

import os
from dataclasses import fields
from typing import Any

from minsnap.errors import VehicleError
from minsnap.thesis.published import SurfaceDrag, published_drag
from minsnap.vehicle.drag import BodyDrag, Drag, RotorSpeedDrag
from minsnap.vehicle.quadrotor import Quadrotor

_PUBLISHED = ("surface", "reduced", "linear", "propeller")


def read_vehicle(path: str | os.PathLike[str]) -> Quadrotor:
    """Read a vehicle from YAML.

    ``drag`` is a mapping with ``linear`` and ``quadratic``, with ``per_rotor_speed``, or with ``published`` and the
    name of one of the published models.

    Raises
    ------
    FileError
        If the file cannot be read.
    VehicleError
        If a field is missing, unknown or not that of a physical vehicle.
    """
    from minsnap.storage.text import load_yaml

    given = load_yaml(path)
    if not isinstance(given, dict):
        raise VehicleError(f"{path} holds no vehicle: give its fields by name, such as 'mass: 1.0'")
    try:
        return vehicle_from(given)
    except VehicleError as error:
        raise VehicleError(f"{path}: {error}") from None


def write_vehicle(vehicle: Quadrotor, path: str | os.PathLike[str]) -> None:
    """Write a vehicle as YAML, whole or not at all; numbers read back exactly.

    Raises
    ------
    VehicleError
        If its drag is of a kind that has no description.
    """
    try:
        import yaml
    except ImportError as error:
        raise ImportError("writing YAML needs PyYAML: pip install minsnap[yaml]") from error
    from minsnap.storage.atomic import atomic_write

    with atomic_write(path) as file:
        file.write(yaml.safe_dump(description_of(vehicle), sort_keys=False))


def vehicle_from(given: dict[str, Any]) -> Quadrotor:
    """Return the vehicle that a mapping of fields describes, or raise VehicleError."""
    known = [field.name for field in fields(Quadrotor)]
    unknown = [str(name) for name in given if name not in known]
    if unknown:
        raise VehicleError(f"no field is called {', '.join(unknown)}: the fields are {', '.join(known)}")
    missing = [name for name in known[:6] if name not in given]
    if missing:
        raise VehicleError(f"a vehicle needs {', '.join(missing)} too")
    values = dict(given)
    if "drag" in values:
        values["drag"] = _drag_from(values["drag"])
    return Quadrotor(**values)


def description_of(vehicle: Quadrotor) -> dict[str, Any]:
    """Return the fields of a vehicle as plain numbers, text and lists."""
    plain = {field.name: getattr(vehicle, field.name) for field in fields(Quadrotor)}
    return plain | {"inertia": vehicle.inertia.tolist(), "drag": _describe(vehicle.drag)}


def _drag_from(given: Any) -> Drag:
    match given:
        case {"published": name, **rest} if not rest:
            return published_drag(name)
        case {"per_rotor_speed": coefficient, **rest} if not rest:
            return RotorSpeedDrag(coefficient)
        case dict() if set(given) <= {"linear", "quadratic"}:
            return BodyDrag(**given)
    raise VehicleError(f"drag is {given!r}: give linear and quadratic, per_rotor_speed, or published")


def _describe(drag: Drag) -> dict[str, Any]:
    match drag:
        case BodyDrag():
            return {"linear": drag.linear.tolist(), "quadratic": drag.quadratic.tolist()}
        case RotorSpeedDrag():
            return {"per_rotor_speed": drag.coefficient.tolist()}
        case SurfaceDrag():
            names = [name for name in _PUBLISHED if published_drag(name).surface is drag.surface]
            if names:
                return {"published": names[0]}
    raise VehicleError(f"drag of kind {type(drag).__name__} has no description: set it in Python")
