"""A way among obstacles that move: which cells of a grid are reached at which instant, the goal as early as can be.

From one slice of time to the next a vehicle stays in its cell or goes to a neighbour; what can be reached grows by
slices. The way back from the goal is then made straight where a straight line in space and time is as clear.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from minsnap.basics.arrays import BoolArray, FloatArray, IntArray
from minsnap.corridors.moving import Moving
from minsnap.corridors.way_around import FreeCells, Inside, Kept, clear_lines


@dataclass(frozen=True)
class InTimeSettings:
    """The grid and the slices of time.

    Parameters
    ----------
    cells : tuple of int
        Cells along the longest side of what is between the ends, in the plane and in space.
    pace : float
        Duration of a slice, in the time that the speed takes to cross a cell: steps to neighbours at a corner are
        longer.
    slices : int
        Of time, at most.
    values : int
        Cells of all slices together, at most.
    finer : int
        How often cells are halved where there is no way.
    straightened : int
        Corners of a way that a straight line leaves out at most.
    looked : int
        Instants of a line at which obstacles are looked at.
    apart : float
        Least distance of a straight line to obstacles beyond the clearance, in sides of a cell.
    """

    cells: tuple[int, int] = (96, 28)
    pace: float = 1.2
    slices: int = 600
    values: int = 60_000_000
    finer: int = 2
    straightened: int = 40
    looked: int = 25
    apart: float = 0.2


IN_TIME = InTimeSettings()


@dataclass(frozen=True, eq=False)
class WayInTime:
    """Corners of a way, (m + 1, dim) [m], and when each is passed, (m + 1,) [s]."""

    points: FloatArray
    times: FloatArray


def way_in_time(
    kept: Kept,
    moving: Sequence[Moving],
    ends: FloatArray,
    speed: float,
    begin: float = 0.0,
    arrive: float | None = None,
    inside: Inside | None = None,
) -> WayInTime | None:
    """Return a way that keeps away from all obstacles, from an instant on; None where none is found.

    Parameters
    ----------
    kept : Kept
        What does not move.
    moving : sequence of Moving
    ends : ndarray, shape (2, dim)
        Start and goal [m].
    speed : float
        Of steps along an axis [m/s].
    begin : float
        When the start is left [s].
    arrive : float, optional
        When the goal is reached [s]; by default as early as possible.
    inside : callable, optional
        Where the way may be.
    """
    dim = ends.shape[1]
    wide = max(each.radius for each in moving) + kept.clearance
    reach = float(np.abs(np.diff(ends, axis=0)).max())
    around = np.stack((ends.min(axis=0), ends.max(axis=0))) + np.array([[-1.0], [1.0]]) * (2.0 * wide + 0.1 * reach)
    size = max(reach, 4.0 * wide) / IN_TIME.cells[dim - 2]
    for _ in range(1 + IN_TIME.finer):
        found = _Slices(kept, moving, around, size, inside).way(ends, speed, begin, arrive)
        if found is not None:
            return found
        size *= 0.5
    return None


class _Slices:
    """Cells of one size, and which of them are free at which instant."""

    def __init__(
        self, kept: Kept, moving: Sequence[Moving], around: FloatArray, size: float, inside: Inside | None
    ) -> None:
        self.kept, self.moving, self.size, self.inside = kept, moving, size, inside
        self.grid = FreeCells(kept, around, size, inside)

    def way(self, ends: FloatArray, speed: float, begin: float, arrive: float | None) -> WayInTime | None:
        """Return the way from the first end, that is left at an instant, to the other."""
        if self.grid.free.ndim != ends.shape[1]:
            return None
        first, last = (self.grid.beside(end) for end in ends)
        if first is None or last is None:
            return None
        step = IN_TIME.pace * self.size / speed
        most = min(IN_TIME.slices, IN_TIME.values // self.grid.free.size)
        if arrive is not None:
            most = min(most, int((arrive - begin) / step))
        reached = [np.zeros(self.grid.free.shape, dtype=np.bool_)]
        reached[0][tuple(first)] = True
        for index in range(most):
            now = _grown_by_one(reached[-1]) & self._free(begin + index * step, begin + (index + 1) * step)
            if not now.any():
                return None
            reached.append(now)
            if arrive is None and now[tuple(last)]:
                break
        if len(reached) == 1 or not reached[-1][tuple(last)]:
            return None
        cells = _back(reached, first, last)
        times = np.asarray(begin + step * np.arange(len(cells)), dtype=np.float64)
        points = self.grid.center(cells)
        points[0], points[-1] = ends
        if arrive is not None:
            times[-1] = arrive
        return self._straightened(points, times)

    def _free(self, begin: float, end: float) -> BoolArray:
        """Return which cells are free between two instants."""
        free = self.grid.free.copy()
        dim, shape = free.ndim, np.array(free.shape)
        for each in self.moving:
            wide = float(each.radius_at(end)) + self.kept.clearance + 0.5 * self.size * dim**0.5
            for instant in np.linspace(begin, end, 3):
                center = each.center(instant)[:dim]
                flat = len(center)
                low = np.clip(np.floor((center - wide - self.grid.lower[:flat]) / self.size), 0, shape[:flat])
                high = np.clip(np.ceil((center + wide - self.grid.lower[:flat]) / self.size), 0, shape[:flat])
                if (low >= high).any():
                    continue
                spans = [np.arange(a, b) for a, b in zip(low.astype(int), high.astype(int), strict=True)]
                axes = np.ix_(*(self.grid.lower[d] + self.size * (span + 0.5) for d, span in enumerate(spans)))
                square = sum((axis - c) ** 2 for axis, c in zip(axes, center, strict=True))
                part = tuple(slice(int(span[0]), int(span[-1]) + 1) for span in spans)
                near = np.asarray(square < wide * wide)
                free[part] &= ~near.reshape(near.shape + (1,) * (dim - flat))
        return free

    def _straightened(self, points: FloatArray, times: FloatArray) -> WayInTime:
        """Leave out corners where a straight line at an even pace is as clear."""
        kept = [0]
        last = len(points) - 1
        while kept[-1] < last:
            here = kept[-1]
            further = np.arange(min(here + IN_TIME.straightened, last), here + 1, -1)
            good = [j for j in further.tolist() if self._clear(points[[here, j]], times[[here, j]])][:1]
            kept.append(good[0] if good else here + 1)
        corners = np.array(kept)
        return WayInTime(points[corners], times[corners])

    def _clear(self, line: FloatArray, times: FloatArray) -> bool:
        share = np.linspace(0.0, 1.0, IN_TIME.looked)
        along, instants = line[0] + share[:, None] * (line[1] - line[0]), times[0] + share * (times[1] - times[0])
        least = self.kept.clearance + IN_TIME.apart * self.size
        if any(each.clearances(along, instants).min() < least for each in self.moving):
            return False
        if self.inside is not None and not self.inside(along).all():
            return False
        return bool(clear_lines(self.kept, line[None], IN_TIME.apart * self.size)[0])


def _grown_by_one(cells: BoolArray) -> BoolArray:
    """Return cells and all their neighbours, those at corners too."""
    for axis in range(cells.ndim):
        wider = cells.copy()
        forth = tuple(slice(1, None) if d == axis else slice(None) for d in range(cells.ndim))
        back = tuple(slice(None, -1) if d == axis else slice(None) for d in range(cells.ndim))
        wider[forth] |= cells[back]
        wider[back] |= cells[forth]
        cells = wider
    return cells


def _back(reached: list[BoolArray], first: IntArray, last: IntArray) -> IntArray:
    """Return the cells of a way, one a slice, from the last one back, as near as can be to the line from the first."""
    steps = np.indices((3,) * len(last)).reshape(len(last), -1).T - 1
    way = [last]
    for index in range(len(reached) - 2, -1, -1):
        near = way[-1] + steps
        near = near[((near >= 0) & (near < reached[0].shape)).all(axis=1)]
        near = near[reached[index][tuple(near.T)]]
        wanted = first + (way[-1] - first) * (index / (index + 1))
        way.append(near[int(((near - wanted) ** 2).sum(axis=1).argmin())])
    return np.array(way[::-1])
