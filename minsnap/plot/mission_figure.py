"""A mission: its course with numbered waypoints and gates, and its profiles."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from minsnap.corridors.gates import Ball
from minsnap.paths.missions.mission import Mission
from minsnap.plot.figures import plot_overview
from minsnap.plot.style import styled

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


@styled
def plot_mission(
    mission: Mission, figure: Figure | None = None, *, view: str = "xy", title: str | None = None
) -> Figure:
    """Draw a mission, its waypoints and gates numbered in the order of the flight, beside its profiles.

    Parameters
    ----------
    mission : Mission
    figure : matplotlib Figure, optional
        Where to draw; a new one, that no window shows, unless given.
    view : str
        As :func:`plot_path` takes it; numbers are written where it is ``"xy"``.
    title : str, optional
        Written above; the course's name and the duration unless given.

    Returns
    -------
    matplotlib Figure
    """
    stops = mission.course.stops
    balls = Ball([stop.ball for stop in stops]) if any(stop.ball for stop in stops) else None
    how: dict[str, Any] = {"waypoints": mission.course.points or None, "tolerance": balls, "limits": mission.limits}
    name = title or f"{mission.course.name}: {mission.trajectory.duration:.2f} s"
    drawn = plot_overview(mission.trajectory, figure, view=view, title=name, **how)
    place, profiles = drawn.subfigs
    if view == "xy":
        _number(place.axes[0], mission)
    for axes in profiles.axes:
        for part in mission.parts[1:]:
            axes.axvline(part.start, color="#000000", linewidth=0.8, linestyle=":")
    return drawn


def _number(ax: Axes, mission: Mission) -> None:
    """Write the number of each waypoint beside it, all numbers of a place that is passed again."""
    numbers: dict[tuple[float, float], list[str]] = {}
    for number, stop in enumerate(mission.course.stops):
        numbers.setdefault((float(stop.center[0]), float(stop.center[1])), []).append(str(number))
    style: dict[str, Any] = {"xytext": (6, 6), "textcoords": "offset points", "fontsize": "small", "fontweight": "bold"}
    for place, here in numbers.items():
        ax.annotate(", ".join(here), place, zorder=8, **style)
