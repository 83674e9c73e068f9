"""A show: formations one after the other, and the flights between them, planned one by one and kept as found.

From home all climb straight up, fly to the acts, each by the assignment of least squared way, hold each, return above
home and land.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.storage.archive import read_archive
from minsnap.basics.storage.atomic import atomic_write
from minsnap.errors import FleetError, MinsnapError
from minsnap.files.formats.light_programme import Lights
from minsnap.fleet.assignment import assign
from minsnap.fleet.common_clock import Fleet
from minsnap.fleet.fleet_planner import plan_fleet
from minsnap.fleet.separation import Separation
from minsnap.limits.limits import Limits
from minsnap.shows.formations import spacing_of
from minsnap.trajectory.trajectory import Trajectory

Told = Callable[[str], None]


@dataclass(frozen=True, eq=False)
class Act:
    """One formation of a show.

    Parameters
    ----------
    name : str
    points : ndarray, shape (vehicles, 3)
        [m].
    hold : float
        How long it stands [s].
    colour : tuple of int or None
        Red, green, blue of all lamps, from 0 to 255; None: as before.
    fade : bool
        The colour is reached during the flight there, else on arrival.
    """

    name: str
    points: FloatArray
    hold: float = 3.0
    colour: tuple[int, int, int] | None = None
    fade: bool = False


@dataclass(frozen=True, eq=False)
class Show:
    """What is to be flown.

    Parameters
    ----------
    home : ndarray, shape (vehicles, 3)
        Where each stands and lands [m].
    acts : tuple of Act
    separation : Separation
    limits : Limits
    take_off : float
        How far above home the vehicles climb straight [m].
    room : pair of corners or None
    seed : int
    """

    home: FloatArray
    acts: tuple[Act, ...]
    separation: Separation
    limits: Limits
    take_off: float = 2.0
    room: tuple[FloatArray, FloatArray] | None = None
    seed: int = 0

    @property
    def reach(self) -> float:
        """Largest coordinate of any formation [m]."""
        points = [self.home + (0.0, 0.0, self.take_off), *(act.points for act in self.acts)]
        return float(max(np.abs(place).max() for place in points))

    def check(self) -> None:
        """Refuse acts that do not fit the vehicles or stand too close, naming the pair."""
        places = [("home", self.home), *((f"act {act.name!r}", act.points) for act in self.acts)]
        for name, points in places:
            if points.shape != self.home.shape:
                raise FleetError(f"{name} has {len(points)} points, and home has {len(self.home)}: give as many")
            if len(points) < 2:
                continue
            least, pair = spacing_of(points, self.separation.downwash)
            asked = self.separation.between(*pair)
            if least < asked:
                raise FleetError(
                    f"points {pair[0]} and {pair[1]} of {name} are {least:.3f} m apart, {asked - least:.3f} m less "
                    f"than the separation of {asked:g} m: spread it, or give it fewer vehicles",
                    pair=pair,
                )


@dataclass(frozen=True)
class Stage:
    """One flight of a show, and the hold after it.

    Parameters
    ----------
    name : str
        Where it leads.
    start, arrival, end : float
        [s].
    method : str
        How it was planned, or ``"kept"`` from an earlier run.
    """

    name: str
    start: float
    arrival: float
    end: float
    method: str


@dataclass(frozen=True, eq=False)
class FlownShow:
    """A show as trajectories.

    Parameters
    ----------
    fleet : Fleet
    lights : tuple of Lights
        Of each vehicle.
    stages : tuple of Stage
    """

    fleet: Fleet
    lights: tuple[Lights, ...]
    stages: tuple[Stage, ...]


def fly(show: Show, kept: str | os.PathLike[str] | None = None, told: Told | None = None) -> FlownShow:
    """Plan every flight of a show.

    Parameters
    ----------
    show : Show
    kept : str or path, optional
        Folder in which flights are stored as they are found; those of an earlier run that ask the same are not planned
        again.
    told : callable, optional
        Is told a sentence after each flight.

    Raises
    ------
    FleetError
        If acts and vehicles do not fit together.
    UnprovedError
        If a flight was not found; says which.
    """
    show.check()
    above = show.home + (0.0, 0.0, show.take_off)
    places = [("take-off", above, 0.0), *((act.name, act.points, act.hold) for act in show.acts)]
    places += [("return", above, 0.0), ("landing", show.home, 0.0)]
    now, clock, stages = show.home, 0.0, []
    parts: list[list[Trajectory]] = [[] for _ in show.home]
    for number, (name, points, hold) in enumerate(places):
        free = 0 < number < len(places) - 2
        goals = points[assign(now, points)] if free else points
        try:
            curves, method = _flight(show, now, goals, kept)
        except MinsnapError as error:
            error.args = (f"the flight to {name}: {error}",)
            raise
        arrival = clock + max(curve.duration for curve in curves)
        for part, curve, goal in zip(parts, curves, goals, strict=True):
            part.extend([curve, *_wait(goal, arrival - clock - curve.duration + hold)])
        stages.append(Stage(name, clock, arrival, arrival + hold, method))
        if told is not None:
            told(f"{name}: {arrival - clock:.2f} s ({method})")
        now, clock = goals, arrival + hold
    fleet = Fleet(tuple(_joined(part) for part in parts), None, show.separation)
    return FlownShow(fleet, (_lights(show, stages),) * len(fleet), tuple(stages))


def _flight(
    show: Show, starts: FloatArray, goals: FloatArray, kept: str | os.PathLike[str] | None
) -> tuple[list[Trajectory], str]:
    """Return the curves from starts to goals, from the folder if they are there."""
    file = None if kept is None else Path(kept) / f"{_key(show, starts, goals)}.npz"
    if file is not None and file.exists():
        stored = read_archive(file)
        return [Trajectory(stored[f"p{i}"], stored[f"d{i}"]) for i in range(len(starts))], "kept"
    ways = np.stack([starts, goals], axis=1)
    fleet = plan_fleet(ways, show.limits, show.separation, show.room, seed=show.seed)
    if file is not None:
        file.parent.mkdir(parents=True, exist_ok=True)
        arrays: dict[str, Any] = {f"p{i}": curve.control_points for i, curve in enumerate(fleet)}
        arrays |= {f"d{i}": curve.durations for i, curve in enumerate(fleet)}
        with atomic_write(file, "wb") as stream:
            np.savez(stream, **arrays)
    return list(fleet), fleet.report.method if fleet.report else ""


def _key(show: Show, starts: FloatArray, goals: FloatArray) -> str:
    """Return a name of what is asked of a flight."""
    apart = show.separation
    radii = None if apart.radii is None else apart.radii.tolist()
    room = None if show.room is None else [np.asarray(corner).tolist() for corner in show.room]
    asked = (starts.tolist(), goals.tolist(), repr(show.limits), apart.distance, radii, apart.downwash, room, show.seed)
    return hashlib.sha256(repr(asked).encode()).hexdigest()[:24]


def _wait(point: FloatArray, duration: float) -> list[Trajectory]:
    return [Trajectory(np.tile(point, (1, 8, 1)), np.array([duration]))] if duration > 1e-9 else []


def _joined(parts: list[Trajectory]) -> Trajectory:
    """Return curves one after the other; all rest where they meet."""
    size = max(part.degree for part in parts)
    if any(part.degree != size for part in parts):
        raise FleetError("the flights of a show have different degrees")
    return Trajectory(
        np.concatenate([part.control_points for part in parts]), np.concatenate([part.durations for part in parts])
    )


def _lights(show: Show, stages: list[Stage]) -> Lights:
    """Return the colours of the acts, white until the first one, dark after the landing."""
    instants, colours, fades = [0.0], [(255, 255, 255)], [False]
    for act, stage in zip(show.acts, stages[1:], strict=False):
        if act.colour is None:
            continue
        if act.fade:
            instants.append(stage.start)
            colours.append(colours[-1])
            fades.append(False)
        instants.append(stage.arrival)
        colours.append(act.colour)
        fades.append(act.fade)
    instants, colours, fades = [*instants, stages[-1].end], [*colours, (0, 0, 0)], [*fades, False]
    return Lights(np.array(instants), np.array(colours, dtype=np.float64), np.array(fades))
