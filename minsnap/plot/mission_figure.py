"""A mission: its course with numbered waypoints and gates, and its profiles."""

from __future__ import annotations

from collections.abc import Sequence
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
    mission: Mission,
    figure: Figure | None = None,
    *,
    view: str = "xy",
    colour_by: str | None = None,
    title: str | None = None,
) -> Figure:
    """Draw a mission, its waypoints and gates numbered in the order of the flight, beside its profiles.

    Parameters
    ----------
    mission : Mission
    figure : matplotlib Figure, optional
        Where to draw; by default a new one, that no window shows.
    view, colour_by
        As :func:`plot_path` takes them; numbers, and when and how fast gates are passed, are written where the view is
        ``"xy"``.
    title : str, optional
        Written above; by default the course's name and the duration.

    Returns
    -------
    matplotlib Figure
    """
    stops = mission.course.stops
    balls = Ball([stop.ball for stop in stops]) if any(stop.ball for stop in stops) else None
    how: dict[str, Any] = {"waypoints": mission.course.points or None, "tolerance": balls, "limits": mission.limits}
    name = title or f"{mission.course.name}: {mission.trajectory.duration:.2f} s"
    drawn = plot_overview(mission.trajectory, figure, view=view, colour_by=colour_by, title=name, **how)
    place, profiles = drawn.subfigs
    if view == "xy":
        _number(place.axes[0], mission)
    _mark_gates(profiles.axes, mission)
    for axes in profiles.axes:
        for part in mission.parts[1:]:
            axes.axvline(part.start, color="#000000", linewidth=0.8, linestyle=":")
    return drawn


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
