"""What a stored plan keeps, and what a flight along it kept, as lines of a summary and as figures."""

from __future__ import annotations

from dataclasses import asdict
from math import isfinite
from typing import TYPE_CHECKING, Any

import numpy as np

from minsnap.basics.limit_kinds import KIND
from minsnap.corridors import GatePassage

if TYPE_CHECKING:
    from minsnap.corridors import ObstacleMargin
    from minsnap.files import FlownMargins, PlanFile
    from minsnap.fleet import FleetTube
    from minsnap.paths.missions import CourseCheck
    from minsnap.vehicle_tube import VehicleTube

Lines = list[tuple[str, str]]


def kept_lines(plan: PlanFile) -> Lines:
    """Return each margin of a plan that is certified again: corridor, obstacles, gates, waypoints and limits."""
    proof, lines = plan.proof, Lines()
    near, beside = proof.nearest, proof.nearest_obstacle
    if near is not None:
        lines.append(
            (f"corridor{_width(plan)}", f"{_inside(near.value)}, least on leg {near.leg} at {near.instant:.4g} s")
        )
    if beside is not None:
        lines.append(("obstacles", _clear(beside)))
    lines += [(f"gate {passed.gate}", passage_text(passed)) for passed in plan.passages]
    if proof.waypoint_error is not None:
        lines.append(("waypoints", f"passed within {proof.waypoint_error:.3g} m"))
    return lines + [used.fact for used in proof.utilisation]


def kept_figures(plan: PlanFile) -> dict[str, Any]:
    """Return the same as plain numbers by name."""
    proof = plan.proof
    parts = {"corridor": proof.nearest, "obstacle": proof.nearest_obstacle}
    figures: dict[str, Any] = {name: None if part is None else asdict(part) for name, part in parts.items()}
    figures |= {"gates": [asdict(passed) for passed in plan.passages], "waypoint_error": proof.waypoint_error}
    return figures | {"limits": [asdict(used) for used in proof.utilisation]}


def tube_lines(tube: VehicleTube | FleetTube) -> Lines:
    """Return how far vehicles in their loops can be from their plan, and in which wind they keep all that is asked."""
    lag = max(each.flight.lag for each in tube.each)
    wind = f"in a wind that changes by {tube.wind:g} m/s, {lag:.3g} m of it in still air"
    error = f"{tube.error:.3g} m at most, {wind}" if isfinite(tube.error) else "not bounded: the loop saturates"
    strongest = f"{tube.strongest:.3g} m/s of change" if tube.strongest else "not even still air"
    return [("tracking error", error), ("strongest wind", strongest)]


def tube_figures(tube: VehicleTube | FleetTube) -> dict[str, Any]:
    """Return the same as plain numbers by name; what is left of each condition, of one vehicle, in its unit."""
    figures = {"tube": tube.error, "wind": tube.wind, "strongest_wind": tube.strongest, "fault": tube.fault}
    return figures | {"left": getattr(tube, "rooms", None)}


def flown_lines(plan: PlanFile, flown: FlownMargins) -> Lines:
    """Return how a flight kept what its plan was to keep."""
    lines, inside, near = Lines(), flown.corridor, flown.obstacle
    if inside is not None:
        lines.append(
            (f"corridor{_width(plan)}", f"{_inside(inside.margin)}, on leg {inside.leg} at {inside.instant:.4g} s")
        )
    if near is not None:
        lines.append(("obstacles", _clear(near)))
    lines += [(f"gate {passed.gate}", passage_text(passed)) for passed in flown.gates]
    if flown.stayed_inside is not None:
        lines.append(("stayed inside", "yes, at its samples" if flown.stayed_inside else "no"))
    return lines


def course_lines(check: CourseCheck) -> Lines:
    """Return how a flight keeps a course, and how near it is to the least time."""
    worst = max(check.passages, key=lambda passed: passed.outside)
    within = f", within {worst.outside:.2g} m (stop {worst.stop})" if worst.outside > 0.0 else ""
    lines = [("stops", f"{len(check.passages)} in order{within}")]
    for passed in check.passages:
        if passed.clearance is not None:
            gate = GatePassage(passed.stop, passed.instant, passed.speed, passed.clearance)
            lines.append((f"gate {passed.stop}", passage_text(gate)))
    lines += [used.fact for used in check.utilisation]
    if check.unknown:
        lines.append(("not measured", ", ".join(KIND[name].label for name in check.unknown)))
    lines.append(("flight time", f"{check.seconds:.6g} s from the first stop to the last"))
    proved = "; proved in exact arithmetic" if check.bound.seconds is not None and check.bound.verify() else ""
    return [*lines, ("least time", check.sentence + proved)]


def course_figures(check: CourseCheck) -> dict[str, Any]:
    """Return the same as plain numbers by name."""
    bound = check.bound
    figures: dict[str, Any] = {"seconds": check.seconds, "lower_bound": bound.seconds, "gap": check.gap}
    figures |= {"verified": bound.verify(), "left_out": list(bound.left_out), "reason": bound.reason or None}
    figures |= {"passages": [asdict(passed) for passed in check.passages], "not_measured": list(check.unknown)}
    return figures | {"limits": [asdict(used) for used in check.utilisation]}


def passage_text(passed: GatePassage) -> str:
    """Return when and how fast a gate is passed, and how far from its nearest edge."""
    side = (
        f"{passed.clearance:.3g} m from its edge" if passed.clearance >= 0.0 else f"missed by {-passed.clearance:.3g} m"
    )
    return f"{passed.instant:.4g} s, {passed.speed:.4g} m/s, {side}"


def _width(plan: PlanFile) -> str:
    """Return the half-width of a tube that has one."""
    widths = None if hasattr(plan.corridor, "walls") or isinstance(plan.corridor, list) else plan.corridor
    return "" if widths is None or np.ndim(widths) else f" of {float(widths):g} m"


def _inside(margin: float) -> str:
    return f"inside by {margin:.3g} m" if margin >= 0.0 else f"left by {-margin:.3g} m"


def _clear(near: ObstacleMargin) -> str:
    if near.value < 0.0:
        return near.inside
    return f"clear by {near.value:.3g} m of {near.name}, least at {near.instant:.4g} s"
