"""The protocol of a heading, constant, remapped and joined headings, and angles unwrapped and wrapped."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from minsnap.basics.arrays import ArrayLike, FloatArray, bounded, numbers
from minsnap.basics.cached import cached_property
from minsnap.basics.checks import check_number
from minsnap.basics.messages import shown
from minsnap.basics.tolerances import EXACT
from minsnap.errors import YawError
from minsnap.native.shortest_time import InstantLimit, YawRule
from minsnap.trajectory.instants import as_instants, check_order, within
from minsnap.trajectory.medium import Medium

Largest = tuple[float, float]
"""A rate [rad/s], and the instant at which it is reached [s]."""


class Heading:
    """Yaw of a path as a function of time [rad], continuous (never wrapped).

    A heading of your own derives from this class and defines ``__call__``, or is a function of instants and order;
    what else it can say is optional.
    """

    constant: float | None = None
    """The angle of a yaw that never changes [rad]."""

    polynomial: Any = None
    """The yaw as a one-dimensional trajectory, where it is one."""

    medium: Medium | None = None
    """Gravity and drag from which the yaw follows, where the body never spins about its thrust axis."""

    @property
    def breaks(self) -> FloatArray:
        """Instants besides the knots of its path at which its second derivative may jump, as far as it knows [s]."""
        return np.zeros(0)

    def __call__(self, t: ArrayLike, order: int = 0) -> FloatArray:
        """Yaw (order 0) or its derivative at ``t``: any shape in, the same shape out."""
        raise NotImplementedError

    def on(self, curve: Any, start: float = 0.0, rate: float = 1.0) -> Heading:
        """Return the heading of a curve that flies this one's path on another clock.

        Parameters
        ----------
        curve : Path
            At t it is where the path of this heading is at ``start + rate t``, or near it.
        start : float
            [s].
        rate : float
            Negative where it is flown backwards.
        """
        return RemappedHeading(self, start, rate)

    def axes(self, t: FloatArray) -> Any:
        """Return the body's axes x, y, z at instants (m,), each (3, m), where it never spins; None for other yaws."""
        return None

    def forward(self, t: FloatArray) -> Any:
        """Return the body's axis x and its two derivatives there; None for other yaws."""
        return None

    def by_rule(self, curve: Any) -> Heading:
        """Return the heading of another curve by the same rule; the same angles where it follows no rule."""
        return self

    def before(self, other: Heading, curve: Any, switch: float) -> Heading:
        """Return the heading of a curve that has this one up to an instant [s], and another from there on."""
        return JoinedHeading(self, other, switch)

    def largest_rate(self, start: float, end: float) -> Largest | None:
        """Return the largest rate between two instants [s], exact; None where it has no exact measure."""
        return None

    def rate_limits(self, most: float, length: float, speed: float) -> list[InstantLimit]:
        """Return what keeps its rate in a search for times; none where that does not depend on the curve alone.

        Parameters
        ----------
        most : float
            [rad/s].
        length, speed : float
            What is typical of a leg [m], [m/s].
        """
        return []

    @property
    def largest_jerk(self) -> float:
        """Bound of the third derivative [rad/s^3]."""
        return float(np.inf)

    def rule(self, curve: Any) -> dict[str, Any] | None:
        """Return how the yaw follows from a curve, as plain text and numbers; None where it follows no rule."""
        return None


class RuledHeading(Heading):
    """A heading that follows from a path by a rule, which holds for other paths as well."""

    path: Any

    what: str
    """What messages call it."""

    highest: float = np.inf
    """Order of the highest derivative that it has."""

    def __call__(self, t: ArrayLike, order: int = 0) -> FloatArray:
        """Yaw or its derivative at ``t``, in the shape of ``t``.

        Raises
        ------
        YawError
            For a higher order than it has.
        IntervalError
            If an instant is outside the path's interval or not a number.
        """
        if check_order(order) > self.highest:
            raise YawError(f"{self.what} has derivatives up to order {self.highest}, not {order}")
        instants = as_instants(t)
        return self._at(within(instants, self.path.duration), int(order)).reshape(instants.shape)

    def _at(self, t: FloatArray, order: int) -> FloatArray:
        """Return yaw or a derivative at instants (m,) of the path."""
        raise NotImplementedError

    @property
    def asked(self) -> tuple[YawRule, tuple[float, float, float]]:
        """The rule as a search takes it, with its numbers."""
        raise NotImplementedError

    def by_rule(self, curve: Any) -> Heading:
        """Return the heading of another curve by the same rule."""
        return self.on(curve)

    def rule(self, curve: Any) -> dict[str, Any] | None:
        """Return the rule for the path's own curve; of another one it would give another heading."""
        return self._rule() if curve._is_like(self.path) else None

    def _rule(self) -> dict[str, Any]:
        """Return the rule as plain text and numbers."""
        raise NotImplementedError


