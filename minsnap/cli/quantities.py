"""Numbers of options, which are in the unit that the help says: a unit behind one is answered with the number."""

from __future__ import annotations

import re
from collections.abc import Callable
from math import degrees, radians

import typer

UNITS = {
    "M": ("metres", {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "km": 1e3}),
    "S": ("seconds", {"s": 1.0, "sec": 1.0, "ms": 1e-3, "min": 60.0}),
    "HZ": ("hertz", {"hz": 1.0, "khz": 1e3}),
    "KG": ("kilograms", {"kg": 1.0, "g": 1e-3}),
    **dict.fromkeys(("DEG", "DEGREES"), ("degrees", {"deg": 1.0, "degrees": 1.0, "°": 1.0, "rad": degrees(1.0)})),
    "RAD/S": ("rad/s", {"rad/s": 1.0, "deg/s": radians(1.0), "°/s": radians(1.0)}),
    "M/S": ("m/s", {"m/s": 1.0, "cm/s": 1e-2, "km/h": 1.0 / 3.6, "kmh": 1.0 / 3.6}),
    "M/S2": ("m/s^2", {"m/s2": 1.0}),
    "M/S3": ("m/s^3", {"m/s3": 1.0}),
    "M/S4": ("m/s^4", {"m/s4": 1.0}),
}
"""What stands for a value in the help, the unit that it is in, and what others are in it."""

_PLAIN = str.maketrans({"²": "2", "³": "3", "⁴": "4", "^": None})

_WITH_UNIT = re.compile(r"([-+]?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?)\s*([^\d\s,;]\S*)", re.IGNORECASE)


def number_in(metavar: str | None) -> Callable[[str], float]:
    """Return what reads the number of an option whose value the help calls ``metavar``."""

    def read(text: str) -> float:
        try:
            return float(text)
        except ValueError:
            raise typer.BadParameter(f"{text!r} {refusal(text, metavar)}") from None

    read.__name__ = "float"  # in the help, where nothing else stands for the value
    return read


def refusal(text: str, metavar: str | None) -> str:
    """Return what is wrong with a text that is no number of an option, and which number it may be."""
    name, known = UNITS.get((metavar or "").translate(_PLAIN), ("", {}))
    written = _WITH_UNIT.fullmatch(text.strip())
    factor = written and known.get(written[2].lower().translate(_PLAIN))
    if written and factor:
        return f"has a unit: give {float(written[1]) * factor:.6g}, in {name}"
    if re.fullmatch(r"[-+]?\d+,\d+", text.strip()):
        return f"has a comma: give {text.strip().replace(',', '.')}"
    return "is no number" + (f": give one, in {name}" if name else "")
