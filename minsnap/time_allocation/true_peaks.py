"""Where a curve exceeds its conditions most: a grid on every piece, and the tops between, by two parabolas each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from minsnap.basics.arrays import FloatArray, IntArray
from minsnap.native.joint_steps import JointTerms
from minsnap.time_allocation.joint_layout import JointLayout, JointState, end_basis
from minsnap.time_allocation.joint_regions import JointRegions
from minsnap.time_allocation.joint_rows import WALL, Block

GRID = 33
"""Instants a piece of the grid on which peaks are looked for."""

NEAR = -0.2
"""Excess above which a local maximum is kept as a peak."""

CLOSER = 6.0
"""How many times narrower the second parabola is than the first."""


@dataclass(frozen=True, eq=False)
class Peaks:
    """Local maxima of one block's excess: which condition (n,), and where on its piece (n,)."""

    index: IntArray
    s: FloatArray

    def joined(self, others: Sequence[Peaks]) -> Peaks:
        """Return these peaks and others, without those of the others that are within 1/250 of a piece of each other."""
        if not others:
            return self
        index = np.concatenate([self.index, *(other.index for other in others)])
        s = np.concatenate([self.s, *(other.s for other in others)])
        _, first = np.unique(np.round(1000 * index + 250.0 * s).astype(np.int64), return_index=True)
        kept = np.union1d(first, np.arange(len(self.index)))
        return Peaks(index[kept], s[kept])


@dataclass(frozen=True, eq=False)
class Measured:
    """How far a curve exceeds what it must keep.

    Parameters
    ----------
    limit : float
        Largest excess of a limit, as the relative change of time that would cure it; at least -1.
    wall : float
        Largest excess of a wall, in its widths; at least -1.
    peaks : list of Peaks
        Of every block.
    worst : tuple of int, int, float
        Block, condition and instant of the largest excess of a limit.
    """

    limit: float
    wall: float
    peaks: list[Peaks]
    worst: tuple[int, int, float]


def derivatives_at(layout: JointLayout, state: JointState, grid: FloatArray, orders: int) -> dict[int, FloatArray]:
    """Return derivatives of all pieces on the same grid: by order, (pieces, m, dim)."""
    ends = layout.ends(state)
    return {
        order: np.matmul(end_basis(layout.degree, order, grid), ends) / state.durations[:, None, None] ** order
        for order in range(orders)
    }


def scattered(
    layout: JointLayout, state: JointState, ends: FloatArray, piece: IntArray, s: FloatArray, orders: Sequence[int]
) -> dict[int, FloatArray]:
    """Return derivatives at single instants: by order, (n, dim)."""
    local, span = ends[piece], state.durations[piece, None]
    return {
        order: np.matmul(end_basis(layout.degree, order, s)[:, None, :], local)[:, 0] / span**order for order in orders
    }


