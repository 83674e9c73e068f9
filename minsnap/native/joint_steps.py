"""The joint search for a curve and its durations by the native core: peaks of a curve, and one step of the search."""

from __future__ import annotations

from collections.abc import Sequence
from ctypes import c_int64, c_void_p
from dataclasses import dataclass, field

import numpy as np

from minsnap.basics.arrays import FloatArray, IntArray
from minsnap.native.library import Entry, address, optional_address
from minsnap.native.status import Status

_MEASURE = Entry("minsnap_joint_measure", *[c_void_p] * 7, c_int64, c_int64, *[c_void_p] * 6)
_STEP = Entry("minsnap_joint_step", *[c_void_p] * 29, c_int64, *[c_void_p] * 4)

ORDERS = 5
"""Derivatives that conditions may depend on: position to snap."""

WALL, LEAST_THRUST, BODY_RATE, UNSPUN_ROTORS, YAWED_ROTORS, MOST_THRUST, TILT, HEADING_RATE, LOOK_RATE = range(9)
"""Kinds of conditions, as in ``src/momentary.hpp``."""

ITERATIONS = 60
ROOM = 4
"""Peaks per condition for which there is room, about."""


@dataclass(frozen=True, eq=False)
class ConditionBlock:
    """Conditions of one kind.

    Parameters
    ----------
    kind : int
        ``WALL`` or one of the others.
    orders : tuple of int
        First and last derivative that they depend on.
    size : int
        Components of a cone.
    slack : int
        0 for limits, 1 for walls.
    weight, band : float
        By how much a slack of 1 widens the cone, and the excess above which instants of the grid become rows.
    piece : ndarray of int, shape (n,)
    values : ndarray
        Of walls: rows (n, size, dim), then offsets (n, size); of others: units of derivatives (5,), then parameters.
    """

    kind: int
    orders: tuple[int, int]
    size: int
    slack: int
    weight: float
    band: float
    piece: IntArray
    values: FloatArray


@dataclass(frozen=True, eq=False)
class Peaking:
    """Largest excess of every block over its weight, where it is, and all peaks with their number by block."""

    tops: FloatArray
    conditions: IntArray
    places: FloatArray
    counts: IntArray
    index: IntArray
    s: FloatArray


@dataclass(frozen=True, eq=False)
class Chained:
    """How the unknowns of the pieces stand, and how their ends depend on durations.

    Parameters
    ----------
    size : int
        Number of unknowns.
    columns : ndarray of int, shape (pieces, width)
        Places of the unknowns of each piece, ``size`` for none.
    exponents : ndarray, shape (pieces, ends, 3)
    metric_orders : ndarray of int, shape (m,)
    metrics : ndarray, shape (m, ends, ends)
    """

    size: int
    columns: IntArray
    exponents: FloatArray
    metric_orders: IntArray
    metrics: FloatArray


@dataclass(frozen=True, eq=False)
class WholeCones:
    """Further cones on single pieces: piece and size (n,), rows (r, width) and bounds (r,)."""

    piece: IntArray
    size: IntArray
    matrix: FloatArray
    bound: FloatArray


@dataclass(frozen=True, eq=False)
class KnownPeaks:
    """Peaks of all blocks: block, not falling, condition and place (n,); own ones are kept even beside others."""

    block: IntArray
    index: IntArray
    own: IntArray
    s: FloatArray


@dataclass(frozen=True, eq=False)
class Pull:
    """Forces of multipliers in the ends (pieces, ends, dim) and in the durations (pieces,); changed in place."""

    ends: FloatArray
    own: FloatArray
    known: list[bool] = field(default_factory=lambda: [False])