YawFunction = Callable[..., FloatArray]
"""A function of an array of instants and of the order of the derivative, which gives an angle for each instant."""


@dataclass(frozen=True, eq=False)
class FunctionHeading(Heading):
    """A yaw that is a function of instants and of the order of the derivative."""

    function: YawFunction

    def __call__(self, t: ArrayLike, order: int = 0) -> FloatArray:
        """Return what the function gives, one number for each instant, in the shape of ``t``."""
        instants = as_instants(t)
        angles = numbers(self.function(instants, check_order(order)), copy=False)
        if angles is None or angles.shape not in ((), instants.shape) or not bounded(angles).all():
            raise YawError(
                "the function that gives the yaw must give a finite number [rad] for each instant of an array"
            )
        return np.full(instants.shape, angles)


def as_heading(yaw: Heading | YawFunction) -> Heading:
    """Return a heading as it is, and a function as one; YawError for anything else."""
    if isinstance(yaw, Heading):
        return yaw
    if not callable(yaw):
        raise YawError(f"the yaw is {shown(yaw)}: give a Heading, such as ConstantHeading(0.3), or a function")
    heading = FunctionHeading(yaw)
    try:
        heading(np.zeros(1), 1)
    except TypeError:
        raise YawError(
            "the function that gives the yaw must take instants and the order of the derivative; one of instants alone "
            "goes to plan(yaw=...)"
        ) from None
    return heading


class ConstantHeading(Heading):
    """A yaw that does not change.

    Parameters
    ----------
    angle : float
        Yaw [rad].
    """

    def __init__(self, angle: float = 0.0) -> None:
        give = "it must be an angle in radians"
        self.angle = self.constant = check_number("the yaw", angle, -np.inf, np.inf, give, YawError)

    def __call__(self, t: ArrayLike, order: int = 0) -> FloatArray:
        """Return ``angle`` for order 0 and zero for every derivative, in the shape of ``t``."""
        return np.full(as_instants(t).shape, self.angle if check_order(order) == 0 else 0.0)

    def on(self, curve: Any, start: float = 0.0, rate: float = 1.0) -> Heading:
        """Return itself."""
        return self

    def largest_rate(self, start: float, end: float) -> Largest:
        """Return zero."""
        return 0.0, start

    @property
    def largest_jerk(self) -> float:
        """Zero."""
        return 0.0

    def __repr__(self) -> str:
        return f"ConstantHeading({shown(self.angle)})"


ZERO_YAW = ConstantHeading()
"""The yaw of a path that has no other."""


@dataclass(frozen=True, eq=False)
class RemappedHeading(Heading):
    """Another heading on another clock: ``yaw(t) = heading(start + rate t)``."""

    heading: Heading
    start: float
    rate: float = 1.0

    def __call__(self, t: ArrayLike, order: int = 0) -> FloatArray:
        """Yaw or its derivative at ``t``, in the shape of ``t``."""
        return self.heading(self.start + self.rate * as_instants(t), order) * self.rate**order

    def on(self, curve: Any, start: float = 0.0, rate: float = 1.0) -> Heading:
        """Return the first heading on the clock of both."""
        return RemappedHeading(self.heading, self.start + self.rate * start, self.rate * rate)

    def largest_rate(self, start: float, end: float) -> Largest | None:
        """Return that of the first heading, on this clock."""
        first, last = sorted(self.start + self.rate * t for t in (start, end))
        largest = self.heading.largest_rate(first, last)
        return None if largest is None else (largest[0] * abs(self.rate), (largest[1] - self.start) / self.rate)

    @property
    def largest_jerk(self) -> float:
        """That of the first heading, on this clock."""
        return self.heading.largest_jerk * abs(self.rate) ** 3


