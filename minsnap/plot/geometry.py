"""Paths in the plane or in space, with their corridor as convex bodies, waypoints, gates, speed and direction."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import product
from typing import Any

import numpy as np

from minsnap.basics.arrays import ArrayLike, FloatArray
from minsnap.basics.checks import check_waypoints
from minsnap.basics.messages import shown
from minsnap.corridors import Avoided, Ball, Gate, Walls, as_constraints, of_unit_length, walls_of, without_gates
from minsnap.errors import CorridorError, InputError
from minsnap.native import bounding_boxes, inner_balls
from minsnap.plot import style
from minsnap.plot.obstacles import draw_obstacles
from minsnap.plot.style import Axes
from minsnap.trajectory import Path, Samples

Waypoints = Any
"""What :func:`minsnap.plan` takes: points (n, dim), with gates among them or not."""

GATE_COLOUR = "#d55e00"

PALETTE = "viridis"
"""Even in lightness, so that it reads in grey and for colour-blind eyes."""

SCALE = (1.02, 0.0, 0.03, 1.0)
"""Left, lower, width and height of the scale of colours, in shares of the axes: beside them whatever their shape."""

FLATTEST = 0.3
"""Least side of the axes, of their longest: below it the labels of a short side would overlap."""

HEAD = 0.035
"""Length of an arrowhead, of the diagonal of the curve."""


def draw_gates(ax: Axes, gates: Sequence[Gate], chosen: list[int]) -> None:
    """Draw the outline of every opening; from its side it is a line."""
    for number, gate in enumerate(gates):
        outline = np.concatenate((gate.corners, gate.corners[:1]))[:, chosen]
        label = None if number else "gates"
        ax.plot(*outline.T, color=GATE_COLOUR, linewidth=2.0, solid_joinstyle="round", label=label, zorder=4)


def draw_balls(ax: Axes, points: FloatArray, ball: Ball, gates: Mapping[int, Gate], chosen: list[int]) -> None:
    """Draw a circle around every waypoint with a ball; in space three circles."""
    radii = ball.of_waypoints(len(points))
    alone = [waypoint for waypoint in np.flatnonzero(radii).tolist() if waypoint not in gates]
    for number, (waypoint, ring) in enumerate(product(alone, _rings(len(chosen)))):
        circle = points[waypoint, chosen] + radii[waypoint] * ring
        label = None if number else "balls"
        ax.plot(*circle.T, color=style.CORRIDOR_EDGE, linewidth=1.0, label=label, zorder=4)


def _rings(dim: int) -> list[FloatArray]:
    """Return unit circles: one in the plane, one for each pair of axes in space."""
    angle = np.linspace(0.0, 2.0 * np.pi, ROUND + 1)
    flat = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    if dim == 2:
        return [flat]
    return [np.insert(flat, axis, 0.0, axis=1) for axis in range(3)]


def draw_coloured(ax: Axes, samples: Samples, chosen: list[int], by: str) -> None:
    """Draw samples as segments, each in the colour of its speed, with a scale beside the axes.

    Raises
    ------
    InputError
        If it is to be coloured by anything but the speed, or the samples have no velocity.
    """
    if by != "speed":
        raise InputError(f"colour_by is {shown(by)}: a path can be coloured by 'speed'")
    if samples.velocity is None:
        raise InputError("the samples have no velocity to colour them by")
    speed, flat = np.linalg.norm(samples.velocity, axis=1), len(chosen) == 2
    points = samples.position[:, chosen]
    segments = np.stack([points[:-1], points[1:]], axis=1)
    lines = _collection(len(chosen), segments)
    lines.set_array((speed[:-1] + speed[1:]) / 2.0)
    lines.set_clim(0.0, float(speed.max()))
    space: Any = ax
    space.add_collection(lines) if flat else space.add_collection3d(lines)
    ax.update_datalim(points[:, :2])
    ax.autoscale_view()
    place: dict[str, Any] = {"cax": ax.inset_axes(SCALE)} if flat else {"ax": ax, "shrink": 0.8, "pad": 0.12}
    ax.figure.colorbar(lines, label="speed [m/s]", **place)


def _collection(dim: int, segments: Any) -> Any:
    how: dict[str, Any] = {"cmap": PALETTE, "linewidth": 2.6, "zorder": 3, "capstyle": "round"}
    if dim == 2:
        from matplotlib.collections import LineCollection

        return LineCollection(segments, **how)
    from mpl_toolkits.mplot3d.art3d import Line3DCollection

    return Line3DCollection(segments, **how)


def arrow_places(points: FloatArray, count: int) -> tuple[FloatArray, FloatArray]:
    """Return places at equal distances along a curve (m, dim), and the steps that lead there, m at most ``count``."""
    travelled = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    places = np.searchsorted(travelled, travelled[-1] * (np.arange(count) + 0.5) / count)
    places = np.clip(places, 1, len(points) - 1)
    steps = points[places] - points[places - 1]
    moving = steps.any(axis=1)
    return points[places][moving], steps[moving]


def arrow_heads(points: FloatArray, count: int) -> FloatArray:
    """Return triangles on a curve in space, a few hundredths of its extent long, shape (m, 3, 3)."""
    places, steps = arrow_places(points, count)
    along = steps / np.linalg.norm(steps, axis=1, keepdims=True)
    across = np.cross(along, np.where(np.abs(along[:, 2:]) < 0.99, [[0.0, 0.0, 1.0]], [[1.0, 0.0, 0.0]]))
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    size = HEAD * float(np.linalg.norm(np.ptp(points, axis=0)))
    back, side = places - 0.5 * size * along, 0.38 * size * across
    return np.stack([places + 0.5 * size * along, back + side, back - side], axis=1)


def equal_space(ax: Any) -> None:
    """Scale all three axes equally in a box that fills the panel, with few ticks; draw the path on top."""
    from matplotlib.ticker import MaxNLocator

    ax.computed_zorder = False
    spans = widen_short_axes(ax, "xyz")
    for name, span in zip("xyz", spans, strict=True):
        axis, share = getattr(ax, f"{name}axis"), span / spans.max()
        axis.set_major_locator(MaxNLocator(2 + round(4 * share), min_n_ticks=2))
        axis.labelpad = 2.0 + 8.0 * share
        axis.pane.set_alpha(0.3)
    ax.view_init(elev=24.0 + 12.0 * (1.0 - spans[2] / spans.max()), azim=-58.0)
    ax.set_box_aspect(spans, zoom=1.0)


def widen_short_axes(ax: Any, names: str) -> FloatArray:
    """Widen the limits of short axes to a share of the longest, about their middle.

    Parameters
    ----------
    ax : matplotlib axes
    names : str
        "xy" or "xyz".

    Returns
    -------
    ndarray, shape (len(names),)
        What each axis spans.
    """
    limits = np.array([getattr(ax, f"get_{name}lim")() for name in names])
    spans = np.ptp(limits, axis=1)
    wanted = np.maximum(spans, FLATTEST * spans.max())
    for name, middle, span in zip(names, limits.mean(axis=1), wanted, strict=True):
        getattr(ax, f"set_{name}lim")(middle - span / 2.0, middle + span / 2.0)
    return np.asarray(wanted)


Corridor = Any
"""What :func:`minsnap.plan` takes: half-widths [m], a Constraint, or a sequence of them."""

ROUND = 48
"""Corners of a circle."""


def leg_bodies(corridor: Corridor, waypoints: FloatArray) -> list[FloatArray]:
    """Corners of the convex body that each leg must stay in.

    A tube is unbounded along its leg; it is drawn from one waypoint to the next. Repeated legs, as in laps, are
    returned once, and legs without walls are left out.

    Parameters
    ----------
    corridor : Constraint, sequence of Constraint, or array_like
        Objects with walls, or the half-widths of a tube [m].
    waypoints : ndarray, shape (n, dim)
        [m].

    Returns
    -------
    list of ndarray, shape (corners, dim)
        [m].

    Raises
    ------
    CorridorError
        If a body is so thin that Qhull finds no hull.
    """
    from scipy.spatial import QhullError

    walls = [wall for wall in walls_of(as_constraints(corridor), waypoints) if wall.order == 0]
    bodies: dict[bytes, FloatArray] = {}
    bounded = {leg for wall in walls for leg in wall.leg.tolist()}
    for leg in sorted(bounded.intersection(range(len(waypoints) - 1))):
        try:
            corners = _body(walls, leg, waypoints)
        except QhullError:
            raise CorridorError(f"the corridor of leg {leg} cannot be drawn: it is too thin for its length") from None
        bodies.setdefault(np.unique(np.round(corners, 9), axis=0).tobytes(), corners)
    return list(bodies.values())


def outline(corners: FloatArray) -> FloatArray:
    """Return the corners of the convex hull of points in the plane, in order: (m, 2)."""
    from scipy.spatial import ConvexHull

    return np.asarray(corners[ConvexHull(corners).vertices])


def _body(walls: Sequence[Walls], leg: int, waypoints: FloatArray) -> FloatArray:
    start, end = waypoints[leg], waypoints[leg + 1]
    blocks = [_half_spaces(wall, leg) for wall in walls]
    ends = [_ends(start, end) for block in blocks if _is_tube(block, end - start)][:1]
    rows = np.vstack([*blocks, *ends])
    return _polytope(np.vstack([rows, _far(rows, waypoints)]), (start + end) / 2.0)


def _half_spaces(cones: Walls, leg: int) -> FloatArray:
    """Rows (normal, offset) with normal . r + offset <= 0 of a leg's planes, and of planes tangent to what is round."""
    parts = [np.zeros((0, cones.anchor.shape[1] + 1))]
    for i in np.flatnonzero(cones.leg == leg):
        across, share = _directions(cones.matrix[i])
        normal = across - share * cones.slope[i]
        parts.append(np.column_stack([normal, -(normal @ cones.anchor[i]) - share * cones.radius[i]]))
    return np.vstack(parts)


