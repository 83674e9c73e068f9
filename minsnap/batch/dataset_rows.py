"""One row of a dataset: a problem drawn or read from a table, planned and certified, or what was wrong with it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from minsnap.basics.arrays import BoolArray, FloatArray, IntArray, lengths_of, numbers
from minsnap.basics.checks import is_number
from minsnap.batch.spec import DRAWN, LIMITS, Range, Spec, draws_of, read_cells, seed_of
from minsnap.certificate import certify
from minsnap.corridors import Boxes, Gate, GridCorridor, center_of, corridor_from_grid, free_cells
from minsnap.errors import CorridorError, InfeasibleError, InputError, MinsnapError, UnprovedError
from minsnap.files import limits_of
from minsnap.limits import Limits
from minsnap.planning import plan, plan_arguments
from minsnap.trajectory import Trajectory
from minsnap.vehicle import named_vehicle


@dataclass(frozen=True)
class DrawSettings:
    """What maps are drawn, and what is kept of an error.

    Parameters
    ----------
    cells : int
        Cells of the largest map.
    attempts : int
        Maps that are drawn until one has a way from one side to the other.
    longest : int
        Longest side of a block, in cells.
    sentence : int
        Characters of an error's sentence that are kept.
    """

    cells: int = 2_000_000
    attempts: int = 20
    longest: int = 8
    sentence: int = 500


DRAWING = DrawSettings()


def boxes(shape: Mapping[str, float], dim: int, rng: np.random.Generator) -> GridCorridor:
    """Draw maps until one can be crossed along x, and return boxes along a shortest way.

    Parameters
    ----------
    shape : mapping
        ``extent`` along x and y, ``height`` along z, side of a ``cell``, ``clearance`` [m]; ``occupied``, the share of
        the map that blocks cover.
    dim : int
        2 or 3.

    Raises
    ------
    CorridorError
        If no map has a way through, or a map has too many cells.
    """
    cell = shape["cell"]
    sides = np.array([shape["extent"], shape["extent"], shape["height"]][:dim])
    cells = np.maximum(np.ceil(sides / cell), 2).astype(np.intp)
    if cells.prod() > DRAWING.cells:
        raise CorridorError(f"a map of {int(cells.prod())} cells is too large: take larger cells, or a smaller extent")
    for _ in range(DRAWING.attempts):
        taken = blocks(cells, shape["occupied"], rng)
        free = free_cells(taken, cell, shape["clearance"])
        way = shortest_way(free, rng)
        if len(way) > 1:
            return corridor_from_grid(taken, cell, (way + 0.5) * cell, clearance=shape["clearance"])
    raise CorridorError(
        f"none of {DRAWING.attempts} random maps has a way through it: lower occupied, or the clearance"
    )


def blocks(cells: IntArray, share: float, rng: np.random.Generator) -> BoolArray:
    """Return a grid in which random blocks cover at least a share of the cells."""
    taken = np.zeros(tuple(cells), dtype=bool)
    while taken.mean() < share:
        low = rng.integers(0, cells)
        size = rng.integers(1, np.minimum(DRAWING.longest, cells), endpoint=True)
        taken[tuple(slice(a, a + b) for a, b in zip(low, size, strict=True))] = True
    return taken


def shortest_way(free: BoolArray, rng: np.random.Generator) -> IntArray:
    """Return cells (m, dim) from a random free cell at the low end of x to the high end; none where there is no way.

    Breadth first, over faces of cells; of several shortest ways always the same one.
    """
    starts = np.argwhere(free[0])
    if not len(starts):
        return np.zeros((0, free.ndim), dtype=np.intp)
    start = np.concatenate(([0], starts[rng.integers(len(starts))]))
    steps = _distances(free, start)
    ends = np.argwhere(steps[-1] >= 0)
    if not len(ends):
        return np.zeros((0, free.ndim), dtype=np.intp)
    return _back(steps, np.concatenate(([free.shape[0] - 1], ends[rng.integers(len(ends))])))


def _distances(free: BoolArray, start: IntArray) -> IntArray:
    """Return steps from a cell to each; -1 where there is no way."""
    from scipy.ndimage import binary_dilation

    steps = np.full(free.shape, -1, dtype=np.intp)
    front = np.zeros(free.shape, dtype=bool)
    front[tuple(start)] = True
    count = 0
    while front.any():
        steps[front] = count
        count += 1
        front = binary_dilation(front) & free & (steps < 0)  # to cells that share a face
    return steps


def _back(steps: IntArray, end: IntArray) -> IntArray:
    """Follow falling distances from a cell to where they are zero, and return the way in its own direction."""
    way = [end]
    moves = np.concatenate((np.eye(steps.ndim, dtype=np.intp), -np.eye(steps.ndim, dtype=np.intp)))
    while steps[tuple(way[-1])] > 0:
        wanted = steps[tuple(way[-1])] - 1
        near = way[-1] + moves
        inside = near[((near >= 0) & (near < steps.shape)).all(axis=1)]
        way.append(next(cell for cell in inside if steps[tuple(cell)] == wanted))
    return np.array(way[::-1])


Shape = Mapping[str, Range]


STATUSES = ("done", "infeasible", "unsolved", "invalid", "timeout", "crashed")
"""Planned; no curve meets everything; the solvers failed; malformed; too slow; the process or the code failed."""

REQUESTED = ("waypoint_tolerance", "total_time", "time_weight")
"""Numbers in a problem's request, as columns."""

PLANNED = ("dim", "legs", "degree", "pieces", "durations", "control_points", "duration")
"""What a trajectory says of itself."""

