"""Flights through what is not known yet: each plan ends at rest inside what has been seen."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from math import inf
from typing import Any, NamedTuple

import numpy as np

from minsnap.basics.arrays import ArrayLike, BoolArray, FloatArray, IntArray, numbers
from minsnap.basics.checks import check_array, check_distance, check_finite, check_positive, point_text
from minsnap.basics.deadline import Clock, checked_clock
from minsnap.basics.messages import shown
from minsnap.basics.tolerances import EXACT
from minsnap.corridors.half_spaces import Polytopes
from minsnap.corridors.keep_out import Avoided
from minsnap.corridors.occupancy_grid import dilated
from minsnap.corridors.tangent_polytopes import polytopes_along, without_needless
from minsnap.corridors.way_around import Kept
from minsnap.errors import InputError, TimingError, UnprovedError, WaypointError
from minsnap.limits.limits import Limits
from minsnap.paths.routes.frontiers import Window
from minsnap.paths.routes.grid_map import GridMap
from minsnap.paths.routes.known_map import OCCUPIED, UNKNOWN, KnownMap, edge
from minsnap.paths.routes.nearness import nearest_kept
from minsnap.paths.routes.surroundings import flown_box
from minsnap.planning.planner import plan
from minsnap.replanning.memory import Change
from minsnap.replanning.replanner import Replanner
from minsnap.replanning.splice import Splice, splice_of
from minsnap.trajectory.trajectory import Trajectory

WINDOW = 1.5
"""Half of the side of the block of cells that a way is looked for in first, in ranges of the sensor."""

BORDER = 2
"""Cells around all that is known, beyond which no way is looked for."""

REACHED = 1e-6
"""Distance to the goal at which it is reached [m]."""

HALF = 4
"""Derivatives that a change takes over."""

AT_REST = "the plan begins at rest"
"""Why a plan has no stop."""


class SeenSoFar(NamedTuple):
    """What an explorer knows at an instant, for pictures.

    Parameters
    ----------
    states : ndarray of int
        0 for unknown cells, 1 for free and 2 for occupied ones, axes x, y[, z].
    lower : ndarray, shape (dim,)
        Where the first cell begins [m].
    size : float
        Side of a cell [m].
    position, goal : ndarray, shape (dim,)
        Of the last observation, and where it leads [m].
    plan : Trajectory or None
        What is to be flown.
    """

    states: IntArray
    lower: FloatArray
    size: float
    position: FloatArray
    goal: FloatArray
    plan: Trajectory | None


class Explorer:
    """Flies to a goal through what sensors see on the way.

    Cells that a line from the sensor passes are free, those of points occupied, for ever. A way is searched through
    free cells: to the goal, or to the place at the border of what is known from which it seems shortest. Plans keep
    the clearance to all other cells, end there at rest, and change in flight as :class:`minsnap.Replanner` does.

    Parameters
    ----------
    goal : array_like, shape (2,) or (3,)
        Where to be at rest [m].
    limits : Limits
    clearance : float
        Least distance of plans to cells that are not free [m]. What is smaller than a cell or the gap between two rays
        may stay unseen: add as much.
    sensing : float
        Range of the sensor [m]: what is further is left out, and plans end within it.
    unknown : str
        ``"occupied"``, or ``"free"``: plans then pass through what was never seen.
    resolution : float
        Side of a cell [m].
    pieces : int
        Polynomials per leg.
    clock : callable
        Reads a monotonic clock [s]; a simulated one in tests.

    Raises
    ------
    WaypointError, LimitError, InputError
        If an argument is malformed.
    """

    def __init__(
        self,
        goal: ArrayLike,
        *,
        limits: Limits,
        clearance: float = 0.2,
        sensing: float = 15.0,
        unknown: str = "occupied",
        resolution: float = 0.25,
        pieces: int = 2,
        clock: Clock = time.monotonic,
    ) -> None:
        self.goal = check_array("the goal", goal, ((2,), (3,)), "2 or 3 finite numbers [m]", WaypointError)
        self.clearance = check_distance("the clearance", clearance, InputError)
        self.sensing = check_positive("the range of the sensor", sensing, "m", InputError)
        if unknown not in ("occupied", "free"):
            raise InputError(f"unknown is {shown(unknown)}: give 'occupied' or 'free'")
        size = check_positive("the resolution", resolution, "m", InputError)
        self.known = KnownMap(len(self.goal), size)
        self._replanner = Replanner(limits, pieces=pieces, clock=clock)
        self._avoids_unknown, self._pieces, self._clock = unknown == "occupied", pieces, checked_clock(clock)
        self._position: FloatArray | None = None
        self._asked: tuple[Trajectory | None, float] = (None, -inf)
        self._places: list[FloatArray] = []
        self._certified: tuple[Trajectory | None, Trajectory | None] = (None, None)

    def observe(self, position: ArrayLike, points: ArrayLike, rays: ArrayLike | None = None) -> None:
        """Take what a sensor saw.

        Parameters
        ----------
        position : array_like, shape (dim,)
            Of the sensor [m].
        points : array_like, shape (k, dim)
            On obstacles, seen along straight lines from the position [m]; k may be 0.
        rays : array_like, shape (m, dim), optional
            Ends of lines from the position on which nothing was seen [m].

        Raises
        ------
        InputError
            If one of them is malformed or not finite; nothing of it is taken then.
        """
        dim = len(self.goal)
        here = check_array("the position of the sensor", position, ((dim,),), f"{dim} finite numbers [m]", InputError)
        seen, ends = (self._listed(*each) for each in (("points", points), ("ends of rays", rays)))
        far = np.linalg.norm(seen - here, axis=1) > self.sensing
        ends = np.vstack((ends, seen[far])) - here
        reach = np.linalg.norm(ends, axis=1, keepdims=True)
        ends = here + ends * np.minimum(1.0, self.sensing / np.maximum(reach, self.sensing))
        self.known.body(here, self.clearance + self.known.size)
        self.known.see(here, seen[~far], ends)
        self._position = here
        if not self._places or np.linalg.norm(here - self._places[-1]) > 0.5 * self.known.size:
            self._places.append(here)

    def seen(self, plan: Trajectory | None = None) -> SeenSoFar:
        """Return what is known by now, for :func:`minsnap.plot.animate_exploration`, with a plan to draw.

        Raises
        ------
        InputError
            Before the first observation.
        """
        if self._position is None:
            raise InputError("nothing was observed yet: call observe first")
        known = self.known
        states, lower = known.states.astype(np.intp), np.asarray(known.first * known.size, dtype=np.float64)
        return SeenSoFar(states, lower, known.size, self._position, self.goal, plan)

    def replan(
        self,
        flown: Trajectory | None,
        now: float,
        budget: float = 0.05,
        *,
        avoid: Avoided | Sequence[Avoided] | None = None,
    ) -> Change:
        """Return what to fly from ``now + budget`` on, and how to stop from there.

        Parameters
        ----------
        flown : Trajectory or None
            What is being flown; None for a plan from rest where the last observation was made. Where what is flown ends
            before the splice, the plan begins at rest there.
        now : float
            Instant of this call on its clock [s].
        budget : float
            Seconds from ``now`` to the splice, within which the answer comes; plans from rest take their time, by which
            the splice is later.
        avoid : obstacle or sequence of obstacles, optional
            To keep out of besides what was seen, as :meth:`minsnap.Replanner.replan` takes them; on the clock of a plan
            from rest where nothing is flown.

        Returns
        -------
        Change
            As :meth:`minsnap.Replanner.replan` returns it.

        Raises
        ------
        UnprovedError
            If no way to the goal is left in what may be flown through, which says where it ends, or nothing from which
            more is seen. What is flown ends at rest.
        TimingError
            If the time went back, or the budget is below what a stop takes.
        InputError
            Before the first observation.
        """
        began = float(self._clock())
        if self._position is None:
            raise InputError("nothing was observed yet: call observe with the position before the first replan")
        if flown is None:
            return Change(self._planned(self._position, avoid), 0.0, None, False, no_stop=AT_REST)
        splice = splice_of(flown, now, budget, HALF)
        if flown is self._asked[0] and now < self._asked[1]:
            raise TimingError(f"the time is {now:g} s after {self._asked[1]:g} s: give the clock of what is flown")
        self._asked = flown, float(now)
        if splice.over and avoid is None:
            return self._from_rest(splice, began)
        way, walls, window = self._corridor(splice.state[0])
        known: dict[str, Any] = {"boxes": walls, "goal": way[-1], "avoid": avoid}
        change = self._replanner.replan(flown, now, None, budget, began=began - float(now), **known)
        if not change.certified and avoid is None and flown in self._certified and self._is_clear(change, window):
            change = replace(change, certified=True, stop=change.stop or change.trajectory, no_stop="")
        self._certified = (change.trajectory if change.certified else None, change.stop)
        return change

    def _from_rest(self, splice: Splice, began: float) -> Change:
        """Return a plan that takes over once it is made, from the end of what was flown."""
        curve = self._planned(splice.state[0])
        took = float(self._clock()) - began
        return Change(curve, splice.instant + max(took, 0.0), None, False, no_stop=AT_REST, took=took)

    def _planned(self, here: FloatArray, avoid: Avoided | Sequence[Avoided] | None = None) -> Trajectory:
        """Return a plan from rest at a place."""
        way, walls, _ = self._corridor(here)
        start, end = ({"position": point} for point in way[[0, -1]])
        how: dict[str, Any] = {"limits": self._replanner.limits, "pieces": self._pieces, "avoid": avoid}
        curve = plan(None, corridor=walls, start=start, end=end, **how)
        self._certified = (curve, None)
        return curve

    def _listed(self, name: str, given: ArrayLike | None) -> FloatArray:
        """Return points (k, dim), none of them for None and empty lists."""
        points, dim = numbers([] if given is None else given), len(self.goal)
        if points is not None and not points.size:
            return np.zeros((0, dim))
        if points is None or points.ndim != 2 or points.shape[1] != dim:
            raise InputError(f"the {name} are {shown(given)}: give rows of {dim} finite numbers [m]")
        check_finite(f"the {name}", points, InputError)
        return points

    def _is_clear(self, change: Change, window: Window) -> bool:
        """Whether what is left of a plan that was certified keeps the clearance to what was seen, and to unknown cells.

        New polytopes lie around another way, which it need not take.
        """
        curve, far = change.trajectory, 2.0 * self.clearance
        points = curve.control_points
        boxes = window.seen(points.min(axis=(0, 1)) - far, points.max(axis=(0, 1)) + far)
        near = nearest_kept(curve, Kept(boxes, np.zeros((0, len(self.goal))), 0.0))
        return near.distance >= self.clearance - EXACT * (1.0 + self.clearance)

    def _corridor(self, start: FloatArray) -> tuple[FloatArray, Polytopes, Window]:
        """Return a way from the start towards the goal, polytopes around it, and the cells that it leads through."""
        if np.linalg.norm(start - self.goal) <= REACHED:
            raise TimingError("the goal is reached by then: what is flown ends there at rest")
        window, way = self._way(start)
        if len(way) < 2:
            raise UnprovedError(f"{point_text(start)} m is where more may be seen next: fly there, and observe")
        way = _within(way, start, self.sensing)
        box, beside = flown_box(window.grid), window.room_at(start)
        if beside < self.clearance:  # the first line leads away from what was seen too late
            boxes, room = window.near(*way[:2])
            sets = polytopes_along(way[:2], boxes, way[:0], room * (1.0 - EXACT), box=box)
            sets += polytopes_along(way[1:], window.edges, way[:0], self.clearance, box=box) if len(way) > 2 else []
        else:
            sets = polytopes_along(way, window.edges, way[:0], self.clearance, box=box)
        return way, Polytopes([sets[index] for index in without_needless(sets)]), window

    def _way(self, start: FloatArray) -> tuple[Window, FloatArray]:
        """Look for a way in the block around the vehicle, then in all that is known."""
        size, known = self.known.size, self.known
        here, reach = known.cells(start), int(np.ceil(WINDOW * self.sensing / size))
        ends = np.stack((here, known.cells(self.goal)))
        margin = BORDER + int(np.ceil(self.clearance / size))
        low = np.minimum(known.first, ends.min(axis=0)) - margin
        behind = np.maximum(known.first + known.states.shape, ends.max(axis=0) + 1) + margin
        around = np.maximum(low, here - reach), np.minimum(behind, here + reach + 1)
        for corners, beyond in ((around, True), ((low, behind), False)):
            window, visited = self._window(*corners, beyond)
            way = window.way(start, self.goal, visited)
            if way is not None:
                return window, way
        raise UnprovedError(
            f"from {point_text(start)} m no more is seen of a way to the goal at {point_text(self.goal)} m: the "
            "vehicle rests at the end of its plan; observe from elsewhere, or lower the clearance"
        )

    def _window(self, low: IntArray, behind: IntArray, beyond: bool) -> tuple[Window, BoolArray]:
        """Return a block of cells, and those of it from which observations were made or beside them."""
        states, size = self.known.window(low, behind), self.known.size
        occupied = states == OCCUPIED
        closed = occupied | (states == UNKNOWN) if self._avoids_unknown else occupied.copy()
        closed[edge(closed.shape)] = True
        visited = np.zeros_like(occupied)
        cells = self.known.cells(np.array(self._places)) - low
        visited[tuple(cells[((cells >= 0) & (cells < visited.shape)).all(axis=1)].T)] = True
        grid = GridMap(closed, size, low * size, "what was seen")
        seen = partial(self.known.boxes, unknown=self._avoids_unknown)
        return Window(grid, occupied, self.clearance, beyond, seen), dilated(visited)


def _within(way: FloatArray, start: FloatArray, reach: float) -> FloatArray:
    """Cut a way where it leaves the ball of a radius around its start."""
    apart = np.linalg.norm(way - start, axis=1)
    if (apart <= reach).all():
        return way
    first = int(np.argmax(apart > reach))
    begin, along = way[first - 1], way[first] - way[first - 1]
    a, b, c = along @ along, along @ (begin - start), (begin - start) @ (begin - start) - reach**2
    cut = begin + along * (np.sqrt(b * b - a * c) - b) / a
    return np.vstack((way[:first], cut))
