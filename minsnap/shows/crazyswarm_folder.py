"""What lies beside the trajectories of a crazyswarm2 folder: who flies them, a script, and its ways, proved apart."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.storage.text import FileName, load_yaml, reading
from minsnap.errors import FileError
from minsnap.files.formats import MAX_PIECES, crazyflie
from minsnap.fleet import (
    GOES,
    LANDS,
    TAKES_OFF,
    Fleet,
    FleetApproach,
    WayStage,
    WayTimes,
    approach_of,
    find_standing_places,
)
from minsnap.shows.memory_parts import PIECE, MemoryPart, curves_of, parts_of
from minsnap.trajectory import Trajectory

MOST_ADDRESSES = 255
"""Vehicles that an address can tell apart."""

ROBOTS, SCRIPT, WAYS, PARTS = "crazyflies.yaml", "fly.py", "ways.yaml", "parts"
MARK = "minsnap ways"

CALLS = {TAKES_OFF: "takeoff", GOES: "goTo", LANDS: "land"}
"""What crazyswarm2 calls the moves."""

ASIDE = 1e-9
"""A vehicle stands beside its start if it is further from it than this, seen from above [m]."""


def refuse_long(flights: Sequence[tuple[str, Sequence[Trajectory]]]) -> None:
    """Raise FileError if flights that follow each other, each with its name, do not fit a memory together."""
    counts = [np.array([_moving_pieces(curve) for curve in curves] or [0]) for _, curves in flights]
    most = int(np.max(sum(np.broadcast_arrays(*counts)))) if counts else 0
    if most > MAX_PIECES:
        names = " and ".join(repr(name) for name, _ in flights)
        text = f"the flight to {names} takes {most} pieces, and a Crazyflie's memory holds {MAX_PIECES} at once"
        raise FileError(f"{text}: write it --to csv, which minsnap upload flies in the compressed form too")


def _moving_pieces(curve: Trajectory) -> int:
    return int(np.ptp(curve.control_points, axis=1).any(axis=1).sum())


def refuse_many(vehicles: int) -> None:
    """Raise FileError if there are more vehicles than addresses."""
    if vehicles > MOST_ADDRESSES:
        raise FileError(f"{vehicles} vehicles: one radio network of crazyswarm2 tells {MOST_ADDRESSES} apart")


@dataclass(frozen=True)
class Robot:
    """A vehicle of ``crazyflies.yaml``.

    Parameters
    ----------
    name, uri : str
    place : tuple of 3, or None
        Its ``initial_position`` [m].
    """

    name: str
    uri: str
    place: tuple[float, float, float] | None


def read_robots(folder: FileName) -> list[Robot]:
    """Return the robots of a folder that are enabled, in their order.

    Raises
    ------
    FileError
        If it has no ``crazyflies.yaml``, or another file of that name.
    """
    file = Path(folder) / ROBOTS
    if not file.exists():
        raise FileError(f"{folder} has no {ROBOTS}, as fleet --to crazyswarm2 writes it: give --uri for each vehicle")
    with reading(file, "a file of robots"):
        robots: dict[str, Any] = load_yaml(file)["robots"]
        return [
            Robot(name, str(each["uri"]), _place(each.get("initial_position")))
            for name, each in robots.items()
            if each.get("enabled", True)
        ]


def _place(position: list[float] | None) -> tuple[float, float, float] | None:
    if position is None:
        return None
    x, y, z = (float(value) for value in (*position, 0.0)[:3])
    return x, y, z


def places_of(fleet: Fleet, robots: list[Robot]) -> FloatArray:
    """Return where vehicles stand, (vehicles, 3) [m]: as their file says, else as ``find_standing_places``."""
    places = find_standing_places(fleet)
    for number, robot in enumerate(robots[: len(fleet)]):
        if robot.place is not None:
            places[number] = robot.place
    return places


def crazyswarm_files(fleet: Fleet, acts: Sequence[tuple[str, float]] = ()) -> tuple[dict[str, str], tuple[str, ...]]:
    """Return the files beside ``traj0.csv``, ``traj1.csv``, ... and what is to be said of them.

    They are ``crazyflies.yaml`` (fileversion 3), ``fly.py``, and ``ways.yaml``, the ways that it flies; in ``parts``
    those of each trajectory that are flown from rest to rest, where it does not fit a memory. A vehicle
    stands below the start of its trajectory, or beside another that stands there.

    Parameters
    ----------
    fleet : Fleet
    acts : sequence of (str, float)
        Names, and when they are reached [s].

    Raises
    ------
    FileError
        If there are more vehicles than addresses, or two flights one after the other do not fit a memory.
    FleetError
        If no ways to the starts and to the ground are proved apart.
    """
    refuse_many(len(fleet))
    places = find_standing_places(fleet)
    approach = approach_of(fleet, places)
    aside = np.flatnonzero(np.linalg.norm(places[:, :2] - fleet(0.0)[:, :2], axis=1) > ASIDE)
    robots = ""
    for number, (x, y, z) in enumerate(
        places.tolist()
    ):  # 20 share a channel; the last byte of an address is the number
        uri = f"radio://0/{80 + 10 * (number // 20 % 4)}/2M/E7E7E7E7{number + 1:02X}"
        robots += f"  cf{number + 1}:\n    enabled: true\n    uri: {uri}\n    initial_position: [{x!r}, {y!r}, {z!r}]\n"
        robots += "    type: cf21  # see robot_types\n"
    templates = Path(__file__).with_name("crazyswarm2")
    script, described = ((templates / f"{name}.txt").read_text(encoding="utf-8") for name in (SCRIPT, ROBOTS))
    names = [f"cf{number + 1}" for number in range(len(fleet))]
    files = {ROBOTS: described.format(robots=robots), SCRIPT: script, **flown_files(fleet, names, approach, acts)}
    which = ", ".join(f"cf{number + 1}" for number in aside)
    stand = f"others stand below the starts of {which}: stand all where {ROBOTS} says"
    return files, (*([stand] if len(aside) else []), *approach.sentences(fleet))


def flown_files(
    fleet: Fleet, names: list[str], approach: FleetApproach, acts: Sequence[tuple[str, float]] = ()
) -> dict[str, str]:
    """Return what the script flies: ``ways.yaml``, and the trajectories of parts where there are several."""
    parts = parts_of(fleet, acts, plain=True)
    files = {WAYS: ways_text(fleet, names, approach, parts)}
    for number, part in enumerate(parts if len(parts) > 1 else []):
        texts = (crazyflie.crazyflie_text(curve, MAX_PIECES) for curve in curves_of(fleet, part))
        files |= {_file_of(number, i): text for i, text in enumerate(texts)}
    return files


def _file_of(part: int, vehicle: int) -> str:
    return f"{PARTS}/{part}_traj{vehicle}.csv"


def _told_parts(parts: Sequence[MemoryPart]) -> list[dict[str, Any]]:
    """Return what the script uploads and starts: at which piece of each memory a part lies, and when it begins."""
    alone, told = len(parts) == 1, []
    for number, part in enumerate(parts):
        files = [f"traj{i}.csv" if alone else _file_of(number, i) for i in range(len(part.uploads))]
        first = [each.offset // PIECE for each in part.uploads]
        times = {"begins": part.begins, "ends": part.ends}
        told.append({**times, "number": part.slot - 1, "files": files, "first_pieces": first})
    return told


def ways_text(fleet: Fleet, names: list[str], approach: FleetApproach, parts: Sequence[MemoryPart]) -> str:
    """Return the content of ``ways.yaml``: what the script tells the vehicles of these names, stage after stage."""
    yaws = np.array([curve.yaw(np.array([0.0, curve.duration])) for curve in fleet]).T.tolist()
    times, near = WayTimes(), approach.nearest
    highest = max(approach.highest, *(float(curve.control_points[..., 2].max()) for curve in fleet))
    content = {
        "format": MARK,
        "version": 1,
        "nearest": None if near is None else near.distance,
        "separation": None if near is None else near.required,
        "vehicles": names,
        "places": approach.places.tolist(),
        "there": [_told(stage, names, yaws[0]) for stage in approach.there],
        "duration": fleet.duration,
        "parts": _told_parts(parts),
        "back": [_told(stage, names, yaws[1]) for stage in approach.back],
        "settle": times.settle,
        "descent": times.lasting(times.landing, highest, times.sink),
    }
    import yaml

    return str(yaml.safe_dump(content, sort_keys=False, default_flow_style=None, width=200))


def _told(stage: WayStage, names: list[str], yaws: list[float]) -> dict[str, Any]:
    moves = [
        {"vehicle": names[i], "call": CALLS[move.kind], "goal": list(move.goal), "yaw": yaws[i]}
        for i, move in sorted(stage.moves.items())
    ]
    return {"seconds": stage.seconds, "moves": moves}
