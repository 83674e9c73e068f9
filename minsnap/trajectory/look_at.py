"""A heading towards a point, and one that a function of time gives."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import comb
from typing import Any

import numpy as np

from minsnap.basics.arrays import ArrayLike, FloatArray, NDArray, ReadOnly, bounded, numbers, set_fields
from minsnap.basics.cached import cached_property
from minsnap.basics.checks import check_array
from minsnap.errors import YawError
from minsnap.native.shortest_time import InstantKind, InstantLimit, YawRule
from minsnap.trajectory.heading import Heading, Largest, RuledHeading, nearest_turn
from minsnap.trajectory.instants import parted_instants
from minsnap.trajectory.path import Path
from minsnap.trajectory.trajectory import Trajectory
from minsnap.trajectory.turn_rates import largest_look_rate


@dataclass(frozen=True)
class LookSettings:
    """How finely the turns around a point are counted.

    Parameters
    ----------
    samples : int
        Instants a polynomial piece at least.
    parts : int
        Parts of a path that has no pieces.
    nearest : float
        Least horizontal distance from which a point can be looked at [m].
    finest : int
        Instants at most.
    """

    samples: int = 256
    parts: int = 64
    nearest: float = 1e-3
    finest: int = 4_000_000


LOOKING = LookSettings()


@dataclass(frozen=True, eq=False)
class LookAt(ReadOnly):
    """A point to look at: the yaw of a plan that turns the vehicle's nose towards it.

    Parameters
    ----------
    point : array_like, shape (2,) or (3,)
        [m]; the altitude does not matter.

    Raises
    ------
    YawError
        If it is no point.

    Examples
    --------
    >>> import minsnap
    >>> path = minsnap.plan([(0, 0, 1), (4, 0, 1)], durations=[4], yaw=minsnap.LookAt((2, 2)))
    >>> float(path.yaw(2.0))
    1.5707963267948966
    """

    point: FloatArray

    def __init__(self, point: ArrayLike) -> None:
        place = check_array("the point to look at", point, ((2,), (3,)), "(x, y) [m]", YawError)
        set_fields(self, point=place)

    def heading(self, path: Path) -> LookAtHeading:
        """Return the heading along a path."""
        return LookAtHeading(path, self)


class LookAtHeading(RuledHeading):
    r"""Yaw towards a point, continuous (not wrapped), with exact derivatives of any order.

    With :math:`w = p_x - x + i (p_y - y)` the yaw is :math:`\arg w`, and its derivatives are those of
    :math:`\Im(w' / w)`: from :math:`q w = w'`,

    .. math:: q^{(m)} = \Bigl(w^{(m+1)} - \sum_{k<m} \binom{m}{k} q^{(k)} w^{(m-k)}\Bigr) / w.

    Parameters
    ----------
    path : Path
        Of two coordinates or more.
    target : LookAt
    near : float
        Angle to which that at the start is the nearest, whole turns away [rad].

    Raises
    ------
    YawError
        If the path has one coordinate, or passes nearer than a millimetre to the point.
    """

    what = "a yaw towards a point"

    def __init__(self, path: Path, target: LookAt, near: float = 0.0) -> None:
        if path.dim < 2:
            raise YawError("a yaw towards a point needs at least two coordinates, this path has one")
        self.path, self.target, self.near = path, target, near
        nearest = float(np.abs(self._table[1]).min())
        if nearest < LOOKING.nearest:
            raise YawError(
                f"the path passes within {nearest:.2g} m of the point to look at, {tuple(target.point[:2].tolist())}: "
                "move the point or the path"
            )

    @property
    def asked(self) -> tuple[YawRule, tuple[float, float, float]]:
        """The point."""
        east, north = map(float, self.target.point[:2])
        return YawRule.POINT, (east, north, 0.0)

    def on(self, curve: Path, start: float = 0.0, rate: float = 1.0) -> LookAtHeading:
        """Return the heading towards the same point along another path, that begins as this one is turned then."""
        return LookAtHeading(curve, self.target, float(self(start)))

    def before(self, other: Heading, curve: Path, switch: float) -> Heading:
        """Return one heading where both look at the same point."""
        same = isinstance(other, LookAtHeading) and np.array_equal(self.target.point[:2], other.target.point[:2])
        return self.on(curve) if same else super().before(other, curve, switch)

    def largest_rate(self, start: float, end: float) -> Largest | None:
        """Return that at which the vector to the point turns along a trajectory."""
        path = self.path
        return largest_look_rate(path, self.target.point, start, end) if isinstance(path, Trajectory) else None

    def rate_limits(self, most: float, length: float, speed: float) -> list[InstantLimit]:
        """Return the limit on the turns of the vector to the point."""
        east, north = map(float, self.target.point[:2])
        return [InstantLimit(InstantKind.LOOK_RATE, (most, east, north, length))]

    def _rule(self) -> dict[str, Any]:
        return {"rule": "look at", "point": self.target.point.tolist()}

    def _at(self, t: FloatArray, order: int) -> FloatArray:
        if order == 0:
            grid, _, turned = self._table
            near = turned[np.clip(np.searchsorted(grid, t, side="right") - 1, 0, len(grid) - 1)]
            return nearest_turn(np.angle(self._spoke(t, 0)), near)
        w = [self._spoke(t, n) for n in range(order + 1)]
        q: list[Any] = []
        for m in range(order):
            rest = sum((comb(m, k) * q[k] * w[m - k] for k in range(m)), np.zeros(len(t), dtype=np.complex128))
            q.append((w[m + 1] - rest) / w[0])
        return np.asarray(q[-1].imag)

    def _spoke(self, t: FloatArray, order: int) -> NDArray[np.complex128]:
        """Return the vector to the point, or its derivative, as complex numbers."""
        place = -self.path(t, order)[:, :2]
        place = place + self.target.point[:2] if order == 0 else place
        return np.asarray(place[:, 0] + 1j * place[:, 1])

    @cached_property
    def _table(self) -> tuple[FloatArray, Any, FloatArray]:
        """Instants between which the yaw turns by less than a quarter, the vectors there, and the yaw."""
        grid = parted_instants(self.path, LOOKING.samples, LOOKING.parts * LOOKING.samples)
        while True:
            w = self._spoke(grid, 0)
            if np.abs(w).min() == 0.0:
                return grid, w, np.zeros(len(grid))
            step = np.angle(w[1:] / w[:-1])
            wide = np.flatnonzero(np.abs(step) > np.pi / 4.0)
            if not len(wide) or len(grid) > LOOKING.finest or np.abs(w).min() < LOOKING.nearest:
                break
            grid = np.sort(np.concatenate((grid, (grid[wide] + grid[wide + 1]) / 2.0)))
        first = nearest_turn(np.angle(w[:1]), np.array([self.near]))
        return grid, w, first + np.concatenate(([0.0], np.cumsum(step)))


def heading_at(function: Callable[[Any], Any], t: FloatArray) -> FloatArray:
    """Return the yaw (m,) of a function of time at instants (m,), called with all at once or one by one [rad].

    Raises
    ------
    YawError
        If it gives anything but finite numbers.
    """
    values = _numbers(lambda: function(t))
    if values.shape != t.shape:
        values = _numbers(lambda: [function(instant) for instant in t.tolist()]).reshape(-1)
    if values.shape != t.shape or not bounded(values).all():
        raise YawError(
            "the function that gives the yaw must give a finite angle [rad] for every instant [s] of the path"
        )
    return values


def _numbers(ask: Callable[[], Any]) -> FloatArray:
    try:
        values = numbers(ask())
    except (TypeError, ValueError, OverflowError):
        values = None
    return np.zeros((0, 0)) if values is None else values
