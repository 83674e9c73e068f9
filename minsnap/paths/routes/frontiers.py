"""Ways through what is known: to the goal, or to where more may be seen of a way there.

A frontier is a cell that may be flown to beside one that may prove free (B. Yamauchi, "A frontier-based approach for
autonomous exploration", CIRA 1997). The one with the least length of the way there and straight on to the goal is next.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from minsnap.basics.arrays import BoolArray, FloatArray, IntArray
from minsnap.basics.cached import cached_property
from minsnap.basics.checks import point_text
from minsnap.basics.tolerances import EXACT
from minsnap.corridors.occupancy_grid import dilated, grown
from minsnap.errors import UnprovedError
from minsnap.native.map_ways import grid_way, tangent_planes
from minsnap.paths.routes.grid_map import GridMap
from minsnap.paths.routes.known_map import edge
from minsnap.paths.routes.passage import LARGE, step_graph
from minsnap.paths.routes.surroundings import bars

TRIED = 50
"""Free cells near the start from which a straight line to it is tried."""


@dataclass(frozen=True, eq=False)
class Window:
    """A block of cells.

    Parameters
    ----------
    grid : GridMap
        Occupied where nothing may be flown through, unknown cells with them where these are avoided.
    occupied : ndarray of bool
        Where something was seen.
    clearance : float
        [m].
    beyond : bool
        Whether there may be a way beyond its border.
    seen : callable
        Returns boxes (m, 13) around what was seen, and what is avoided besides, between two corners [m].
    """

    grid: GridMap
    occupied: BoolArray
    clearance: float
    beyond: bool
    seen: Callable[[FloatArray, FloatArray], FloatArray]

    @cached_property
    def edges(self) -> FloatArray:
        """What is kept away from as boxes, (m, 13)."""
        return bars(self.grid)

    def room_at(self, place: FloatArray) -> float:
        """Return the clearance, or how far a place is from cells that are to be avoided, if that is less [m]."""
        return min(self.clearance, self._distance(self.edges, place, place))

    def near(self, start: FloatArray, end: FloatArray) -> tuple[FloatArray, float]:
        """Return boxes around what was seen beside a line, and the clearance, or the room at its start if less."""
        line, far = np.stack((start, end)), 2.0 * self.clearance + 1e-9
        boxes = self.seen(line.min(axis=0) - far, line.max(axis=0) + far)
        return boxes, min(self.clearance, self._distance(boxes, start, start))

    def way(self, start: FloatArray, goal: FloatArray, visited: BoolArray) -> FloatArray | None:
        """Return the corners of a way towards the goal (m, dim) [m]; None where nothing in the block leads on.

        Parameters
        ----------
        start, goal : ndarray, shape (dim,)
            [m].
        visited : ndarray of bool
            Cells from which nothing more is to be seen.

        Raises
        ------
        UnprovedError
            If the start is too near to what must be avoided, or no way to the goal can be left.
        """
        size, edges = self.grid.resolution, self.edges
        free = ~grown(self.grid.occupied, self.clearance, size)
        leading = self._leading(goal)
        first = self._beside(start, free & leading, edges)
        if first is None:
            raise self._no_way(start, free, edges, goal)
        last = self.grid.cell(goal)
        inside = self.grid.holds(goal)
        cells = grid_way(free, size, first, last) if inside and free[tuple(last)] else None
        if cells is not None:
            return self._line(edges, start, self.grid.center(cells), goal)
        target = self._ahead(free, leading, visited, first, goal)
        if target is None:
            target = self._frontier(free, leading, visited, first, goal)
        cells = None if target is None else grid_way(free, size, first, target)
        return None if cells is None else self._line(edges, start, self.grid.center(cells))

    def _beside(self, start: FloatArray, free: BoolArray, edges: FloatArray) -> IntArray | None:
        """Return the cell of the start, or the nearest one from which a straight line leads to it; None without one."""
        here = self.grid.cell(start)
        if free[tuple(here)]:
            return here
        cells = np.argwhere(free)
        near = cells[np.argsort(((self.grid.center(cells) - start) ** 2).sum(axis=1), kind="stable")[:TRIED]]
        return next((cell for cell in near if self._clear(edges, start, self.grid.center(cell))), None)

    def _ahead(
        self, free: BoolArray, leading: BoolArray, visited: BoolArray, first: IntArray, goal: FloatArray
    ) -> IntArray | None:
        """Return the cell where a way through what may prove free is not known any more; None without one.

        It leads to the goal, or to the cell at the border of the block nearest to it: as if all that may be free
        were (S. Koenig, C. Tovey and Y. Smirnov, "Performance bounds for planning in unknown terrain", 2003).
        """
        if self.grid.holds(goal):
            last = self.grid.cell(goal)
        else:
            inner = np.zeros_like(leading)
            inner[tuple(slice(1, -1) for _ in leading.shape)] = True
            cells = np.argwhere(leading & inner & dilated(~inner, corners=False))
            if not len(cells):
                return None
            last = cells[int(((self.grid.center(cells) - goal) ** 2).sum(axis=1).argmin())]
        open_ = leading | free
        way = grid_way(open_, self.grid.resolution, first, last) if open_[tuple(last)] else None
        return None if way is None else _last_known(way, free, visited)

    def _frontier(
        self, free: BoolArray, leading: BoolArray, visited: BoolArray, first: IntArray, goal: FloatArray
    ) -> IntArray | None:
        """Return the frontier by which the goal seems nearest; None without one."""
        from scipy.sparse.csgraph import dijkstra

        seen = free & dilated(leading & ~free, corners=False) & ~visited
        cells = np.argwhere(seen)
        if not len(cells):
            return None
        graph = step_graph(free, self.grid.resolution, free.size <= LARGE, np.zeros_like(free))
        lengths = dijkstra(graph, directed=False, indices=int(np.ravel_multi_index(tuple(first), free.shape)))
        total = lengths.reshape(free.shape)[seen] + np.linalg.norm(self.grid.center(cells) - goal, axis=1)
        best = int(np.argmin(total))
        return np.asarray(cells[best]) if np.isfinite(total[best]) else None

    def _leading(self, goal: FloatArray) -> BoolArray:
        """Return cells that may prove free and from which such ones lead to the goal, or beyond the border to it."""
        part, border = self._parts(), edge(self.occupied.shape)
        inside = self.grid.holds(goal)
        wanted = [part[tuple(self.grid.cell(goal))]] if inside else []
        if self.beyond and (not inside or wanted[0] in part[border]):
            wanted = [*wanted, *np.unique(part[border])]
        return np.asarray((part > 0) & np.isin(part, wanted))

    def _parts(self) -> IntArray:
        """Return the connected part of each cell that may prove free, 0 for the others."""
        from scipy.ndimage import label

        return np.asarray(label(~grown(self.occupied, self.clearance, self.grid.resolution))[0])

    def _no_way(self, start: FloatArray, free: BoolArray, edges: FloatArray, goal: FloatArray) -> UnprovedError:
        """Return the error that says where ways from the start end."""
        first = self._beside(start, free, edges)
        if first is None:
            return UnprovedError(
                f"nothing is known to be free by {self.clearance:g} m around {point_text(start)} m: fly on to the end "
                "of the plan, which is at rest, or lower the clearance"
            )
        part = self._parts()
        cells = self.grid.center(np.argwhere(part == part[tuple(first)]))
        nearest = cells[int(np.argmin(((cells - goal) ** 2).sum(axis=1)))]
        return UnprovedError(
            f"the goal at {point_text(goal)} m is closed off by what was seen: with a clearance of {self.clearance:g} "
            f"m ways end at {point_text(nearest)} m, {np.linalg.norm(nearest - goal):.3g} m from it; what is flown "
            "ends at rest"
        )

    def _line(self, edges: FloatArray, start: FloatArray, *parts: FloatArray) -> FloatArray:
        """Join points, and go from the start as straight as it is clear."""
        points = np.vstack((start, *parts))
        points = points[np.append(True, (np.diff(points, axis=0) != 0.0).any(axis=1))]
        while len(points) > 2 and self._clear(edges, start, points[2]):
            points = np.delete(points, 1, axis=0)
        return points

    def _clear(self, edges: FloatArray, start: FloatArray, end: FloatArray) -> bool:
        """Whether a straight line has the clearance; or to what was seen, as much as its start."""
        slack = EXACT * (1.0 + self.clearance)
        if self._distance(edges, start, end) >= self.clearance - slack:
            return True
        if self.room_at(start) >= self.clearance:
            return False
        boxes, room = self.near(start, end)
        return room > 0.0 and self._distance(boxes, start, end) >= room - slack

    def _distance(self, edges: FloatArray, start: FloatArray, end: FloatArray) -> float:
        """Return how far a line is from boxes, if it is less than its length and twice the clearance [m]."""
        line, nowhere = np.stack((start, end)), np.zeros((0, len(start)))
        far = float(np.linalg.norm(end - start)) + 2.0 * self.clearance + 1e-9
        dim = len(start)
        low, high = line.min(axis=0) - far, line.max(axis=0) + far
        near = ((edges[:, 7 : 7 + dim] <= high) & (edges[:, 10 : 10 + dim] >= low)).all(axis=1)
        return float(tangent_planes(line, edges[near], nowhere, self.clearance, far).distance[0])


def _last_known(way: IntArray, free: BoolArray, visited: BoolArray) -> IntArray | None:
    """Return the cell before a way (m, dim) leaves the free ones; None if it never does, or more was not seen there."""
    for begin, end in pairwise(way):
        count = 2 * int(np.abs(end - begin).max())
        passed = np.round(begin + np.arange(count + 1)[:, None] * ((end - begin) / count)).astype(np.intp)
        known = free[tuple(passed.T)]
        if not known.all():
            last = passed[max(int(np.argmin(known)) - 1, 0)]
            return None if visited[tuple(last)] or not free[tuple(last)] else np.asarray(last)
    return None
