"""What stands still in the scene: the ground grid, the axes with their names, obstacles, the scale of speeds."""

from __future__ import annotations

from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.files.frames import get_frame
from minsnap.studio.obstacles import Floor, Obstacles

AXES = {
    "enu": ("x East", "y North", "z Up"),
    "ned": ("x North", "y East", "z Down"),
    "flu": ("x Forward", "y Left", "z Up"),
    "frd": ("x Forward", "y Right", "z Down"),
    "optitrack": ("x", "y Up", "z"),
}
"""Names of the axes of every frame."""

COLOURS = ((213, 0, 0), (0, 140, 0), (0, 60, 220))
OBSTACLE = (134, 96, 62)

Lines = tuple[tuple[int, int, int], tuple[int, int, int]]
BY_DAY: Lines = ((222, 226, 230), (173, 181, 189))
BY_NIGHT: Lines = ((30, 37, 56), (48, 57, 80))
"""Colours of the lines of the ground: of cells, and of every fifth."""


class GroundView:
    """Grid, axes and obstacles.

    Parameters
    ----------
    server : viser.ViserServer
        Where they are drawn.
    """

    def __init__(self, server: Any) -> None:
        self._server = server
        server.scene.world_axes.visible = False
        self._labels: list[Any] = []
        self._axes: tuple[Any, ...] = ()
        self._place: tuple[float, tuple[float, ...]] = (0.0, ())

    def show(self, frame: str, points: FloatArray, lines: Lines = BY_DAY) -> None:
        """Draw the ground under the waypoints, shape (n, 3) [m], and the axes of a frame."""
        center, size = points.mean(axis=0), float(np.ceil(2.0 * np.ptp(points, axis=0)[:2].max() + 8.0))
        middle = (float(np.round(center[0])), float(np.round(center[1])), 0.0)
        cell = 1.0 if size < 100.0 else 10.0
        cells = {
            "cell_size": cell,
            "section_size": 5.0 * cell,
            "fade_distance": 4.0 * size,
            "cell_color": lines[0],
            "section_color": lines[1],
        }
        if self._place != (size, middle):
            self._place = size, middle
            self._server.scene.add_grid("/ground", size, size, position=middle, shadow_opacity=0.0, **cells)
        length = float(np.clip(0.2 * np.ptp(points, axis=0).max(), 1.0, 20.0))
        place = (frame, length, float(center[0]), float(points[:, 1].min() - 1.2 * length))
        if place != self._axes:
            self._axes = place
            self._show_axes(frame, length, np.array([*place[2:], 0.0]))

    def show_obstacles(self, obstacles: Obstacles) -> None:
        """Draw occupied cells and points."""
        if len(obstacles.boxes):
            vertices, faces = obstacles.surface()
            look = {"color": OBSTACLE, "opacity": 0.55, "flat_shading": True, "side": "double"}
            self._server.scene.add_mesh_simple("/obstacles/cells", vertices, faces, **look)
        if len(obstacles.points):
            how = {"point_size": obstacles.point_size, "point_shape": "rounded"}
            self._server.scene.add_point_cloud("/obstacles/points", obstacles.points, OBSTACLE, **how)

        if obstacles.floor is not None:
            self._show_floor(obstacles.floor)

    def _show_floor(self, floor: Floor) -> None:
        """Lay a picture on the ground, a little below the grid; viser's pictures have x to the right and y down."""
        width, height = floor.size
        middle = (floor.corner[0] + 0.5 * width, floor.corner[1] + 0.5 * height, -0.01)
        turned = {"wxyz": (0.0, 1.0, 0.0, 0.0), "position": middle, "cast_shadow": False, "receive_shadow": False}
        self._server.scene.add_image("/obstacles/floor", floor.picture, width, height, **turned)

    def _show_axes(self, frame: str, length: float, corner: FloatArray) -> None:
        """Draw the axes beside the scene, where their names cover nothing of it."""
        for label in self._labels:
            label.remove()
        directions = length * get_frame(frame).matrix
        ends = np.stack([np.zeros((3, 3)), directions], axis=1) + corner
        colours = np.repeat(np.array(COLOURS, dtype=np.uint8)[:, None], 2, axis=1)
        how = {"thickness": 4.0, "thickness_units": "screen"}
        self._server.scene.add_line_segments("/axes", ends, colours, **how)
        add = self._server.scene.add_label
        names = AXES[get_frame(frame).name]
        places = corner + 1.15 * directions
        self._labels = [
            add(f"/axes/{i}", name, position=place, anchor="center-center", font_screen_scale=0.9)
            for i, (name, place) in enumerate(zip(names, places, strict=True))
        ]
