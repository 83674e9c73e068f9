"""What stands still in the scene: the ground grid, the axes with their names, and obstacles read from files."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from minsnap.basics.arrays import ArrayLike, BoolArray, FloatArray, NDArray, ReadOnly
from minsnap.basics.storage.table import read_archive
from minsnap.basics.storage.text import FileName, check_size, reading
from minsnap.errors import FileError, InputError
from minsnap.files import get_frame, read_waypoints
from minsnap.paths.routes import GridMap, read_map_entries
from minsnap.studio.plan_drawing import blended
from minsnap.studio.wall_view import box_surface

MOST_CELLS = 200_000
"""Occupied cells of the largest grid that is shown."""

MOST_PIXELS = 16_000_000
"""Of the largest floor."""

MOST_POINTS = 200_000
"""Points that are shown of a cloud; of larger ones every n-th."""

ENDINGS = (".npz", ".csv", ".yaml", ".yml")
"""Of files of obstacles and floors."""

PICTURES = (".png", ".jpg", ".jpeg", ".pgm")
"""Of pictures of a floor."""


AXES = {
    "enu": ("x East", "y North", "z Up"),
    "ned": ("x North", "y East", "z Down"),
    "flu": ("x Forward", "y Left", "z Up"),
    "frd": ("x Forward", "y Right", "z Down"),
    "optitrack": ("x", "y Up", "z"),
}
"""Names of the axes of every frame."""

COLOURS = ((213, 0, 0), (0, 140, 0), (30, 90, 235))

OBSTACLE = (134, 96, 62)

Lines = tuple[tuple[int, int, int], tuple[int, int, int]]

BY_DAY: Lines = ((222, 226, 230), (173, 181, 189))

BY_NIGHT: Lines = ((30, 37, 56), (48, 57, 80))
"""Colours of the lines of the ground: of cells, and of every fifth."""


@dataclass(frozen=True, eq=False)
class Floor:
    """A picture on the ground, such as a floor plan or an aerial photograph.

    Parameters
    ----------
    picture : ndarray, shape (rows, columns, 3)
        Red, green, blue; north, which is y, is up.
    resolution : float
        Side of a pixel [m].
    corner : tuple of 2 floats
        The lower left one [m].
    """

    picture: NDArray[np.uint8]
    resolution: float
    corner: tuple[float, float]

    @property
    def size(self) -> tuple[float, float]:
        """Width and height [m]."""
        return self.picture.shape[1] * self.resolution, self.picture.shape[0] * self.resolution


@dataclass(frozen=True, eq=False)
class Obstacles(ReadOnly):
    """What is to be shown.

    Parameters
    ----------
    boxes : ndarray, shape (m, 2, 3)
        Corners of occupied columns of cells [m].
    points : ndarray, shape (n, 3)
        [m].
    point_size : float
        [m].
    floor : Floor or None
        A picture on the ground.
    """

    boxes: FloatArray = field(default_factory=lambda: np.zeros((0, 2, 3)))
    points: FloatArray = field(default_factory=lambda: np.zeros((0, 3)))
    point_size: float = 0.05
    floor: Floor | None = None


def cloud(points: ArrayLike) -> Obstacles:
    """Return a point cloud, shape (n, 3) [m], thinned if it is large.

    Raises
    ------
    InputError
        If it has another shape or is not finite.
    """
    values = np.asarray(points, dtype=np.float64)
    if values.ndim != 2 or values.shape[1] != 3 or not len(values) or not np.isfinite(values).all():
        raise InputError(f"a point cloud has shape (n, 3) and finite coordinates, not shape {values.shape}")
    step = -(-len(values) // MOST_POINTS)
    size = 0.004 * float(max(np.ptp(values, axis=0).max(), 1.0))
    return Obstacles(points=values[::step], point_size=size)


def grid(occupancy: ArrayLike, resolution: ArrayLike, origin: ArrayLike | None = None) -> Obstacles:
    """Return the occupied cells of a grid, as :func:`minsnap.corridor_from_grid` takes it.

    Cells that follow each other along z become one box; a grid of two axes stands 1 m high on the ground.

    Parameters
    ----------
    occupancy : array_like, shape (nx, ny) or (nx, ny, nz)
        0 where free.
    resolution : float or array_like
        Side of a cell [m].
    origin : array_like, optional
        Outer corner of the first cell [m]; by default zero.

    Raises
    ------
    InputError
        If an array has another shape, or too many cells are occupied.
    """
    start = None if origin is None else np.asarray(origin, dtype=np.float64)
    held = GridMap(np.asarray(occupancy) != 0, np.asarray(resolution, dtype=np.float64), start, "the occupancy grid")
    taken, side, corner = held.occupied, held.resolution, held.lower
    if taken.ndim == 2:
        taken, side, corner = taken[:, :, None], np.append(side, 1.0), np.append(corner, 0.0)
    if taken.sum() > MOST_CELLS:
        raise InputError(f"{int(taken.sum())} cells are occupied: the studio shows up to {MOST_CELLS}")
    return Obstacles(corner + side * _columns(taken))


def floor(path: FileName, resolution: float, corner: ArrayLike) -> Obstacles:
    """Read a picture of the ground: metres a pixel, and where its lower left corner lies [m].

    Raises
    ------
    FileError
        If it is no picture, or too large.
    InputError
        If the numbers are not finite, or the first not positive.
    """
    from PIL import Image

    place = np.asarray(corner, dtype=np.float64).reshape(-1)
    if not (np.isfinite(resolution) and resolution > 0.0 and len(place) >= 2 and np.isfinite(place).all()):
        raise InputError("a floor needs the side of a pixel [m], which is positive, and its lower left corner, x and y")
    check_size(path)
    with reading(path, "a picture"), Image.open(path, formats=("PNG", "JPEG", "PPM")) as opened:
        if opened.width * opened.height > MOST_PIXELS:
            raise FileError(f"{path} has {opened.width} x {opened.height} pixels: at most {MOST_PIXELS} are shown")
        picture = np.array(opened.convert("RGB"), dtype=np.uint8)
    return Obstacles(floor=Floor(picture, float(resolution), (float(place[0]), float(place[1]))))


def read_obstacles(path: FileName) -> Obstacles:
    """Read obstacles: x,y,z CSV; or an ``.npz`` archive of ``points``, or of ``occupancy``, ``resolution``, ``origin``.

    A map of ROS's map_server (YAML with its picture beside it) is a floor.

    Raises
    ------
    FileError
        If the file is neither.
    """
    if Path(path).suffix.lower() == ".csv":
        return cloud(read_waypoints(path).points)
    if Path(path).suffix.lower() in (".yaml", ".yml"):
        entries = read_map_entries(path)
        return floor(Path(path).parent / entries["image"], entries["resolution"], entries["origin"])
    if Path(path).suffix.lower() != ".npz":
        raise FileError(f"{Path(path).name} holds no obstacles by its ending: it must be one of {', '.join(ENDINGS)}")
    content: dict[str, Any] = read_archive(path)
    try:
        if "points" in content:
            return cloud(content["points"])
        return grid(content["occupancy"], content["resolution"], content.get("origin"))
    except KeyError:
        raise FileError(f"{path} needs an array called points, or two called occupancy and resolution") from None
    except InputError as error:
        raise FileError(f"{path}: {error}") from None


def _columns(taken: BoolArray) -> FloatArray:
    """Return runs of occupied cells along the last axis as corners in cells, shape (m, 2, 3)."""
    padded = np.pad(taken, ((0, 0), (0, 0), (1, 1))).astype(np.int8)
    change = np.diff(padded, axis=2)
    starts, ends = np.argwhere(change == 1), np.argwhere(change == -1)
    return np.stack([starts, ends + [1, 1, 0]], axis=1).astype(np.float64)


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
        self._found: list[Any] = []
        self._place: tuple[Any, ...] = ()

    def show(self, frame: str, points: FloatArray, lines: Lines = BY_DAY) -> None:
        """Draw the ground under the waypoints, shape (n, 3) [m], and the axes of a frame."""
        center, size = points.mean(axis=0), float(np.ceil(2.0 * np.ptp(points, axis=0)[:2].max() + 8.0))
        middle = (float(np.round(center[0])), float(np.round(center[1])), 0.0)
        cell = 1.0 if size < 100.0 else 10.0
        sizes = {"cell_size": cell, "section_size": 5.0 * cell, "fade_distance": 4.0 * size}
        cells = sizes | {"cell_color": lines[0], "section_color": lines[1]}
        if self._place != (size, middle, lines):
            self._place = size, middle, lines
            self._server.scene.add_grid("/ground", size, size, position=middle, shadow_opacity=0.0, **cells)
        length = float(np.clip(0.2 * np.ptp(points, axis=0).max(), 1.0, 20.0))
        place = (frame, length, float(center[0]), float(points[:, 1].min() - 1.2 * length))
        if place != self._axes:
            self._axes = place
            self._show_axes(frame, length, np.array([*place[2:], 0.0]))

    def hide_obstacles(self, hidden: bool) -> None:
        """Hide cells and points of files, or show them again; floors stay."""
        for handle in self._found:
            handle.visible = not hidden

    def show_obstacles(self, obstacles: Obstacles) -> None:
        """Draw occupied cells and points."""
        if len(obstacles.boxes):
            vertices, faces = box_surface(obstacles.boxes)
            look = {"color": OBSTACLE, "opacity": 0.55, "flat_shading": True, "side": "double"}
            cells = self._server.scene.add_mesh_simple("/obstacles/cells", vertices, faces, **look)
            self._found = [*self._found, cells]
        if len(obstacles.points):
            how = {"point_size": obstacles.point_size, "point_shape": "rounded"}
            points = self._server.scene.add_point_cloud("/obstacles/points", obstacles.points, OBSTACLE, **how)
            self._found = [*self._found, points]
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
        colours = np.repeat(blended(COLOURS)[:, None], 2, axis=1)
        how = {"thickness": 4.0, "thickness_units": "screen"}
        self._server.scene.add_line_segments("/axes", ends, colours, **how)
        add = self._server.scene.add_label
        names = AXES[get_frame(frame).name]
        places = corner + 1.15 * directions
        self._labels = [
            add(f"/axes/{i}", name, position=place, anchor="center-center", font_screen_scale=0.9)
            for i, (name, place) in enumerate(zip(names, places, strict=True))
        ]
