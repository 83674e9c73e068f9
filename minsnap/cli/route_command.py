"""The command that plans through a map."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from typer.core import TyperCommand

from minsnap.cli import options
from minsnap.cli.command import command
from minsnap.cli.output import Destination
from minsnap.cli.planning import TimingOptions, gain_of_auto_pieces
from minsnap.errors import InputError

if TYPE_CHECKING:
    from minsnap.paths.routes.plan_route import Route

POINT_OPTIONS = ("--start", "--goal")


class PointCommand(TyperCommand):
    """A command whose options ``--start`` and ``--goal`` take two or three numbers each."""

    def parse_args(self, context: Any, args: list[str]) -> list[str]:
        """Join the numbers after such an option to one text before the command reads them."""
        return super().parse_args(context, joined_points(args))


def joined_points(arguments: list[str]) -> list[str]:
    """Return the arguments with ``--start 1 -2`` written as ``--start=1,-2``."""
    joined: list[str] = []
    at = 0
    while at < len(arguments):
        word = arguments[at]
        at += 1
        count = 0
        while word in POINT_OPTIONS and at + count < len(arguments) and _is_number(arguments[at + count]):
            count += 1
        joined.append(f"{word}={','.join(arguments[at : at + count])}" if count else word)
        at += count
    return joined


def parse_point(option: str, text: str) -> tuple[float, ...]:
    """Return the coordinates of a point, two or three [m].

    Raises
    ------
    InputError
        If the text is not as many numbers.
    """
    words = text.split(",")
    if len(words) not in (2, 3) or not all(map(_is_number, words)):
        raise InputError(f"{option} is {text!r}: give X Y or X Y Z [m]")
    return tuple(map(float, words))


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


@dataclass(frozen=True)
class MapOptions:
    """How a map is read."""

    clearance: Annotated[float, "M", "Least distance to all that is occupied [m]."] = 0.3
    resolution: Annotated[float | None, "M", "Side of a cell of an array or a cloud [m]."] = None
    origin: Annotated[str | None, "X,Y[,Z]", "Corner of an array [m]; by default zero."] = None
    threshold: Annotated[float | None, "P", "Probability from which a cell is occupied."] = None
    unknown: Annotated[str, "Unknown cells are occupied or free."] = "occupied"
    altitudes: Annotated[tuple[float, float] | None, "LOW HIGH", "Cells to fly through [m]."] = None
    transpose: Annotated[bool, "The first axis of the array is y."] = False

    def arguments(self) -> dict[str, Any]:
        """Return the arguments of a route that the options name."""
        chosen = options.present(threshold=self.threshold, altitudes=self.altitudes, resolution=self.resolution)
        corner = None if self.origin is None else options.parse_numbers("--origin", self.origin)
        return chosen | options.present(origin=corner) | {"clearance": self.clearance, "unknown": self.unknown}


@command(cls=PointCommand)
def route(
    reading: MapOptions,
    timing: TimingOptions,
    destination: Destination,
    map_file: Annotated[Path, "MAP", "map_server YAML, .npy (axes x, y[, z]), .pcd, .ply or .xyz."],
    *,
    start: Annotated[str, "X Y [Z]", "Where to fly from [m]."],
    goal: Annotated[str, "X Y [Z]", "Where to fly to [m]."],
) -> None:
    """Plan from a start to a goal through the free cells of a map, at a distance from all that is occupied.

    Within 3 m/s and 6 m/s^2 in the shortest time found, unless a time or limits are given. Exit status 1 if no way is
    wide enough.
    """
    from minsnap.paths.routes.plan_route import plan_through
    from minsnap.planning.request import plan_arguments

    ends = parse_point("--start", start), parse_point("--goal", goal)
    arguments = reading.arguments() | timing.arguments() | destination.search
    planned = plan_through(_source(map_file, reading.transpose), *ends, **plan_arguments(arguments))
    shorter = gain_of_auto_pieces(
        partial(plan_through, _source(map_file, reading.transpose), *ends),
        arguments | {"limits": planned.limits},
        planned.trajectory,
    )
    figures = shorter | {"obstacle_distance": planned.distance, "obstacle_instant": planned.approach.instant}
    figures["altitude"] = 0.0 if planned.dim == 2 else None
    how: dict[str, Any] = {"corridor": planned.corridor, "limits": planned.limits, "further": figures}
    destination.deliver(planned.trajectory, **how, draw=lambda: _figure(planned, map_file, destination))


def _source(file: Path, transpose: bool) -> Any:
    if not transpose:
        return file
    if file.suffix.lower() != ".npy":
        raise InputError(f"--transpose is for arrays: {file} says which axis is which")
    from minsnap.paths.routes.map_files import read_array

    cells = read_array(file)
    return cells.swapaxes(0, 1) if cells.ndim > 1 else cells


def _figure(route: Route, file: Path, wanted: Destination) -> Any:
    from minsnap.plot.overviews import plot_route

    return plot_route(route, view=wanted.view or "xy", colour_by=wanted.colour_by, title=file.name)
