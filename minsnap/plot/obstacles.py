"""Obstacles in figures: what they cover in a plane, and their surfaces in space; near the path."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.corridors import Avoided, Cuboid, Moving, Obstacle, Prism, standing_at

CIRCLE, HEIGHTS = 65, 17
"""Points of a circle, and of a meridian."""

INSTANTS = 7
"""Of its path, at which a moving obstacle is drawn."""

BEYOND, NEAR = 0.1, 0.5
"""How far beyond the path obstacles without an end are drawn, and others, in its extents."""

PARTS = 3, 6, 7, 10
"""Where the parts of the numbers of an obstacle begin."""

OBSTACLE_COLOUR = "#868e96"


class Numbered(NamedTuple):
    """An obstacle of which the thirteen numbers are known."""

    values: FloatArray

    def numbers(self) -> FloatArray:
        """Return its thirteen numbers; see ``Obstacle``."""
        return self.values


def standing(avoid: Sequence[Avoided]) -> list[Obstacle]:
    """Return obstacles, those that move at several instants of their paths, and the boxes around prisms."""
    shown: list[Obstacle] = []
    for each in avoid:
        if isinstance(each, Moving):
            begin = max(each.begin, 0.0)
            shown += standing_at(each, np.linspace(begin, max(begin, each.begin + each.motion.duration), INSTANTS))
        elif isinstance(each, Prism):
            low, high = each.polygon.min(axis=0), each.polygon.max(axis=0)
            shown.append(Cuboid((*low, each.low), (*high, each.high)))
        else:
            shown.append(each)
    return shown


def drawn_places(places: FloatArray, avoid: Sequence[Avoided], chosen: Sequence[int]) -> FloatArray:
    """Return the corners of a path (m, len(chosen)) and of what is drawn of obstacles, shape (k, len(chosen)) [m]."""
    corners = [places.min(axis=0), places.max(axis=0)]
    for obstacle in standing(avoid):
        low, high = _bounds(obstacle, list(chosen), places)
        corners += [low, high] if (low < high).all() else []
    return np.array(corners)


def draw_obstacles(ax: Any, avoid: Sequence[Avoided], chosen: Sequence[int], places: FloatArray) -> None:
    """Draw obstacles near a path, whose places in the coordinates drawn are (m, len(chosen)) [m]."""
    if len(chosen) == 3:
        _draw_surfaces(ax, avoid, places)
        return
    kinds = [(each, "fence" if isinstance(each, Prism) and each.inclusion else type(each).__name__) for each in avoid]
    named = set[str]()
    for each, kind in kinds:
        moves = kind == "Moving"
        name = f"moving obstacles, {INSTANTS} instants" if moves else kind if kind == "fence" else "obstacles"
        for ring in _rings(each, list(chosen), places):
            label = "_" if name in named else name
            named.add(name)
            if kind == "fence":
                ax.plot(*np.vstack((ring, ring[:1])).T, color=OBSTACLE_COLOUR, linestyle="--", label=label)
            else:
                ax.fill(*ring.T, color=OBSTACLE_COLOUR, alpha=0.2 if moves else 0.6, linewidth=0.0, label=label)


def _rings(each: Avoided, chosen: list[int], places: FloatArray) -> list[FloatArray]:
    """Return outlines of what an obstacle covers in a plane, each (corners, 2) [m]."""
    if isinstance(each, Prism) and chosen == [0, 1]:
        return [each.polygon]
    return [_ring(obstacle, chosen, places) for obstacle in standing([each])]


def _bounds(obstacle: Obstacle, chosen: list[int], places: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the lower and the upper corner of an obstacle near a path [m]; not below each other where it is far."""
    center, scale, radius, low, high = np.split(obstacle.numbers(), PARTS)
    curved = _curved(scale, radius)
    reach = np.where(curved, radius / np.where(curved, scale, 1.0), np.inf)
    low, high = np.maximum(low, center - reach)[chosen], np.minimum(high, center + reach)[chosen]
    extent = float(np.ptp(places, axis=0).max())
    lower, upper = (np.where(np.isfinite(end), NEAR, BEYOND) * extent for end in (low, high))
    return np.maximum(low, places.min(axis=0) - lower), np.minimum(high, places.max(axis=0) + upper)


