"""Overviews of missions, with numbered waypoints and gates, and of routes, on their maps."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from minsnap.basics.arrays import BoolArray, FloatArray
from minsnap.corridors import Avoided, Ball, Kept
from minsnap.paths import Survey
from minsnap.paths.missions import Mission
from minsnap.paths.routes import GridMap, Route
from minsnap.plot.figures import plot_overview
from minsnap.plot.map_scene import OCCUPIED, draw_ground, draw_in_space
from minsnap.plot.obstacles import Numbered, draw_obstacles
from minsnap.plot.style import LIMIT_COLOUR, Axes, Figure, dense_samples, legend_beside, styled

MOST_POINTS = 20_000
"""Points of a cloud that are drawn."""


@styled
def plot_mission(
    mission: Mission, figure: Figure | None = None, *, view: str = "xy", title: str | None = None, **drawn: Any
) -> Figure:
    """Draw a mission, its waypoints and gates numbered in the order of the flight, beside its profiles.

    Parameters
    ----------
    mission : Mission
    figure : matplotlib Figure, optional
        Where to draw; by default a new one, that no window shows.
    view : str
        As :func:`plot_path` takes it; numbers, and when and how fast gates are passed, are written where it is
        ``"xy"``.
    title : str, optional
        Written above; by default the course's name and the duration.
    **drawn
        What else :func:`plot_overview` takes, such as ``colour_by``.

    Returns
    -------
    matplotlib Figure
    """
    stops = mission.course.stops
    balls = Ball([stop.ball for stop in stops]) if any(stop.ball for stop in stops) else None
    how: dict[str, Any] = {"waypoints": mission.course.points or None, "tolerance": balls, "limits": mission.limits}
    how["avoid"] = mission.course.obstacles
    name = title or f"{mission.course.name}: {mission.trajectory.duration:.2f} s"
    overview = plot_overview(mission.trajectory, figure, view=view, title=name, **how, **drawn)
    place, profiles = overview.subfigs
    if view == "xy":
        _number(place.axes[0], mission)
    _mark_gates(profiles.axes, mission)
    for axes in profiles.axes:
        for part in mission.parts[1:]:
            axes.axvline(part.start, color="#000000", linewidth=0.8, linestyle=":")
    return overview


def _mark_gates(stack: Sequence[Axes], mission: Mission) -> None:
    """Mark when each gate is passed, with its number above the first of the curves against time."""
    for passed in mission.gate_passages():
        for ax in stack:
            ax.axvline(passed.instant, color="#999999", linewidth=0.6)
        above: dict[str, Any] = {"xycoords": ("data", "axes fraction"), "fontsize": "x-small", "ha": "center"}
        stack[0].annotate(str(passed.gate), (passed.instant, 1.02), **above)


def _number(ax: Axes, mission: Mission) -> None:
    """Write the number of each waypoint beside it, all of a place that is passed again, and how a gate is passed."""
    numbers: dict[tuple[float, float], list[str]] = {}
    for number, stop in enumerate(mission.course.stops):
        numbers.setdefault((float(stop.center[0]), float(stop.center[1])), []).append(str(number))
    style: dict[str, Any] = {"textcoords": "offset points", "fontsize": "small", "fontweight": "bold"}
    left, right = ax.get_xlim()
    passages = {passed.gate: passed for passed in reversed(mission.gate_passages())}
    for place, here in numbers.items():
        first = passages.get(int(here[0]))
        how = "" if first is None else f"\n{first.instant:.2f} s, {first.speed:.1f} m/s"
        beside = ("left", 6) if right - place[0] > 0.2 * (right - left) else ("right", -6)
        ax.annotate(", ".join(here) + how, place, (beside[1], 6), zorder=8, ha=beside[0], **style)


@styled
def plot_route(
    route: Route, figure: Figure | None = None, *, view: str = "xy", title: str | None = None, **drawn: Any
) -> Figure:
    """Draw a route on its map, with position, derivatives and use of limits against time.

    From above, the occupied cells are drawn. Of a map in space they are those that are occupied at an altitude at which
    the path passes, or nearer to it than the clearance. In space, what is near the path is drawn.

    Parameters
    ----------
    route : Route
    figure : matplotlib Figure, optional
        Where to draw; by default a new one, that no window shows.
    view : str
        As :func:`plot_path` takes it.
    title : str, optional
        Written above, with the least distance to an occupied cell.
    **drawn
        What else :func:`plot_overview` takes, such as ``colour_by``.

    Returns
    -------
    matplotlib Figure
    """
    nearest = f"{route.distance:.3f} m from what is occupied" if np.isfinite(route.distance) else "nothing occupied"
    name = nearest if title is None else f"{title}: {nearest}"
    how: dict[str, Any] = {"corridor": route.corridor, "limits": route.limits, "title": name}
    overview = plot_overview(route.trajectory, figure, view=view, **how, **drawn)
    if view == "xy":
        plane: Any = overview.subfigs[0].axes[0]
        if route.grid is not None:
            draw_cells(plane, route.grid, route.clearance, dense_samples(route.trajectory).position)
            _draw_nearest(plane, route, route.grid)
        elif isinstance(route.around, Kept):
            _draw_kept(plane, route.around, dense_samples(route.trajectory).position)
        legend_beside(plane)
    elif view == "3d":
        space: Any = overview.subfigs[0].axes[0]
        draw_in_space(space, route.around, dense_samples(route.trajectory).position, route.clearance)
        space.legend(loc="upper left", handlelength=1.8)
    return overview


def _draw_kept(ax: Axes, kept: Kept, position: FloatArray) -> None:
    """Draw obstacles, points and prisms from above, near the path."""
    limits = ax.get_xlim(), ax.get_ylim()
    prisms = () if kept.prisms is None else kept.prisms.prisms
    shown: list[Avoided] = [*(Numbered(numbers) for numbers in kept.obstacles), *prisms]
    draw_obstacles(ax, shown, (0, 1), position[:, :2])
    points = kept.points[:: max(1, len(kept.points) // MOST_POINTS)]
    if len(points):
        ax.plot(*points[:, :2].T, ".", color=OCCUPIED, markersize=2.0, label="points", zorder=0.7)
    ax.set(xlim=limits[0], ylim=limits[1])


def draw_cells(ax: Axes, grid: GridMap, clearance: float, position: FloatArray) -> None:
    """Draw the occupied cells of a map from above, as a picture."""
    from matplotlib.colors import ListedColormap

    cells = grid.occupied if grid.dim == 2 else _passed(grid, clearance, position).any(axis=2)
    (left, bottom), (right, top) = grid.lower[:2], grid.upper[:2]
    style: dict[str, Any] = {"cmap": ListedColormap([OCCUPIED]), "interpolation": "nearest", "zorder": 0.7}
    shown = np.ma.masked_where(~cells.T, np.ones(cells.T.shape))
    limits = ax.get_xlim(), ax.get_ylim()
    ax.imshow(shown, origin="lower", extent=(left, right, bottom, top), **style)
    ax.set(xlim=_within(limits[0], left, right), ylim=_within(limits[1], bottom, top))


def _within(shown: tuple[float, float], low: float, high: float) -> tuple[float, float]:
    """Return limits that show the path and the map around it, up to a half of the path's extent."""
    margin = 0.5 * (shown[1] - shown[0])
    return min(shown[0], max(low, shown[0] - margin)), max(shown[1], min(high, shown[1] + margin))


