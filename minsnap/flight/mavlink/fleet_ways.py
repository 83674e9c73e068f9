"""The ways of a fleet of autopilots to its starts and to the ground: proved apart from where they stand, or refused.

An autopilot flies to the first setpoint by itself, in a way of its own: straight, or up and then along, as
ArduPilot's take-off does. Any point of one vehicle's triangle of place, start and the point above the place is to be
apart from any of another's, whenever each flies. Modes that land go straight down.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.fleet import Meeting, Separation, nearest_of_ways
from minsnap.flight.mavlink.setpoints import SetpointTable
from minsnap.flight.mavlink.vehicle_messages import Vector

Judge = Callable[[Sequence[Vector]], str | None]
"""Returns why a fleet that stands at these places, in its z-down frame, must not fly, or None."""


def judge_of_ways(
    separation: Separation | None, tables: Sequence[SetpointTable], names: Sequence[str], *, land: bool
) -> Judge:
    """Return what judges the places of vehicles before anything is sent.

    Parameters
    ----------
    separation : Separation or None
        None: nothing is asked.
    tables : sequence of SetpointTable
        In one local frame of all.
    names : sequence of str
        Of the vehicles.
    land : bool
        Whether all land at the end of their setpoints.
    """
    starts = _upwards([table.start.position for table in tables])
    ends = _upwards([table[len(table) - 1].position for table in tables])

    def judge(places: Sequence[Vector]) -> str | None:
        if separation is None:
            return None
        stand = _upwards(places)
        over = np.concatenate([stand[:, :2], starts[:, 2:]], axis=1)
        way = "on their ways to their starts: stand them nearer to their starts, or bring them there"
        refused = _refusal(nearest_of_ways(np.stack([stand, over, starts, stand], axis=1), separation), names, way)
        if refused is None and land:
            ground = np.full(len(ends), min(0.0, float(stand[:, 2].min())))
            below = np.column_stack([ends[:, :2], ground])
            way = "as they land below their ends: leave --land out, and land one after the other"
            refused = _refusal(nearest_of_ways(np.stack([ends, below], axis=1), separation), names, way)
        return refused

    return judge


def _upwards(places: Sequence[Vector]) -> FloatArray:
    """Return places (vehicles, 3) with their heights upwards."""
    return np.array(places, dtype=np.float64) * (1.0, 1.0, -1.0)


def _refusal(near: Meeting | None, names: Sequence[str], way: str) -> str | None:
    if near is None or near.apart:
        return None
    one, two = (names[vehicle] for vehicle in near.pair)
    return f"{one} and {two} would come as near as {near.distance:.4g} m, and {near.required:g} m are asked, {way}"
