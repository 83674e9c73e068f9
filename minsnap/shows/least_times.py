"""Times of a storyboard that no flight can keep, told before anything is planned.

Whoever flies to a point of an act comes from a place of the formation before it: no flight is quicker than the farthest
of all points needs from the place nearest to it, within speed and acceleration. Moves whose seconds nobody gave,
and animations, count as none.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.tolerances import EXACT
from minsnap.errors import FleetError
from minsnap.fleet import table_of, trapezoid
from minsnap.limits import Limits
from minsnap.shows.acts import Act, Groups, Show
from minsnap.shows.moves import Move


def refuse_hasty(show: Show) -> None:
    """Raise FleetError for the first act that is given less time than its flight takes at least; says how much."""
    earliest = (show.wait or 0.0) + least_seconds(show.home, show.above, show.limits)
    _refuse_hasty(show.acts, show.above, earliest, show)


def _refuse_hasty(
    acts: Sequence[Act | Groups], now: FloatArray | None, earliest: float, show: Show, grouped: bool = False
) -> float:
    """Return when acts are over at the earliest that follow on places, or on unknown ones; see ``refuse_hasty``."""
    for act in acts:
        if isinstance(act, Groups):
            earliest = max(_refuse_hasty(group.acts, now, earliest, show, True) for group in act.groups)
            now = None
            continue
        reached = act.points if grouped else _reached(act, show)
        late = 0.0 if act.delays is None else float(act.delays.max())  # the last one leaves then
        bound = late if now is None else max(late, least_seconds(now, reached, show.limits))
        if act.seconds is not None and act.seconds < bound * (1.0 - EXACT):
            text = f"the flight to act {act.name!r} is to last {act.seconds:g} s, and no flight there takes less than"
            raise FleetError(f"{text} {bound:.2f} s within the limits: give it more seconds")
        leaves = earliest + max(bound, act.seconds or 0.0)
        if act.at is not None and act.at < leaves * (1.0 - EXACT):
            text = f"act {act.name!r} is at {act.at:g} s, and within the limits nobody is there before {leaves:.2f} s"
            raise FleetError(f"{text}: give it later, or shorten what is before it")
        moves = sum(move.seconds or 0.0 for move in act.moves if isinstance(move, Move))
        earliest = (leaves if act.at is None else act.at) + act.hold + moves
        now = None if act.moves else reached
    return earliest


def _reached(act: Act, show: Show) -> FloatArray:
    """Return where vehicles may be in an act: at its points, or above their homes where it has fewer."""
    return act.points if len(act.points) == show.flying else np.concatenate((act.points, show.above[: show.flying]))


def least_seconds(places: FloatArray, points: FloatArray, limits: Limits) -> float:
    """Return a time below which no flight from places (n, 3) to points (m, 3) is, whoever flies where [s]."""
    from scipy.spatial import KDTree

    tree, table, least = KDTree(places), table_of(limits), 0.0
    for order, rows in ((2.0, table[:2, 3]), (np.inf, table[:2, :3].max(axis=1))):  # by norms, and by axes
        farthest = float(tree.query(points, p=order)[0].max())
        if farthest > 0.0 and np.isfinite(rows).any():
            least = max(least, trapezoid(farthest, *rows.tolist()))
    return least
