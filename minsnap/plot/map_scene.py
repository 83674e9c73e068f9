"""What is around a path: cells, obstacles and points in space, and the ground."""

from __future__ import annotations

from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.corridors import Avoided, Kept
from minsnap.paths.routes import GridMap, Terrain
from minsnap.plot.geometry import equal_space
from minsnap.plot.map_cells import near_cells, surface
from minsnap.plot.obstacles import OBSTACLE_COLOUR, Numbered, draw_faces, faces_of

OCCUPIED = "#4d4d4d"
"""Colour of occupied cells."""

GROUND = "#5a8f5a"
"""Colour of the ground."""

MOST_FACES, MOST_POINTS = 6000, 4000
"""Faces of cells, and points, that are drawn in space."""

FINE = 160
"""Places along each axis at which the ground is looked up."""

CONTOURS = 8
"""Lines of equal height, about."""


def draw_in_space(ax: Any, around: GridMap | Kept, places: FloatArray, clearance: float) -> None:
    """Draw what is around a path (m, 3) in the box of axes in space: cells; or obstacles, points and fences."""
    box = _box(ax)
    if isinstance(around, GridMap):
        taken, side, corner = near_cells(around, places, clearance)
        faces = corner + side * surface(taken, MOST_FACES)[0]
        edges: dict[str, Any] = {"edgecolor": (0.2, 0.2, 0.2, 0.25), "linewidth": 0.3, "zorder": 0.7}
        draw_faces(ax, _clipped(faces, box), OCCUPIED, 0.25, "occupied", **edges)
        return
    prisms = () if around.prisms is None else around.prisms.prisms
    solid: list[Avoided] = [*map(Numbered, around.obstacles), *(each for each in prisms if not each.inclusion)]
    faces = np.array([face for each in solid for face in faces_of(each, places)]).reshape(-1, 4, 3)
    draw_faces(ax, _clipped(faces, box), OBSTACLE_COLOUR, 0.35, "obstacles", zorder=0.7)
    inside = around.points[((around.points >= box[0]) & (around.points <= box[1])).all(axis=1)]
    if len(inside):
        drawn = inside[:: -(-len(inside) // MOST_POINTS)]
        ax.plot(*drawn.T, ".", color=OCCUPIED, markersize=2.0, label="points", zorder=0.7)
    for each in (each for each in prisms if each.inclusion):
        _draw_fence(ax, each.polygon, box)
    ax.set(**{f"{name}lim": ends for name, ends in zip("xyz", box.T.tolist(), strict=True)})


def _box(ax: Any) -> FloatArray:
    """Return the lower and the upper corner of axes in space, shape (2, 3) [m]."""
    return np.array([ax.get_xlim(), ax.get_ylim(), ax.get_zlim()]).T


def _clipped(faces: FloatArray, box: FloatArray) -> FloatArray:
    """Return the parts of faces (n, 4, 3) in a box; those outside, which have no area left, go."""
    inside = np.clip(faces, *box)
    one, other = inside[:, 1] - inside[:, 0], inside[:, 2] - inside[:, 0]
    area = np.linalg.norm(np.cross(one, other), axis=1) if len(inside) else np.zeros(0)
    return np.asarray(inside[area > 0.0])


def _draw_fence(ax: Any, polygon: FloatArray, box: FloatArray) -> None:
    """Draw the sides of a fence at the bottom of a box, where they are inside of it."""
    share = np.linspace(0.0, 1.0, 200)[:, None]
    sides = [(1.0 - share) * a + share * b for a, b in zip(polygon, np.roll(polygon, -1, axis=0), strict=True)]
    line = np.concatenate(sides)
    line[((line < box[0, :2]) | (line > box[1, :2])).any(axis=1)] = np.nan
    ax.plot(*line.T, np.full(len(line), box[0, 2]), "--", color=OBSTACLE_COLOUR, label="fence", zorder=0.7)


def draw_ground(ax: Any, terrain: Terrain, view: str, places: FloatArray) -> None:
    """Draw the ground around a path (m, 3): lines of equal height from above, how high it is from a side, a surface.

    The axes reach down to it.
    """
    low, high = places[:, :2].min(axis=0), places[:, :2].max(axis=0)
    if view == "xy":
        low, high = np.array([ax.get_xlim(), ax.get_ylim()]).T
    elif view == "3d":
        low, high = _box(ax)[:, :2]
    low, high = np.maximum(low, terrain.reach[0]), np.minimum(high, terrain.reach[1])
    if not (low < high).all():
        return
    x, y = (np.linspace(a, b, FINE) for a, b in zip(low, high, strict=True))
    ground = terrain.known_at(np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1))
    if np.isnan(ground).all():
        return
    if view == "xy":
        limits = ax.get_xlim(), ax.get_ylim()
        ax.contourf(x, y, ground.T, CONTOURS, cmap="Greens", alpha=0.45, zorder=0.5)
        lines = ax.contour(x, y, ground.T, CONTOURS, colors=GROUND, linewidths=0.6, zorder=0.6)
        ax.clabel(lines, fontsize="x-small", fmt="%g m")
        ax.set(xlim=limits[0], ylim=limits[1])
    elif view == "3d":
        look: dict[str, Any] = {"color": GROUND, "alpha": 0.5, "linewidth": 0.0, "zorder": 0.5}
        ax.plot_surface(*np.meshgrid(x, y, indexing="ij"), ground, rcount=60, ccount=60, **look)
        ax.set_zlim(float(np.nanmin(ground)), max(ax.get_zlim()[1], float(np.nanmax(ground))))
        equal_space(ax)
    else:
        _draw_ground_beside(ax, x if view[0] == "x" else y, ground if view[0] == "x" else ground.T)


def _draw_ground_beside(ax: Any, along: FloatArray, ground: FloatArray) -> None:
    """Draw the lowest and highest ground at each place along an axis, with all below it."""
    known = ~np.isnan(ground).all(axis=1)
    least, most = np.nanmin(ground[known], axis=1), np.nanmax(ground[known], axis=1)
    low, high = ax.get_ylim()
    bottom = min(low, float(least.min()))
    ax.fill_between(along[known], bottom, least, color=GROUND, alpha=0.5, linewidth=0.0, zorder=0.5)
    ax.fill_between(along[known], least, most, color=GROUND, alpha=0.25, linewidth=0.0, zorder=0.5)
    ax.set_ylim(bottom, max(high - (low - bottom), float(ax.dataLim.y1), float(most.max())))