def _directions(matrix: FloatArray) -> tuple[FloatArray, float]:
    """Return normals d A of planes d . A x <= share (radius + slope . x); a circle's have their corners on it."""
    _, scale, basis = np.linalg.svd(matrix)
    rank = int((scale > 1e-9).sum())
    if rank < 2:
        return scale[:rank, None] * basis[:rank] * [[1.0], [-1.0]] if rank else np.zeros((1, matrix.shape[1])), 1.0
    angle = np.linspace(0.0, 2.0 * np.pi, ROUND, endpoint=False) + np.pi / ROUND
    circle = np.column_stack([np.cos(angle), np.sin(angle)])
    if rank == 2:
        return circle @ (scale[:2, None] * basis[:2]), float(np.cos(np.pi / ROUND))
    height = np.linspace(-1.0, 1.0, ROUND // 2 + 1)[:, None, None]
    sphere = np.concatenate([np.sqrt(1.0 - height**2) * circle, height + 0.0 * circle[:, :1]], axis=2)
    return np.unique(np.round(sphere.reshape(-1, 3), 12), axis=0) @ (scale[:3, None] * basis[:3]), 1.0


def _is_tube(rows: FloatArray, step: FloatArray) -> bool:
    """Whether half-spaces are unbounded only along the direction of the leg."""
    normals = rows[:, :-1] / np.maximum(np.linalg.norm(rows[:, :-1], axis=1, keepdims=True), 1e-300)
    across = np.abs(normals @ step).max(initial=0.0) < 1e-6 * np.linalg.norm(step)
    paired = (normals @ normals.T).min(axis=1, initial=0.0) < 1e-6 - 1.0
    return bool(across and paired.all() and np.linalg.matrix_rank(normals, tol=1e-6) == len(step) - 1)


def _ends(start: FloatArray, end: FloatArray) -> FloatArray:
    """Return the planes that close a tube at its waypoints."""
    along = (end - start) / np.linalg.norm(end - start)
    return np.array([[*along, -along @ end], [*-along, along @ start]])


def _far(rows: FloatArray, waypoints: FloatArray) -> FloatArray:
    """Return planes slightly beyond all waypoints, on the sides where the half-spaces are unbounded."""
    lower, upper = bounding_boxes([of_unit_length(rows[:, :-1], -rows[:, -1])])
    beyond = 1.0 + 0.25 * np.ptp(waypoints, axis=0).max()
    axes = np.eye(waypoints.shape[1])
    above = np.column_stack([axes, -waypoints.max(axis=0) - beyond])[~np.isfinite(upper[0])]
    below = np.column_stack([-axes, waypoints.min(axis=0) - beyond])[~np.isfinite(lower[0])]
    return np.vstack([above, below])


def _polytope(rows: FloatArray, guess: FloatArray) -> FloatArray:
    from scipy.spatial import HalfspaceIntersection

    if not (rows[:, :-1] @ guess + rows[:, -1]).max() < 0.0:
        guess = inner_balls([of_unit_length(rows[:, :-1], -rows[:, -1])])[0][0]
    return np.asarray(HalfspaceIntersection(rows, guess).intersections)


VIEWS = {"xy": (0, 1), "xz": (0, 2), "yz": (1, 2), "3d": (0, 1, 2)}
ARROWS = 6


@style.styled
def plot_path(
    path: Path | Samples,
    ax: Axes | None = None,
    *,
    view: str = "xy",
    corridor: Corridor | None = None,
    waypoints: Waypoints | None = None,
    tolerance: ArrayLike | Ball | None = None,
    avoid: Sequence[Avoided] = (),
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
        Those of :func:`minsnap.plan`; drawn as shadows in a plane, as surfaces in the view "3d", near the path.
    colour_by : {"speed"}, optional
        Colour the curve by its speed, with a scale beside it.


    Raises
    ------
    InputError
        If the view is unknown or needs coordinates that the path does not have, or the colour is of nothing known.
    """
    samples = style.dense_samples(path)
    chosen = view_coordinates(view, samples.dim)
    flat_size = fitting_size(samples.position[:, chosen]) if len(chosen) == 2 else (7.5, 5.5)
    axes = style.new_axes("3d" if len(chosen) == 3 else None, flat_size) if ax is None else ax
    if (axes.name == "3d") != (view == "3d"):
        raise InputError(f"the view {view!r} needs axes of {'three' if view == '3d' else 'two'} dimensions")
    points, gates = _waypoints(path, waypoints)
    draw_surroundings(axes, samples.position, chosen, (corridor, points, gates, avoid))
    if colour_by is None:
        curve = samples.position[:, chosen].T
        axes.plot(*curve, color=style.PATH_COLOUR, linewidth=1.8, label="path", zorder=3)
    else:
        draw_coloured(axes, samples, chosen, colour_by)
    _draw_ends(axes, samples.position[:, chosen])
    if points is not None:
        dots = np.delete(points, list(gates), axis=0)[:, chosen].T
        axes.plot(*dots, "o", color="black", markersize=4, linestyle="none", label="waypoints", zorder=4)
        if isinstance(tolerance, Ball):
            draw_balls(axes, points, tolerance, gates, chosen)
    finish_place(axes, chosen, samples.dim)
    if colour_by is not None and len(chosen) == 2:
        above: dict[str, Any] = {"loc": "lower left", "bbox_to_anchor": (0.0, 1.0), "ncols": 4}
        axes.legend(fontsize="small", **above)  # the scale of colours stands beside
    elif len(chosen) == 3:
        axes.legend(loc="upper left", handlelength=1.8)  # a corner that the box in perspective leaves free
    else:
        style.legend_beside(axes)
    return axes


Kept = tuple[Corridor | None, FloatArray | None, Mapping[int, Gate], Sequence[Avoided]]
"""What a curve keeps: corridor, the points (n, dim) that it runs between [m], gates and obstacles."""


def draw_surroundings(ax: Axes, places: FloatArray, chosen: list[int], kept: Kept) -> None:
    """Draw what a curve, whose places are (m, dim) [m], was to keep."""
    corridor, points, gates, avoid = kept
    if corridor is not None and points is not None:
        _draw_corridor(ax, corridor, points, chosen)
    draw_obstacles(ax, avoid, chosen, places[:, chosen])
    draw_gates(ax, list(gates.values()), chosen)


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
        points, gates = without_gates(places)
        return check_waypoints(points), gates
    breaks = getattr(path, "leg_breaks", None)
    return (None if breaks is None or isinstance(path, Samples) else path(breaks)), {}


def _draw_corridor(ax: Axes, corridor: Corridor, waypoints: FloatArray, chosen: list[int]) -> None:
    bodies = leg_bodies(corridor, waypoints)
    if len(chosen) == 3:
        from mpl_toolkits.mplot3d.art3d import Poly3DCollection
        from scipy.spatial import ConvexHull

        triangles = np.concatenate([body[ConvexHull(body).simplices] for body in bodies])
        space: Any = ax
        walls = Poly3DCollection(triangles, facecolor=style.CORRIDOR_COLOUR, alpha=0.12, label="corridor")
        space.add_collection3d(walls)
        return
    from matplotlib.patches import Polygon

    for i, body in enumerate(bodies):
        shape = outline(body[:, chosen])
        label = None if i else "corridor"
        ax.add_patch(Polygon(shape, facecolor=style.CORRIDOR_COLOUR, alpha=0.22, label=label, zorder=1))
        ax.add_patch(Polygon(shape, fill=False, edgecolor=style.CORRIDOR_EDGE, linewidth=1.2, zorder=2))


def _draw_ends(ax: Axes, points: FloatArray) -> None:
    """Mark start, end and direction of the path."""
    ax.plot(*points[:1].T, marker="^", color=style.PATH_COLOUR, markersize=9, linestyle="none", label="start", zorder=5)
    end: dict[str, Any] = {"markerfacecolor": "white", "markeredgecolor": style.PATH_COLOUR, "markersize": 6}
    ax.plot(*points[-1:].T, linestyle="none", marker="s", label="end", zorder=6, **end)
    _draw_arrows(ax, points)


def _draw_arrows(ax: Any, points: FloatArray) -> None:
    """Draw arrows along the curve at equal distances; flat heads in space."""
    if points.shape[1] == 3:
        from mpl_toolkits.mplot3d.art3d import Poly3DCollection

        heads = arrow_heads(points, ARROWS)
        if len(heads):
            ax.add_collection3d(Poly3DCollection(heads, facecolor=style.PATH_COLOUR, edgecolor="none", zorder=4))
        return
    for end, step in zip(*arrow_places(points, ARROWS), strict=True):
        look = {"arrowstyle": "-|>", "color": style.PATH_COLOUR, "mutation_scale": 12}
        ax.annotate("", xy=tuple(end), xytext=tuple(end - step), arrowprops=look, zorder=3)


def finish_place(ax: Axes, chosen: Sequence[int], dim: int) -> None:
    """Name the axes of a view of places, and scale them equally."""
    for name, index in zip(("x", "y", "z"), chosen, strict=False):
        getattr(ax, f"set_{name}label")(f"{style.coordinate_name(index, dim)} [m]")
    if len(chosen) == 3:
        equal_space(ax)
        return
    widen_short_axes(ax, "xy")
    ax.set_aspect("equal", adjustable="box", anchor="NW")
