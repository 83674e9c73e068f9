"""What a fleet flies around its curves: take-off, ways to the starts, ways home, landing; proved apart, or refused.

Every move is a straight line from rest to rest. Those of one stage may be flown at any instants of it
(``straight_ways``); a stage begins when all have ended the one before.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from minsnap.basics.arrays import BoolArray, FloatArray
from minsnap.errors import FleetError
from minsnap.fleet.common_clock import Fleet, Separation
from minsnap.fleet.fleet_certificate import certify_fleet
from minsnap.fleet.straight_ways import Meeting, nearest_of_stages, stages_between
from minsnap.trajectory.trajectory import Trajectory

GROUND = 0.1
"""Height below which a curve begins or ends on the ground, and takes off or lands itself [m]."""

NEAR = 0.1
"""How far from its start a vehicle may stand whose curve begins on the ground [m]: its setpoint steps by that."""

SPAN = 0.15
"""Least distance where a fleet does not say how far apart it stays [m]: a Crazyflie's width with its propellers."""


@dataclass(frozen=True)
class WayTimes:
    """How long ways take: what they need at moderate speeds, and no less than this.

    Parameters
    ----------
    take_off : float
        Climb to the height of the start, at least [s].
    approach : float
        Straight way to the start, at least [s].
    landing : float
        At least [s].
    settle : float
        Wait after each of these [s].
    climb, travel, sink : float
        Greatest speeds upwards, along, and downwards [m/s]: moderate, and slower down, into its own wash.
    peak : float
        Greatest speed of a way from rest to rest over its mean: 35/16 for the polynomials of degree 7 that the
        Crazyflie's firmware flies.
    """

    take_off: float = 2.5
    approach: float = 3.0
    landing: float = 3.0
    settle: float = 0.5
    climb: float = field(default=1.0, kw_only=True)
    travel: float = field(default=1.0, kw_only=True)
    sink: float = field(default=0.8, kw_only=True)
    peak: float = field(default=35.0 / 16.0, kw_only=True)

    def lasting(self, least: float, way: float, speed: float) -> float:
        """Return the time of a way [m] that is nowhere faster than a speed [m/s]; ``least`` [s] or more."""
        return max(least, self.peak * way / speed)

    def of_move(self, kind: str, way: FloatArray) -> float:
        """Return the time of a move along a vector [m]."""
        least = {TAKES_OFF: self.take_off, LANDS: self.landing}.get(kind, self.approach)
        along, rise = math.hypot(way[0], way[1]), float(way[2])
        upwards = self.lasting(least, abs(rise), self.climb if rise > 0.0 else self.sink)
        return max(upwards, self.lasting(least, along, self.travel))


TAKES_OFF, GOES, LANDS = "take-off", "go", "land"
"""Kinds of moves."""


@dataclass(frozen=True)
class WayMove:
    """What a vehicle is told in a stage.

    Parameters
    ----------
    kind : {"take-off", "go", "land"}
        Straight up from where it stands, straight to a place, or straight down.
    goal : tuple of 3
        Where it leads [m].
    """

    kind: str
    goal: tuple[float, float, float]


@dataclass(frozen=True)
class WayStage:
    """What vehicles fly at one time; the others stay.

    Parameters
    ----------
    moves : dict
        By the number of the vehicle.
    seconds : float
        How long each takes [s].
    """

    moves: dict[int, WayMove]
    seconds: float


@dataclass(frozen=True, eq=False)
class FleetApproach:
    """What a fleet flies before and after its curves.

    Parameters
    ----------
    places : ndarray, shape (vehicles, 3)
        Where the vehicles stand [m].
    there, back : tuple of WayStage
        From there to the starts of the curves; from their ends to the ground.
    nearest : Meeting or None
        The two that come nearest to their separation on these ways, at whatever instant of a stage each flies its
        part; None for one vehicle.
    upright : Meeting or None
        The two that come nearest seen from above, at any instant of ways and curves: where they are apart, all may
        land straight down at any instant.
    highest : float
        Of the ways [m].
    home : bool
        Whether all land where they stood; else below the ends of their curves.
    stated : bool
        Whether the fleet says how far apart it stays; else it is ``SPAN``.
    """

    places: FloatArray = field(repr=False)
    there: tuple[WayStage, ...] = field(repr=False)
    back: tuple[WayStage, ...] = field(repr=False)
    nearest: Meeting | None
    upright: Meeting | None
    highest: float
    home: bool
    stated: bool

    @property
    def seconds(self) -> float:
        """How long the ways take in all, without waits [s]."""
        return sum(stage.seconds for stage in (*self.there, *self.back))

    def sentences(self, fleet: Fleet) -> list[str]:
        """Return what is proved of the ways, and what is not, with the vehicles' names."""
        begin = f"{len(self.there)} stages to the starts" if self.there else "none to the starts, on the ground"
        flown = f"{begin}, {len(self.back)} to the ground, {self.seconds:.1f} s"
        told = [f"ways: {flown}, up to {self.highest:.2f} m high; all land {'home' if self.home else 'in place'}"]
        if self.nearest is not None:
            asked = "asked" if self.stated else "taken, for the files do not say how far apart the vehicles must be"
            near = f"{self.nearest.distance:.4g} m ({fleet.names_of(self.nearest.pair)})"
            told.append(f"ways: apart by {near} or more whenever each is told, {self.nearest.required:g} m are {asked}")
        if self.upright is not None:
            near = f"{fleet.names_of(self.upright.pair)} are {self.upright.distance:.4g} m apart seen from above"
            told.append(
                f"if one is lost: all land straight down, proved apart at any instant ({near})"
                if self.upright.apart
                else f"if one is lost: all land straight down, which is not proved apart: at worst {near}"
            )
        return told