@dataclass(frozen=True, eq=False)
class JoinedHeading(Heading):
    """One heading up to an instant, another from there on, turned by whole turns to meet it."""

    first: Heading
    second: Heading
    switch: float

    def __call__(self, t: ArrayLike, order: int = 0) -> FloatArray:
        """Yaw or its derivative at ``t``, in the shape of ``t``."""
        instants = as_instants(t)
        before = self.first(np.minimum(instants, self.switch), order)
        after = self._after(np.maximum(instants - self.switch, 0.0), order)
        return np.where(instants < self.switch, before, after)

    @cached_property
    def _after(self) -> Heading:
        return turned_to(self.second, float(self.first(self.switch)))

    def largest_rate(self, start: float, end: float) -> Largest | None:
        """Return the larger one of both; one without bound where the second begins elsewhere than the first ends."""
        if start < self.switch <= end and abs(float(self.first(self.switch) - self._after(0.0))) > EXACT:
            return np.inf, self.switch
        parts: list[Largest | None] = []
        if start < self.switch:
            parts.append(self.first.largest_rate(start, min(end, self.switch)))
        if end >= self.switch:
            after = self.second.largest_rate(max(start - self.switch, 0.0), end - self.switch)
            parts.append(None if after is None else (after[0], after[1] + self.switch))
        known = [part for part in parts if part is not None]
        return max(known) if len(known) == len(parts) else None


class TurnedHeading(Heading):
    """The directions of another heading, whole turns away from its angles.

    Parameters
    ----------
    heading : Heading
    turns : int
    """

    def __init__(self, heading: Heading, turns: int) -> None:
        self.heading, self.turns = heading, turns
        for name in "medium axes forward largest_rate rate_limits rule".split():
            setattr(self, name, getattr(heading, name))  # what whole turns do not change; files say none of a rule

    def __call__(self, t: ArrayLike, order: int = 0) -> FloatArray:
        """Yaw or its derivative at ``t``, in the shape of ``t``."""
        return np.asarray(self.heading(t, order) + (2.0 * np.pi * self.turns if order == 0 else 0.0))

    def on(self, curve: Any, start: float = 0.0, rate: float = 1.0) -> Heading:
        """Return that of the other heading, as many turns away."""
        return TurnedHeading(self.heading.on(curve, start, rate), self.turns)

    def by_rule(self, curve: Any) -> Heading:
        """Return that of the other heading, as many turns away."""
        return TurnedHeading(self.heading.by_rule(curve), self.turns)

    @property
    def largest_jerk(self) -> float:
        """That of the other heading."""
        return self.heading.largest_jerk


def turned_to(heading: Heading, angle: float) -> Heading:
    """Return a heading, whole turns away where it then begins nearer to an angle [rad]."""
    turns = round((angle - float(heading(0.0))) / (2.0 * np.pi))
    if turns == 0:
        return heading
    if heading.constant is not None:
        return ConstantHeading(heading.constant + 2.0 * np.pi * turns)
    return TurnedHeading(heading, turns)


def shortest_turns(angles: ArrayLike) -> FloatArray:
    """Unwrap yaw angles so that every step is the shortest way round: shape (n,) [rad]."""
    return np.unwrap(np.asarray(angles, dtype=np.float64))


def turns_of(angles: ArrayLike) -> FloatArray:
    """Return yaw angles so that every step is the shortest way round, but those of a whole turn or more: (n,) [rad].

    Angles that come from a function of two coordinates never differ by a whole turn: one that is given is meant.
    """
    given = np.asarray(angles, dtype=np.float64)
    steps = np.diff(given)
    meant = np.abs(steps) >= 2.0 * np.pi * (1.0 - EXACT)
    return np.concatenate((given[:1], given[0] + np.cumsum(np.where(meant, steps, np.diff(shortest_turns(given))))))


def wrap(angle: ArrayLike) -> FloatArray:
    """Bring angles of any shape into [-pi, pi) [rad], for the formats that want it."""
    return np.asarray((np.asarray(angle, dtype=np.float64) + np.pi) % (2.0 * np.pi) - np.pi)


def nearest_turn(angle: FloatArray, near: FloatArray) -> FloatArray:
    """Return angles, but for whole turns, as near to others as they can be [rad]."""
    return np.asarray(angle + 2.0 * np.pi * np.round((near - angle) / (2.0 * np.pi)))
