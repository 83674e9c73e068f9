"""Vehicles as YAML: each field of :class:`~minsnap.vehicle.Quadrotor` under its name, in SI units."""

from __future__ import annotations

import os
from dataclasses import fields
from typing import Any, TypeVar

import numpy as np

from minsnap.basics.messages import SHOWN, shown
from minsnap.errors import VehicleError
from minsnap.vehicle.drag import BodyDrag, Drag, RotorSpeedDrag
from minsnap.vehicle.surface import Surface, SurfaceDrag

Vehicle = TypeVar("Vehicle")
"""The class of a vehicle: a dataclass."""


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

    content = load_yaml(path)
    if not isinstance(content, dict):
        raise VehicleError(f"{path} holds no vehicle: give its fields by name, such as 'mass: 1.0'")
    try:
        return vehicle_from(kind, content)
    except VehicleError as error:
        raise VehicleError(f"{path}: {error}") from None
    except (TypeError, ValueError, OverflowError) as error:
        raise VehicleError(f"{path} describes no vehicle: a field has a value of another form than its own") from error


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


def vehicle_from(kind: type[Vehicle], content: dict[str, Any]) -> Vehicle:
    """Return the vehicle that a mapping of fields describes, or raise VehicleError."""
    known = [field.name for field in fields(kind)]  # type: ignore[arg-type]
    unknown = [str(name)[:SHOWN] for name in content if name not in known][:5]
    if unknown:
        raise VehicleError(f"no field is called {', '.join(unknown)}: the fields are {', '.join(known)}")
    missing = [name for name in known[:6] if name not in content]
    if missing:
        raise VehicleError(f"a vehicle needs {', '.join(missing)} too")
    values = dict(content)
    if "drag" in values:
        values["drag"] = _drag_from(values["drag"])
    return kind(**values)


def description_of(vehicle: Any) -> dict[str, Any]:
    """Return the fields of a vehicle as plain numbers, text and lists."""
    plain = {field.name: getattr(vehicle, field.name) for field in fields(vehicle)}
    return plain | {"inertia": vehicle.inertia.tolist(), "drag": _describe(vehicle.drag)}


def _drag_from(content: Any) -> Drag:
    match content:
        case {"surface": dict(surface), **rest} if rest.keys() <= {"count"}:
            return _surface_from(surface, rest.get("count", 1))
        case {"per_rotor_speed": coefficient, **rest} if not rest:
            return RotorSpeedDrag(coefficient)
        case dict() if set(content) <= {"linear", "quadratic"}:
            return BodyDrag(**content)
    raise VehicleError(f"drag is {shown(content)}: give linear and quadratic, per_rotor_speed, or surface")


def _surface_from(content: dict[str, Any], count: Any) -> Drag:
    try:
        values = dict(content)
        values |= {"variables": tuple(content["variables"]), "exponents": tuple(tuple(e) for e in content["exponents"])}
        values["measured"] = {name: (low, high) for name, (low, high) in content.get("measured", {}).items()}
        drag = SurfaceDrag(Surface(**values), int(count))
        drag.force(np.ones(3))
    except (KeyError, TypeError, ValueError, IndexError) as error:
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
        case SurfaceDrag():
            surface = {entry.name: getattr(drag.surface, entry.name) for entry in fields(Surface)}
            surface |= {
                "variables": list(drag.surface.variables),
                "exponents": [list(e) for e in drag.surface.exponents],
            }
            surface |= {"coefficients": drag.surface.coefficients.tolist()}
            surface |= {"measured": {name: list(span) for name, span in drag.surface.measured.items()}}
            return {"surface": surface, "count": drag.count}
    raise VehicleError(f"drag of kind {type(drag).__name__} has no description: set it in Python")
