"""The way back from a start on or outside its limits or its corridor: the shortest piece that ends with room.

Conditions that the start keeps hold during the piece; those that it does not keep hold at its end, and before it as far
as they can.  At its end all are kept with room, also a moment ahead, so that a search can go on from there.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from math import hypot

import numpy as np

from minsnap.basics.arrays import GRAVITY, FloatArray
from minsnap.basics.deadline import NEVER, Deadline
from minsnap.corridors.constraint import Walls, walls_from
from minsnap.durations.initial_guess import norm_limits
from minsnap.durations.single_piece import Demand, SinglePiece, conditions_of
from minsnap.limits.limits import Limits
from minsnap.optimisation.task import Task
from minsnap.trajectory.trajectory import Trajectory


@dataclass(frozen=True)
class ConnectorSettings:
    """What a way back keeps, and how its duration is looked for.

    Parameters
    ----------
    instants : int
        Of the piece, at which conditions hold.
    margins : tuple of float
        By how many widths conditions are moved inwards, so that they hold between instants, by order of the derivative.
    doubtful_margin : float
        A condition whose margin is below this at the start, or the moment ahead of it, counts as violated there.
    leniences : tuple of (float, float)
        Excess, below zero, above which a limit counts as not kept, and by how many widths it may be exceeded further;
        they are tried in this order.
    rest_room : (float, float)
        Share of the room of a motion at rest that is left at the end, of positions and velocities, and of the others.
    moment_ahead : float
        Moment ahead for which the end has room, in the time that full acceleration takes to the largest speed.
    shortest_tried, longest_tried, least_ratio : float
        Durations tried, in the same unit, and the ratio of one that does to one that does not at which their bisection
        ends.
    on_limit : float
        How near to a limit a start or an end counts as on it.
    pieces : int
        Pieces a leg with which is searched again where fewer find nothing between the ways.
    """

    instants: int = 16
    margins: tuple[float, ...] = (1e-4, 1e-3, 4e-3, 2e-2)
    doubtful_margin: float = 0.02
    leniences: tuple[tuple[float, float], ...] = ((0.02, 0.05), (np.inf, 0.3), (np.inf, 3.0))
    rest_room: tuple[float, float] = (0.02, 0.5)
    moment_ahead: float = 0.1
    shortest_tried: float = 0.02
    longest_tried: float = 20.0
    least_ratio: float = 1.1
    on_limit: float = 1e-5
    pieces: int = 3


CONNECTOR = ConnectorSettings()


def pinned_state(task: Task, waypoint: int = 0) -> FloatArray:
    """Position and pinned derivatives of a waypoint, (k, dim)."""
    pinned, zero = task.pins.get(waypoint, {}), np.zeros(task.dim)
    return np.stack([task.waypoints[waypoint], *(pinned.get(order, zero) for order in range(1, task.half))])


def pinned_use(task: Task, limits: Limits, waypoint: int = 0) -> float:
    """Share of the most used limit at a waypoint."""
    return state_use(pinned_state(task, waypoint), limits)


def state_use(state: FloatArray, limits: Limits) -> float:
    """Share of the most used limit in a state (k, dim)."""
    derivatives = {order: state[order] for order in range(1, len(state))}
    return max((used.fraction for used in limits.use_of_state(derivatives, state.shape[1])), default=0.0)


def connect_start(
    state: FloatArray, walls: Sequence[Walls], limits: Limits, deadline: Deadline = NEVER, leg: int = 0
) -> Trajectory | None:
    """Return the shortest way back from a state, one polynomial; None where there is none.

    Parameters
    ----------
    state : ndarray, shape (k, dim)
        Derivatives 0 ... k - 1.
    walls : sequence of Walls
        Of the corridor; those of one leg are kept.
    limits : Limits
    deadline : Deadline
        At which the search ends.
    leg : int
        Which leg that is.
    """
    scales = typical(state, limits)
    piece = SinglePiece(state, scales[1], deadline)
    moment = scales[0] / scales[1]
    soon = CONNECTOR.moment_ahead * moment
    bounds = [limits, *_smoothing(limits, scales[1] / soon, soon, len(state))]
    own = walls_from(walls, leg, leg + 1)
    own += [wall for bound in bounds for wall in walls_from(bound.walls(np.zeros((2, len(state[0])))), 0, 1)]
    known = [wall.from_origin(state[0]) for wall in own]
    for lenience in CONNECTOR.leniences:
        demands = [demand for wall in known for demand in _demands(wall, piece.state, moment, lenience)]
        attempt = partial(piece.within, conditions_of(demands))
        least, most = CONNECTOR.shortest_tried * moment, CONNECTOR.longest_tried * moment
        duration, answer = shortest(attempt, least, most, CONNECTOR.least_ratio)
        if answer is not None:
            return Trajectory(answer[None] + state[0], np.array([duration]))
    return None


def _smoothing(limits: Limits, jerk: float, ahead: float, half: int) -> list[Limits]:
    """Bound what limits leave free: the jerk of a body rate, and all but the highest derivative of a state.

    That one is bounded by the room which the one below it has a moment ahead.
    """
    turning = norm_limits(limits)[2]
    bounded = {"jerk": min(jerk if half > 4 else np.inf, turning), "snap": jerk / ahead if half > 5 else np.inf}
    given = limits.given()
    lacking = {name: most for name, most in bounded.items() if np.isfinite(most) and name not in given}
    return [Limits(jerk=lacking.get("jerk"), snap=lacking.get("snap"))] if lacking else []


def shortest(
    attempt: Callable[[float], FloatArray | None], least: float, most: float, finer: float
) -> tuple[float, FloatArray | None]:
    """Look for the least duration that has an answer: coarsely upwards, then by bisection."""
    high, answer = least, attempt(least)
    low = high
    while answer is None and high < most:
        low, high = high, 1.6 * high
        answer = attempt(high)
    while answer is not None and high > finer * low:
        middle = float(np.sqrt(low * high))
        shorter = attempt(middle)
        low, high, answer = (low, middle, shorter) if shorter is not None else (middle, high, answer)
    return high, answer


def typical(state: FloatArray, limits: Limits | None) -> tuple[float, float]:
    """Return a speed and an acceleration that count as large from a state on: of the limits, or else of the state."""
    speed, acceleration = (np.inf, np.inf) if limits is None else norm_limits(limits)[:2]
    acceleration = acceleration if np.isfinite(acceleration) else GRAVITY / 2.0
    moving = hypot(*state[1]) if len(state) > 1 else 0.0
    speed = speed if np.isfinite(speed) else max(moving, 1.0)
    return max(speed, moving), acceleration


def _demands(walls: Walls, state: FloatArray, moment: float, lenience: tuple[float, float]) -> list[Demand]:
    """Return the demands of some walls on the piece and on its end."""
    demands = piece_demands(walls, state, moment, lenience)
    order = walls.order
    if order >= len(state):
        return demands
    end, room = np.ones(1), _room(walls)
    demands.append(Demand(walls, end, room))
    if order and order + 1 < len(state):
        demands.append(Demand(walls, end, room, ahead=CONNECTOR.moment_ahead * moment))
    return demands


def piece_demands(
    walls: Walls, state: FloatArray, moment: float, lenience: tuple[float, float] = CONNECTOR.leniences[0]
) -> list[Demand]:
    """Return the demands of some walls on a piece: kept where the start keeps it, else as far as it can be.

    Parameters
    ----------
    walls : Walls
    state : ndarray, shape (k, dim)
        Derivatives at the start; the position is the origin.
    moment : float
        Time that full acceleration takes to the largest speed [s].
    lenience : tuple of float
        One of ``CONNECTOR.leniences``.
    """
    order, inside = walls.order, np.arange(1, CONNECTOR.instants + 1) / CONNECTOR.instants
    margin = np.full(CONNECTOR.instants, CONNECTOR.margins[min(order, len(CONNECTOR.margins) - 1)])
    if order >= len(state):
        return [Demand(walls, inside, margin)]
    now = walls.excess_at(state[order])
    unsure = np.maximum(now, _soon(walls, state, moment)) > (-lenience[0] if order else -CONNECTOR.doubtful_margin)
    demands = [Demand(walls.chosen(~unsure), inside, margin)] if not unsure.all() else []
    if unsure.any():
        part, allowed = walls.chosen(unsure), np.maximum(now[unsure], 0.0) + lenience[1]
        demands.append(Demand(part, inside, margin * inside, soft=True))
        demands.append(Demand(part, inside, np.broadcast_to(-allowed, (CONNECTOR.instants, len(allowed)))))
    return demands


def _soon(walls: Walls, state: FloatArray, moment: float) -> FloatArray:
    """Excess of a limit a moment ahead of the start, (r,); of a position at the start."""
    order = walls.order
    ahead = bool(order) and order + 1 < len(state)
    return walls.excess_at(state[order] + CONNECTOR.moment_ahead * moment * state[order + 1] if ahead else state[order])


def _room(walls: Walls) -> FloatArray:
    """Inward move at the end, (1, r): a share of the room that rest has, or of the width for positions."""
    share = CONNECTOR.rest_room[walls.order > 1]
    if walls.order == 0:
        return np.full((1, len(walls.leg)), share)
    rest = walls.excess_at(np.zeros(walls.anchor.shape[1]))
    return np.asarray(share * np.maximum(-rest, 0.0))[None]
