"""Many plans, free or in tubes, how their costs change, and their evaluation, by the native core over threads."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from minsnap.basics.arrays import BoolArray, FloatArray, IntArray
from minsnap.basics.tolerances import GAP
from minsnap.native.library import Entry
from minsnap.native.records import ManyRecord, PlansRecord, ValuesRecord

_SOLVE = Entry("minsnap_many", ManyRecord)
_GRADIENTS = Entry("minsnap_many_gradients", ManyRecord)
_TUBES = Entry("minsnap_many_tubes", ManyRecord)
_EVALUATE = Entry("minsnap_evaluate_many", ValuesRecord)
_PLANS = Entry("minsnap_plans", PlansRecord)

BLOCK = 4096
"""Problems solved in one call, between which Ctrl-C is taken: some tenths of a second."""

MOST_PIECES = 9
"""Polynomials into which searches divide a leg at most."""

EndStates = tuple[FloatArray | None, FloatArray | None]
"""Derivatives 1 … k - 1 at start and end, (problems, k - 1, dim); None at rest."""


class ManySlopes(NamedTuple):
    """Derivatives of costs in durations (legs in all,), displacements of legs (legs in all, dim) and half-widths."""

    durations: FloatArray
    displacements: FloatArray
    widths: FloatArray | None


class ManyTubes(NamedTuple):
    """Curves that are proved to stay inside tubes.

    Parameters
    ----------
    points : ndarray, shape (legs in all, 2k, dim)
        Control points [m].
    breaks : ndarray, shape (knots in all,)
        [s].
    figures : ndarray, shape (problems, 4)
        Cost and lower bound of any cost [m^2/s^(2k - 1)], contacts with walls, rounds.
    statuses : ndarray of int, shape (problems,)
    slopes : ManySlopes or None
    """

    points: FloatArray
    breaks: FloatArray
    figures: FloatArray
    statuses: IntArray
    slopes: ManySlopes | None


class ManyChains(NamedTuple):
    """Problems, one after the other.

    Parameters
    ----------
    points : ndarray, shape (knots in all, dim)
        C-contiguous [m]; problem b has one knot more than legs.
    durations : ndarray, shape (legs in all,)
        [s].
    offsets : ndarray of int64, shape (problems + 1,)
        First leg of each problem, and the number of all legs.
    half : int
        k, for degree 2k - 1.
    threads : int
    """

    points: FloatArray
    durations: FloatArray
    offsets: IntArray
    half: int
    threads: int

    def record(self, **further: Any) -> ManyRecord:
        """Return them as entry points take them, with places for answers."""
        return ManyRecord(count=len(self.offsets) - 1, dim=self.points.shape[1], **self._asdict(), **further)


def many_tubes(
    chains: ManyChains,
    widths: FloatArray,
    slopes: bool = False,
    gap: float = GAP,
    watch: Callable[[int, int], None] | None = None,
) -> ManyTubes | None:
    """Return curves of least cost from rest to rest in a ``Tube`` each; None where the Python core is in use.

    Parameters
    ----------
    chains : ManyChains
    widths : ndarray, shape (legs in all,)
        Half-widths [m].
    slopes : bool
        Whether derivatives of the costs are wanted.
    gap : float
        Share of a cost that may be given away; where that does not end with a proof, ``GAP``.
    watch : callable, optional
        Called with the numbers of problems that are solved and of all.

    Notes
    -----
    Problems are solved in blocks, between which Python takes Ctrl-C.
    """
    points, durations, offsets, half, _ = chains
    count, legs, dim = len(offsets) - 1, len(durations), points.shape[1]
    curves, breaks = np.empty((legs, 2 * half, dim)), np.empty(len(points))
    figures, statuses = np.zeros((count, 4)), np.zeros(count, dtype=np.int32)
    wanted = ManySlopes(np.full(legs, np.nan), np.full((legs, dim), np.nan), np.full(legs, np.nan)) if slopes else None
    places = dict(zip(("slopes", "displacements", "width_slopes"), wanted or (), strict=False))
    for first in range(0, count, BLOCK):
        last = min(first + BLOCK, count)
        problems, own = slice(first, last), offsets[first : last + 1] - offsets[first]
        legs_in = slice(offsets[first], offsets[last])
        knots = slice(legs_in.start + first, legs_in.stop + last)
        part = chains._replace(points=points[knots], durations=durations[legs_in], offsets=own)
        block = part.record(widths=widths[legs_in], gap=gap, most_gap=GAP)
        block.put(curves=curves[legs_in], breaks=breaks[knots], figures=figures[problems], statuses=statuses[problems])
        block.put(**{name: place[legs_in] for name, place in places.items() if place is not None})
        if _TUBES(block):
            return None
        if watch is not None:
            watch(last, count)
    return ManyTubes(curves, breaks, figures, statuses.astype(np.intp), wanted)


def many_gradients(chains: ManyChains, ends: EndStates) -> ManySlopes | None:
    """Return derivatives of the optimal costs without walls, not numbers where the native core does not answer."""
    count, legs, dim = len(chains.offsets) - 1, len(chains.durations), chains.points.shape[1]
    costs, statuses = np.zeros(count), np.zeros(count, dtype=np.int32)
    slopes = ManySlopes(np.empty(legs), np.empty((legs, dim)), None)
    places = {"costs": costs, "slopes": slopes.durations, "displacements": slopes.displacements, "statuses": statuses}
    if _GRADIENTS(chains.record(starts=ends[0], ends=ends[1], **places)):
        return None
    failed = np.repeat(statuses != 0, np.diff(chains.offsets))
    slopes.durations[failed] = np.nan
    slopes.displacements[failed] = np.nan
    return slopes


def many_optima(chains: ManyChains, ends: EndStates) -> tuple[FloatArray, FloatArray, IntArray] | None:
    """Return curves of least integral of the squared k-th derivative.

    Returns
    -------
    (control points (legs in all, 2k, dim), breaks (knots in all,), statuses (problems,)) or None
        None where the Python core is in use.
    """
    points, durations, offsets, half, _ = chains
    curves, breaks = np.empty((len(durations), 2 * half, points.shape[1])), np.empty(len(points))
    statuses = np.zeros(len(offsets) - 1, dtype=np.int32)
    if _SOLVE(chains.record(starts=ends[0], ends=ends[1], curves=curves, breaks=breaks, statuses=statuses)):
        return None
    return curves, breaks, statuses.astype(np.intp)


def plans_within(
    points: Sequence[FloatArray], limits: FloatArray, widths: FloatArray | None, pieces: int, threads: int
) -> list[tuple[FloatArray, FloatArray, int] | None]:
    """Plan from rest to rest within limits, each problem as if it were alone.

    Parameters
    ----------
    points : sequence of ndarray, shape (n_b, dim)
        Waypoints of each problem [m].
    limits : ndarray, shape (problems, 9)
        Speed, acceleration, jerk, snap, most and least thrust over weight, tilt, body rate and gravity; zero is none.
    widths : ndarray, shape (legs in all,), or None
        Half-widths of tubes, infinite where there is none [m].
    pieces : int
        Polynomials of a leg, 0 to leave them to each search.
    threads : int

    Returns
    -------
    list of (control points (pieces in all, 8, dim), durations (pieces in all,), pieces of a leg) or None
        None for what is left to ``plan``.
    """
    legs = [len(each) - 1 for each in points]
    offsets, most = np.cumsum([0, *legs], dtype=np.int64), pieces or MOST_PIECES
    curves, durations = np.empty((offsets[-1] * most, 8, points[0].shape[1])), np.empty(offsets[-1] * most)
    found, statuses = np.zeros(len(points), dtype=np.int64), np.zeros(len(points), dtype=np.int32)
    asked = PlansRecord(
        **{"count": len(points), "dim": points[0].shape[1], "threads": threads, "pieces": pieces, "most": most},
        **{"points": np.concatenate(points), "offsets": offsets, "limits": limits, "widths": widths},
        **{"curves": curves, "durations": durations, "found": found, "statuses": statuses},
    )
    if _PLANS(asked):
        return [None] * len(points)
    made = zip(legs, offsets.tolist(), found.tolist(), statuses.tolist(), strict=False)
    parts = ((slice(most * first, most * first + count * each), each, status) for count, first, each, status in made)
    return [None if status else (curves[part].copy(), durations[part].copy(), each) for part, each, status in parts]


def many_values(
    curves: tuple[FloatArray, FloatArray, FloatArray, IntArray],
    present: BoolArray,
    order: int,
    t: FloatArray,
    threads: int,
) -> tuple[FloatArray, IntArray] | None:
    """Return a derivative of every curve at instants (m,) for all, or (problems, m).

    Parameters
    ----------
    curves : tuple
        Control points, durations, breaks and offsets, as ``ManyChains`` and ``many_optima`` have them.
    present : ndarray of bool, shape (problems,)
        Which curves there are; the others give not a number.

    Returns
    -------
    (values (problems, m, dim), statuses (problems,)) or None
        None where the Python core is in use.
    """
    points, durations, breaks, offsets = curves
    count, (_, size, dim), instants = len(present), points.shape, np.ascontiguousarray(t)
    values, statuses = np.empty((count, t.shape[-1], dim)), np.zeros(count, dtype=np.int32)
    asked = ValuesRecord(
        **{"count": count, "degree": size - 1, "dim": dim, "order": order, "instants": t.shape[-1]},
        **{"shared": t.ndim == 1, "threads": threads, "points": points, "durations": durations, "breaks": breaks},
        **{"offsets": offsets, "present": present, "t": instants, "values": values, "statuses": statuses},
    )
    return None if _EVALUATE(asked) else (values, statuses.astype(np.intp))
