"""The command that surveys an area or a facade."""

from __future__ import annotations

from functools import partial
from math import radians
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import minsnap
from minsnap.cli import options
from minsnap.cli.app import command
from minsnap.cli.output import Destination
from minsnap.cli.planning import LimitOptions
from minsnap.errors import InputError

if TYPE_CHECKING:
    from minsnap.paths import Survey
    from minsnap.paths.routes import Terrain

Facade = tuple[float, float]


@command()
def survey(
    limits: LimitOptions,
    destination: Destination,
    file: Annotated[Path, "FILE", "Corners of the area: x,y in CSV or YAML, or a polygon in .kml; ends of a facade."],
    *,
    spacing: Annotated[float, "M", "Distance of neighbouring lines [m]."],
    height: Annotated[
        float | None, "M", "Of the lines; with --terrain above the highest ground below the flight."
    ] = None,
    angle: Annotated[float | None, "DEG", "Direction of the lines from x; by default that of the fewest."] = None,
    speed: Annotated[float | None, "M/S", "On the lines; by default 3, or --max-speed."] = None,
    margin: Annotated[float, "M", "How far lines go on beyond the area."] = 0.0,
    facade: Annotated[
        Facade | None, "LOW HIGH", "Cover a wall between two heights; FILE has the ends of its base."
    ] = None,
    distance: Annotated[float, "M", "With --facade: from the wall, to its left; to its right where negative."] = 0.0,
    terrain: Annotated[Path | None, "FILE", "Heights of the ground, a GeoTIFF or an ESRI ASCII grid."] = None,
    follow: Annotated[
        float | None, "M", "With --terrain: lines follow the ground, so many metres above and below --height at most."
    ] = None,
    yaw: options.Yaw = None,
    origin: options.Origin = None,
    within: options.Within = None,
) -> None:
    """Survey an area or a facade: straight lines at constant speed, and turns outside as quick as the limits allow.

    Lines are exactly straight and at exactly their speed. Turns are within 3 m/s, or the speed of the lines, 6 m/s^2
    and 30 m/s^3 unless limits are named, and stay beyond the ends of the lines.
    """
    from minsnap.paths import SURVEY
    from minsnap.paths.routes import read_terrain

    limits.refuse_idle()
    if (facade is None) == (height is None):
        raise InputError("give --height of the lines over an area, or --facade LOW HIGH in front of a wall")
    corners, place = _corners(file, origin)
    destination.check_mission(place, within)
    own = limits.limits
    how: dict[str, Any] = {"speed": speed, "limits": own, "margin": margin}
    if own is not None and speed is not None and "speed" not in options.limit_values(limits):
        from dataclasses import replace

        how["limits"] = replace(own, speed=speed if follow is None else SURVEY.climbing * speed)
    if facade is not None:
        for name, value in (("--angle", angle), ("--terrain", terrain), ("--follow", follow), ("--yaw", yaw)):
            if value is not None:
                raise InputError(f"{name} is of lines over an area: leave it out beside --facade")
        if len(corners) != 2:
            raise InputError(f"{file} has {len(corners)} places: a facade has two, the ends of its base")
        ends = corners[0], corners[1]
        found = minsnap.plan_facade(*ends, facade[0], facade[1], spacing, distance=distance, **how)
    else:
        if distance:
            raise InputError("--distance is from a wall: give --facade LOW HIGH with it")
        how |= {"angle": None if angle is None else radians(angle), "yaw": options.chosen_yaw(yaw or "velocity", None)}
        if follow is not None:
            if terrain is None:
                raise InputError("--follow is of the ground: give --terrain FILE with it")
            how |= {"terrain": read_terrain(terrain), "within": follow}
        found = minsnap.plan_survey(corners, spacing, height or 0.0, **how)
        if terrain is not None and follow is None:
            from dataclasses import replace

            ground = read_terrain(terrain)
            found = minsnap.plan_survey(corners, spacing, (height or 0.0) + _highest(found, ground), **how)
            found = replace(found, terrain=ground)
    lines = f"{len(found.lines)}, {found.on_lines:.0%} of the time at {found.speed:g} m/s"
    further = {"lines": lines, "survey": {"lines": found.lines.tolist(), "instants": found.spans.tolist()}}
    drawn = partial(minsnap.plot.plot_survey, found)
    destination.deliver(found.trajectory, limits=found.limits, further=further, draw=drawn, origin=place, within=within)


def _corners(file: Path, origin: options.Triple | None) -> tuple[Any, Any]:
    """Return the corners in a file, shape (n, 2), and the origin that they are about, if it is known."""
    from minsnap.files import is_mission, read_mission

    if file.suffix.lower() in (".kml", ".kmz"):
        import numpy as np

        from minsnap.files import local_positions, read_outline

        places = read_outline(file)
        home = (*places[0].tolist(), 0.0) if origin is None else origin
        return local_positions(np.column_stack([places, np.full(len(places), home[2])]), home)[:, :2], home
    if is_mission(file):
        mission = read_mission(file, origin)
        return mission.points[:, :2], tuple(mission.home.tolist())
    return minsnap.read_waypoints(file).points[:, :2], origin


def _highest(found: Survey, terrain: Terrain) -> float:
    """Return the highest ground in the rectangle that a flight lies in [m].

    Raises
    ------
    InputError
        If the grid does not cover it, or does not know it all.
    """
    import numpy as np

    points = found.trajectory.control_points[..., :2].reshape(-1, 2)
    reach = terrain.reach
    if (points.min(axis=0) < reach[0]).any() or (points.max(axis=0) > reach[1]).any():
        raise InputError(f"{terrain.name} does not cover the flight: it reaches from {reach[0]} to {reach[1]} m")
    first = np.floor((points.min(axis=0) - terrain.middle) / terrain.side).astype(int)
    last = np.ceil((points.max(axis=0) - terrain.middle) / terrain.side).astype(int) + 1
    heights = terrain.heights[first[0] : last[0], first[1] : last[1]]
    if np.isnan(heights).any():
        raise InputError(f"{terrain.name} does not know all heights below the flight")
    return float(heights.max())
