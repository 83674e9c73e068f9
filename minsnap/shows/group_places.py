"""Where vehicles are in acts, and groups that stand too near to each other there, told before anything is planned."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from minsnap.basics.arrays import FloatArray, IntArray
from minsnap.basics.tolerances import EXACT
from minsnap.errors import FleetError
from minsnap.fleet import assign
from minsnap.shows.act_moves import Curves
from minsnap.shows.acts import Act, Groups, Show
from minsnap.shows.formations import spacing_of

Moves = Mapping[Act, Sequence[Curves]]


def places_in(show: Show, now: FloatArray, act: Act, progress: bool) -> tuple[IntArray, FloatArray]:
    """Return which point of an act each vehicle flies to, -1 for none, and its goal: else above its own home."""
    from scipy.optimize import linear_sum_assignment
    from scipy.spatial.distance import cdist

    count, points = len(act.points), np.concatenate((act.points, show.above))
    if count == len(now):
        order = np.asarray(assign(now, act.points, progress))
        return order, act.points[order]
    flat = show.separation.flat(points)
    free = cdist(flat[count:], flat[:count]).min(axis=1) >= (show.separation.distance or 0.0)
    if free.sum() < len(now) - count:
        raise FleetError(
            f"{len(now) - count} vehicles wait above their homes during act {act.name!r}, and {int(free.sum())} can, "
            "which are apart from its points: raise the act"
        )
    ways = cdist(now, points, "sqeuclidean")
    worst = float(ways.max()) * len(now) + 1.0
    own = np.full((len(now), len(now)), worst**2)
    own[free, free] = ways[:, count:][free, free] + worst  # as few wait as must
    _, chosen = linear_sum_assignment(np.concatenate((ways[:, :count], own), axis=1))
    return np.where(chosen < count, chosen, -1), points[chosen]


def refuse_near_groups(show: Show, moves: Moves) -> None:
    """Refuse groups that fly at once to, or end at, or pass by where others stand: formations that are too near.

    Who is where is known from the assignments, up to the first groups, and after acts of all vehicles.
    """
    last = max((i for i, act in enumerate(show.acts) if isinstance(act, Groups)), default=-1)
    now: FloatArray | None = show.above
    told = True  # who is where, and not the places alone
    for act in show.acts[: last + 1]:
        if isinstance(act, Groups):
            _refuse_near_ends(act, moves, show)
            _refuse_near_first(act, now, show)
            now, told = None, False
        elif told and now is not None:
            order, now = places_in(show, now, act, False)
            there = order >= 0
            now[there] = _ends(act, moves)[order[there]]
        else:
            now = _ends(act, moves) if len(act.points) == show.flying else None


def _ends(act: Act, moves: Moves) -> FloatArray:
    """Return where the points of an act are after its moves, shape (points, 3) [m]."""
    flown = [curves for curves in moves[act] if curves]
    return np.stack([curve.control_points[-1, -1] for curve in flown[-1]]) if flown else act.points


def _refuse_near_first(groups: Groups, now: FloatArray | None, show: Show) -> None:
    """Refuse first acts of groups that leave at once, and any act, near vehicles of no group, which stay."""
    first = [group.acts[0] for group in groups.groups]
    leaving = [act for act in first if act.at is None or act.seconds is None]
    names = [f"point {i} of act {act.name!r}" for act in leaving for i in range(len(act.points))]
    if leaving:
        what = f"to which groups of {groups.name!r} fly at once"
        _refuse(np.concatenate([act.points for act in leaving]), names, what, show)
    if now is None or len(now) <= len(groups.first):
        return
    stays = np.delete(now, assign(groups.first, now, False), axis=0)
    still = [f"a vehicle of no group of {groups.name!r}"] * len(stays)
    for act in groups.acts:
        names = [f"point {i} of act {act.name!r}" for i in range(len(act.points))]
        _refuse(np.concatenate((act.points, stays)), names + still, "which stays where it is", show)


def _refuse_near_ends(groups: Groups, moves: Moves, show: Show) -> None:
    """Refuse groups whose last formations stand too near to each other."""
    ends = [_ends(group.acts[-1], moves) for group in groups.groups]
    names = [
        f"point {i} of act {group.acts[-1].name!r}"
        for group, points in zip(groups.groups, ends, strict=True)
        for i in range(len(points))
    ]
    _refuse(np.concatenate(ends), names, f"where groups of {groups.name!r} end", show)


def _refuse(places: FloatArray, names: Sequence[str], what: str, show: Show) -> None:
    """Raise FleetError where two places are nearer than the separation."""
    if len(places) < 2:
        return
    least, pair = spacing_of(show.separation.flat(places))
    apart = show.separation.distance or 0.0
    if least < apart * (1.0 - EXACT):
        one, two = sorted(pair)
        text = f"{names[one]} and {names[two]}, {what}, are {least:.3f} m apart"
        raise FleetError(f"{text}, {apart - least:.3f} m less than the separation: shift one of them")
