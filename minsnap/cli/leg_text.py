"""The table of the legs of a plan, and how its flight time depends on limits and gates."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from math import degrees, radians
from typing import Any

import minsnap
from minsnap.basics.limit_kinds import KIND
from minsnap.errors import InputError
from minsnap.trajectory import Sensitivity


def figures_of_legs(
    path: minsnap.Path, limits: minsnap.Limits | None, sensitivities: Callable[[], Sequence[Sensitivity]] | None = None
) -> dict[str, Any]:
    """Return the figures ``leg_table`` and ``sensitivities`` of a plan.

    Raises
    ------
    InputError
        If the path is a shape, which has no legs.
    """
    from minsnap.limits import legs_within

    if not isinstance(path, minsnap.Trajectory):
        raise InputError("--legs is for plans through waypoints: a shape has no legs; leave it out")
    table = [vars(use) | {"binding": dict(use.binding), "limit": use.limit} for use in legs_within(path, limits)]
    if sensitivities is None:
        known = path.report.sensitivities if isinstance(path, minsnap.Plan) else ()
    else:
        known = tuple(sensitivities())
    return {"leg_table": table, "sensitivities": [vars(one) | {"unit": one.unit} for one in known]}


def leg_text(figures: Mapping[str, Any]) -> str:
    """Return both as tables."""
    rows = [("leg", "time [s]", "mean [m/s]", "greatest [m/s]", "limits that bind [s]")]
    for use in figures["leg_table"]:
        bound = ", ".join(f"{KIND[name].label} {seconds:.3g}" for name, seconds in use["binding"].items()) or "none"
        numbers = f"{use['duration']:.4g}", f"{use['mean_speed']:.3g}", f"{use['max_speed']:.3g}"
        rows.append((str(use["leg"]), *numbers, bound))
    tables = [_aligned(rows)]
    if figures["sensitivities"]:
        seconds = sum(use["duration"] for use in figures["leg_table"])
        known = [_row(one, seconds) for one in figures["sensitivities"]]
        tables.append(_aligned([("one unit more of", "now", "flight time"), *known]))
    return "\n\n".join(tables)


LITTLE = 5e-3
"""Share of the flight time per share of a limit, below which a difference is that of two searches, not of the limit."""


def _row(figures: Mapping[str, Any], duration: float) -> tuple[str, str, str]:
    one = Sensitivity(**{name: figures[name] for name in ("name", "waypoint", "value", "seconds")})
    value, seconds, unit = one.value, one.seconds, one.unit
    if one.waypoint is None and KIND[one.name].degrees:
        value, seconds, unit = degrees(value), seconds * radians(1.0), "degree"
    change = f"{seconds:+.3g} s per {'weight' if unit == 'of the weight' else unit}"
    return one.label, f"{value:.4g} {unit}", change if abs(seconds * value) > LITTLE * duration else "none"


def _aligned(rows: Sequence[Sequence[str]]) -> str:
    """Return rows in columns, all but the last as wide as their widest entry."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = ("  ".join(text.ljust(width) for text, width in zip(row, widths, strict=True)).rstrip() for row in rows)
    return "\n".join(lines)
