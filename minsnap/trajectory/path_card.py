"""What a notebook shows for a path."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from minsnap.basics.cards import card, curve_svg, strip_svg
from minsnap.trajectory.report import cost_unit, norm_facts

if TYPE_CHECKING:
    from minsnap.basics.arrays import FloatArray
    from minsnap.basics.cards import Facts

PER_LEG, FEWEST, MOST = 24, 241, 2_401
"""Instants drawn for each leg, and the least and the greatest number of them."""

LARGE = 20_000
"""Pieces from which greatest speeds are left out of a card, so that it is there at once."""


def path_drawings(path: Any) -> list[str]:
    """Return SVG drawings of a path: from above, and its altitude against time where that changes.

    Parameters
    ----------
    path : Path
        Any dim: a path of one coordinate is drawn against time, of more by its first two, and its third in a strip.
    """
    breaks = getattr(path, "leg_breaks", None)
    legs = 1 if breaks is None else len(breaks) - 1
    t = np.linspace(0.0, path.duration, int(np.clip(PER_LEG * legs + 1, FEWEST, MOST)))
    points = path(t)
    if path.dim == 1:
        return [strip_svg(t, points[:, 0], "x [m]")]
    dots = None if breaks is None or legs > MOST else path(breaks)[:, :2]
    flat = curve_svg(points[:, :2], dots, "the path from above: x to the right, y upwards")
    climbs = path.dim == 3 and np.ptp(points[:, 2]) > 1e-9 * np.abs(points).max()
    return [flat, strip_svg(t, points[:, 2], "z [m] against time")] if climbs else [flat]


def path_card(path: Any) -> str:
    """Return the card of any path."""
    facts = [("duration", f"{path.duration:.6g} s"), *_extents(path(np.linspace(0.0, path.duration, FEWEST)))]
    return card(type(path).__name__, facts, path_drawings(path))


def trajectory_card(path: Any) -> str:
    """Return the card of a trajectory: drawn, with its greatest speed, and how it was planned."""
    shape = f"{path.legs} of degree {path.degree}" + (f", {path.pieces} pieces each" if path.pieces > 1 else "")
    known = [("duration", f"{path.duration:.6g} s"), ("legs", shape)]
    known += [("cost", f"{path.cost():.6g} {cost_unit(path.cost_order)}")]
    if len(path.durations) <= LARGE:
        known += norm_facts(norm for norm, _ in path.max_norms((1, 2, 3)))
    how = [] if path.report is None else path.report.facts()
    return card("Trajectory", [*known, *how], path_drawings(path))


def _extents(points: FloatArray) -> Facts:
    names = "xyz" if points.shape[1] <= 3 else [str(i) for i in range(points.shape[1])]
    ends = zip(names, points.min(axis=0), points.max(axis=0), strict=False)
    return [(name, f"{low:.4g} to {high:.4g} m") for name, low, high in ends]
