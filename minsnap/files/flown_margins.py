"""A flight against what its plan was to keep: corridor, obstacles and gates, at the samples of the flight."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from minsnap.corridors.gates import Gate
from minsnap.corridors.keep_out import clearances_of
from minsnap.corridors.moving import Moving
from minsnap.corridors.obstacle_margins import ObstacleMargin, in_space
from minsnap.corridors.passages import GatePassage, clearances
from minsnap.files.consistency import Membership, check_membership
from minsnap.files.plan_file import PlanFile
from minsnap.trajectory.samples import Samples

LATE = 1.0
"""By how much a vehicle may be late, or early, to count to a leg of its plan [s]."""


@dataclass(frozen=True)
class FlownMargins:
    """How a flight kept what its plan was to keep, at its samples.

    Parameters
    ----------
    corridor : Membership or None
        Least margin inside the corridor; None without one.
    obstacle : ObstacleMargin or None
        Least distance to an obstacle; None without any.
    gates : tuple of GatePassage
        Where it crossed the planes of gates; a clearance below 0 is a gate that was missed.
    """

    corridor: Membership | None
    obstacle: ObstacleMargin | None
    gates: tuple[GatePassage, ...]

    @property
    def stayed_inside(self) -> bool | None:
        """Whether it kept all of them; None where there was nothing to keep."""
        found = [] if self.corridor is None else [self.corridor.margin]
        found += [] if self.obstacle is None else [self.obstacle.value]
        found += [passed.clearance for passed in self.gates]
        return min(found) >= 0.0 if found else None

    def figures(self) -> dict[str, Any]:
        """Return the margins as plain numbers by name."""
        parts = {"corridor": self.corridor, "obstacle": self.obstacle}
        named: dict[str, Any] = {name: None if part is None else asdict(part) for name, part in parts.items()}
        return named | {"gates": [asdict(passed) for passed in self.gates], "stayed_inside": self.stayed_inside}


def find_flown_margins(plan: PlanFile, flight: Samples) -> FlownMargins:
    """Return how a flight along a plan, on its clock, kept corridor, obstacles and gates.

    Parameters
    ----------
    plan : PlanFile
    flight : Samples
        Positions against time, the first instant that of the plan's start.
    """
    t = flight.t - flight.t[0]
    inside = None
    if plan.corridor is not None:
        breaks = plan.trajectory.leg_breaks[:, None]
        near = (breaks[:-1] <= t + LATE) & (breaks[1:] >= np.minimum(t, breaks[-1]) - LATE)
        inside = check_membership(replace(flight, t=t), plan.points, plan.corridor, near)
    return FlownMargins(inside, _nearest(plan, t, flight), _passages(plan, t, flight))


def _nearest(plan: PlanFile, t: Any, flight: Samples) -> ObstacleMargin | None:
    if not plan.avoid:
        return None
    places = in_space(flight.position)
    distances = np.stack(
        [
            obstacle.clearances(places, t) if isinstance(obstacle, Moving) else clearances_of(obstacle, places)
            for obstacle in plan.avoid
        ]
    )
    which, sample = np.unravel_index(distances.argmin(), distances.shape)
    return ObstacleMargin.of(float(distances[which, sample]), int(which), float(t[sample]), plan.avoid)


def _passages(plan: PlanFile, t: Any, flight: Samples) -> tuple[GatePassage, ...]:
    return tuple(_passage(plan.gates[passed.gate], passed, t, flight) for passed in plan.passages)


def _passage(gate: Gate, planned: GatePassage, t: Any, flight: Samples) -> GatePassage:
    """Return where a flight crosses the plane of a gate next to when that is planned, or comes nearest to it."""
    places, ahead = flight.position, (flight.position - gate.center) @ gate.normal
    crossed = np.flatnonzero(ahead[:-1] * ahead[1:] <= 0.0)
    if not len(crossed):
        at = int(np.abs(ahead).argmin())
        missed = -float(np.linalg.norm(places[at] - gate.center))
        return replace(planned, instant=float(t[at]), speed=_speed(t, places, at), clearance=missed)
    at = int(crossed[np.abs(t[crossed] - planned.instant).argmin()])
    span = ahead[at] - ahead[at + 1]
    share = ahead[at] / span if span else 0.0
    place = places[at] + share * (places[at + 1] - places[at])
    instant = float(t[at] + share * (t[at + 1] - t[at]))
    clear = float(clearances(gate, place[None], np.inf)[0])
    return replace(planned, instant=instant, speed=_speed(t, places, at), clearance=clear)


def _speed(t: Any, places: Any, at: int) -> float:
    """Return the speed from a sample to the next one [m/s]."""
    at = min(at, len(t) - 2)
    return float(np.linalg.norm(places[at + 1] - places[at]) / (t[at + 1] - t[at]))
