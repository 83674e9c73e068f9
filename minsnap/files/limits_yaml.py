"""Limits in files: the mapping that requests, courses, plans, shows and rows of batches have under ``limits``.

A mapping says limits by name, and may say whose rotors are kept within their range. Where the limits choose the time,
the ordinary ones that it does not name hold too (:mod:`minsnap.limits.ordinary`), unless they are null; where a time is
given, or a vehicle says what it can do, exactly those hold that are named.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import sqrt
from pathlib import Path
from typing import Any

from minsnap.basics.limit_kinds import KINDS
from minsnap.basics.schema import NUMBER, Form, Key, either, mapping, several, word
from minsnap.basics.storage.text import FileName, load_yaml
from minsnap.errors import FileError
from minsnap.limits.limits import Limits, VehicleLimits
from minsnap.limits.ordinary import completed
from minsnap.vehicle.quadrotor import (
    SHORT_NAMES,
    VEHICLES,
    Quadrotor,
    description_of,
    named_vehicle,
    preset_of,
    vehicle_from,
)

RESERVE = 0.1
"""Share of the rotors' room that is left to feedback unless told otherwise."""

PRESET = word(*VEHICLES, short=SHORT_NAMES)
"""How a file names a preset of a vehicle."""

DESCRIBED = Form(
    "its fields by name, or a YAML file that does, or one of " + ", ".join(VEHICLES),
    lambda value: isinstance(value, (str, dict)),
    lambda where, value: value,
    {"type": ["string", "object"]},
)
"""A vehicle: a preset, a file beside the one that names it, the fields of a Quadrotor, or those of ``THRUST``."""

THRUST = mapping(
    {
        "mass": Key(NUMBER, "[kg]", needed=True),
        "max_thrust": Key(NUMBER, "of all rotors together [N]", needed=True),
        "min_thrust": Key(NUMBER, "the least [N]"),
        "body_rate": Key(NUMBER, "roll and pitch rate together [rad/s]"),
        "yaw_rate": Key(NUMBER, "[rad/s]"),
    },
    "a mapping of mass, max_thrust and rates",
)
"""A vehicle of which no more is known than what it lifts, and how fast it turns."""

ROTORS = mapping(
    {
        "vehicle": Key(either(PRESET, DESCRIBED), "whose rotors", needed=True),
        "reserve": Key(NUMBER, "share of their room that is left to feedback, in [0, 1)"),
    },
    "a mapping of vehicle and reserve",
)

OFF = Form("null, which takes a limit off", lambda value: value is None, lambda where, value: None, {"type": "null"})

SPEED = either(NUMBER, several(NUMBER, "one of each leg", 1), OFF)

LIMIT_KEYS = {
    kind.name: Key(SPEED if kind.name == "speed" else either(NUMBER, OFF), f"[{kind.typed_unit}]")
    for kind in KINDS
    if kind.measure != "rotors"
}
"""The limits that are numbers, and the speed of each leg."""

HOW = {"norm": Key(word("euclidean", "axis")), "gravity": Key(NUMBER, "[m/s^2]")}

LIMITS = mapping(
    LIMIT_KEYS | HOW | {"rotors": Key(ROTORS, "keep the thrust of each rotor within its range")},
    "a mapping of limits by name, such as {speed: 3}",
)
"""How a file says limits: those of ``LIMIT_KEYS``, and how they are kept."""


def limit_fields(content: Mapping[str, Any], *, timed: bool) -> dict[str, Any]:
    """Return the fields of :class:`~minsnap.Limits` that a mapping of ``LIMITS`` says, all but those of its rotors.

    Parameters
    ----------
    content : mapping
        As it was read.
    timed : bool
        Whether the times are given beside it, so that only what it names is limited.
    """
    how = {name: content[name] for name in HOW if name in content}
    named = {name: value for name, value in content.items() if name not in (*HOW, "rotors")}
    if timed or "rotors" in content:
        return {name: value for name, value in named.items() if value is not None} | how
    return completed(named) | how


def limits_of(
    where: str, content: Any, folder: Path, *, timed: bool = True, vehicle: Any = None, name: str = "vehicle"
) -> Limits:
    """Return the limits that a mapping says, those of a vehicle's rotors among them.

    Parameters
    ----------
    where : str
        What error messages say.
    content : mapping
        Of the file.
    folder : path
        Of the file, which may name one of a vehicle.
    timed : bool
        As :func:`limit_fields` has it.
    vehicle : str, mapping or None
        What keeps its rotors within their whole range, named beside the limits, as in a course.
    name : str
        Of a vehicle that a mapping describes.

    Raises
    ------
    FileError
        If a name is not known, a value has another form, or there are two vehicles.
    LimitError, VehicleError
        If a limit cannot be kept, or a vehicle cannot fly.
    """
    said = LIMITS.read(where, content)
    rotors = said.get("rotors")
    if vehicle is None and rotors is None:
        return Limits(**limit_fields(said, timed=timed))
    if vehicle is not None and rotors is not None:
        raise FileError(f"{where} has rotors, and a vehicle stands beside it: leave out one of them")
    described, reserve = (vehicle, 0.0) if rotors is None else (rotors["vehicle"], rotors.get("reserve", RESERVE))
    others = {"reserve": reserve} | limit_fields(said, timed=True)
    if isinstance(described, Mapping) and "max_thrust" in described:  # no more is known of it, none of its rotors
        return Limits.of_mass(**{**THRUST.read(f"{where}: vehicle", described), **others})
    return Limits.of(vehicle_of(described, folder, name), **others)


def describe_limits(limits: Limits) -> dict[str, Any]:
    """Return limits as a file says them, so that :func:`limits_of` reads them again."""
    if not isinstance(limits, VehicleLimits):
        return {"norm": limits.norm, "gravity": limits.gravity} | limits.named()
    vehicle = preset_of(limits.vehicle) or description_of(limits.vehicle)
    return {"norm": limits.norm, "rotors": {"vehicle": vehicle, "reserve": limits.reserve}} | besides_rotors(limits)


def read_limits(path: FileName) -> Limits:
    """Return exactly the limits that a YAML file names under ``limits``, whatever else it holds.

    Raises
    ------
    FileError
        If it cannot be read, or has none.
    LimitError, VehicleError
        As :func:`limits_of`.
    """
    if isinstance(path, str | Path) and not Path(path).exists() and f"{path}" in (*VEHICLES, *SHORT_NAMES):
        raise FileError(f"{path} is the name of a vehicle, and no file: give a file as minsnap limits -o writes it")
    content = load_yaml(path)
    if not isinstance(content, dict) or not content.get("limits"):
        raise FileError(f"{path} has no limits: give a file as minsnap limits -o writes it")
    return limits_of(f"{path}: limits", content["limits"], Path(path).parent)


def besides_rotors(limits: VehicleLimits) -> dict[str, Any]:
    """Return the limits that a vehicle's own were combined with, by name."""
    own = type(limits).of(limits.vehicle, limits.reserve).given()
    return {name: value for name, value in limits.named().items() if own.get(name) != value}


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
