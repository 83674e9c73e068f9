"""Task: all requirements of a plan except its durations, checked once and solved many times."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from minsnap.basics.arrays import BoolArray, FloatArray, lengths_of
from minsnap.basics.cached import cached_property
from minsnap.basics.deadline import NEVER, Deadline
from minsnap.corridors.constraint import Walls
from minsnap.corridors.knot_regions import KnotRegion, Placement
from minsnap.last_look import AskedCurve
from minsnap.optimisation.reduced_qp import ReducedProblem, Slots, slots_of
from minsnap.optimisation.touches import touched_walls
from minsnap.optimisation.units import Units
from minsnap.trajectory.trajectory import Trajectory

Pins = Mapping[int, Mapping[int, FloatArray]]

AttachHeading = Callable[[Trajectory], Trajectory]
"""Gives a trajectory its yaw."""


def as_it_is(curve: Trajectory) -> Trajectory:
    """Return a curve with the yaw that it has."""
    return curve


@dataclass(frozen=True, eq=False)
class Task:
    """All requirements of a plan except its durations.

    Parameters
    ----------
    waypoints : ndarray, shape (n, dim)
        Nominal positions [m].
    lower, upper : ndarray, shape (n, dim)
        How far a waypoint may be from its nominal position [m]; zero where pinned.
    pins : mapping of int to mapping of int to ndarray
        Derivatives of order 1 … k - 1 pinned at a waypoint, by waypoint and order [m/s^order].
    half : int
        k, for degree 2k - 1.
    continuity : int
        Derivatives continuous at the knots.
    closed : bool
        The state at the end is the state at the start.
    pieces : int
        Polynomials per leg.
    walls : sequence of Walls
        What the curve must stay inside.
    solver : str
        Name of the QP solver, or ``"auto"``.
    regions : mapping of int to KnotRegion
        Waypoints that must lie in a ball or a gate, within ``lower`` and ``upper``.
    deadline : Deadline
        At which every solve ends, with what is certified or with a SolverError.
    explains : bool
        Whether an error says which leg or limit is in the way; finding that takes longer than a plan.
    touching : bool
        Whether what follows where waypoints lie on walls is used: see ``touches``.
    samples : int, optional
        Instants per polynomial at which the walls of the plan hold; by default at every instant.
    finish : callable
        Gives a curve its yaw.
    """

    waypoints: FloatArray
    lower: FloatArray
    upper: FloatArray
    pins: Pins
    half: int
    continuity: int
    closed: bool
    pieces: int
    walls: Sequence[Walls]
    solver: str
    regions: Mapping[int, KnotRegion] = field(default_factory=dict)
    deadline: Deadline = NEVER
    explains: bool = True
    touching: bool = True
    samples: int | None = None
    finish: AttachHeading = as_it_is

    def __getstate__(self) -> dict[str, Any]:
        """Leave out what gives a curve its yaw, a function of one call: errors with their proofs are pickled."""
        return vars(self) | {"finish": as_it_is}

    @property
    def legs(self) -> int:
        """Number of legs."""
        return len(self.waypoints) - 1

    @property
    def dim(self) -> int:
        """Number of coordinates."""
        return int(self.waypoints.shape[1])

    @property
    def conditions(self) -> AskedCurve:
        """What the plan has to keep, as the last look judges it."""
        placement = Placement(self.waypoints, self.lower, self.upper, regions=self.regions)
        return AskedCurve(placement, self.pins, self.continuity, self.closed, self.pieces, self.walls)

    @cached_property
    def lengths(self) -> FloatArray:
        """Straight lengths of the legs, shape (legs,) [m]."""
        return lengths_of(self.waypoints)

    @cached_property
    def length(self) -> float:
        """A typical length of a leg [m]."""
        return float(self.lengths.sum()) / self.legs or 1.0

    @property
    def joined_orders(self) -> tuple[int, ...]:
        """Orders above k - 1 that are continuous too."""
        return tuple(range(self.half, self.continuity + 1))

    @cached_property
    def slots(self) -> Slots:
        """Layout of a knot's derivatives."""
        return slots_of(self.half, min(self.continuity, self.half - 1))

    @cached_property
    def nominal(self) -> FloatArray:
        """Nominal positions of all knots, (knots, dim), in lengths from the first waypoint."""
        points = np.asarray((self.waypoints - self.waypoints[0]) / self.length)
        if self.pieces == 1:
            return points
        share = (np.arange(self.pieces) / self.pieces)[None, :, None]
        inner = points[:-1, None] + share * np.diff(points, axis=0)[:, None]
        return np.concatenate((inner.reshape(-1, self.dim), points[-1:]))

    @cached_property
    def positions(self) -> FloatArray:
        """Nominal positions of all knots, (knots, dim) [m]."""
        if self.pieces == 1:
            return self.waypoints
        positions = self.waypoints[0] + self.length * self.nominal
        positions[:: self.pieces] = self.waypoints
        return np.asarray(positions)

    @cached_property
    def free(self) -> np.ndarray[tuple[int, ...], np.dtype[np.bool_]]:
        """What may vary at the knots, (knots, slots, dim)."""
        free = np.ones((len(self.nominal), self.slots.count, self.dim), dtype=bool)
        free[:: self.pieces, 0] = self.upper > self.lower
        starts, ends = self.slots.start, self.slots.end
        if not self.closed and self.slots.count > self.half:
            free[0, np.setdiff1d(ends, starts)] = False
            free[-1, np.setdiff1d(starts, ends)] = False
        for knot, slot, _ in self._pinned_slots():
            free[knot, slot] = False
        if starts[1] == ends[1] and self.touches.any():
            free[:: self.pieces, 1] &= ~self.touches.all(axis=0).any(axis=0)
        return free

    @cached_property
    def touches(self) -> BoolArray:
        """Pinned waypoints on walls of the leg before and the leg after them: see :func:`touched_walls`."""
        if not self.touching:
            return np.zeros((2, 2, *self.waypoints.shape), dtype=bool)
        return touched_walls(self.waypoints, self.lower == self.upper, self.walls, self.closed)

    def _pinned_slots(self) -> list[tuple[int, int, FloatArray]]:
        starts, ends = self.slots.start.tolist(), self.slots.end.tolist()
        return [
            (waypoint * self.pieces, slot, value)
            for waypoint, state in self.pins.items()
            for order, value in state.items()
            for slot in {starts[order], ends[order]}
        ]

    @cached_property
    def pinned(self) -> FloatArray:
        """Derivatives pinned at the knots, (knots, slots, dim) [m/s^order]; zero where there are none."""
        pinned = np.zeros(self.free.shape)
        for knot, slot, value in self._pinned_slots():
            pinned[knot, slot] = value
        return pinned

    @cached_property
    def held(self) -> np.ndarray[tuple[int, ...], np.dtype[np.bool_]]:
        """Knots whose position is free within bounds, (knots,)."""
        held = np.zeros(len(self.nominal), dtype=bool)
        held[:: self.pieces] = (self.upper > self.lower).any(axis=1)
        return held

    def units(self, durations: FloatArray) -> Units:
        """Units in which lengths and durations are of order one: times by a power of two, which rounds nothing."""
        exponents = np.frexp(durations)[1]
        return Units(self.length, math.ldexp(1.0, int(exponents.sum()) // len(exponents)), self.waypoints[0])

    def problem(self, durations: FloatArray, units: Units) -> ReducedProblem:
        """Return the reduced problem for piece durations (pieces in all,) [s]."""
        values = self.pinned / np.array([[units.of_order(order)] for order in self.slots.order.tolist()])
        known = (self.nominal, values, self.free, self.held, self.closed, self.joined_orders)
        return ReducedProblem(self.slots, durations / units.time, *known, planes=self._planes)

    @cached_property
    def own_regions(self) -> dict[int, KnotRegion]:
        """Regions by waypoint, without the last of a closed lap, which is the first."""
        return {k: region for k, region in self.regions.items() if not (self.closed and k == self.legs)}

    @cached_property
    def _planes(self) -> tuple[tuple[int, FloatArray], ...]:
        """Knots that must lie in a slanted plane through their nominal positions, and its unit normal."""
        return tuple((k * self.pieces, r.plane) for k, r in self.own_regions.items() if r.plane is not None)

    def piece_durations(self, durations: FloatArray) -> FloatArray:
        """Split leg durations (legs,) equally over the pieces."""
        return np.repeat(durations / self.pieces, self.pieces) if self.pieces > 1 else durations

    def with_walls(self, walls: Sequence[Walls]) -> Task:
        """Return the same task with further walls."""
        return replace(self, walls=[*self.walls, *walls])

    @cached_property
    def moving(self) -> frozenset[int]:
        """Waypoints at which a derivative is pinned that is not zero."""
        return frozenset(k for k, state in self.pins.items() if any(any(value.tolist()) for value in state.values()))

    @property
    def end_velocities(self) -> FloatArray | None:
        """Velocities at start and end, (2, dim) [m/s], not a number where the plan chooses them; None for a lap."""
        free = np.full(self.dim, np.nan)
        return None if self.closed else np.stack([self.pins.get(end, {}).get(1, free) for end in (0, self.legs)])

    @cached_property
    def free_ends(self) -> bool:
        """Whether the plan chooses derivatives below the k-th at a start or an end."""
        whole = range(1, self.half)
        return not self.closed and any(order not in self.pins.get(end, {}) for end in (0, self.legs) for order in whole)

    @property
    def still(self) -> bool:
        """Whether all pinned derivatives are zero, so that time may be scaled."""
        return not self.moving

    @property
    def constrained(self) -> bool:
        """Whether the curve has constraints other than pins and continuity."""
        return bool(self.walls) or bool(self.held.any())
