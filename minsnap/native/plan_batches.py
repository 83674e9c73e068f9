"""Many plans, free or in tubes, how their costs change, and their evaluation, by the native core over threads."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from minsnap.basics.arrays import BoolArray, FloatArray, IntArray
from minsnap.basics.tolerances import GAP
from minsnap.native.library import Entry
from minsnap.native.records import ManyRecord, ValuesRecord

_SOLVE = Entry("minsnap_many", ManyRecord)
_GRADIENTS = Entry("minsnap_many_gradients", ManyRecord)
_TUBES = Entry("minsnap_many_tubes", ManyRecord)
_EVALUATE = Entry("minsnap_evaluate_many", ValuesRecord)

BLOCK = 4096
"""Problems solved in one call, between which Ctrl-C is taken: some tenths of a second."""


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


def many_record(
    points: FloatArray,
    durations: FloatArray,
    offsets: IntArray,
    half: int,
    threads: int,
    ends: tuple[FloatArray | None, FloatArray | None] = (None, None),
) -> ManyRecord:
    """Return the problems as entry points take them, without places for answers; arrays as for ``many_optima``."""
    sizes = {"count": len(offsets) - 1, "dim": points.shape[1], "half": half, "threads": threads}
    return ManyRecord(points=points, durations=durations, offsets=offsets, starts=ends[0], ends=ends[1], **sizes)


def many_tubes(
    points: FloatArray,
    durations: FloatArray,
    offsets: IntArray,
    half: int,
    widths: FloatArray,
    threads: int,
    slopes: bool = False,
    gap: float = GAP,
    watch: Callable[[int, int], None] | None = None,
) -> ManyTubes | None:
    """Return curves of least cost from rest to rest in a ``Tube`` each; None where the Python core is in use.

    Parameters
    ----------
    points, durations, offsets, half, threads
        As for ``many_optima``.
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
    solve = _TUBES.ready or _TUBES.function()
    if solve is None:
        return None
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
        block = many_record(points[knots], durations[legs_in], own, half, threads)
        block.put(widths=widths[legs_in], gap=gap, most_gap=GAP)
        block.put(curves=curves[legs_in], breaks=breaks[knots], figures=figures[problems], statuses=statuses[problems])
        block.put(**{name: place[legs_in] for name, place in places.items() if place is not None})
        solve(block)
        if watch is not None:
            watch(last, count)
    return ManyTubes(curves, breaks, figures, statuses.astype(np.intp), wanted)


def many_gradients(
    points: FloatArray,
    durations: FloatArray,
    offsets: IntArray,
    half: int,
    ends: tuple[FloatArray | None, FloatArray | None],
    threads: int,
) -> ManySlopes | None:
    """Return derivatives of the optimal costs without walls, not numbers where the native core does not answer.

    Parameters
    ----------
    points, durations, offsets, half, ends, threads
        As for ``many_optima``.
    """
    solve = _GRADIENTS.ready or _GRADIENTS.function()
    if solve is None:
        return None
    count, dim = len(offsets) - 1, points.shape[1]
    costs, statuses = np.zeros(count), np.zeros(count, dtype=np.int32)
    slopes = ManySlopes(np.empty(len(durations)), np.empty((len(durations), dim)), None)
    many = many_record(points, durations, offsets, half, threads, ends)
    many.put(costs=costs, slopes=slopes.durations, displacements=slopes.displacements, statuses=statuses)
    solve(many)
    failed = np.repeat(statuses != 0, np.diff(offsets))
    slopes.durations[failed] = np.nan
    slopes.displacements[failed] = np.nan
    return slopes


def many_optima(
    points: FloatArray,
    durations: FloatArray,
    offsets: IntArray,
    half: int,
    ends: tuple[FloatArray | None, FloatArray | None],
    threads: int,
) -> tuple[FloatArray, FloatArray, IntArray] | None:
    """Return curves of least integral of the squared k-th derivative; all problems one after the other.

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
    ends : tuple of ndarray, shape (problems, k - 1, dim), or None
        Derivatives at start and end; None at rest.
    threads : int

    Returns
    -------
    (control points (legs in all, 2k, dim), breaks (knots in all,), statuses (problems,)) or None
        None where the Python core is in use.
    """
    solve = _SOLVE.ready or _SOLVE.function()
    if solve is None:
        return None
    curves, breaks = np.empty((len(durations), 2 * half, points.shape[1])), np.empty(len(points))
    statuses = np.zeros(len(offsets) - 1, dtype=np.int32)
    many = many_record(points, durations, offsets, half, threads, ends)
    many.put(curves=curves, breaks=breaks, statuses=statuses)
    solve(many)
    return curves, breaks, statuses.astype(np.intp)


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
        Control points, durations, breaks and offsets, as ``many_optima`` takes and gives them.
    present : ndarray of bool, shape (problems,)
        Which curves there are; the others give not a number.

    Returns
    -------
    (values (problems, m, dim), statuses (problems,)) or None
        None where the Python core is in use.
    """
    evaluate = _EVALUATE.ready or _EVALUATE.function()
    if evaluate is None:
        return None
    points, durations, breaks, offsets = curves
    count, (_, size, dim), instants = len(present), points.shape, np.ascontiguousarray(t)
    values, statuses = np.empty((count, t.shape[-1], dim)), np.zeros(count, dtype=np.int32)
    asked = ValuesRecord(
        **{"count": count, "degree": size - 1, "dim": dim, "order": order, "instants": t.shape[-1]},
        **{"shared": t.ndim == 1, "threads": threads, "points": points, "durations": durations, "breaks": breaks},
        **{"offsets": offsets, "present": present, "t": instants, "values": values, "statuses": statuses},
    )
    evaluate(asked)
    return values, statuses.astype(np.intp)
