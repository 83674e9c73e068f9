"""Certified corridors in native code: least cost inside walls that hold at every instant, with a proof and a bound."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf
from typing import Any

import numpy as np

from minsnap.basics.arrays import BoolArray, FloatArray, IntArray
from minsnap.basics.tolerances import GAP
from minsnap.native.library import Entry
from minsnap.native.records import CorridorAnswerRecord, CorridorRecord, SlackRecord, WallsRecord
from minsnap.native.status import Status

_SOLVE = Entry("minsnap_corridor", CorridorRecord, CorridorAnswerRecord)
_SLACK = Entry("minsnap_least_slack", CorridorRecord, SlackRecord, CorridorAnswerRecord)


@dataclass(frozen=True, eq=False)
class CorridorQuestion:
    """A chain of pieces through nominal positions, and the walls it must stay inside.

    Parameters
    ----------
    half : int
        k of degree 2k - 1.
    positions : ndarray, shape (pieces + 1, dim)
        Nominal positions of the knots [m].
    durations : ndarray, shape (pieces,)
        [s].
    walls : sequence of WallsRecord
        Each wall on a piece.
    length, time : float
        What normalised lengths and times are worth [m], [s]; typical ones of the question.
    pinned : ndarray of bool, shape (pieces + 1, slots, dim), or None
        Which derivatives 0 … k - 1 are given at the knots; None: all positions, and all derivatives at both ends.
        With continuity k - 2 the last has two slots: of the piece that ends at the knot, and of the one that starts.
    values : ndarray, shape (pieces + 1, slots, dim), or None
        Their values, for positions the deviation from the nominal one [m/s^order]; None: zero.
    closed : bool
        The last knot is the first; its entries are not read.
    continuity : int
        Derivatives continuous at the knots, k - 2 … 2k - 2; by default k - 1.
    """

    half: int
    positions: FloatArray
    durations: FloatArray
    walls: Sequence[WallsRecord]
    length: float
    time: float
    pinned: BoolArray | None = None
    values: FloatArray | None = None
    closed: bool = False
    continuity: int = -1

    @property
    def slots(self) -> int:
        """Values of a knot along each coordinate."""
        return self.half + (0 <= self.continuity < self.half - 1)


@dataclass(frozen=True, eq=False)
class CorridorAnswer:
    """What the native core returned; all but ``status``, ``work`` and ``attempts`` hold only if the status is ``DONE``.

    Parameters
    ----------
    status : Status
    points : ndarray, shape (pieces, 2k, dim)
        Control points that are proved to be inside every wall [m].
    knots : ndarray, shape (pieces + 1, slots, dim)
        Derivatives at the knots, normalised, of positions the deviation.
    wall : ndarray of int64, shape (r,)
        Walls that the curve touches, one for each contact.
    s : ndarray, shape (r,)
        Where on their pieces.
    multiplier : ndarray, shape (r,)
        By how much the normalised cost falls for each normalised unit by which the bound of that wall grows there.
    cost, bound : float
        Normalised cost, and a lower bound of the cost of every curve inside the walls, computed from the multipliers.
    share : float
        Share of their widths by which walls were moved inwards to leave room for the proof.
    work : float
        Counted work; 1 is what a question is worth.
    rounds : int
    attempts : int
        1: double precision was enough; 2: double-double arithmetic was used.
    """

    status: Status
    points: FloatArray
    knots: FloatArray
    wall: IntArray
    s: FloatArray
    multiplier: FloatArray
    cost: float
    bound: float
    share: float
    work: float
    rounds: int
    attempts: int


@dataclass(frozen=True, eq=False)
class Give:
    """How walls may give way.

    Parameters
    ----------
    group : ndarray of int, shape (m,)
        Slack that moves each wall outwards; -1 for a wall that stands.
    weight : ndarray, shape (m,)
        Widths by which a wall moves for a slack of 1.
    slacks : int
        Number of slacks.
    """

    group: IntArray
    weight: FloatArray
    slacks: int


@dataclass(frozen=True, eq=False)
class LeastSlack:
    """The least sum of squares of slacks with which a curve keeps all walls, and the rows that press against them.

    Parameters
    ----------
    status : Status
    slacks : ndarray, shape (slacks,)
    knots : ndarray, shape (pieces + 1, slots, dim)
        Of a curve with these slacks, as those of a ``CorridorAnswer``.
    wall : ndarray of int64, shape (r,)
    s : ndarray, shape (r,)
        Where on its piece each wall presses.
    multiplier, remainder : ndarray, shape (r,)
        Of the rows in normalised units, the largest 1, as sums of two numbers: next to nothing is left of the sum of
        the rows. That of a plane on which the curve lies has any sign.
    direction : ndarray, shape (r, dim)
        Of tangent planes of round walls, a little shorter than 1.
    work : float
        As of a ``CorridorAnswer``.
    """

    status: Status
    slacks: FloatArray
    knots: FloatArray
    wall: IntArray
    s: FloatArray
    multiplier: FloatArray
    direction: FloatArray
    remainder: FloatArray
    work: float


def solve_corridor(
    question: CorridorQuestion, gap: float = GAP, effort: float = 1.0, seconds: float = inf
) -> CorridorAnswer:
    """Solve a question, giving away at most a share ``gap`` of the cost.

    It gives up after a share ``effort`` of the work that a question is worth, or after so many seconds.
    """
    record = _answer_record(question)
    status = Status(_SOLVE(corridor_record(question, question.durations, gap, effort, seconds), record))
    figures = {name: getattr(record, name) for name in ("cost", "bound", "share", "work", "rounds", "attempts")}
    return CorridorAnswer(status, record.kept["points"], record.kept["knots"], **_contacts(record), **figures)


def least_slack(question: CorridorQuestion, give: Give, sign: bool, effort: float, seconds: float = inf) -> LeastSlack:
    """Return the least slacks with which a curve keeps all walls.

    Both hold at any status that is about the method, the slacks as a bound from below.  It gives up after an ``effort``
    of all stages, as of a solve, or after so many seconds; with ``sign`` it ends where they are known to be more than
    nothing.
    """
    answer = _answer_record(question, give.slacks)
    most, dim = len(answer.kept["s"]), question.positions.shape[1]
    slack, remainder = np.zeros(give.slacks), np.zeros(most)
    answer.put(direction=np.zeros((most, dim)), rows=0)
    group, weight = np.ascontiguousarray(give.group, dtype=np.int64), np.ascontiguousarray(give.weight)
    known = {"count": give.slacks, "group": group, "weight": weight, "sign": sign}
    slacks = SlackRecord(**known, slack=slack, remainder=remainder)
    status = Status(_SLACK(corridor_record(question, question.durations, GAP, effort, seconds), slacks, answer))
    rest = {"direction": answer.kept["direction"][: answer.rows], "remainder": remainder[: answer.rows]}
    return LeastSlack(status, slack, answer.kept["knots"], **_contacts(answer), **rest, work=answer.work)


def _contacts(answer: CorridorAnswerRecord) -> dict[str, Any]:
    """Return the rows that an answer has, by name."""
    return {name: answer.kept[name][: answer.rows] for name in ("wall", "s", "multiplier")}


def _answer_record(question: CorridorQuestion, slacks: int = 0) -> CorridorAnswerRecord:
    """Return room for the answer to a question."""
    pieces, dim, slots = len(question.durations), question.positions.shape[1], question.slots
    most = pieces * slots * dim + 2 + slacks
    curve = {"points": np.empty((pieces, 2 * question.half, dim)), "knots": np.empty((pieces + 1, slots, dim))}
    rows = {"wall": np.empty(most, dtype=np.int64), "s": np.empty(most), "multiplier": np.empty(most)}
    return CorridorAnswerRecord(**curve, **rows)


def corridor_record(
    question: CorridorQuestion, durations: FloatArray, gap: float, effort: float = 1.0, seconds: float = inf
) -> CorridorRecord:
    """Return a question as entry points take it, with durations of pieces, or of legs for a search."""
    sizes = {"pieces": len(durations), "dim": question.positions.shape[1], "groups": len(question.walls)}
    ends = {"gap": gap, "effort": effort, "seconds": seconds}
    return CorridorRecord(**vars(question) | sizes | ends | {"durations": durations})
