"""Certified corridors in native code: least cost inside walls that hold at every instant, with a proof and a bound."""

from __future__ import annotations

from ctypes import c_double, c_int64, c_void_p
from dataclasses import dataclass

import numpy as np

from minsnap.basics.arrays import BoolArray, FloatArray, IntArray
from minsnap.basics.tolerances import GAP
from minsnap.native.library import Entry, address, optional_address
from minsnap.native.status import Status

WALL_TYPES = (c_int64, *[c_void_p] * 8, c_int64, c_void_p)
"""ctypes of what ``wall_arguments`` returns."""

_SOLVE = Entry(
    "minsnap_corridor",
    *(c_int64, c_int64, c_int64, c_int64, c_int64, c_double, c_double, c_void_p, c_void_p, c_void_p, c_void_p),
    *WALL_TYPES,
    *(c_double, c_void_p, c_void_p, c_void_p, c_void_p, c_void_p, c_void_p),
)

_KEPT = Entry("minsnap_walls_kept", c_int64, c_int64, c_int64, c_void_p, c_void_p, *WALL_TYPES, c_void_p)


@dataclass(frozen=True, eq=False)
class WallArrays:
    """Walls, m of them, each on one piece; C-contiguous arrays.

    For ``x = r^(order)(t) - anchor``: planes ``normal . x <= bound``, round walls ``|matrix x| + normal . x <= bound``,
    balls where the normal is zero and else cones.

    Parameters
    ----------
    piece, order : ndarray of int64, shape (m,)
        Where, and which derivative.
    normal, anchor : ndarray, shape (m, dim)
    bound, width : ndarray, shape (m,)
        Right-hand side, and the positive length by which an excess is judged, both [m/s^order].
    when : ndarray of int64, shape (m,), or None
        -1 for every instant of the piece, 0 for its start, 1 for its end; 2 and 3 for a plane on which the curve lies
        at its start or end. None is -1 for all.
    ball : ndarray of int64, shape (m,), or None
        Which matrix each round wall has, -1 for planes; None where all are planes.
    matrix : ndarray, shape (balls, dim, dim), or None
    """

    piece: IntArray
    order: IntArray
    normal: FloatArray
    anchor: FloatArray
    bound: FloatArray
    width: FloatArray
    when: IntArray | None = None
    ball: IntArray | None = None
    matrix: FloatArray | None = None


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
    walls : WallArrays
    length, time : float
        What normalised lengths and times are worth [m], [s]; typical ones of the question.
    pinned : ndarray of bool, shape (pieces + 1, k, dim), or None
        Which derivatives 0 … k - 1 are given at the knots; None: all positions, and all derivatives at both ends.
    values : ndarray, shape (pieces + 1, k, dim), or None
        Their values, for positions the deviation from the nominal one [m/s^order]; None: zero.
    closed : bool
        The last knot is the first; its entries are not read.
    continuity : int
        Derivatives continuous at the knots, up to 2k - 2; always k - 1 at least.
    """

    half: int
    positions: FloatArray
    durations: FloatArray
    walls: WallArrays
    length: float
    time: float
    pinned: BoolArray | None = None
    values: FloatArray | None = None
    closed: bool = False
    continuity: int = 0


@dataclass(frozen=True, eq=False)
class CorridorAnswer:
    """What the native core returned; all but ``status`` and ``attempts`` hold only if the status is ``DONE``.

    Parameters
    ----------
    status : Status
    points : ndarray, shape (pieces, 2k, dim)
        Control points that are proved to be inside every wall [m].
    knots : ndarray, shape (pieces + 1, k, dim)
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
    rounds: int
    attempts: int


def solve_corridor(question: CorridorQuestion, gap: float = GAP) -> CorridorAnswer | None:
    """Solve a question, giving away at most a share ``gap`` of the cost; None where the Python core is in use."""
    function = _SOLVE.function()
    if function is None:
        return None
    pieces, dim, half = len(question.durations), question.positions.shape[1], question.half
    most = pieces * half * dim + 2
    points, knots = np.empty((pieces, 2 * half, dim)), np.empty((pieces + 1, half, dim))
    wall, rows, figures = np.empty(most, dtype=np.int64), np.empty((2, most)), np.zeros(6)
    status = function(
        *(half, pieces, dim, question.continuity, question.closed, question.length, question.time),
        *map(optional_address, (question.positions, question.durations, question.pinned, question.values)),
        *wall_arguments(question.walls),
        *(gap, *map(address, (points, knots, wall, rows[0], rows[1], figures))),
    )
    cost, bound, share, count, rounds, attempts = figures.tolist()
    used = slice(0, int(count))
    active = wall[used], rows[0, used], rows[1, used]
    return CorridorAnswer(Status(status), points, knots, *active, cost, bound, share, int(rounds), int(attempts))


def walls_kept(points: FloatArray, durations: FloatArray, walls: WallArrays) -> BoolArray | None:
    """Say which walls a curve is proved to keep at every instant, rounding included.

    Parameters
    ----------
    points : ndarray, shape (pieces, 2k, dim)
        Control points [m], C-contiguous.
    durations : ndarray, shape (pieces,)
        [s].
    walls : WallArrays

    Returns
    -------
    ndarray of bool, shape (m,), or None
        None where the Python core is in use.

    Raises
    ------
    ValueError
        If a number is not finite or an index out of range.
    """
    function = _KEPT.function()
    if function is None:
        return None
    pieces, count, dim = points.shape
    kept = np.zeros(len(walls.piece), dtype=np.uint8)
    known = (address(points), address(durations), *wall_arguments(walls), address(kept))
    status = Status(function(count // 2, pieces, dim, *known))
    if status is not Status.DONE:
        raise ValueError(f"the walls cannot be checked: {status.reason}")
    return kept.astype(bool)


def wall_arguments(walls: WallArrays) -> tuple[object, ...]:
    """Return the walls as entry points take them."""
    arrays = (walls.piece, walls.order, walls.normal, walls.anchor, walls.bound, walls.width, walls.when, walls.ball)
    balls = 0 if walls.matrix is None else len(walls.matrix)
    return (len(walls.piece), *map(optional_address, arrays), balls, optional_address(walls.matrix))
