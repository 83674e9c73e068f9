"""Straight ways of a fleet from rest to rest, in stages: those of one stage are apart at whatever instant each flies.

Commands reach vehicles one after the other, and some are sent again. What is proved here does not depend on it: within
a stage any point of one vehicle's line is apart from any point of another's. The least distance of two segments has a
closed form: one of its ends is an end of a segment, or both lie inside, where the distance is at right angles to both
lines (D. Eberly, Robust Computation of Distance Between Line Segments, 2018).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from minsnap.basics.arrays import BoolArray, FloatArray
from minsnap.basics.tolerances import EXACT
from minsnap.errors import FleetError
from minsnap.fleet.common_clock import Separation

CORNERS = 4
"""Points of a way that is tried: up, over and down, or less."""

ROOM = 1e-6
"""Share by which a level lies higher than it must."""

LEVELS = 2
"""Levels above the goals on which others are flown over."""


@dataclass(frozen=True)
class Meeting:
    """Two vehicles that come near each other on their ways.

    Parameters
    ----------
    pair : tuple of int
        Ascending.
    distance : float
        Least distance of their lines, heights divided by the downwash [m].
    required : float
        What it is to be [m].
    """

    pair: tuple[int, int]
    distance: float
    required: float

    @property
    def apart(self) -> bool:
        """Whether they keep their separation."""
        return self.distance >= self.required * (1.0 - EXACT)


def nearest_of_stages(places: FloatArray, separation: Separation) -> Meeting | None:
    """Return the two vehicles that come nearest to their separation while all fly straight from place to place.

    Parameters
    ----------
    places : ndarray, shape (stages + 1, vehicles, dim)
        Before the first stage and after each [m]; all have ended one before another begins.
    separation : Separation

    Returns
    -------
    Meeting or None
        None for one vehicle.
    """
    found = [nearest_of_ways(np.stack(ends, axis=1), separation) for ends in zip(places, places[1:], strict=False)]
    known = [each for each in found if each is not None]
    return min(known, key=lambda each: each.distance / each.required) if known else None


def nearest_of_ways(ways: FloatArray, separation: Separation) -> Meeting | None:
    """Return the two vehicles that come nearest to their separation, whenever each flies its way.

    Parameters
    ----------
    ways : ndarray, shape (vehicles, corners, dim)
        Corners of the ways, in their order [m].
    separation : Separation

    Returns
    -------
    Meeting or None
        None for one vehicle.
    """
    if len(ways) < 2:
        return None
    field = _Field(ways, separation)
    return min((field.nearest(i, ways[i]) for i in range(len(ways))), key=lambda each: each.distance / each.required)


def segment_distances(a: FloatArray, b: FloatArray, c: FloatArray, d: FloatArray) -> FloatArray:
    """Return the least distance of segments ab and cd; shapes (..., dim) of one kind."""
    u, v, w = b - a, d - c, a - c
    ends = [_to_segment(*each) for each in ((a, c, d), (b, c, d), (c, a, b), (d, a, b))]
    uu, uv, vv, uw, vw = ((one * two).sum(axis=-1) for one, two in ((u, u), (u, v), (v, v), (u, w), (v, w)))
    skew = uu * vv - uv * uv
    with np.errstate(divide="ignore", invalid="ignore"):
        s, t = (uv * vw - vv * uw) / skew, (uu * vw - uv * uw) / skew
    inside = (skew > 0.0) & (s > 0.0) & (s < 1.0) & (t > 0.0) & (t < 1.0)
    s, t = (np.where(inside, each, 0.0)[..., None] for each in (s, t))
    within = np.linalg.norm(w + s * u - t * v, axis=-1)  # where it is not inside, the distance of two ends
    return np.asarray(np.minimum(within, np.minimum.reduce(ends)))


def _to_segment(point: FloatArray, one: FloatArray, two: FloatArray) -> FloatArray:
    line = two - one
    square = (line * line).sum(axis=-1)
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.where(square > 0.0, ((point - one) * line).sum(axis=-1) / square, 0.0)
    foot = one + np.clip(share, 0.0, 1.0)[..., None] * line
    return np.asarray(np.linalg.norm(point - foot, axis=-1))


class _Field:
    """Ways of all vehicles, shape (vehicles, corners, dim), against which others are measured."""

    def __init__(self, ways: FloatArray, separation: Separation) -> None:
        self._separation, self._radii = separation, separation.radii_of(len(ways))
        self._ways = separation.flat(ways)

    def take(self, vehicle: int, way: FloatArray) -> None:
        """Let a vehicle fly a way."""
        self._ways[vehicle] = self._separation.flat(way)

    def nearest(self, vehicle: int, way: FloatArray) -> Meeting:
        """Return who comes nearest to a way of a vehicle, whenever each flies its own."""
        own = self._separation.flat(way)[None, :, None]
        others = self._ways[:, None]
        distances = segment_distances(own[:, :-1], own[:, 1:], others[:, :, :-1], others[:, :, 1:]).min(axis=(1, 2))
        required = self._radii[vehicle] + self._radii
        share = distances / required
        share[vehicle] = np.inf
        other = int(share.argmin())
        pair = (min(vehicle, other), max(vehicle, other))
        return Meeting(pair, float(distances[other]), float(required[other]))

    def apart(self, vehicle: int, way: FloatArray) -> bool:
        """Whether a way of a vehicle is apart from those of all others."""
        return len(self._ways) < 2 or self.nearest(vehicle, way).apart


def stages_between(places: FloatArray, goals: FloatArray, flies: BoolArray, separation: Separation) -> FloatArray:
    """Find straight ways from places on the ground to goals, apart from all others in every stage.

    All take off at once, straight up to the heights of their goals. Then as many as can fly straight to their goals,
    at once or one after the other, or over the others, a separation above the highest goal, or two. A vehicle whose
    goal is taken by one that waits for it in turn goes up out of its way.

    Parameters
    ----------
    places, goals : ndarray, shape (vehicles, 3)
        [m].
    flies : ndarray of bool, shape (vehicles,)
        Those that do not stay where they stand.
    separation : Separation

    Returns
    -------
    ndarray, shape (stages + 1, vehicles, 3)
        Where all are before the first stage and after each [m].

    Raises
    ------
    FleetError
        If two stand nearer than their separation, or no ways are found; says which two, and how near they come.
    """
    up = places.copy()
    up[flies, 2] = goals[flies, 2]
    stages = np.stack([places, up]) if flies.any() else places[None]
    first = nearest_of_ways(np.stack([places, up], axis=1), separation)
    if first is not None and not first.apart:
        raise _too_near(first, "as they take off: stand them further apart")
    refusals = []
    for level in range(LEVELS):
        try:
            return np.concatenate([stages, *_turns(up, flies, _Turns(goals, separation, level))])
        except FleetError as error:
            refusals.append(error)
    raise refusals[0]


def _turns(at: FloatArray, flies: BoolArray, search: _Turns) -> list[FloatArray]:
    """Return where all are after each further stage; raises FleetError where nobody can fly any more."""
    stages, waiting = [], [int(vehicle) for vehicle in np.flatnonzero(flies)]
    while waiting:
        ways = search.arrivals(at, waiting)
        arrived = list(ways)
        if not ways and not (ways := search.parkings(at, waiting)):
            raise _too_near(search.blocked(at, waiting[0]), "on straight ways, at once or in turn: change their places")
        legs = np.repeat(at[None], CORNERS, axis=0)
        for vehicle, way in ways.items():
            legs[:, vehicle] = way
        flown = (legs[1:] != legs[:-1]).any(axis=(1, 2))
        flown[0] |= not flown.any()  # all are at their goals already
        stages.append(legs[1:][flown])
        at = legs[-1]
        waiting = [vehicle for vehicle in waiting if vehicle not in arrived]
    return stages


def _too_near(near: Meeting, what: str) -> FleetError:
    text = f"vehicles {near.pair[0]} and {near.pair[1]} would come as near as {near.distance:.4g} m"
    return FleetError(f"{text}, and {near.required:g} m are asked, {what}", pair=near.pair)


class _Turns:
    """Which vehicles can fly next.

    On the first level many go out of the way at once, which is quick; on the highest one, one at a time, below which
    all others can pass.
    """

    def __init__(self, goals: FloatArray, separation: Separation, level: int) -> None:
        self._goals, self._separation, highest = goals, separation, float(goals[:, 2].max())
        radii = separation.radii_of(len(goals))
        step = 2.0 * float(radii.max()) * separation.downwash * (1.0 + ROOM)
        self._levels = [highest + step * number for number in range(1, LEVELS + 1)]
        self._top, self._alone = self._levels[level], level > 0

    def arrivals(self, at: FloatArray, waiting: list[int]) -> dict[int, FloatArray]:
        """Return ways to their goals of as many as are apart from all others."""
        field, columns = self._field(at), self._field(at)
        found: dict[int, FloatArray] = {}
        for vehicle in waiting if self._alone else ():  # nobody ends above one that is still to go up
            columns.take(vehicle, self._raised(at[vehicle]))
        for vehicle in [each for _ in range(1 + self._alone) for each in waiting]:
            goal = np.repeat(self._goals[vehicle][None], CORNERS, axis=0)
            if vehicle in found or not columns.apart(vehicle, goal):
                continue
            way = next((way for way in self._ways(at[vehicle], goal[0]) if field.apart(vehicle, way)), None)
            if way is not None:
                field.take(vehicle, way)
                columns.take(vehicle, goal)
                found[vehicle] = way
        return found

    def parkings(self, at: FloatArray, waiting: list[int]) -> dict[int, FloatArray]:
        """Return ways up for vehicles that wait for each other: of two, one goes out of the way."""
        field, resting = self._field(at), self._field(at)
        found: dict[int, FloatArray] = {}
        for vehicle in waiting:
            taken = resting.nearest(vehicle, np.repeat(self._goals[vehicle][None], CORNERS, axis=0))
            way = self._raised(at[vehicle])
            stays = taken.apart or not set(taken.pair) & set(found)
            if stays and at[vehicle, 2] < self._top and field.apart(vehicle, way):
                field.take(vehicle, way)
                found[vehicle] = way
                if self._alone:
                    break
        return found

    def blocked(self, at: FloatArray, vehicle: int) -> Meeting:
        """Return whom the straight way of a vehicle meets."""
        return self._field(at).nearest(vehicle, self._ways(at[vehicle], self._goals[vehicle])[0])

    def _field(self, at: FloatArray) -> _Field:
        return _Field(np.repeat(at[:, None], CORNERS, axis=1), self._separation)

    def _raised(self, place: FloatArray) -> FloatArray:
        top = np.append(place[:2], self._top)
        return np.stack([place, top, top, top])

    def _ways(self, place: FloatArray, goal: FloatArray) -> list[FloatArray]:
        """Return the straight way, and those over all others."""
        found = [np.stack([place, goal, goal, goal])]
        for level in self._levels:
            found.append(np.stack([place, np.append(place[:2], level), np.append(goal[:2], level), goal]))
        return found
