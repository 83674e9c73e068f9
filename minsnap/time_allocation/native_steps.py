"""The joint search's terms as the native core takes them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.native.joint_steps import (
    ORDERS,
    Chained,
    JointTerms,
    KnownPeaks,
    Pull,
    WholeCones,
)
from minsnap.time_allocation.cone_programme import Rows
from minsnap.time_allocation.joint_layout import SLACKS, JointLayout, JointState, end_metric, ends_to_derivative
from minsnap.time_allocation.joint_rows import Block, largest_metrics
from minsnap.time_allocation.true_peaks import Peaks

MOST_AXES = 8

GRID, FINER_GRID = 17, 9
"""Instants per piece at which rows stand where the curve is near a limit, with one piece per leg and with several."""

PATH_METRIC = 1e-3
"""Weight of the squared length of a change of the curve beside the squares in units of limits."""


@dataclass(frozen=True, eq=False)
class Tried:
    """A step that was tried, (unknowns,), and the state after it."""

    step: FloatArray
    state: JointState


def native_terms(layout: JointLayout, blocks: Sequence[Block]) -> JointTerms | None:
    """Return the terms of a search; None where a block has no native form."""
    found = [block.condition_block() for block in blocks]
    if not found or any(block is None for block in found) or layout.dim > MOST_AXES:
        return None
    degree = layout.degree
    maps = [ends_to_derivative(degree, p) for p in range(min(ORDERS, degree + 1))]
    return JointTerms((layout.pieces, 2 * layout.half, layout.dim), [b for b in found if b is not None], maps)


def instants(layout: JointLayout) -> int:
    """Return the number of instants per piece at which rows may stand."""
    return GRID if layout.task.pieces == 1 else FINER_GRID


class NativeSteps:
    """Steps of one search in the native core.

    Parameters
    ----------
    layout : JointLayout
    blocks : sequence of Block
    terms : JointTerms
    """

    def __init__(self, layout: JointLayout, blocks: Sequence[Block], terms: JointTerms) -> None:
        self.layout, self.terms, self.place = layout, terms, layout.places
        steep = largest_metrics(blocks, layout.pieces)
        metrics = [PATH_METRIC * end_metric(layout.degree, 1)]
        metrics += [end_metric(layout.degree, order) for order in steep]
        self.steep = np.array([np.zeros(layout.pieces), *steep.values()])
        self.chained = Chained(
            len(self.place) - 1,
            np.ascontiguousarray(self.place[layout.unknowns], dtype=np.int64),
            np.ascontiguousarray(layout.exponents),
            np.array([0, *steep], dtype=np.int64),
            np.ascontiguousarray(metrics),
        )

    def step(
        self,
        state: JointState,
        peaks: KnownPeaks,
        regions: Sequence[Rows],
        lengths: FloatArray,
        numbers: tuple[float, ...],
        objective: tuple[FloatArray, FloatArray | None],
        pull: Pull,
        tried: Tried | None = None,
    ) -> FloatArray | None:
        """Return the step from a state, (unknowns,); None where the native core does not find one."""
        layout, sizes = self.layout, self.steep.copy()
        sizes[0] = 1.0 / lengths
        curve = (layout.ends(state), state.durations, layout.scales(state))
        cones = whole_cones(regions, layout.unknowns.shape[1])
        linear = np.empty(len(self.place) - 1)
        linear[self.place[:-1]] = objective[0]
        model = linear, objective[1]
        known = None
        if tried is not None:
            step = np.zeros(len(linear))
            step[self.place[: -1 - SLACKS]] = tried.step[:-SLACKS]
            known = step, layout.ends(tried.state), tried.state.durations
        x = self.terms.step(
            curve, self.chained, peaks, cones, (sizes, lengths), np.array(numbers), model, instants(layout), pull, known
        )
        return None if x is None else x[self.place[:-1]]


def native_steps(layout: JointLayout, blocks: Sequence[Block]) -> NativeSteps | None:
    """Return the steps of a search; None where the native core does not know a block."""
    terms = native_terms(layout, blocks)
    return None if terms is None else NativeSteps(layout, blocks, terms)


def known_peaks(peaks: Sequence[Peaks], former: Sequence[Sequence[Peaks]]) -> KnownPeaks:
    """Join the present peaks of every block and those remembered."""
    sets = [
        (number, k == 0, found)
        for number, (present, others) in enumerate(zip(peaks, former, strict=True))
        for k, found in enumerate((present, *others))
    ]
    index, s = (np.concatenate([getattr(found, name) for _, _, found in sets]) for name in ("index", "s"))
    marks = np.array([(number, own) for number, own, _ in sets], dtype=np.int64)
    block, own = marks.repeat([len(found.s) for _, _, found in sets], axis=0).T.copy()
    return KnownPeaks(block, index, own, s)


def whole_cones(rows: Sequence[Rows], width: int) -> WholeCones:
    """Cones of groups of rows, one after the other."""
    none = np.zeros(0, dtype=np.int64)
    piece = np.concatenate([none, *(group.piece for group in rows)])
    size = np.concatenate([none, *(np.full(len(group.piece), group.bound.shape[1]) for group in rows)])
    matrix = np.concatenate([np.zeros((0, width)), *(group.matrix.reshape(-1, width) for group in rows)])
    bound = np.concatenate([np.zeros(0), *(group.bound.reshape(-1) for group in rows)])
    return WholeCones(*(np.ascontiguousarray(part) for part in (piece, size, matrix, bound)))