def _passed(grid: GridMap, clearance: float, position: FloatArray) -> BoolArray:
    """Return the layers of a map in space that the path passes, and those within the clearance."""
    low, high = position[:, 2].min() - clearance, position[:, 2].max() + clearance
    edges = grid.lower[2] + grid.resolution[2] * np.arange(grid.occupied.shape[2] + 1)
    return np.asarray(grid.occupied[:, :, (edges[1:] > low) & (edges[:-1] < high)])


def _draw_nearest(ax: Axes, route: Route, grid: GridMap) -> None:
    """Draw a line from the path to the occupied cell that it comes nearest to."""
    approach = route.approach
    if approach.instant is None or approach.cell is None:
        return
    place = route.trajectory(approach.instant)[:2]
    low = grid.lower[:2] + grid.resolution[:2] * np.array(approach.cell[:2])
    there = np.clip(place, low, low + grid.resolution[:2])
    line = np.stack((place, there), axis=1)
    ax.plot(*line, color=LIMIT_COLOUR, linewidth=1.5, label="nearest", zorder=7)


@styled
def plot_survey(
    survey: Survey, figure: Figure | None = None, *, view: str | None = None, title: str | None = None, **drawn: Any
) -> Figure:
    """Draw a survey: the area or wall, its lines and its turns, and the ground where it is known, beside the profiles.

    Parameters
    ----------
    survey : Survey
    figure : matplotlib Figure, optional
        Where to draw; by default a new one, that no window shows.
    view : str, optional
        As :func:`plot_path` takes it; by default from above, and from the side of a wall along an axis.
    title : str, optional
        Written above; by default the lines and the duration.
    **drawn
        What else :func:`plot_overview` takes, such as ``colour_by``.

    Returns
    -------
    matplotlib Figure
    """
    count = len(survey.lines)
    name = title or f"{count} line{'s' * (count > 1)} at {survey.speed:g} m/s: {survey.trajectory.duration:.1f} s"
    seen = view or "xy"
    how: dict[str, Any] = {"waypoints": survey.lines.reshape(-1, 3), "limits": survey.limits}
    overview = plot_overview(survey.trajectory, figure, view=seen, title=name, **how, **drawn)
    place, profiles = overview.subfigs
    if seen != "3d":
        _draw_lines(place.axes[0], survey, ["xyz".index(letter) for letter in seen])
        for axis in profiles.axes:
            for start, end in survey.spans:
                axis.axvspan(start, end, color="#0072b2", alpha=0.08, linewidth=0.0)
    if survey.terrain is not None:
        for ax, letters in zip(place.axes, (seen, "xz"), strict=False):
            draw_ground(ax, survey.terrain, letters, dense_samples(survey.trajectory).position)
    return overview


def _draw_lines(ax: Axes, survey: Survey, axes: list[int]) -> None:
    """Draw what is covered, and the lines, in a plane that reaches around both."""
    around = np.concatenate([survey.outline, survey.outline[:1]])[:, axes]
    ax.plot(*around.T, color="#555555", linewidth=1.2, linestyle="--", zorder=1)
    for line in survey.lines:
        ax.plot(*line[:, axes].T, color="#0072b2", linewidth=4.0, alpha=0.35, zorder=1, solid_capstyle="butt")
    (left, right), (low, high) = ax.get_xlim(), ax.get_ylim()
    room = 0.02 * max(right - left, high - low)
    (least, lowest), (most, highest) = around.min(axis=0) - room, around.max(axis=0) + room
    ax.set_xlim(min(left, least), max(right, most))
    ax.set_ylim(min(low, lowest), max(high, highest))
