r"""Few polynomials for many samples: least squares on as few pieces as a tolerance allows, with a proved distance.

The curve is a spline of degree 7 whose first three derivatives are continuous, as those of plans. Its unknowns are the
derivatives at the knots, each scaled by a power of time so that all are lengths; the normal equations are banded.
Knots follow the error: those of the next try share out :math:`\int e^{1/8}` evenly, with e the error of each piece,
which is of the eighth order in its duration (de Boor, *A Practical Guide to Splines*, XII).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise
from math import radians

import numpy as np

from minsnap.basics.arrays import ArrayLike, FloatArray, bounded, numbers
from minsnap.basics.cached import cached_property
from minsnap.basics.checks import check_flag, check_positive, is_whole
from minsnap.basics.messages import explains_names, shown
from minsnap.basics.tolerances import ROUNDING
from minsnap.errors import InputError, UnprovedError
from minsnap.polynomials.bernstein import basis, cut_points, ends_gram, ends_to_points
from minsnap.trajectory.heading import ZERO_YAW, ConstantHeading, Heading, shortest_turns
from minsnap.trajectory.instants import SHORTEST_PIECE
from minsnap.trajectory.planned_heading import PlannedHeading
from minsnap.trajectory.samples import Samples
from minsnap.trajectory.trajectory import Trajectory


@dataclass(frozen=True)
class FitSettings:
    """How samples are fitted.

    Parameters
    ----------
    stiffness : float
        Weight of the snap of each piece, in its own time, beside the squares of its samples' errors: it decides where
        a piece has fewer samples than unknowns, and else nothing.
    rounds : int
        How often knots are moved for one number of pieces.
    hopeless : float
        Error, in tolerances, above which they are not moved.
    yaw : float
        Greatest error of headings [rad].
    """

    stiffness: float = 1e-12
    rounds: int = 8
    hopeless: float = 20.0
    yaw: float = radians(1.0)


FIT = FitSettings()
DEGREE, HALF = 7, 4


@dataclass(frozen=True, eq=False)
class SampleFit:
    """Polynomials for samples, and how near they are.

    Parameters
    ----------
    trajectory : Trajectory
        The polynomials; begins at time 0, where the first sample is.
    at_samples : float
        Greatest distance from a sample, at its instant [m].
    between : float
        No instant's position is farther than this from the straight line between the two samples around it, at the same
        instant [m]. It is proved on control points. Where the samples are a motion, the line itself is up to
        :math:`a h^2 / 8` from it, with its acceleration a and the step h between samples.
    turned : float
        Greatest difference of the heading from a sample's [rad]; 0 without headings.
    """

    trajectory: Trajectory
    at_samples: float
    between: float
    turned: float = 0.0

    @property
    def sentence(self) -> str:
        """What was fitted, and what is proved of it."""
        pieces = len(self.trajectory.durations)
        said = f"{pieces} polynomial{'s' * (pieces > 1)}, at most {_length(self.at_samples)} from the samples and, at "
        said += f"every instant, {_length(self.between)} from the lines between them"
        return f"{said}; the heading within {np.degrees(self.turned):.2g} degrees" if self.turned else said


def _length(metres: float) -> str:
    return f"{max(1e3 * metres, 1e-3):.3g} mm" if metres < 1.0 else f"{metres:.3g} m"


@explains_names({})
def fit_samples(
    t: ArrayLike,
    position: ArrayLike,
    tolerance: float,
    *,
    yaw: ArrayLike | None = None,
    rest: bool = True,
    most_pieces: int | None = None,
) -> SampleFit:
    r"""Return as few polynomials as pass within a tolerance of all samples: least squares, degree 7, C3.

    For positions with noise or rounding, such as frames of an animation, motion capture, or what another planner
    sampled: the curve averages what lies within the tolerance, and its derivatives are those of a smooth motion.

    Parameters
    ----------
    t : array_like, shape (m,)
        Instants [s], increasing; the curve begins at 0, where the first one is.
    position : array_like, shape (m, dim)
        [m].
    tolerance : float
        Greatest distance from a sample at its instant [m].
    yaw : array_like, shape (m,), optional
        Headings [rad], whole turns do not matter; kept within a degree.
    rest : bool
        Whether velocity, acceleration and jerk are 0 at both ends; else they are what fits best.
    most_pieces : int, optional
        No more polynomials than this.

    Returns
    -------
    SampleFit

    Raises
    ------
    InputError
        If the samples are not finite, fewer than two, or their instants do not increase.
    UnprovedError
        If no curve within the tolerance was found with so many pieces, and never more than there are steps between
        samples; says how near the nearest comes.

    Examples
    --------
    >>> import numpy as np, minsnap
    >>> t = np.linspace(0.0, 6.0, 145)
    >>> frames = minsnap.rectangle(width=4, length=2, total_time=6.0)(t).round(3)
    >>> fit = minsnap.fit_samples(t, frames, tolerance=0.005)
    >>> len(fit.trajectory.durations) < 12, fit.at_samples <= 0.005
    (True, True)
    """
    instants, values, yaws = _checked(t, position, yaw)
    check_positive("the tolerance", tolerance, "m", InputError)
    rest = check_flag("rest", rest)
    if most_pieces is not None and not (is_whole(most_pieces) and most_pieces > 0):
        raise InputError(f"most_pieces is {shown(most_pieces)}: give a whole number from 1")
    columns = values if yaws is None else np.column_stack([values, yaws])
    task = _Task(instants - instants[0], columns, values.shape[1], float(tolerance), rest)
    most = min(len(instants) - 1, most_pieces or len(instants))
    found = _fewest(task, most)
    if found.error > 1.0:
        raise UnprovedError(_refusal(found, task, most))
    return _proved(found, task)


def fit_to(samples: Samples, tolerance: float, *, rest: bool = True, most_pieces: int | None = None) -> SampleFit:
    """Return the fit of the positions and headings of samples, as :func:`fit_samples` does."""
    how = {"rest": rest, "most_pieces": most_pieces}
    return fit_samples(samples.t, samples.position, tolerance, yaw=samples.yaw, **how)  # type: ignore[arg-type]


@dataclass(frozen=True, eq=False)
class _Task:
    """Samples (m, columns), of which the first ``dim`` are positions, and what is asked of their curve."""

    t: FloatArray
    values: FloatArray
    dim: int
    tolerance: float
    rest: bool

    @cached_property
    def middles(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Middles of the steps [s], of the lines there [m], and how far a curve may be from these [m].

        It is half as much again as the tolerance, and what lines are from a motion by the second differences of the
        samples: it keeps a curve that meets the samples from swinging between them.
        """
        places, steps = self.values[:, : self.dim], np.diff(self.t)
        slopes = np.diff(places, axis=0) / steps[:, None]
        bent = np.linalg.norm(np.diff(slopes, axis=0), axis=1) / (steps[1:] + steps[:-1])
        around = np.concatenate([bent[:1], bent, bent[-1:]]) if len(bent) else np.zeros(2)
        allowed = 1.5 * self.tolerance + 0.5 * np.maximum(around[1:], around[:-1]) * steps**2
        return self.t[:-1] + 0.5 * steps, 0.5 * (places[1:] + places[:-1]), allowed

    def errors(self, apart: FloatArray) -> FloatArray:
        """Return how far differences (m, columns) use up what is allowed: 1 is all of it."""
        used: FloatArray = np.linalg.norm(apart[:, : self.dim], axis=1) / self.tolerance
        return used if self.dim == apart.shape[1] else np.maximum(used, np.abs(apart[:, self.dim]) / FIT.yaw)


