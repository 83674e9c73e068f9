"""Drawing of waypoints: points, balls around them, and gates."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.corridors.gates import Ball, Gate, without_gates
from minsnap.plot.style import CORRIDOR_EDGE

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Waypoints = Any
"""What :func:`minsnap.plan` takes: points (n, dim), with gates among them or not."""

AROUND = 48
"""Corners of a circle."""

GATE_COLOUR = "#d55e00"


def nominal_points(waypoints: Waypoints) -> tuple[FloatArray, Mapping[int, Gate]]:
    """Return positions (n, dim) [m], with the centers of gates, and the gates by waypoint."""
    points, gates = without_gates(waypoints)
    return np.asarray(points, dtype=np.float64), gates


def draw_waypoints(ax: Axes, points: FloatArray, chosen: list[int]) -> None:
    """Mark positions (n, dim) with dots, in some of their coordinates."""
    ax.plot(*points[:, chosen].T, "o", color="black", markersize=4, linestyle="none", label="waypoints", zorder=4)


def draw_gates(ax: Axes, gates: Sequence[Gate], chosen: list[int]) -> None:
    """Draw the outline of every opening; from its side it is a line."""
    for number, gate in enumerate(gates):
        outline = np.concatenate((gate.corners, gate.corners[:1]))[:, chosen]
        label = None if number else "gates"
        ax.plot(*outline.T, color=GATE_COLOUR, linewidth=2.0, solid_joinstyle="round", label=label, zorder=4)


def draw_balls(ax: Axes, points: FloatArray, ball: Ball, gates: Mapping[int, Gate], chosen: list[int]) -> None:
    """Draw a circle around every waypoint with a ball; in space three circles."""
    radii = ball.of_waypoints(len(points))
    label: str | None = "balls"
    for waypoint in np.flatnonzero(radii):
        if int(waypoint) in gates:
            continue
        for ring in _rings(len(chosen)):
            circle = points[waypoint, chosen] + radii[waypoint] * ring
            ax.plot(*circle.T, color=CORRIDOR_EDGE, linewidth=1.0, label=label, zorder=4)
            label = None


def _rings(dim: int) -> list[FloatArray]:
    """Return unit circles: one in the plane, one for each pair of axes in space."""
    angle = np.linspace(0.0, 2.0 * np.pi, AROUND + 1)
    flat = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    if dim == 2:
        return [flat]
    return [np.insert(flat, axis, 0.0, axis=1) for axis in range(3)]