class PeakFinder:
    """Finds the peaks of all blocks of a task.

    Parameters
    ----------
    layout : JointLayout
    blocks : sequence of Block
    terms : JointTerms, optional
        The same for the native core.
    """

    def __init__(self, layout: JointLayout, blocks: Sequence[Block], terms: JointTerms | None = None) -> None:
        self.layout, self.blocks, self.regions, self.terms = layout, blocks, JointRegions(layout), terms
        self.grid = np.linspace(0.0, 1.0, GRID)
        self.orders = 1 + max(order for block in blocks for order in block.orders)
        self._walls = np.array([block.slack == WALL for block in blocks])

    def refine(self, instants: int) -> None:
        """Look at so many instants a piece from now on."""
        self.grid = np.linspace(0.0, 1.0, instants)

    def measure(self, state: JointState) -> Measured:
        """Find the peaks of a state and the largest excesses."""
        self.layout.task.deadline.check()
        found = None if self.terms is None else self._measured_natively(state, self.terms)
        return self._measured(state) if found is None else found

    def _measured_natively(self, state: JointState, terms: JointTerms) -> Measured | None:
        found = terms.measure(self.layout.ends(state), state.durations, len(self.grid))
        if found is None:
            return None
        ends = np.cumsum(found.counts)
        peaks = [
            Peaks(found.index[end - count : end], found.s[end - count : end])
            for end, count in zip(ends.tolist(), found.counts.tolist(), strict=True)
        ]
        places = list(zip(found.conditions.tolist(), found.places.tolist(), strict=True))
        return self._summary(found.tops, peaks, places, self.regions.excess(state))

    def _measured(self, state: JointState) -> Measured:
        x = derivatives_at(self.layout, state, self.grid, self.orders)
        ends = self.layout.ends(state)
        tops, peaks, places = np.full(len(self.blocks), -1.0), [], []
        for k, block in enumerate(self.blocks):
            values = block.on_grid(x)
            at = int(values.argmax())
            best, place = float(values.flat[at]), (at // len(self.grid), float(self.grid[at % len(self.grid)]))
            found = self._coarse(values)
            if len(found.index):
                found, highest = self._fine(state, ends, block, found)
                top = int(highest.argmax())
                if highest[top] > best:
                    best, place = float(highest[top]), (int(found.index[top]), float(found.s[top]))
            peaks.append(found)
            tops[k] = max(best / block.weight, -1.0)
            places.append(place)
        return self._summary(tops, peaks, places, self.regions.excess(state))

    def _summary(
        self, tops: FloatArray, peaks: list[Peaks], places: list[tuple[int, float]], outside: float
    ) -> Measured:
        limits = np.where(self._walls, -2.0, tops)
        worst = int(limits.argmax())
        return Measured(
            float(max(limits.max(), -1.0)),
            float(max(np.where(self._walls, tops, -1.0).max(), outside)),
            peaks,
            (worst, *places[worst]),
        )

    def _coarse(self, values: FloatArray) -> Peaks:
        """Local maxima: within the grid at the top of the parabola through three values, or near an end."""
        left, middle, right = values[:, :-2], values[:, 1:-1], values[:, 2:]
        bend = left - 2.0 * middle + right
        row, place = np.nonzero((middle >= left) & (middle >= right) & (middle > NEAR) & (bend < 0.0))
        step = self.grid[1]
        slope = right[row, place] - left[row, place]
        first = np.flatnonzero((values[:, 0] >= values[:, 1]) & (values[:, 0] > NEAR))
        last = np.flatnonzero((values[:, -1] >= values[:, -2]) & (values[:, -1] > NEAR))
        inner = self.grid[place + 1] - step * slope / (2.0 * bend[row, place])
        near = step / CLOSER
        s = np.concatenate((inner, np.full(len(first), near), np.full(len(last), 1.0 - near)))
        return Peaks(np.concatenate((row, first, last)), s)

    def _fine(self, state: JointState, ends: FloatArray, block: Block, found: Peaks) -> tuple[Peaks, FloatArray]:
        """Peaks moved to the top of a narrower parabola, and their height."""
        step = self.grid[1] / CLOSER
        s = np.clip(found.s[:, None] + step * np.array([-1.0, 0.0, 1.0]), 0.0, 1.0)
        index = np.repeat(found.index, 3)
        x = scattered(self.layout, state, ends, block.piece[index], s.reshape(-1), block.orders)
        left, middle, right = block.at(x, index).reshape(-1, 3).T
        bend = np.minimum(left - 2.0 * middle + right, -1e-300)
        move = -(right - left) / (2.0 * bend)
        inner = (np.abs(move) < 1.0) & (bend < -1e-300)
        highest = np.maximum(np.maximum(left, middle), right)
        height = np.where(inner, np.maximum(highest, middle - (right - left) ** 2 / (8.0 * bend)), highest)
        return Peaks(found.index, np.clip(s[:, 1] + step * np.clip(move, -1.0, 1.0), 0.0, 1.0)), height
