"""From few pieces a leg to more: the same curve on a finer layout, to search on from."""

from __future__ import annotations

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.time_allocation.joint_layout import JointLayout, JointState, end_basis

SLOWED = 1.1
"""Factor on time from which the search goes on after a division, so that limits leave room to move."""


def division(pieces: int) -> FloatArray:
    """Return the ends of the parts of a leg, (pieces + 1,) from 0 to 1: shorter parts where the leg begins and ends."""
    return np.asarray((1.0 - np.cos(np.pi * np.arange(pieces + 1) / pieces)) / 2.0)


def divided(coarse: JointLayout, state: JointState, fine: JointLayout) -> JointState:
    """Return the same curve on a layout with several pieces for each of the coarse one.

    Parameters
    ----------
    coarse : JointLayout
    state : JointState
        On the coarse layout.
    fine : JointLayout
        Of the same task, with a multiple of the pieces, in the same units.
    """
    parts = fine.pieces // coarse.pieces
    cuts = division(parts)
    durations = (state.durations[:, None] * np.diff(cuts)).reshape(-1)
    ends = coarse.ends(state)
    starts = np.stack([_derivatives(coarse, ends, state.durations, s) for s in cuts[:-1]], axis=1)
    finishes = np.stack([_derivatives(coarse, ends, state.durations, s) for s in cuts[1:]], axis=1)
    knots = _knots(fine, *(side.reshape(fine.pieces, fine.half, fine.dim) for side in (starts, finishes)))
    kept = coarse.knots(state)
    knots[::parts] = kept
    knots[::parts, 0] += coarse.problem.nominal - fine.problem.nominal[::parts]
    return fine.state(knots, durations)


def _derivatives(layout: JointLayout, ends: FloatArray, durations: FloatArray, s: float) -> FloatArray:
    """Physical derivatives of every piece at the same place, (pieces, k, dim)."""
    factors = np.concatenate([end_basis(layout.degree, p, np.array([s])) for p in range(layout.half)])
    return np.asarray(np.matmul(factors, ends) / durations[:, None, None] ** np.arange(layout.half)[:, None])


def _knots(fine: JointLayout, starts: FloatArray, finishes: FloatArray) -> FloatArray:
    """Knot values (knots, slots, dim), positions as deviations, from both ends of all pieces."""
    slots = fine.problem.slots
    knots = np.zeros((fine.pieces + 1, slots.count, fine.dim))
    knots[1:, slots.end] = finishes
    knots[:-1, slots.start] = starts
    knots[:, 0] -= fine.problem.nominal
    return knots


def slowed(state: JointState, factor: float = SLOWED) -> JointState:
    """Return the same path flown more slowly by a factor; scaled derivatives do not change."""
    return JointState(state.scaled, state.durations * factor)
