"""Where a show is flown: its origin on the earth, homes that were surveyed, and a fence around all.

A fence is a convex polygon seen from above: its walls are vertical planes, so that the distance of a curve to each is
that of its control points along one direction, exact over all time.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from minsnap.basics.arrays import ArrayLike, FloatArray, ReadOnly, numbers, set_fields
from minsnap.basics.checks import check_array
from minsnap.basics.messages import shown
from minsnap.basics.storage.table import LooseColumns, read_loose_table
from minsnap.basics.storage.text import FileName
from minsnap.corridors import Cylinder
from minsnap.errors import FileError, FleetError
from minsnap.files import geodetic_positions, local_positions
from minsnap.fleet import Fleet, extent_of

FAR = 5000.0
"""Distance from the origin from which a surveyed place is taken for a mistake [m]."""

FLAT_WALL = 1e3
"""Radius of the cylinder that stands for a wall where curves are searched for: 1 cm from it at 5 m [m]."""

SURVEY = LooseColumns(
    {
        "latitude": ("deg",),
        "longitude": ("deg",),
        "altitude": ("m",),
        "lat": ("deg",),
        "lon": ("deg",),
        "lng": ("deg",),
        "alt": ("m",),
    },
    (),
    (("latitude", "longitude"), ("latitude", "longitude", "altitude")),
    "give latitude and longitude, and altitude if there is one",
)
"""Columns of a survey."""


@dataclass(frozen=True, eq=False)
class ShowOrigin:
    """The place of the origin of a show, and its direction.

    Parameters
    ----------
    latitude, longitude : float
        WGS 84 [degrees].
    altitude : float or None
        Of height 0, above mean sea level [m].
    orientation : float
        Of the x axis, clockwise from north [degrees]; y is left of it. 90 is east.
    """

    latitude: float
    longitude: float
    altitude: float | None = None
    orientation: float = 90.0

    def __post_init__(self) -> None:
        sizes = {"latitude": (self.latitude, 90.0), "longitude": (self.longitude, 180.0)}
        sizes |= {"altitude": (self.altitude or 0.0, 10_000.0), "orientation": (self.orientation, 360.0)}
        for name, (value, most) in sizes.items():
            if not abs(value) <= most:
                raise FleetError(f"the {name} of the origin is {value:g}: give a number from {-most:g} to {most:g}")

    @property
    def axes(self) -> FloatArray:
        """The axes of the show as columns, in the frame east, north, up, shape (3, 3)."""
        turn = np.radians(90.0 - self.orientation)
        return np.array([[np.cos(turn), -np.sin(turn), 0.0], [np.sin(turn), np.cos(turn), 0.0], [0.0, 0.0, 1.0]])

    def local(self, geodetic: ArrayLike) -> FloatArray:
        """Return places in the frame of the show, shape (..., 3) [m].

        Parameters
        ----------
        geodetic : array_like, shape (..., 3)
            Latitude, longitude [degrees] and altitude above mean sea level [m].
        """
        away = local_positions(geodetic, (self.latitude, self.longitude, self.altitude or 0.0))
        return np.asarray(away @ self.axes)

    def geodetic(self, local: ArrayLike) -> FloatArray:
        """Return latitude, longitude [degrees] and altitude above mean sea level [m] of places, shape (..., 3)."""
        home = (self.latitude, self.longitude, self.altitude or 0.0)
        return geodetic_positions(np.asarray(local, dtype=np.float64) @ self.axes.T, home)


def read_survey(file: FileName, origin: ShowOrigin | None) -> FloatArray:
    """Return surveyed places in the frame of a show, shape (n, 3) [m].

    Parameters
    ----------
    file : str or path
        A table with latitude and longitude [degrees], and the altitude above mean sea level [m]: without it, or where
        the origin has none, all are at height 0.
    origin : ShowOrigin or None

    Raises
    ------
    FileError
        If there is no origin, the file is no such table, or a place is farther than 5 km from the origin.
    """
    if origin is None:
        raise FileError(f"{file} has latitudes and longitudes: give the show an origin: {{latitude, longitude}}")
    table, _ = read_loose_table(file, SURVEY)
    columns = [next((table[name] for name in names if name in table), None) for names in _NAMES]
    if columns[0] is None or columns[1] is None:
        raise FileError(f"{file} has the columns {', '.join(table)}: give latitude and longitude")
    level = columns[2] if columns[2] is not None and origin.altitude is not None else None
    heights = np.full(len(columns[0]), origin.altitude or 0.0) if level is None else level
    places = origin.local(np.stack([columns[0], columns[1], heights], axis=1))
    away = np.linalg.norm(places, axis=1)
    if away.max() > FAR:
        which = int(away.argmax())
        raise FileError(
            f"{file}: place {which} is {away[which] / 1e3:.0f} km from the origin of the show: is one of them on the "
            "wrong side, or are latitude and longitude exchanged?"
        )
    if level is None:
        places[:, 2] = 0.0  # what the earth curves away is no height
    return places


_NAMES = (("latitude", "lat"), ("longitude", "lon", "lng"), ("altitude", "alt"))


@dataclass(frozen=True, eq=False)
class Fence(ReadOnly):
    """Vertical walls around a convex polygon, each with a margin.

    Parameters
    ----------
    corners : array_like, shape (n, 2), n >= 3
        In either order [m]; wall i leads from corner i to the next.
    margins : float or array_like, shape (n,)
        How far vehicles stay away from each wall [m].

    Raises
    ------
    FleetError
        If they are no polygon, its sides cross or it is not convex, a margin is negative, or nothing is left inside.
    """

    corners: FloatArray
    margins: FloatArray

    def __init__(self, corners: ArrayLike, margins: ArrayLike = 0.0) -> None:
        points = numbers(corners)
        if (
            points is None
            or points.ndim != 2
            or points.shape[1] != 2
            or len(points) < 3
            or not np.isfinite(points).all()
        ):
            raise FleetError(f"the fence is {shown(corners)}: give three corners or more, each x and y [m]")
        sides = np.roll(points, -1, axis=0) - points
        turns = sides[:, 0] * np.roll(sides, -1, axis=0)[:, 1] - sides[:, 1] * np.roll(sides, -1, axis=0)[:, 0]
        angles = np.arctan2(turns, (sides * np.roll(sides, -1, axis=0)).sum(axis=1))
        if not (np.linalg.norm(sides, axis=1) > 0.0).all():
            raise FleetError("two corners of the fence are one point: give each once")
        if not (np.all(turns >= 0.0) or np.all(turns <= 0.0)) or not np.isclose(abs(angles.sum()), 2.0 * np.pi):
            raise FleetError(
                "the sides of the fence cross, or it has a corner that points inwards: give a convex polygon"
            )
        give = f"one number of 0 or more, or one for each of {len(points)} walls [m]"
        away = check_array("the margin of the fence", margins, ((), (len(points),)), give, FleetError, 0.0)
        set_fields(self, corners=points, margins=np.zeros(len(points)) + away)
        if float(self.walls_of(self._middle()).min()) <= 0.0:
            raise FleetError("the margins of the fence leave nothing inside: give smaller ones")

    def _middle(self) -> FloatArray:
        """Return a point that is farthest inside of all walls and margins, shape (1, 3)."""
        from scipy.optimize import linprog

        normals, offsets = self._planes
        rows, upper = np.column_stack((normals, np.ones(len(normals)))), offsets - self.margins
        found = linprog((0.0, 0.0, -1.0), rows, upper, bounds=(None, None))
        return np.array([[found.x[0], found.x[1], 0.0]])

    @property
    def _planes(self) -> tuple[FloatArray, FloatArray]:
        """Unit normals that point out, shape (n, 2), and offsets (n,)."""
        sides = np.roll(self.corners, -1, axis=0) - self.corners
        normals = np.stack([sides[:, 1], -sides[:, 0]], axis=1) / np.linalg.norm(sides, axis=1)[:, None]
        if (normals * self.corners).sum() < 0.0:  # twice the area, its sign that of the order
            normals = -normals
        return normals, (normals * self.corners).sum(axis=1)

    @property
    def inside(self) -> FloatArray:
        """Corners of what the margins leave inside, in turn, shape (m, 2) [m]."""
        from scipy.spatial import ConvexHull, HalfspaceIntersection

        normals, offsets = self._planes
        rows = np.column_stack((normals, self.margins - offsets))
        corners = HalfspaceIntersection(rows, self._middle()[0, :2]).intersections
        return np.asarray(corners[ConvexHull(corners).vertices])

    def walls_of(self, points: FloatArray) -> FloatArray:
        """Return how far inside of each wall's margin points (..., 3) are, shape (..., n) [m]."""
        normals, offsets = self._planes
        return np.asarray(offsets - self.margins - points[..., :2] @ normals.T)

    def distances(self, fleet: Fleet) -> FloatArray:
        """Return the proved least distance of each vehicle to each wall, negative outside, shape (vehicles, n) [m]."""
        normals, offsets = self._planes
        slack = 1e-15 * (np.abs(offsets) + np.abs(self.corners).max())
        highest = [extent_of(curve.control_points[..., :2] @ normals.T)[1] for curve in fleet]
        return np.asarray(offsets - 4.0 * slack - np.stack(highest))

    def margin_of(self, fleet: Fleet) -> float:
        """Return by how much all vehicles stay away from the walls beyond their margins, proved [m]."""
        return float((self.distances(fleet) - self.margins).min())

    def obstacles(self) -> list[Cylinder]:
        """Return what stands outside of the margins while curves are searched for: nearly flat cylinders."""
        normals, offsets = self._planes
        middles = (self.corners + np.roll(self.corners, -1, axis=0)) / 2.0
        inside = middles + normals * (offsets - self.margins - (normals * middles).sum(axis=1))[:, None]
        return [Cylinder(point + FLAT_WALL * normal, FLAT_WALL) for point, normal in zip(inside, normals, strict=True)]
