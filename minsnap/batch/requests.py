"""The arguments of ``plan`` for every problem of a batch: drawn by a generator, or read from a table."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray, lengths_of
from minsnap.batch.problem_table import DRAWN, read_cells
from minsnap.batch.random_maps import boxes
from minsnap.batch.ranges import Range, draws_of, seed_of
from minsnap.batch.spec import LIMITS, Spec
from minsnap.corridors.gates import Gate
from minsnap.errors import InputError
from minsnap.files.limits_in_files import limits_of
from minsnap.limits.limits import Limits
from minsnap.vehicle.named import named_vehicle

Shape = Mapping[str, Range]


@dataclass(frozen=True, eq=False)
class DrawnProblem:
    """One problem.

    Parameters
    ----------
    number : int
        Its place in the batch.
    seed : int
        What its random numbers come from.
    arguments : mapping
        Arguments of ``plan`` by name.
    vehicle : str or None
        The preset whose rotors' limits are among them.
    """

    number: int
    seed: int
    arguments: Mapping[str, Any]
    vehicle: str | None = None


def request(spec: Spec, number: int) -> DrawnProblem:
    """Return a problem of a batch; it depends on the specification and on its number.

    Raises
    ------
    MinsnapError
        If a map has no way through it, or a row of a table cannot be read.
    """
    if not 0 <= number < spec.count:
        raise InputError(f"problem {number} is not one of the {spec.count} of this batch")
    seed = seed_of(spec.seed, number)
    rng = draws_of(seed)
    own = _from_table(spec, number) if spec.table else GENERATORS[spec.source](spec.shape, spec.dim, rng)
    arguments = dict(spec.fixed) | {name: spec.drawn[name].draw(rng) for name in DRAWN if name in spec.drawn}
    bounds: dict[str, Any] = {name: spec.limits[name].draw(rng) for name in LIMITS if name in spec.limits}
    vehicle = str(rng.choice(spec.vehicles)) if spec.vehicles else None
    if vehicle is not None:
        arguments["limits"] = Limits.of(named_vehicle(vehicle), **bounds)
    elif bounds:
        arguments["limits"] = Limits(**bounds)
    if {"total_time", "time_weight", "limits"} & arguments.keys():
        own.pop("durations", None)
    return DrawnProblem(number, seed, arguments | own, vehicle)


def _from_table(spec: Spec, number: int) -> dict[str, Any]:
    cells = read_cells(spec.table, number)
    if "limits" in cells:
        cells["limits"] = limits_of(f"row {number}: limits", cells["limits"], Path(spec.table).parent)
    if isinstance(cells.get("pins"), dict):
        cells["pins"] = {int(waypoint): state for waypoint, state in cells["pins"].items()}
    return cells


def walks(shape: Shape, dim: int, rng: np.random.Generator) -> dict[str, Any]:
    """Legs of random lengths in directions that are equally likely; durations from a speed."""
    count = shape["legs"].whole(rng)
    points, lengths = _walk(count, dim, shape["step"], rng)
    return {"waypoints": points, "durations": _durations(lengths, shape, rng)}


def gates(shape: Shape, dim: int, rng: np.random.Generator) -> dict[str, Any]:
    """Return a walk whose inner waypoints are square gates that face the next one."""
    count = shape["legs"].whole(rng)
    points, lengths = _walk(count, dim, shape["step"], rng)
    sides = shape["opening"].draws(rng, count - 1)
    inner = [Gate(points[i + 1], points[i + 2] - points[i], side) for i, side in enumerate(sides.tolist())]
    return {"waypoints": [points[0], *inner, points[-1]], "durations": _durations(lengths, shape, rng)}


def in_maps(shape: Shape, dim: int, rng: np.random.Generator) -> dict[str, Any]:
    """Boxes of free space along a way through a random map; durations from a speed."""
    world = boxes(
        {name: value.draw(rng) for name, value in shape.items() if name not in ("speed", "stretch")}, dim, rng
    )
    ways = {"waypoints": None, "corridor": world.boxes, "start": world.start, "end": world.end}
    return ways | {"durations": _durations(lengths_of(world.waypoints), shape, rng)}


def _walk(legs: int, dim: int, step: Range, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    """Return points (legs + 1, dim) [m] and lengths (legs,) [m]."""
    directions = rng.normal(size=(legs, dim))
    directions /= np.sqrt((directions * directions).sum(axis=1))[:, None]
    lengths = step.draws(rng, legs)
    points = np.zeros((legs + 1, dim))
    np.cumsum(directions * lengths[:, None], axis=0, out=points[1:])
    return points, lengths


def _durations(lengths: FloatArray, shape: Shape, rng: np.random.Generator) -> FloatArray:
    """Return durations of legs: lengths at one speed, each stretched by a factor of its own."""
    speed = shape["speed"].draw(rng)
    return np.asarray(lengths / speed * shape["stretch"].draws(rng, len(lengths)))


GENERATORS: Mapping[str, Callable[[Shape, int, np.random.Generator], dict[str, Any]]] = {
    "walks": walks,
    "gates": gates,
    "boxes": in_maps,
}
