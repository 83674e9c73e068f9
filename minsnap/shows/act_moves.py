"""What formations of a show do after their holds: the curves of its moves and animations, checked before any flight."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from minsnap.basics.arrays import FloatArray, IntArray
from minsnap.basics.tolerances import EXACT
from minsnap.errors import FleetError, MinsnapError
from minsnap.fleet import Separation, certify_fleet, extent_of
from minsnap.shows.acts import Act, Show
from minsnap.shows.frame_animation import Animation
from minsnap.shows.moves import Move, moved
from minsnap.trajectory import Trajectory

Curves = list[Trajectory]
"""Of one move, in the order of the points of its act; none where it takes no time."""


def curves_of_moves(act: Act, show: Show) -> list[Curves]:
    """Return the curves of each move of an act, one after the other."""
    now, flown = act.points, []
    for move in act.moves:
        try:
            flown.append(_curves(move, now, show))
        except MinsnapError as error:
            error.args = (f"a move of act {act.name!r}: {error}",)
            raise
        now = np.stack([curve.control_points[-1, -1] for curve in flown[-1]]) if flown[-1] else now
    return flown


def _curves(move: Move | Animation, now: FloatArray, show: Show) -> Curves:
    if isinstance(move, Animation):
        return list(move.curves)
    return moved(move, now, show.limits if move.seconds is not None else show.flown_limits)


def reach_of(moves: Sequence[Sequence[Curves]]) -> float:
    """Return the largest coordinate of any move [m]."""
    points = [curve.control_points for act in moves for curves in act for curve in curves]
    return max((float(np.abs(each).max()) for each in points), default=0.0)


def refuse_late_lights(act: Act, moves: Sequence[Curves]) -> None:
    """Refuse changes of the lights of an act that are after its hold and its moves: other acts are flown then."""
    lasts = act.lasts(moves)
    late = [change.after for change in act.lights if change.after > lasts + EXACT]
    if late:
        text = f"the lights of act {act.name!r} change {late[0]:g} s after its arrival, and it lasts {lasts:.4g} s"
        raise FleetError(f"{text}: change them earlier, or hold it longer")


def check_moves(act: Act, moves: Sequence[Curves], show: Show) -> None:
    """Refuse moves whose vehicles come too near, leave the room or the fence, go underground, or are too fast."""
    for move, curves in zip(act.moves, moves, strict=True):
        if isinstance(move, Animation):
            move.refuse_dense_or_fast(act.name, show.separation.aloft, show.limits)
        if curves:
            _check(curves, show, act.name)


def _check(curves: Curves, show: Show, name: str) -> None:
    below = float(show.home[:, 2].min()) - min(float(extent_of(curve.control_points)[0][2]) for curve in curves)
    if below > EXACT:
        raise FleetError(f"a move of {name!r} goes {below:.3g} m below the lowest home: raise the act, or move it less")
    certificate = certify_fleet(curves, show.separation.aloft, room=show.room)
    near = certificate.closest
    if near is not None and near.share < 1.0 - EXACT:
        text = f"vehicles {near.pair[0]} and {near.pair[1]} come within {near.distance:.3f} m of {near.required:g} m"
        raise FleetError(f"{text} in a move of {name!r}: shrink it less", pair=near.pair)
    if certificate.room_margin is not None and certificate.room_margin < -EXACT:
        raise FleetError(f"a move of {name!r} leaves the room by {-certificate.room_margin:.3g} m: move it less far")
    beyond = 0.0 if show.fence is None else -show.fence.margin_of(certificate.fleet)
    if beyond > EXACT:
        raise FleetError(f"a move of {name!r} is {beyond:.3g} m beyond a margin of the fence: move it less far")


def of_vehicles(
    curves: Curves, order: IntArray, now: FloatArray, reserves: FloatArray, separation: Separation, name: str
) -> Curves:
    """Return the curves of all vehicles, of whom those without a point of the act stay where they are.

    Raises
    ------
    FleetError
        If one that stays there, or on the ground as a reserve, is too near to one that moves.
    """
    if not curves:
        return []
    still = [_standing(place, curves[0]) for place in now]
    flown = [still[i] if point < 0 else curves[point] for i, point in enumerate(order.tolist())]
    if len(curves) == len(now) and not len(reserves):
        return flown
    near = certify_fleet([*flown, *(_standing(place, curves[0]) for place in reserves)], separation).closest
    if near is not None and near.share < 1.0 - EXACT:
        text = f"vehicles {near.pair[0]} and {near.pair[1]}, of which one waits, come within {near.distance:.3f} m"
        raise FleetError(f"{text} of {near.required:g} m in a move of {name!r}: raise the act", pair=near.pair)
    return flown


def _standing(place: FloatArray, beside: Trajectory) -> Trajectory:
    return Trajectory(np.tile(place, (1, 8, 1)), np.array([beside.duration]))