PROVED = ("corridor_margin", "max_speed", "max_acceleration", "max_jerk", "max_snap")
"""What a certificate says of it."""

Row = dict[str, Any]
"""Values by column; a column that is not named is null."""


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
    points, lengths = _walk(shape, dim, rng)
    return {"waypoints": points, "durations": _durations(lengths, shape, rng)}


def gates(shape: Shape, dim: int, rng: np.random.Generator) -> dict[str, Any]:
    """Return a walk whose inner waypoints are square gates that face the next one."""
    points, lengths = _walk(shape, dim, rng)
    sides = shape["opening"].draw(rng, len(lengths) - 1)
    inner = [Gate(points[i + 1], points[i + 2] - points[i], side) for i, side in enumerate(sides.tolist())]
    return {"waypoints": [points[0], *inner, points[-1]], "durations": _durations(lengths, shape, rng)}


def in_maps(shape: Shape, dim: int, rng: np.random.Generator) -> dict[str, Any]:
    """Boxes of free space along a way through a random map; durations from a speed."""
    drawn = {name: value.draw(rng) for name, value in shape.items() if name not in ("speed", "stretch")}
    world = boxes(drawn, dim, rng)
    ways = {"waypoints": None, "corridor": world.boxes, "start": world.start, "end": world.end}
    return ways | {"durations": _durations(lengths_of(world.waypoints), shape, rng)}


def _walk(shape: Shape, dim: int, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    """Return points (legs + 1, dim) [m] and lengths (legs,) [m]."""
    legs = shape["legs"].whole(rng)
    directions = rng.normal(size=(legs, dim))
    directions /= np.sqrt((directions * directions).sum(axis=1))[:, None]
    lengths = shape["step"].draw(rng, legs)
    points = np.zeros((legs + 1, dim))
    np.cumsum(directions * lengths[:, None], axis=0, out=points[1:])
    return points, lengths


def _durations(lengths: FloatArray, shape: Shape, rng: np.random.Generator) -> FloatArray:
    """Return durations of legs: lengths at one speed, each stretched by a factor of its own."""
    speed = shape["speed"].draw(rng)
    return np.asarray(lengths / speed * shape["stretch"].draw(rng, len(lengths)))


GENERATORS = {"walks": walks, "gates": gates, "boxes": in_maps}


def planned_row(spec: Spec, number: int) -> Row:
    """Plan a problem and return its columns; whatever fails becomes its status and sentence."""
    row: Row = {"problem": number, "seed": seed_of(spec.seed, number)}
    try:
        problem = request(spec, number)
        row |= _question(problem)
        asked = plan_arguments(problem.arguments)
        row |= _answer(asked, plan(**asked))
    except MinsnapError as error:
        row |= {"status": _status(error), "error": str(error)[: DRAWING.sentence]}
    except Exception as error:
        row |= {"status": "crashed", "error": f"{type(error).__name__}: {error}"[: DRAWING.sentence]}
    return row


def stopped_row(spec: Spec, number: int, status: str, error: str) -> Row:
    """Return the row of a problem whose process had to be stopped, or ended by itself."""
    return {"problem": number, "seed": seed_of(spec.seed, number), "status": status, "error": error}


def _status(error: MinsnapError) -> str:
    if isinstance(error, InfeasibleError):
        return "unsolved" if isinstance(error, UnprovedError) else "infeasible"
    return "invalid" if isinstance(error, InputError) else "unsolved"


def _question(problem: DrawnProblem) -> Row:
    """Columns of the problem itself, as far as it is one of numbers."""
    arguments = problem.arguments
    row: Row = {"vehicle": problem.vehicle}
    row |= {name: arguments[name] for name in REQUESTED if is_number(arguments.get(name))}
    if isinstance(arguments.get("limits"), Limits):
        row |= {f"limit_{name}": getattr(arguments["limits"], name) for name in LIMITS}
    waypoints = _points(arguments.get("waypoints"))
    if waypoints is not None:
        row |= {"waypoints": waypoints, "dim": waypoints.shape[1], "legs": len(waypoints) - 1}
        row["gates"] = _corners(arguments["waypoints"], waypoints.shape[1])
    corridor = arguments.get("corridor")
    if isinstance(corridor, Boxes):
        row["boxes"] = np.stack((corridor.lower, corridor.upper), axis=1)
    elif corridor is not None:
        row["corridor"] = numbers(corridor)
    return row


def _points(waypoints: Any) -> FloatArray | None:
    """Waypoints as (n, dim), a gate by its center; None where they are malformed or the corridor's."""
    if not isinstance(waypoints, (list, np.ndarray)) or not len(waypoints):
        return None
    points = numbers(list(map(center_of, waypoints)))
    return points if points is not None and points.ndim == 2 else None


def _corners(waypoints: Any, dim: int) -> FloatArray | None:
    """Corners of gates (waypoints, corners, dim), not numbers at points; None without gates."""
    gates = [point.corners if isinstance(point, Gate) else None for point in waypoints]
    if all(gate is None for gate in gates):
        return None
    blank = np.full((4 if dim == 3 else 2, dim), np.nan)
    return np.array([blank if gate is None else gate for gate in gates])


def _answer(asked: Mapping[str, Any], curve: Trajectory) -> Row:
    kept = {name: asked[name] for name in ("waypoints", "corridor", "limits") if name in asked}
    proof = certify(curve, **kept, tolerance=asked.get("waypoint_tolerance", 0.0))
    own = {name: getattr(curve, name) for name in PLANNED} | {name: getattr(proof, name) for name in PROVED}
    return own | {"status": "done", "cost": curve.cost(), "certified": proof.ok}