class JointTerms:
    """Conditions of a search in the form that the native core takes.

    Parameters
    ----------
    shape : tuple of int
        Pieces, ends of a piece for each axis, axes.
    blocks : sequence of ConditionBlock
    maps : sequence of ndarray, shape (degree + 1 - order, ends)
        From ends to control points of each derivative, orders 0 to 4.
    """

    def __init__(
        self, shape: tuple[int, int, int], blocks: Sequence[ConditionBlock], maps: Sequence[FloatArray]
    ) -> None:
        pieces, ends, dim = shape
        table, at, place = [], 0, 0
        for block in blocks:
            count = len(block.piece)
            table.append((block.kind, *block.orders, block.size, count, block.slack, at, place))
            at, place = at + count, place + 2 + len(block.values)
        self.table = np.array(table, dtype=np.int64)
        self.pieces = np.concatenate([np.asarray(block.piece, dtype=np.int64) for block in blocks])
        self.values = np.concatenate([[block.weight, block.band, *block.values] for block in blocks])
        self.maps = np.concatenate([np.zeros(1) if not part.size else part.reshape(-1) for part in maps])
        self.sizes = np.array([pieces, ends, dim, len(blocks), at, place], dtype=np.int64)
        self.room = ROOM * at + 64
        given = (self.sizes, self.table, self.pieces, self.values, self.maps)
        self._given = tuple(int(part.ctypes.data) for part in given)

    def measure(self, ends: FloatArray, durations: FloatArray, instants: int) -> Peaking | None:
        """Find the peaks of a curve on a grid of so many instants a piece.

        Parameters
        ----------
        ends : ndarray, shape (pieces, ends, dim)
        durations : ndarray, shape (pieces,)
        instants : int

        Returns
        -------
        Peaking or None
            None where the native core is not in use or does not answer.
        """
        measure = _MEASURE.function()
        if measure is None:
            return None
        blocks = len(self.table)
        tops, places, s = np.empty(blocks), np.empty(blocks), np.empty(self.room)
        conditions, counts = np.empty(blocks, dtype=np.int64), np.empty(blocks, dtype=np.int64)
        index = np.empty(self.room, dtype=np.int64)
        found = (tops, places, conditions, counts, index, s)
        curve = (address(np.ascontiguousarray(ends)), address(np.ascontiguousarray(durations)))
        status = measure(*self._given, *curve, instants, self.room, *(address(part) for part in found))
        if Status(status) is not Status.DONE:
            return None
        total = int(counts.sum())
        return Peaking(tops, conditions, places, counts, index[:total], s[:total])

    def step(
        self,
        curve: tuple[FloatArray, FloatArray, FloatArray],
        chained: Chained,
        peaks: KnownPeaks,
        cones: WholeCones,
        sizes: tuple[FloatArray, FloatArray],
        numbers: FloatArray,
        objective: tuple[FloatArray, FloatArray | None],
        instants: int,
        pull: Pull,
        tried: tuple[FloatArray, FloatArray, FloatArray] | None = None,
    ) -> FloatArray | None:
        """Build the cone programme of one step around a curve, and solve it.

        Parameters
        ----------
        curve : tuple of ndarray
            Ends (pieces, ends, dim), durations (pieces,), and scales of the ends (pieces, ends).
        chained : Chained
        peaks : KnownPeaks
        cones : WholeCones
        sizes : tuple of ndarray
            One over what counts as large in each metric (m, pieces), and lengths of the pieces (pieces,).
        numbers : ndarray, shape (10,)
            Weight of the proximal term, reach, largest relative change of a duration to longer and to shorter, prices
            of the slacks, shares by which limits and walls are moved inwards, accuracy, and seconds after which no
            iteration begins.
        objective : tuple of ndarray
            Linear (size,), in the order of places, and quadratic (pieces, width, width) or None.
        instants : int
            Of the grid, on every piece.
        pull : Pull
            Forces of the last step, replaced by those of this one.
        tried : tuple of ndarray, optional
            A step (size,) without slacks, and the ends and durations after it, for the second-order correction.

        Returns
        -------
        ndarray, shape (size,), or None
            The step in the order of places; None where the native core is not in use or finds none.
        """
        step = _STEP.function()
        if step is None:
            return None
        counts = np.array(
            [chained.size, instants, len(peaks.s), len(cones.piece), len(cones.bound)]
            + [len(chained.metric_orders), int(pull.known[0])],
            dtype=np.int64,
        )
        x, iterations = np.empty(chained.size), np.zeros(1, dtype=np.int64)
        given: tuple[np.ndarray[tuple[int, ...], np.dtype[np.generic]], ...] = (
            *(np.ascontiguousarray(part) for part in curve[:2]),
            *(counts, chained.columns, np.ascontiguousarray(curve[2]), chained.exponents),
            *(peaks.block, peaks.index, peaks.own, peaks.s),
            *(cones.piece, cones.size, cones.matrix, cones.bound),
            *(chained.metric_orders, chained.metrics, *sizes, numbers),
        )
        found = (pull.ends, pull.own, x, iterations)
        known = (*objective, *(tried or (None, None, None)))
        others = [None if part is None else np.ascontiguousarray(part) for part in known]
        model = [optional_address(part) for part in others]
        places = (address(part) for part in found)
        status = step(*self._given, *(address(part) for part in given), *model, ITERATIONS, *places)
        if Status(status) is not Status.DONE:
            return None
        pull.known[0] = True
        return x
