"""The path of the plan in the scene, coloured by speed, with the plan before and a simulated flight."""

from __future__ import annotations

from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.studio.plan_drawing import coloured_path, pieces_of
from minsnap.studio.workbench import BenchState
from minsnap.trajectory.trajectory import Trajectory

GHOST = (173, 181, 189)
FLIGHT = (230, 73, 20)
"""Colours of the plan before and of a simulated flight."""

WIDTH = 5.0
"""Of the path [pixels]."""


class PathView:
    """Lines of the scene.

    Parameters
    ----------
    server : viser.ViserServer
        Where it is drawn.
    """

    def __init__(self, server: Any) -> None:
        nothing, white = np.zeros((1, 2, 3)), (255, 255, 255)
        lines = {"thickness_units": "screen", "visible": False}
        add = server.scene.add_line_segments
        self._path = add("/plan/path", nothing, np.zeros((1, 2, 3)), thickness=WIDTH, **lines)
        self._ghost = add("/plan/before", nothing, GHOST or white, thickness=WIDTH / 2.0, **lines)
        self._flight = add("/plan/flight", nothing, FLIGHT, thickness=WIDTH / 1.5, **lines)
        self._drawn: Trajectory | None = None
        self._before: Trajectory | None = None
        self.top_speed = 0.0

    def show(self, state: BenchState) -> None:
        """Draw the last good plan and the one before."""
        if state.planned is not None and state.planned.trajectory is not self._drawn:
            self._drawn = state.planned.trajectory
            points, colours, self.top_speed = coloured_path(self._drawn)
            self._path.points, self._path.colors, self._path.visible = points, colours, True
        if state.ghost is not None and state.ghost is not self._before and state.ghost is not self._drawn:
            self._before = state.ghost
            t = np.linspace(0.0, self._before.duration, 200)
            self._ghost.points, self._ghost.visible = pieces_of(self._before(t)), True

    def overlay(self, positions: FloatArray | None) -> None:
        """Draw a simulated flight, positions of shape (m, 3) [m]; or remove it."""
        if positions is not None:
            step = max(len(positions) // 800, 1)
            self._flight.points = pieces_of(positions[::step])
        self._flight.visible = positions is not None