def _curved(scale: FloatArray, radius: FloatArray) -> Any:
    return (scale > 0.0) & (radius >= 0.0)


def _ring(obstacle: Obstacle, chosen: list[int], places: FloatArray) -> FloatArray:
    """Return the outline of what an obstacle covers in a plane, shape (corners, 2) [m]; none where it is far."""
    low, high = _bounds(obstacle, chosen, places)
    if not (low < high).all():
        return np.zeros((0, 2))
    center, scale, radius, *_ = np.split(obstacle.numbers(), PARTS)
    if not _curved(scale, radius)[chosen].all():
        return np.array([low, [high[0], low[1]], high, [low[0], high[1]]])
    angles = np.linspace(0.0, 2.0 * np.pi, CIRCLE)
    circle = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    return np.asarray(np.clip(center[chosen] + radius / scale[chosen] * circle, low, high))


def _draw_surfaces(ax: Any, avoid: Sequence[Avoided], places: FloatArray) -> None:
    draw_faces(ax, [face for each in avoid for face in faces_of(each, places)], OBSTACLE_COLOUR, 0.35, "obstacles")


def draw_faces(
    ax: Any, faces: Sequence[FloatArray] | FloatArray, colour: str, alpha: float, name: str, **look: Any
) -> None:
    """Draw faces, each (4, 3) [m], in space; nothing where there are none."""
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    if len(faces):
        how: dict[str, Any] = {"facecolor": colour, "edgecolor": "none", "alpha": alpha, "label": name}
        ax.add_collection3d(Poly3DCollection(np.array(faces), **how | look))


def faces_of(each: Avoided, places: FloatArray) -> Iterator[FloatArray]:
    """Yield the faces of an obstacle near a path (m, 3), each (4, 3) [m]; of a prism its sides."""
    if not isinstance(each, Prism):
        for obstacle in standing([each]):
            yield from surface(obstacle, places)
        return
    (box,) = standing([each])
    low, high = _bounds(box, [0, 1, 2], places)
    for a, b in zip(each.polygon, np.roll(each.polygon, -1, axis=0), strict=True):
        yield np.array([(*a, low[2]), (*b, low[2]), (*b, high[2]), (*a, high[2])])


def surface(obstacle: Obstacle, places: FloatArray) -> Iterator[FloatArray]:
    """Yield the faces of an obstacle near a path (m, 3), each (4, 3) [m]; none where it is far."""
    low, high = _bounds(obstacle, [0, 1, 2], places)
    if not (low < high).all():
        return
    center, scale, radius, *_ = np.split(obstacle.numbers(), PARTS)
    curved, angles = _curved(scale, radius), np.linspace(0.0, 2.0 * np.pi, CIRCLE)
    if not curved[:2].all():
        corners = [(-1, -1), (1, -1), (1, 1), (-1, 1), (-1, -1)]
        circle = np.array(corners, dtype=np.float64) * np.inf  # of a box: its bounds, by the clipping below
    else:
        circle = np.stack([np.cos(angles), np.sin(angles)], axis=1) * (radius / scale[:2])
    heights = np.linspace(-0.5 * np.pi, 0.5 * np.pi, HEIGHTS) if curved[2] else np.zeros(2)
    levels = center[2] + np.sin(heights) * radius / scale[2] if curved[2] else np.array([low[2], high[2]])
    rings = [
        np.clip(np.column_stack([center[:2] + share * circle, np.full(len(circle), level)]), low, high)
        for share, level in zip(np.cos(heights), levels, strict=True)
    ]
    for below, above in pairwise(rings):
        yield from np.stack([below[:-1], below[1:], above[1:], above[:-1]], axis=1)
    for ring in (rings[0], rings[-1]):
        middle = np.broadcast_to(ring[:-1].mean(axis=0), ring[1:].shape)
        yield from np.stack([middle, ring[:-1], ring[1:], middle], axis=1)
