"""The surroundings of a route in the scene: what is occupied of a map, obstacles, points, fences, and its polytopes."""

from __future__ import annotations

from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray, IntArray
from minsnap.corridors import Avoided, Kept, Prism
from minsnap.paths.routes import GridMap, Route
from minsnap.plot.geometry import leg_bodies
from minsnap.plot.map_cells import HEIGHT, near_cells, surface
from minsnap.plot.obstacles import Numbered
from minsnap.studio.ground_view import OBSTACLE, cloud
from minsnap.studio.obstacle_view import halves_of, triangles
from minsnap.studio.wall_view import TUBE
from minsnap.trajectory import Trajectory

FENCE = (92, 98, 112)


def in_space(curve: Trajectory) -> Trajectory:
    """Return a path in space: a plane one at half the height of what is drawn around it."""
    if curve.dim == 3:
        return curve
    points = np.pad(curve.control_points, ((0, 0), (0, 0), (0, 1)), constant_values=0.5 * HEIGHT)
    return Trajectory(points, curve.durations, curve.yaw, curve.pieces)


class MapView:
    """The surroundings of a route.

    Parameters
    ----------
    server : viser.ViserServer
        Where they are drawn.
    route : Route
    """

    def __init__(self, server: Any, route: Route) -> None:
        self._scene = server.scene
        self.note = ""
        places = np.asarray(route.trajectory(np.linspace(0.0, route.duration, 400)))
        self._draw_polytopes(route)
        if route.grid is not None:
            self._draw_cells(route.grid, places, route.clearance)
        elif isinstance(route.around, Kept):
            self._draw_kept(route.around, places)

    def _draw_polytopes(self, route: Route) -> None:
        from scipy.spatial import ConvexHull

        look = {"color": TUBE, "opacity": 0.12, "side": "double", "flat_shading": True}
        plain = {"cast_shadow": False, "receive_shadow": False}
        for leg, corners in enumerate(leg_bodies(route.corridor, route(route.trajectory.leg_breaks))):
            body = corners if route.dim == 3 else _upright(corners)
            faces = ConvexHull(body).simplices
            self._scene.add_mesh_simple(f"/plan/polytope/{leg}", body, faces, **look, **plain)

    def _draw_cells(self, grid: GridMap, places: FloatArray, clearance: float) -> None:
        taken, side, corner = near_cells(grid, places, clearance)
        faces, size = surface(taken)
        if not len(faces):
            return
        self._mesh("/map/cells", *halves_of(corner + side * faces))
        if size > 1:
            across = " by ".join(f"{size * each:g}" for each in side[: grid.dim])
            self.note = f"cells are drawn {across} m large, occupied where one of the map's is"

    def _draw_kept(self, kept: Kept, places: FloatArray) -> None:
        prisms = () if kept.prisms is None else kept.prisms.prisms
        inside = [each for each in prisms if each.inclusion]
        around = places if places.shape[1] == 3 else _upright(places)
        shown: list[Avoided] = [*map(Numbered, kept.obstacles), *(each for each in prisms if not each.inclusion)]
        corners, faces = triangles(shown, around)
        if len(faces):
            self._mesh("/map/obstacles", corners, faces)
        if len(kept.points):
            seen = cloud(kept.points if kept.points.shape[1] == 3 else _upright(kept.points))
            how = {"point_size": seen.point_size, "point_shape": "rounded"}
            self._scene.add_point_cloud("/map/points", seen.points, OBSTACLE, **how)
        for number, fence in enumerate(inside):
            self._draw_fence(number, fence, around)

    def _draw_fence(self, number: int, fence: Prism, places: FloatArray) -> None:
        rings = [np.insert(fence.polygon, 2, height, axis=1) for height in (0.0, float(places[:, 2].max()))]
        sides = [np.stack([ring, np.roll(ring, -1, axis=0)], axis=1) for ring in rings]
        lines = np.concatenate([*sides, np.stack(rings, axis=1)]).astype(np.float32)
        self._scene.add_line_segments(f"/map/fence/{number}", lines, FENCE, thickness=2.0, thickness_units="screen")

    def _mesh(self, name: str, corners: FloatArray, faces: IntArray) -> None:
        look = {"color": OBSTACLE, "flat_shading": True, "side": "double"}
        self._scene.add_mesh_simple(name, corners.astype(np.float32), faces, cast_shadow=False, **look)


def _upright(corners: FloatArray) -> FloatArray:
    """Return points of a plane, shape (n, 2), at the ground and at the height that they are drawn to, (2 n, 3) [m]."""
    return np.concatenate([np.insert(corners, 2, height, axis=1) for height in (0.0, HEIGHT)])
