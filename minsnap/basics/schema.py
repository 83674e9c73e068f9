"""Forms of the values in YAML files: what is read, what a refusal says, and the JSON schema, from one table of keys."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from difflib import get_close_matches
from typing import Any

from minsnap.basics.checks import is_number, is_whole
from minsnap.basics.messages import shown
from minsnap.errors import FileError

Json = Mapping[str, Any]


@dataclass(frozen=True)
class Form:
    """What a value must be.

    Parameters
    ----------
    said : str
        What a refusal asks for: ``"a finite number"``.
    fits : callable
        Whether a value is of this form, its entries left aside.
    made : callable
        Returns what is read; takes where the value stands, for the errors of its entries, and the value.
    json : mapping
        The JSON schema.
    """

    said: str
    fits: Callable[[Any], bool]
    made: Callable[[str, Any], Any] = field(repr=False)
    json: Json = field(repr=False)

    def read(self, where: str, value: Any) -> Any:
        """Return what a value means, or raise FileError, which says where it stands."""
        if not self.fits(value):
            raise FileError(f"{where} is {shown(value)}: give {self.said}")
        return self.made(where, value)

    def then(self, make: Callable[[Any], Any]) -> Form:
        """Return the form of the same values from which something else is made."""
        return replace(self, made=lambda where, value: make(self.made(where, value)))


@dataclass(frozen=True)
class Key:
    """An entry of a mapping.

    Parameters
    ----------
    form : Form
    text : str
        What it means, with its unit.
    needed : bool
    """

    form: Form
    text: str = ""
    needed: bool = False


def _plain(said: str, fits: Callable[[Any], bool], kind: Callable[[Any], Any], json: Json) -> Form:
    return Form(said, fits, lambda where, value: kind(value), json)


NUMBER = _plain("a finite number", is_number, float, {"type": "number"})
WHOLE = _plain("a whole number", is_whole, int, {"type": "integer"})
FLAG = _plain("true or false", lambda value: isinstance(value, bool), bool, {"type": "boolean"})
TEXT = _plain("a text", lambda value: isinstance(value, str), str, {"type": "string"})
ANY = _plain("anything", lambda value: True, lambda value: value, {})


def from_to(form: Form, least: float, most: float) -> Form:
    """Return the form of a number in a range, its ends among them."""
    fits = lambda value: form.fits(value) and least <= value <= most  # noqa: E731
    limits = {"minimum": least, "maximum": most}
    return Form(f"{form.said} from {least:g} to {most:g}", fits, form.made, {**form.json, **limits})


def word(*known: str, short: Mapping[str, str] | None = None) -> Form:
    """Return the form of one of some words; short ones stand for others."""
    names = {name: name for name in known} | dict(short or {})
    fits = lambda value: isinstance(value, str) and value in names  # noqa: E731
    return _plain(f"one of {', '.join(known)}", fits, names.__getitem__, {"enum": list(names)})


def several(form: Form, said: str, least: int = 0, most: int | None = None, first: int = 0) -> Form:
    """Return the form of a list with ``least`` to ``most`` entries, read as a tuple; a tuple is read as well.

    A refusal counts the entries from ``first`` on.
    """

    def fits(value: Any) -> bool:
        return isinstance(value, (list, tuple)) and least <= len(value) and (most is None or len(value) <= most)

    def made(where: str, value: Sequence[Any]) -> tuple[Any, ...]:
        return tuple(form.read(f"{where} {i}", entry) for i, entry in enumerate(value, first))

    size = {"minItems": least} | ({} if most is None else {"maxItems": most})
    return Form(said, fits, made, {"type": "array", "items": form.json, **size})


def either(*forms: Form) -> Form:
    """Return the form of a value that has one of some forms; the first that fits reads it."""

    def made(where: str, value: Any) -> Any:
        return next(form for form in forms if form.fits(value)).read(where, value)

    wording = ", or ".join(form.said for form in forms)
    return Form(
        wording, lambda value: any(form.fits(value) for form in forms), made, {"anyOf": [f.json for f in forms]}
    )


def mapping(keys: Mapping[str, Key], said: str, marks: Collection[str] = ()) -> Form:
    """Return the form of a mapping with these keys, read as a dict.

    A key whose value is null is left out, unless null means something.

    Parameters
    ----------
    keys : mapping
        What may stand in it.
    said : str
        What a refusal of anything but a mapping asks for.
    marks : collection of str
        Keys by which such a mapping is known among others; none where every mapping is meant to be one.
    """

    def made(where: str, value: Mapping[str, Any]) -> dict[str, Any]:
        refuse_unknown(where, value, keys)
        missing = [name for name, key in keys.items() if key.needed and value.get(name) is None]
        if missing:
            raise FileError(f"{where} has no {' and no '.join(missing)}: give it")
        read = {name: entry for name, entry in value.items() if entry is not None or keys[name].form.fits(None)}
        return {name: keys[name].form.read(f"{where}: {name}", entry) for name, entry in read.items()}

    def fits(value: Any) -> bool:
        return isinstance(value, Mapping) and (not marks or any(mark in value for mark in marks))

    needed = [name for name, key in keys.items() if key.needed]
    entries = {name: {**key.form.json, **({"description": key.text} if key.text else {})} for name, key in keys.items()}
    json = {"type": "object", "properties": entries, **({"required": needed} if needed else {})}
    return Form(said, fits, made, json | {"additionalProperties": False})


MEANT = {
    **dict.fromkeys(("obstacles", "obstacle", "no_fly_zones"), "avoid"),
    **dict.fromkeys(("max_speed", "speed", "velocity", "v_max", "vmax", "max_velocity"), "limits: {speed: 3}"),
    **dict.fromkeys(("max_acceleration", "acceleration", "a_max", "amax", "max_accel"), "limits: {acceleration: 6}"),
    **dict.fromkeys(("points", "path", "route"), "waypoints"),
    **dict.fromkeys(("time", "duration"), "total_time"),
    **dict.fromkeys(("yaw", "yaw_deg", "angle", "direction"), "heading_deg"),
    **dict.fromkeys(("loops", "repeat", "rounds"), "laps"),
    **dict.fromkeys(("wait", "pause", "delay"), "hold"),
    **dict.fromkeys(
        ("lat", "lon", "latitude", "longitude"), "x, y and z; latitudes are those of a CSV lat,lon,alt or a mission"
    ),
    **dict.fromkeys(("tolerance", "acceptance_radius"), "ball"),
}
"""Keys that others have, and what is written here: the word before a sign is the key."""


def refuse_unknown(where: str, content: Mapping[Any, Any], known: Mapping[str, Any]) -> None:
    """Raise FileError for the first key that is not known, with the one that may be meant."""
    for unknown in [key for key in content if key not in known][:1]:
        meant = MEANT.get(str(unknown), "")
        near = [meant] if re.split(r"[:,]", meant)[0] in known else get_close_matches(str(unknown), known, 1)
        hint = f"did you mean {near[0]}? " if near else ""
        raise FileError(f"{where}: {shown(unknown)} is not known: {hint}the keys are {', '.join(known)}")


def json_schema(title: str, form: Form) -> dict[str, Any]:
    """Return the JSON schema of a file, as an editor takes it."""
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", "title": title, **form.json}


POINT = several(NUMBER, "two or three numbers [m]", 2, 3)
BOX = several(POINT, "two corners, such as [[0, 0, 0], [4, 4, 3]]", 2, 2)
HEADING = either(word("velocity", "tilt", "free"), NUMBER)
