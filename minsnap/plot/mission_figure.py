"""A mission: its course with numbered waypoints and gates, and its profiles."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from minsnap.corridors.gates import Ball
from minsnap.missions.mission import Mission
from minsnap.plot.geometry import plot_path
from minsnap.plot.profiles import available_orders, plot_profiles
from minsnap.plot.style import dense_samples

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def plot_mission(mission: Mission, figure: Figure | None = None, *, title: str | None = None) -> Figure:
    """Draw a mission from above, its waypoints and gates numbered in the order of the flight, beside its profiles.

    Parameters
    ----------
    mission : Mission
    figure : matplotlib Figure, optional
        Where to draw; a new one, that no window shows, unless given.
    title : str, optional
        Written above; the course's name and the duration unless given.

    Returns
    -------
    matplotlib Figure
    """
    from matplotlib.figure import Figure

    orders = available_orders(dense_samples(mission.trajectory))
    drawn = Figure(figsize=(13.0, max(4.5, 1.5 * len(orders))), layout="constrained") if figure is None else figure
    left, right = np.asarray(drawn.subfigures(1, 2, width_ratios=(1.15, 1.0)))
    plane = left.add_subplot()
    stops = mission.course.stops
    balls = Ball([stop.ball for stop in stops]) if any(stop.ball for stop in stops) else None
    plot_path(mission.trajectory, plane, waypoints=mission.course.points or None, tolerance=balls)
    _number(plane, mission)
    stack = right.subplots(len(orders), 1, sharex=True, squeeze=False)[:, 0]
    plot_profiles(mission.trajectory, stack, orders=orders, limits=mission.limits)
    for axes in stack:
        for part in mission.parts[1:]:
            axes.axvline(part.start, color="#000000", linewidth=0.8, linestyle=":")
    right.align_ylabels(stack)
    drawn.suptitle(title or f"{mission.course.name}: {mission.trajectory.duration:.2f} s")
    return drawn


def _number(ax: Axes, mission: Mission) -> None:
    """Write the number of each waypoint beside it."""
    for number, stop in enumerate(mission.course.stops):
        style = {"xytext": (6, 6), "textcoords": "offset points", "fontsize": "small", "fontweight": "bold"}
        ax.annotate(str(number), tuple(stop.centre[:2]), zorder=8, **style)  # type: ignore[arg-type]
