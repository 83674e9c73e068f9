"""Lines of a survey that follow the ground: straight as seen from above, and within a distance of a height over it.

A line is divided into legs whose ends are at the height over the ground. Each leg stays between a floor and a ceiling,
planes as steep as itself (:func:`minsnap.paths.routes.terrain_walls.build_terrain_walls`), at every instant; its
horizontal part is a polynomial of degree 1.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.checks import check_positive
from minsnap.certificate import certify
from minsnap.errors import InfeasibleError, ShapeError, WaypointError
from minsnap.limits.limits import Limits
from minsnap.paths.routes.terrain import Terrain
from minsnap.paths.routes.terrain_walls import build_terrain_walls
from minsnap.planning.planner import plan
from minsnap.polynomials.bernstein import subdivision
from minsnap.trajectory.trajectory import Trajectory


@dataclass(frozen=True)
class GroundSettings:
    """How lines are laid over the ground.

    Parameters
    ----------
    cells : float
        Length of a leg at first, in cells of the ground.
    seconds : float
        Least time of a leg at first [s].
    halved : int
        Times that legs are halved at most.
    beside : float
        Half-width of the strip below a line whose ground counts [m].
    kept : float
        Share of the distance from the height that plans use; the rest is for rounding of the horizontal part.
    parts : int
        Into how many parts polynomials of turns are divided to look at the ground below each.
    """

    cells: float = 4.0
    seconds: float = 2.0
    halved: int = 3
    beside: float = 1.0
    kept: float = 0.95
    parts: int = 8


GROUND = GroundSettings()


@dataclass(frozen=True, eq=False)
class GroundLines:
    """The ground, the height over it, and how far lines may be above and below that height [m]."""

    terrain: Terrain
    height: float
    within: float

    @classmethod
    def of(cls, terrain: Any, height: float, within: Any) -> GroundLines:
        """Return them from what a caller gave.

        Raises
        ------
        ShapeError
            If one of both is missing, or a number makes no sense.
        """
        if not isinstance(terrain, Terrain) or within is None:
            raise ShapeError("terrain and within go together: the ground as read_terrain returns it, and metres")
        room = check_positive("within", within, "m", ShapeError)
        if room >= height:
            raise ShapeError(f"lines {height:g} m above the ground cannot be {room:g} m lower: give a larger height")
        return cls(terrain, height, float(room))

    def line(self, line: FloatArray, pace: float, limits: Limits) -> Trajectory:
        """Return the flight over the ground from one end of a line (2, 3) to the other, level at both ends.

        Raises
        ------
        ShapeError
            If the ground cannot be followed so closely, or within the limits at this speed.
        WaypointError
            If it is not known.
        """
        length = float(np.linalg.norm(line[1, :2] - line[0, :2]))
        least = max(GROUND.cells * self.terrain.side, GROUND.seconds * pace)
        count, why = max(1, round(length / least)), ""
        for _ in range(GROUND.halved + 1):
            places = np.linspace(line[0, :2], line[1, :2], count + 1)
            try:
                flown = self._flown(np.column_stack([places, self.terrain.at(places) + self.height]), pace)
            except (WaypointError, InfeasibleError) as error:
                count, why = 2 * count, f"{error}"
                continue
            if flown is not None and certify(flown, limits=limits).ok:
                return flown
            count, why = (
                2 * count,
                "it is beyond the limits" if flown is not None else "it is not proved to keep its distance",
            )
        ends = " to ".join(f"({x:.4g}, {y:.4g})" for x, y in line[:, :2])
        raise ShapeError(
            f"the line from {ends} cannot follow the ground within {self.within:g} m at {pace:g} m/s ({why}): "
            "give more room, or a lower speed"
        )

    def _flown(self, points: FloatArray, pace: float) -> Trajectory | None:
        """Return the flight past points (n, 3), in given times, between floors and ceilings; None where unproved."""
        steps = np.diff(points[:, :2], axis=0)
        durations = np.linalg.norm(steps, axis=1) / pace
        level = np.array([*(steps[0] / durations[0]), 0.0])
        room = np.zeros(points.shape)
        room[1:-1, 2] = 0.5 * self.within
        ends: dict[str, Any] = {"start": {"velocity": level}, "end": {"velocity": level}}
        walls = self._walls(points, GROUND.kept)
        raw = plan(points, durations, corridor=walls, waypoint_tolerance=room if len(points) > 2 else None, **ends)
        shares = np.linspace(0.0, 1.0, raw.degree + 1)[:, None]
        flat = points[:-1, None, :2] + shares * steps[:, None]
        curve = Trajectory(np.concatenate([flat, raw.control_points[..., 2:]], axis=2), durations)
        return curve if certify(curve, curve(curve.breaks), self._walls(points, 1.0)).ok else None

    def _walls(self, points: FloatArray, share: float) -> Any:
        room = share * self.within
        return build_terrain_walls(self.terrain, points, self.height - room, self.height + room, GROUND.beside)

    def check(self, parts: list[Trajectory]) -> None:
        """Refuse turns and ends of a survey that come nearer to the ground than its lines may.

        Every part of a polynomial is inside the box of its control points.

        Raises
        ------
        WaypointError
            If one of them does, or the ground below is not known; says where.
        """
        least = self.height - self.within
        for part in parts[::2]:
            matrix = subdivision(part.degree, GROUND.parts)
            cut = np.einsum("ij,pjd->pid", matrix, part.control_points)
            for points in cut.reshape(-1, part.degree + 1, part.dim):
                low, high = points[:, :2].min(axis=0), points[:, :2].max(axis=0)
                room = float(points[:, 2].min()) - self._highest(low, high)
                x, y = 0.5 * (low + high)
                if np.isnan(room):
                    raise WaypointError(f"a turn leads over ground of unknown height, near ({x:.4g}, {y:.4g}) m")
                if room < least:
                    raise WaypointError(
                        f"a turn comes within {room:.4g} m of the ground near ({x:.4g}, {y:.4g}) m, and {least:g} m "
                        "are asked for: give a greater height, more room within, or a longer margin"
                    )

    def _highest(self, low: FloatArray, high: FloatArray) -> float:
        """Return the highest ground in a rectangle [m]; not a number where it is not known."""
        first = np.floor((low - self.terrain.middle) / self.terrain.side).astype(int)
        last = np.ceil((high - self.terrain.middle) / self.terrain.side).astype(int)
        if (first < 0).any() or (last >= np.array(self.terrain.heights.shape)).any():
            return float("nan")
        return float(self.terrain.heights[first[0] : last[0] + 1, first[1] : last[1] + 1].max())