@dataclass(frozen=True, eq=False)
class _Found:
    """Control points (pieces, 8, columns) of a fit between knots [s], and what its samples use of the tolerance."""

    knots: FloatArray
    points: FloatArray
    used: FloatArray

    @property
    def error(self) -> float:
        return float(self.used.max())


def _checked(
    t: ArrayLike, position: ArrayLike, yaw: ArrayLike | None
) -> tuple[FloatArray, FloatArray, FloatArray | None]:
    instants, values, yaws = numbers(t), numbers(position), None if yaw is None else numbers(yaw)
    if instants is None or instants.ndim != 1 or len(instants) < 2 or not bounded(instants).all():
        raise InputError(f"the instants are {shown(t)}: give two or more finite numbers [s]")
    if values is None or values.ndim != 2 or len(values) != len(instants) or not values.shape[1]:
        raise InputError(f"the positions are {shown(position)}: give one row of coordinates for each instant")
    if not bounded(values).all():
        raise InputError(f"position {int(np.argwhere(~bounded(values))[0, 0])} is not finite")
    steps = np.diff(instants)
    if not (steps >= SHORTEST_PIECE).all():
        i = int(np.argmin(steps >= SHORTEST_PIECE))
        raise InputError(f"instant {i + 1} is {instants[i + 1]:g} s, not after the {instants[i]:g} s before it")
    if yaw is None:
        return instants, values, None
    if yaws is None or yaws.shape != instants.shape or not bounded(yaws).all():
        raise InputError(f"the headings are {shown(yaw)}: give one finite angle for each instant [rad]")
    return instants, values, shortest_turns(yaws)


