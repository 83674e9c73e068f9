"""Limits in YAML files: one form and one reader for requests, courses, shows, plans and batches."""

from __future__ import annotations

from collections.abc import Mapping
from math import sqrt
from pathlib import Path
from typing import Any

from minsnap.basics.limit_kinds import KINDS
from minsnap.basics.schema import NUMBER, Form, Key, either, mapping, word
from minsnap.limits.limits import Limits, VehicleLimits
from minsnap.limits.ordinary import completed_in_file
from minsnap.planning.request import RESERVE
from minsnap.vehicle.quadrotor import SHORT_NAMES, VEHICLES, Quadrotor, named_vehicle, vehicle_from

PRESET = word(*VEHICLES, short=SHORT_NAMES)

DESCRIBED = Form(
    "its fields by name, or a YAML file that does, or one of " + ", ".join(VEHICLES),
    lambda value: isinstance(value, (str, dict)),
    lambda where, value: value,
    {"type": ["string", "object"]},
)
"""A vehicle: a preset, a file beside the one that names it, or the fields of a Quadrotor."""

ROTORS = mapping(
    {
        "vehicle": Key(either(PRESET, DESCRIBED), "whose rotors", needed=True),
        "reserve": Key(NUMBER, "share of their room that is left to feedback, in [0, 1)"),
    },
    "a mapping of vehicle and reserve",
)

OFF = Form("null, which takes a limit off", lambda value: value is None, lambda where, value: None, {"type": "null"})

NAMED = {kind.name: Key(either(NUMBER, OFF), f"[{kind.typed_unit}]") for kind in KINDS if kind.measure != "rotors"}
"""The limits that are numbers."""

HOW = {"norm": Key(word("euclidean", "axis")), "gravity": Key(NUMBER, "[m/s^2]")}

LIMITS = mapping(
    NAMED | HOW | {"rotors": Key(ROTORS, "keep the thrust of each rotor within its range")},
    "a mapping of limits by name, such as {speed: 3}",
)


def complete(content: Mapping[str, Any]) -> dict[str, Any]:
    """Return limits that choose the time with the ordinary ones that are neither named nor null."""
    options = {name: value for name, value in content.items() if name in HOW}
    return completed_in_file({name: value for name, value in content.items() if name not in HOW}) | options


def without_null(content: Mapping[str, Any]) -> dict[str, Any]:
    """Return the limits that are not null."""
    return {name: value for name, value in content.items() if value is not None}


def limits_of(where: str, content: Any, folder: Path) -> Limits:
    """Return exactly the limits that a mapping names, those of a vehicle's rotors among them; its file is in a folder.

    Raises
    ------
    FileError
        If a name is not known, or a value has another form.
    LimitError, VehicleError
        If a limit cannot be kept, or a vehicle cannot fly.
    """
    values = without_null(LIMITS.read(where, content))
    rotors = values.pop("rotors", None)
    if rotors is None:
        return Limits(**values)
    vehicle = vehicle_of(rotors["vehicle"], folder)
    return Limits.of(vehicle, rotors.get("reserve", RESERVE), **values)


def besides_rotors(limits: VehicleLimits) -> dict[str, float]:
    """Return the limits that a vehicle's own were combined with, by name."""
    own = type(limits).of(limits.vehicle, limits.reserve).given()
    return {name: value for name, value in limits.given().items() if own.get(name) != value}


def vehicle_of(content: Any, folder: Path, name: str = "vehicle") -> Quadrotor:
    """Return the vehicle of a preset, of a file in a folder, or of a mapping of its fields.

    The rotors of a mapping may be described by their least and largest thrust, ``rotor_thrust`` [N].
    """
    if isinstance(content, str):
        preset = content in VEHICLES or content in SHORT_NAMES or not Path(content).suffix
        return named_vehicle(content) if preset else Quadrotor.from_yaml(folder / content)
    rest = {key: value for key, value in content.items() if key != "rotor_thrust"}
    if "rotor_thrust" in content and "thrust_coefficient" in content:
        least, most = (sqrt(thrust / content["thrust_coefficient"]) for thrust in content["rotor_thrust"])
        rest |= {"rotor_speed_min": least, "rotor_speed_max": most}
    return vehicle_from({"name": name} | rest)
