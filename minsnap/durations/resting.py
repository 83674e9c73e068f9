"""Plans from rest to rest, free or in a tube, without other conditions: a call or two of the native core."""

from __future__ import annotations

from collections.abc import Sequence
from time import perf_counter
from typing import Any

import numpy as np
import numpy.typing as npt

from minsnap.basics.arrays import FloatArray, bounded, lengths_of, numbers
from minsnap.basics.checks import DEGREES, LONGEST, SHORTEST
from minsnap.corridors.given_waypoints import is_transposed, warn_magnitude
from minsnap.native.durations import BestSplit, best_split, best_tube_split
from minsnap.native.free_optimum import resting_optimum
from minsnap.native.quick_look import keeps
from minsnap.native.tube import tube_optimum
from minsnap.optimisation.tube_report import TubeReport
from minsnap.trajectory.report import LinearSystem
from minsnap.trajectory.trajectory import Plan, planned


def resting_plan(
    waypoints: npt.ArrayLike | Sequence[object] | None,
    durations: npt.ArrayLike | None,
    total: float | None,
    corridor: object,
    degree: int,
) -> Plan | None:
    """Plan for given durations, or for a total time and the split of it that costs least; arguments as of ``plan``.

    What comes back passed a last look of the native core at its control points: waypoints, rest, joints and tube.
    None where anything is unusual: the checks of ``plan`` name what is wrong, and the other ways solve the rest.
    """
    began = perf_counter()
    if type(degree) is not int or degree not in DEGREES or (durations is None) is (total is None):
        return None
    points = numbers(waypoints, copy=corridor is not None)  # which the report of a tube keeps
    if points is None or points.ndim != 2:
        return None
    count, dim = points.shape
    if count < 2 or not dim or is_transposed(count, dim):
        return None
    times = _split_by_distance(points, total) if durations is None else numbers(durations)
    if times is None or times.shape != (count - 1,):
        return None
    widths = None if corridor is None else half_widths(corridor, count - 1)
    if corridor is not None and (widths is None or dim == 1):
        return None
    half, history = (degree + 1) // 2, None
    if durations is None and count > 2:
        split = _best_split(points, times, widths, half)
        if split is None:
            return None
        times, history = split.durations, split.history
    if widths is None:
        plan = _free(points, times, half, history, began)
    else:
        plan = _in_tube(widths, points, times, half, history, began)
    if plan is not None:
        warn_magnitude(points)
    return plan


def _split_by_distance(points: FloatArray, total: Any) -> FloatArray | None:
    """Durations in proportion to the legs; None unless the total is a time and every leg has a length."""
    if not (type(total) in (int, float) and SHORTEST <= total <= LONGEST and bounded(points).all()):
        return None
    lengths = lengths_of(points)
    return np.asarray(total * lengths / lengths.sum()) if lengths.min() > 0.0 else None


def _best_split(points: FloatArray, first: FloatArray, widths: FloatArray | None, half: int) -> BestSplit | None:
    """Split of least cost, in a tube from the one without walls on, or from the one by distance."""
    free = best_split(points, first, half, None, {})
    if widths is None:
        return free if isinstance(free, BestSplit) else None
    starts = [free.durations] if isinstance(free, BestSplit) else []
    splits = (best_tube_split(points, start, widths, half) for start in [*starts, first])
    return next((split for split in splits if isinstance(split, BestSplit)), None)


def _free(points: FloatArray, times: FloatArray, half: int, history: FloatArray | None, began: float) -> Plan | None:
    control_points = resting_optimum(points, times, half)
    if not isinstance(control_points, np.ndarray):
        return None
    how = LinearSystem(began, perf_counter(), "native", history)
    return planned(control_points, times, how)


def _in_tube(
    widths: FloatArray, points: FloatArray, times: FloatArray, half: int, history: FloatArray | None, began: float
) -> Plan | None:
    optimum = tube_optimum(points, times, widths, half)
    if optimum is None or not keeps(points, times, optimum.points, half - 1, half - 1, widths):
        return None
    how = TubeReport(perf_counter() - began, optimum.figures, points, widths, history)
    return planned(optimum.points, times, how)


def half_widths(width: object, legs: int) -> FloatArray | None:
    """Return one half-width, or one per leg, as an array of its own; None for anything else."""
    if type(width) in (int, float):
        return numbers(width)
    if isinstance(width, np.ndarray):
        plain = width.ndim == 1 and width.dtype.kind in "fiu"
    else:
        plain = isinstance(width, list | tuple) and {int, float}.issuperset(map(type, width))
    widths = numbers(width) if plain else None
    return widths if widths is not None and widths.shape == (legs,) else None