def _fewest(task: _Task, most: int) -> _Found:
    """Return the fit of fewest pieces that keeps the tolerance, or of those tried the nearest one."""
    low, high, best = 0, 1, None
    while True:
        found = _fit(task, high, best)
        best = found if best is None or found.error < best.error else best
        if found.error <= 1.0 or high == most:
            break
        wanted = 0.8 * high * found.error ** (1.0 / (DEGREE + 1))  # the error is of the eighth order
        low, high = high, min(most, max(high + 1 + high // 12, min(int(wanted), 2 * high)))
    if best.error > 1.0:
        return best
    best = found
    while high - low > 1:
        middle = (low + high) // 2
        tried = _fit(task, middle, best)
        if tried.error <= 1.0:
            best, high = tried, middle
        else:
            low = middle
    return best


def _fit(task: _Task, pieces: int, like: _Found | None) -> _Found:
    """Return the best fit with a number of pieces, from even knots and from those of another fit."""
    end = float(task.t[-1])
    starts = [np.linspace(0.0, end, pieces + 1)]
    if like is not None and len(like.knots) > 2:
        starts.append(_shared(like.knots, np.ones(len(like.knots) - 1), pieces, task))
    best: _Found | None = None
    for knots in starts:
        for _ in range(FIT.rounds if pieces > 1 else 1):
            found = _solved(task, knots)
            best = found if best is None or found.error < best.error else best
            if best.error <= 1.0:
                return best
            if best.error > FIT.hopeless or found.error > 2.0 * best.error:
                break
            parts = _within(knots, task.t)[0]
            worst = np.array([found.used[part].max(initial=1e-3) for part in parts])
            knots = _shared(knots, worst ** (1.0 / (DEGREE + 1)), pieces, task)
    assert best is not None
    return best


def _shared(knots: FloatArray, weights: FloatArray, pieces: int, task: _Task) -> FloatArray:
    """Return knots between which equal shares of weights lie that pieces have; half a mean step apart at least."""
    sums = np.concatenate([[0.0], np.cumsum(weights)])
    moved = np.interp(np.linspace(0.0, sums[-1], pieces + 1), sums, knots)
    least = 0.5 * task.t[-1] / (len(task.t) - 1)
    widths = np.maximum(np.diff(moved), least)
    return np.concatenate([[0.0], np.cumsum(widths) * (task.t[-1] / widths.sum())])


def _solved(task: _Task, knots: FloatArray) -> _Found:
    """Return the least-squares curve between knots."""
    from scipy.linalg import solveh_banded

    widths, pieces = np.diff(knots), len(knots) - 1
    parts, s = _within(knots, task.t)
    rows, scale = basis(DEGREE, s), _scales(widths)
    squares = np.empty((pieces, 2 * HALF, 2 * HALF))
    right = np.empty((pieces, 2 * HALF, task.values.shape[1]))
    for i, part in enumerate(parts):  # products of few long matrices: quicker than one sum over all samples
        squares[i], right[i] = rows[part].T @ rows[part], rows[part].T @ task.values[part]
    ends = ends_to_points(DEGREE) * scale[:, None, :]  # from the unknowns at both ends of a piece to its control points
    share = FIT.stiffness * len(task.t) / pieces
    squares = (
        ends.transpose(0, 2, 1) @ squares @ ends + share * scale[:, :, None] * ends_gram(DEGREE) * scale[:, None, :]
    )
    band, sums = _banded(squares, ends.transpose(0, 2, 1) @ right)
    if task.rest:
        for unknown in (1, 2, 3, len(sums) - 3, len(sums) - 2, len(sums) - 1):
            _pin(band, sums, unknown)
    unknowns = solveh_banded(band, sums, lower=True).reshape(pieces + 1, HALF, -1)
    points = ends @ np.concatenate([unknowns[:-1], unknowns[1:]], axis=1)
    used = task.errors(_evaluated(points, parts, rows) - task.values)
    at, lines, allowed = task.middles
    parts, s = _within(knots, at)
    apart = _evaluated(points[:, :, : task.dim], parts, basis(DEGREE, s)) - lines
    np.maximum(used[1:], np.linalg.norm(apart, axis=1) / allowed, out=used[1:])
    return _Found(knots, points, used)


def _within(knots: FloatArray, t: FloatArray) -> tuple[list[slice], FloatArray]:
    """Return which instants each piece has, and the time of each within its piece from 0 to 1."""
    first = np.concatenate([[0], np.searchsorted(t, knots[1:-1]), [len(t)]])
    start, width = (np.repeat(values, np.diff(first)) for values in (knots[:-1], np.diff(knots)))
    return [slice(*pair) for pair in pairwise(first.tolist())], np.clip((t - start) / width, 0.0, 1.0)


def _evaluated(points: FloatArray, parts: list[slice], rows: FloatArray) -> FloatArray:
    """Return the values of pieces (pieces, 8, columns) at instants, of which each has a part: (m, columns)."""
    values = np.empty((len(rows), points.shape[2]))
    for part, own in zip(parts, points, strict=True):
        values[part] = rows[part] @ own
    return values


def _scales(widths: FloatArray) -> FloatArray:
    """Return what turns the scaled derivatives at the knots into those in a piece's own time: (pieces, 8)."""
    left, right = np.concatenate([widths[:1], widths[:-1]]), np.concatenate([widths[1:], widths[-1:]])
    orders = np.arange(HALF)
    start = np.sqrt(widths / left)[:, None] ** orders
    end = np.sqrt(widths / right)[:, None] ** orders
    return np.concatenate([start, end], axis=1)


def _banded(squares: FloatArray, right: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the sum of the blocks of pieces as the lower band of ``solveh_banded``, and the right-hand side."""
    pieces, size = len(squares), HALF * (len(squares) + 1)
    band, sums = np.zeros((2 * HALF, size)), np.zeros((size, right.shape[2]))
    starts = HALF * np.arange(pieces)
    for column in range(2 * HALF):
        np.add.at(sums, starts + column, right[:, column])
        for row in range(column, 2 * HALF):
            np.add.at(band[row - column], starts + column, squares[:, row, column])
    return band, sums


def _pin(band: FloatArray, sums: FloatArray, unknown: int) -> None:
    """Make one unknown zero."""
    band[:, unknown] = 0.0
    for below in range(1, min(unknown, len(band) - 1) + 1):
        band[below, unknown - below] = 0.0
    band[0, unknown], sums[unknown] = 1.0, 0.0


def _proved(found: _Found, task: _Task) -> SampleFit:
    """Return a fit with its distances: at the samples by evaluation, between them by control points."""
    places, widths = found.points[:, :, : task.dim], np.diff(found.knots)
    yaws = found.points[:, :, task.dim :]
    heading: Heading = ZERO_YAW
    if yaws.shape[2]:
        still = np.ptp(yaws) == 0.0
        heading = ConstantHeading(float(yaws.flat[0])) if still else PlannedHeading(Trajectory(yaws, widths))
    curve = Trajectory(places, widths, heading)
    t = np.minimum(task.t, curve.duration)
    at = float(np.linalg.norm(curve(t) - task.values[:, : task.dim], axis=1).max())
    turned = float(np.abs(curve.yaw(t) - task.values[:, task.dim]).max()) if yaws.shape[2] else 0.0
    return SampleFit(curve, at, max(at, distance_between(curve, t, task.values[:, : task.dim])), turned)


def distance_between(curve: Trajectory, t: FloatArray, position: FloatArray) -> float:
    """Return a bound of the distance of a curve from the straight lines between samples, at the same instants [m].

    Each part between two neighbouring instants, of samples or of knots, has its own control points; a curve of control
    points that are differences lies in their hull.

    Parameters
    ----------
    curve : Trajectory
    t : ndarray, shape (m,)
        From 0 to the curve's duration [s].
    position : ndarray, shape (m, dim)
        [m].
    """
    parts = np.unique(np.concatenate([t, curve.breaks]))
    starts, ends = parts[:-1], parts[1:]
    piece = np.clip(np.searchsorted(curve.breaks, 0.5 * (starts + ends), side="right") - 1, 0, len(curve.durations) - 1)
    s = [np.clip((at - curve.breaks[piece]) / curve.durations[piece], 0.0, 1.0) for at in (starts, ends)]
    points = cut_points(curve.control_points[piece], *s)
    lines = [np.column_stack([np.interp(at, t, axis) for axis in position.T]) for at in (starts, ends)]
    along = np.linspace(0.0, 1.0, curve.degree + 1)[None, :, None]
    apart = points - ((1.0 - along) * lines[0][:, None] + along * lines[1][:, None])
    rounding = ROUNDING * max(float(np.abs(position).max()), float(np.abs(curve.control_points).max()))
    return float(np.linalg.norm(apart, axis=2).max()) + rounding


def _refusal(found: _Found, task: _Task, most: int) -> str:
    """Return a sentence on why the tolerance is not kept, and what would help."""
    places = _proved(found, task)
    reached = f"{most} pieces come within {_length(places.at_samples)} of the samples, not within "
    reached += _length(task.tolerance)
    if places.turned > FIT.yaw and places.at_samples <= task.tolerance:
        reached = f"{most} pieces come within {np.degrees(places.turned):.3g} degrees of the headings, not within 1"
    worst = float(task.t[int(found.used.argmax())])
    if task.rest and _fewest(replace(task, rest=False), most).error <= 1.0:
        return f"{reached}: the samples do not rest at both ends; leave these free, rest=False (--ends free)"
    return f"{reached}, farthest at {worst:.4g} s: give a greater tolerance, or fly it in parts"
