"""Summary of a path: one set of figures, as text or as JSON."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from minsnap.basics.limit_kinds import KIND, KINDS
from minsnap.basics.storage.text_columns import labelled

if TYPE_CHECKING:
    import numpy.typing as npt

    from minsnap.limits.limits import Limits
    from minsnap.trajectory.path import Path
    from minsnap.trajectory.trajectory import Trajectory

_LINES = (
    ("duration", "duration", "{:.6g} s"),
    ("start", "start", "{}"),
    ("standing", "from standing", "{:.6g} s, from rest to rest"),
    ("legs", "legs", "{}"),
    ("cost", "cost", "{:.6g}"),
    *((f"max_{kind.name}", f"max {kind.label}", f"{{:.4g}} {kind.unit}") for kind in KINDS[:3]),
    ("corridor_margin", "corridor margin", "{:.3g} m, at every instant"),
    ("obstacle_distance", "obstacle distance", "{:.4g} m, at every instant"),
    ("altitude", "altitude", "{:g} m in files of setpoints: give --start X Y Z to choose it"),
    ("parts", "parts", "{}"),
    ("pieces_auto", "with --pieces auto", "{}"),
    ("solver", "solver", "{}"),
    ("rounds", "rounds", "{}"),
    ("milliseconds", "planned in", "{:.1f} ms"),
    ("interrupted", "interrupted", "{} (the best plan until then)"),
    ("note", "note", "{}"),
    ("output", "written", "{}"),
    ("beside", "beside it", "{}"),
    ("frame", "frame", "{}"),
    ("plot", "drawn", "{}"),
)

BINDING = 0.999
"""Share of a limit from which it binds."""

STANDING = 1e-6
"""Speed up to which a path begins at rest [m/s]."""

_LIMITS_AFTER = 8
"""Limits stand below the greatest speed, acceleration and jerk."""


def summarise(
    path: Path, corridor: Any = None, waypoints: npt.ArrayLike | None = None, limits: Limits | None = None
) -> dict[str, Any]:
    """Return the figures of a path; figures that do not apply are None.

    Exact over all time; for a shape that is not a polynomial, those of polynomials within a micrometre of it.

    Parameters
    ----------
    path : Path
        A plan or a shape.
    corridor, waypoints, limits
        What it was planned with.

    Returns
    -------
    dict
        duration [s], legs, cost [cost_unit], max_speed [m/s], max_acceleration [m/s^2], max_jerk [m/s^3],
        corridor_margin [m], solver, rounds, milliseconds, limits: for each, how far it is used, and where
        most; binding: those used up.
    """
    from minsnap.certificate import certify
    from minsnap.trajectory.trajectory import Trajectory

    known: dict[str, Any] = dict.fromkeys(name for name, _, _ in _LINES[:-4])
    certificate = certify(path, waypoints=waypoints, corridor=corridor, limits=limits)
    known |= {name: getattr(certificate, name) for name in ("max_speed", "max_acceleration", "max_jerk")}
    known |= {"duration": path.duration, "cost_unit": None}
    known["corridor_margin"] = None if corridor is None else certificate.corridor_margin
    known["limits"] = [asdict(used) for used in certificate.utilisation]
    known["binding"] = [used.name for used in certificate.utilisation if used.fraction >= BINDING]
    return known | (_of_plan(path) if isinstance(path, Trajectory) else {})


def as_text(figures: Mapping[str, Any]) -> str:
    """Return the figures that are not None, one per line."""
    from minsnap.trajectory.report import Utilisation

    limits = [Utilisation(**used).fact for used in figures["limits"]]
    if limits:
        limits.append(("limits that bind", ", ".join(KIND[name].label for name in figures["binding"]) or "none"))
    gates = [(f"gate {passed['gate']}", _passage(passed)) for passed in figures.get("gates") or ()]
    return labelled(_lines(figures, _LINES[:_LIMITS_AFTER]) + limits + gates + _lines(figures, _LINES[_LIMITS_AFTER:]))


def _passage(passed: Mapping[str, Any]) -> str:
    """Return when and how fast a gate is passed, and how far from its nearest edge."""
    return f"{passed['instant']:.4g} s, {passed['speed']:.4g} m/s, {passed['clearance']:.3g} m from its edge"


def _lines(figures: Mapping[str, Any], wanted: tuple[tuple[str, str, str], ...]) -> list[tuple[str, str]]:
    """Return labels and texts of the figures that are not None."""
    return [(label, _line(figures, name, form)) for name, label, form in wanted if figures.get(name) is not None]


def _line(figures: Mapping[str, Any], name: str, form: str) -> str:
    if name == "pieces_auto":
        return f"{figures[name]:.6g} s, {100.0 * figures['pieces_auto_gain']:.1f} % shorter"
    text = form.format(_parts(figures[name]) if name == "parts" else figures[name])
    return f"{text} {figures['cost_unit']}" if name == "cost" else text


def _parts(parts: Any) -> str:
    """Return names and durations of the parts of a mission."""
    return ", ".join(f"{part['name']} {part['duration']:.4g} s" for part in parts)


def as_json(figures: Mapping[str, Any]) -> str:
    """Return the figures as one JSON object; missing ones are null."""
    return json.dumps(dict(figures), indent=2)


def _of_plan(path: Trajectory) -> dict[str, Any]:
    """Return the figures that a shape does not have."""
    from minsnap.trajectory.report import cost_unit

    figures: dict[str, Any] = {"legs": path.legs, "start": _start(path), "cost": path.cost()}
    figures["cost_unit"], report = cost_unit(path.cost_order), path.report
    if report is None:
        return figures
    made = {name: getattr(report, name) for name in ("solver", "rounds", "milliseconds")}
    return (
        figures | made | {"interrupted": "yes" if report.interrupted else None, "note": "; ".join(report.notes) or None}
    )


def _start(path: Any) -> str | None:
    """Return the speed at which a path begins; None at rest."""
    speed = sum(float(part) ** 2 for part in path(0.0, 1)) ** 0.5
    return f"flying, at {speed:.4g} m/s: a vehicle has to reach it first" if speed > STANDING else None
