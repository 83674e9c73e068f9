"""Paths in the plane or in space, with their corridor, waypoints and direction."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from minsnap.basics.arrays import FloatArray
from minsnap.corridors.gates import Ball, Gate
from minsnap.corridors.keep_out import Obstacle
from minsnap.errors import InputError
from minsnap.plot.marks import (
    Corridor,
    Waypoints,
    arrow_places,
    draw_balls,
    draw_coloured,
    draw_gates,
    draw_heads,
    draw_waypoints,
    equal_space,
    facets,
    leg_bodies,
    nominal_points,
    outline,
    widen_short_axes,
)
from minsnap.plot.style import (
    CORRIDOR_COLOUR,
    CORRIDOR_EDGE,
    PATH_COLOUR,
    coordinate_name,
    dense_samples,
    legend_beside,
    new_axes,
    styled,
)
from minsnap.trajectory.path import Path
from minsnap.trajectory.samples import Samples

if TYPE_CHECKING:
    from matplotlib.axes import Axes

VIEWS = {"xy": (0, 1), "xz": (0, 2), "yz": (1, 2), "3d": (0, 1, 2)}
ARROWS = 6

ROUND, BEYOND = 65, 0.1
"""Points of a circle; how far obstacles without an end are drawn beyond the path, in its extents."""

PARTS = 3, 6, 7, 10
"""Where the parts of the numbers of an obstacle begin."""

OBSTACLE_COLOUR = "#868e96"


@styled
def plot_path(
    path: Path | Samples,
    ax: Axes | None = None,
    *,
    view: str = "xy",
    corridor: Corridor | None = None,
    waypoints: Waypoints | None = None,
    tolerance: npt.ArrayLike | Ball | None = None,
    avoid: Sequence[Obstacle] = (),
    colour_by: str | None = None,
) -> Axes:
    """Draw the curve of a path, its direction, its waypoints and its corridor.

    Parameters
    ----------
    path : Path or Samples
        dim 2 or 3.
    ax : matplotlib axes, optional
        Where to draw; by default a new figure (three-dimensional axes for the view "3d").
    view : str
        ``"xy"``, ``"xz"``, ``"yz"`` or ``"3d"``.
    corridor : Constraint, sequence of Constraint, or array_like, optional
        That of :func:`minsnap.plan`; drawn as one body a leg.
    waypoints : array_like, shape (n, dim), or sequence with Gates among them, optional
        [m]; by default those of a planned trajectory. Gates are drawn as outlines.
    tolerance : Ball, optional
        The ``waypoint_tolerance`` of :func:`minsnap.plan`; drawn as circles. Boxes are not drawn.
    avoid : sequence of Obstacle
        Those of :func:`minsnap.plan`; drawn as shadows in a plane, and not in the view "3d".
    colour_by : {"speed"}, optional
        Colour the curve by its speed, with a scale beside it.

    Returns
    -------
    matplotlib axes

    Raises
    ------
    InputError
        If the view is unknown or needs coordinates that the path does not have, or the colour is of nothing known.
    """
    samples = dense_samples(path)
    chosen = view_coordinates(view, samples.dim)
    flat_size = fitting_size(samples.position[:, chosen]) if len(chosen) == 2 else (7.5, 5.5)
    axes = new_axes("3d" if len(chosen) == 3 else None, flat_size) if ax is None else ax
    if (axes.name == "3d") != (view == "3d"):
        raise InputError(f"the view {view!r} needs axes of {'three' if view == '3d' else 'two'} dimensions")
    points, gates = _waypoints(path, waypoints)
    if corridor is not None and points is not None:
        _draw_corridor(axes, corridor, points, chosen)
    if avoid and len(chosen) == 2:
        _draw_obstacles(axes, avoid, chosen, samples.position[:, chosen])
    if colour_by is None:
        curve = samples.position[:, chosen].T
        axes.plot(*curve, color=PATH_COLOUR, linewidth=1.8, label="path", zorder=3)
    else:
        draw_coloured(axes, samples, chosen, colour_by)
    _draw_ends(axes, samples.position[:, chosen])
    if points is not None:
        draw_waypoints(axes, np.delete(points, list(gates), axis=0), chosen)
        draw_gates(axes, list(gates.values()), chosen)
        if isinstance(tolerance, Ball):
            draw_balls(axes, points, tolerance, gates, chosen)
    finish_place(axes, chosen, samples.dim)
    if colour_by is not None and len(chosen) == 2:
        above: dict[str, Any] = {"loc": "lower left", "bbox_to_anchor": (0.0, 1.0), "ncols": 4}
        axes.legend(fontsize="small", **above)  # the scale of colours stands beside
    elif len(chosen) == 3:
        axes.legend(loc="upper left", handlelength=1.8)  # a corner that the box in perspective leaves free
    else:
        legend_beside(axes)
    return axes


def fitting_size(points: FloatArray) -> tuple[float, float]:
    """Return the size of a figure whose shape is about that of points in a plane [inches]."""
    width, height = np.ptp(points, axis=0)
    return 7.5, float(np.clip(6.0 * height / max(width, 1e-9 * height, 1e-300) + 0.8, 2.5, 7.0))


def check_view(view: str) -> str:
    """Return the name of a view, or raise InputError if there is none of that name."""
    if view not in VIEWS:
        raise InputError(f"no view is called {view!r}: choose one of {', '.join(VIEWS)}")
    return view


def view_coordinates(view: str, dim: int) -> list[int]:
    """Return the coordinates that a view of a path of ``dim`` coordinates shows, or raise InputError."""
    check_view(view)
    if max(VIEWS[view]) >= dim:
        raise InputError(f"the view {view!r} needs {max(VIEWS[view]) + 1} coordinates, the path has {dim}")
    return list(VIEWS[view])


def _waypoints(path: Path | Samples, places: Waypoints | None) -> tuple[FloatArray | None, Mapping[int, Gate]]:
    if places is not None:
        return nominal_points(places)
    breaks = getattr(path, "leg_breaks", None)
    return (None if breaks is None or isinstance(path, Samples) else path(breaks)), {}


def _draw_corridor(ax: Axes, corridor: Corridor, waypoints: FloatArray, chosen: list[int]) -> None:
    bodies = leg_bodies(corridor, waypoints)
    if len(chosen) == 3:
        from mpl_toolkits.mplot3d.art3d import Poly3DCollection

        triangles = np.concatenate([facets(body) for body in bodies])
        space: Any = ax
        space.add_collection3d(Poly3DCollection(triangles, facecolor=CORRIDOR_COLOUR, alpha=0.12, label="corridor"))
        return
    from matplotlib.patches import Polygon

    for i, body in enumerate(bodies):
        shape = outline(body[:, chosen])
        ax.add_patch(Polygon(shape, facecolor=CORRIDOR_COLOUR, alpha=0.22, label=None if i else "corridor", zorder=1))
        ax.add_patch(Polygon(shape, fill=False, edgecolor=CORRIDOR_EDGE, linewidth=1.2, zorder=2))


def _draw_obstacles(ax: Axes, avoid: Sequence[Obstacle], chosen: list[int], places: FloatArray) -> None:
    """Draw what obstacles cover in a plane, where they have no end to beyond the path, places (m, 2) [m]."""
    beyond = BEYOND * float(np.ptp(places, axis=0).max())
    lowest, highest = places.min(axis=0) - beyond, places.max(axis=0) + beyond
    angles = np.linspace(0.0, 2.0 * np.pi, ROUND)
    for number, obstacle in enumerate(avoid):
        center, scale, radius, low, high = np.split(obstacle.numbers(), PARTS)
        curved = (scale[chosen] > 0.0) & (radius >= 0.0)
        reach = np.where(curved, radius / np.where(curved, scale[chosen], 1.0), np.inf)
        low, high = np.maximum(low[chosen], center[chosen] - reach), np.minimum(high[chosen], center[chosen] + reach)
        low, high = np.where(np.isfinite(low), low, lowest), np.where(np.isfinite(high), high, highest)
        ring = np.array([low, [high[0], low[1]], high, [low[0], high[1]]])
        if curved.all():
            ring = np.clip(center[chosen] + reach * np.stack([np.cos(angles), np.sin(angles)], axis=1), low, high)
        ax.fill(*ring.T, color=OBSTACLE_COLOUR, alpha=0.6, linewidth=0.0, label="_" if number else "obstacles")


def _draw_ends(ax: Axes, points: FloatArray) -> None:
    """Mark start, end and direction of the path."""
    ax.plot(*points[:1].T, marker="^", color=PATH_COLOUR, markersize=9, linestyle="none", label="start", zorder=5)
    end: dict[str, Any] = {"markerfacecolor": "white", "markeredgecolor": PATH_COLOUR, "markersize": 6}
    ax.plot(*points[-1:].T, linestyle="none", marker="s", label="end", zorder=6, **end)
    _draw_arrows(ax, points)


def _draw_arrows(ax: Axes, points: FloatArray) -> None:
    """Draw arrows along the curve at equal distances."""
    if points.shape[1] == 3:
        draw_heads(ax, points, ARROWS)
        return
    for end, step in zip(*arrow_places(points, ARROWS), strict=True):
        style = {"arrowstyle": "-|>", "color": PATH_COLOUR, "mutation_scale": 12}
        ax.annotate("", xy=tuple(end), xytext=tuple(end - step), arrowprops=style, zorder=3)


def finish_place(ax: Axes, chosen: Sequence[int], dim: int) -> None:
    """Name the axes of a view of places, and scale them equally."""
    for name, index in zip(("x", "y", "z"), chosen, strict=False):
        getattr(ax, f"set_{name}label")(f"{coordinate_name(index, dim)} [m]")
    if len(chosen) == 3:
        equal_space(ax)
        return
    widen_short_axes(ax, "xy")
    ax.set_aspect("equal", adjustable="box", anchor="NW")