def approach_of(fleet: Fleet, places: FloatArray, times: WayTimes | None = None) -> FleetApproach:
    """Find ways from where vehicles stand to the starts of their curves, and to the ground, and prove them apart.

    Vehicles land below the ends of their curves where that is apart, else where they stood. A curve that begins on the
    ground takes off by itself.

    Parameters
    ----------
    fleet : Fleet
        Three coordinates; proved apart by itself, see :func:`~minsnap.certify_fleet`.
    places : ndarray, shape (vehicles, 3)
        Where the vehicles stand [m].
    times : WayTimes, optional

    Raises
    ------
    FleetError
        If no ways are found that are apart, with the pair and how near it comes, or a vehicle stands too far from a
        start on the ground.
    """
    apart = fleet.separation or Separation(SPAN)
    starts, ends = (np.stack([curve(instant) for curve in fleet for instant in [when(curve)]]) for when in _ENDS)
    flies, lands = starts[:, 2] > GROUND, ends[:, 2] > GROUND
    _refuse_far(fleet, places, starts, flies)
    up = stages_between(places, np.where(flies[:, None], starts, places), flies, apart)
    down, home = _down(places, ends, lands, apart)
    pace, joined = times or WayTimes(), np.concatenate([up, down])
    near = _nearest([nearest_of_stages(each, apart) for each in (up, down)])
    if near is not None and not near.apart:
        raise FleetError(
            f"the ways of vehicles {near.pair} are {near.distance:.4g} m apart: not proved", pair=near.pair
        )
    there, back = _stages(up, flies, pace, landing=False), _stages(down, lands, pace, landing=True)
    upright = _nearest([nearest_from_above(fleet), *(_flattened(each, apart) for each in (up, down))])
    highest = float(joined[..., 2].max())
    return FleetApproach(places, there, back, near, upright, highest, home, fleet.separation is not None)


_ENDS = (lambda curve: 0.0, lambda curve: curve.duration)


def _nearest(found: list[Meeting | None]) -> Meeting | None:
    known = [each for each in found if each is not None]
    return min(known, key=lambda each: each.distance / each.required) if known else None


def _refuse_far(fleet: Fleet, places: FloatArray, starts: FloatArray, flies: BoolArray) -> None:
    far = np.where(flies, 0.0, np.linalg.norm(places - starts, axis=1))
    vehicle = int(far.argmax())
    if far[vehicle] > NEAR:
        text = f"{fleet.name(vehicle)} stands {far[vehicle]:.2f} m from its start, which is on the ground"
        raise FleetError(f"{text}: stand it there, within {NEAR:g} m", vehicle=vehicle)


def _down(places: FloatArray, ends: FloatArray, lands: BoolArray, apart: Separation) -> tuple[FloatArray, bool]:
    """Return the places after each stage from the ends of curves to the ground, and whether that is home."""
    below = ends.copy()
    below[lands, 2] = 0.0
    straight = np.stack([ends, below])
    near = nearest_of_stages(straight, apart)
    if near is None or near.apart:
        return straight, False
    grounds = np.where(lands[:, None], places, ends)
    try:
        return stages_between(grounds, ends, lands, apart)[::-1], True
    except FleetError as error:
        text = f"landing in place, vehicles {near.pair[0]} and {near.pair[1]} would come within {near.distance:.4g} m"
        raise FleetError(f"{text}, and back to where they stood, {error}", pair=near.pair) from None


def _stages(places: FloatArray, moves: BoolArray, times: WayTimes, *, landing: bool) -> tuple[WayStage, ...]:
    """Return what is told in each stage; the last to the starts tells all that fly, for their headings."""
    stages, last = [], len(places) - 2
    for number, (before, after) in enumerate(zip(places, places[1:], strict=False)):
        moved = (before != after).any(axis=1)
        if landing and number == last:
            moved, kind = np.ones(len(moved), dtype=bool), LANDS  # those on the ground too, which stops their motors
        elif landing:
            kind = GOES
        else:
            moved, kind = (moved, TAKES_OFF) if number == 0 else (moved | (moves & (number == last)), GOES)
        told = {int(i): WayMove(kind, tuple(after[i].tolist())) for i in np.flatnonzero(moved)}
        seconds = max((times.of_move(kind, after[i] - before[i]) for i in told), default=0.0)
        stages.append(WayStage(told, seconds))
    return tuple(stages)


def _flat_separation(apart: Separation) -> Separation:
    return Separation(apart.distance) if apart.radii is None else Separation(radii=apart.radii)


def _flattened(places: FloatArray, apart: Separation) -> Meeting | None:
    return nearest_of_stages(places[..., :2], _flat_separation(apart))


def nearest_from_above(fleet: Fleet) -> Meeting | None:
    """Return the two vehicles that come nearest to their separation seen from above; None for one vehicle.

    Where they are apart, all may land straight down at any instant.
    """
    apart = fleet.separation or Separation(SPAN)
    flat = [Trajectory(curve.control_points[..., :2], curve.durations) for curve in fleet]
    near = certify_fleet(flat, _flat_separation(apart)).closest
    return None if near is None else Meeting(near.pair, near.distance, near.required)
