"""Records of a plan: how durations were searched, how far limits are used, how it was made, what is out of the way."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from math import degrees
from typing import Any, NamedTuple, Protocol

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.cards import Facts, card, curve_svg, strip_svg
from minsnap.basics.limit_kinds import KIND, KINDS
from minsnap.basics.messages import labelled
from minsnap.basics.tolerances import EXACT
from minsnap.trajectory.leg_uses import LegUse, PlainLegs, Sensitivity
from minsnap.trajectory.plan_notes import plan_notes


class Step(NamedTuple):
    """One evaluation of a search for durations.

    Parameters
    ----------
    evaluation : int
        Counted from 1.
    total_time : float
        Of the plan that was evaluated [s].
    value : float
        What the search minimises, there: a cost [m^2 / s^(2k - 1)], or a time [s], with a price of what is exceeded.
    best : float
        The least value so far, since that price was raised last.
    """

    evaluation: int
    total_time: float
    value: float
    best: float


def steps_of(history: FloatArray | None) -> tuple[Step, ...]:
    """Return the steps of a search from total time and value, evaluation by evaluation, shape (evaluations, 2)."""
    if history is None:
        return ()
    best = np.minimum.accumulate(history[:, 1]).tolist()
    return tuple(Step(k + 1, total, value, best[k]) for k, (total, value) in enumerate(history.tolist()))


Progress = Callable[[Step], None]
"""Called with every evaluation of a search."""


@dataclass(frozen=True)
class Utilisation:
    """Largest use of a limit, and where it is.

    Parameters
    ----------
    name : str
        Which limit.
    value : float
        Largest value over all time, in the limit's unit (smallest for a lower limit).
    limit : float
    fraction : float
        1 is fully used; more is violated.
    leg : int or None
        Leg where that is; None where a path has none, such as a shape.
    instant : float
        When [s].
    method : {"exact", "interval", "sampled"}
        How it was measured: from exact extrema, as a bound that interval arithmetic proves, or at many instants.
    """

    name: str
    value: float
    limit: float
    fraction: float
    leg: int | None
    instant: float
    method: str = "exact"

    @property
    def fact(self) -> tuple[str, str]:
        """Name and text, in the unit of its option: an active limit is at 100 %."""
        kind = KIND[self.name]
        value, limit = (degrees(size) if kind.degrees else size for size in (self.value, self.limit))
        amount = f"least {value:.4g}, not below {limit:.4g}" if kind.least else f"{value:.4g} of {limit:.4g}"
        place = "" if self.leg is None else f"on leg {self.leg} "
        text = f"{amount} {'degrees' if kind.degrees else kind.unit}, {place}at {self.instant:.4g} s"
        return f"limit {kind.label}", f"{100.0 * self.fraction:.2f} %, {text}"

    @property
    def kept(self) -> bool:
        """Whether the limit is kept, to ``EXACT``."""
        return self.fraction <= 1.0 + EXACT


def norm_facts(norms: Iterable[float]) -> list[tuple[str, str]]:
    """Return the greatest speed, acceleration, jerk and snap, or the first of these, as names and texts."""
    return [(f"max {kind.label}", f"{norm:.4g} {kind.unit}") for kind, norm in zip(KINDS, norms, strict=False)]


def cost_unit(order: int) -> str:
    """Return the unit of the integral of the squared norm of a derivative."""
    return f"m²/s{str(2 * order - 1).translate(_RAISED)}"


_RAISED = str.maketrans("0123456789", "⁰¹²³⁴⁵⁶⁷⁸⁹")


class FoundBound(Protocol):
    """A bound of the time of all flights."""

    @property
    def seconds(self) -> float | None:
        """The time that each takes at least [s]; None where nothing bounds it."""
        ...

    @property
    def left_out(self) -> tuple[str, ...]:
        """What flights keep that it does not know."""
        ...


class LeastTime(Protocol):
    """Asks how long every flight takes at least."""

    @property
    def bound(self) -> FoundBound:
        """The answer, found at the first use."""
        ...


class KnownLegs(Protocol):
    """Knows the legs of a flight."""

    @property
    def legs(self) -> tuple[LegUse, ...]:
        """Each leg."""
        ...

    @property
    def sensitivities(self) -> tuple[Sensitivity, ...]:
        """How the flight time depends on limits and rooms."""
        ...


@dataclass(frozen=True)
class Report:
    """How a plan was made.

    Parameters
    ----------
    solver : str
        ``"banded"`` for the linear system, else the name of the QP solver.
    rounds : int
        QP solves until the curve was proved to be inside all walls; 0 without a QP.
    rows : int
        Inequality rows of the last QP.
    cost : float
        Integral of the squared norm of the k-th derivative for degree 2k - 1 [m^2 / s^(2k - 1)].
    corridor_margin : float or None
        Least distance to a wall over all time [m]; None without a corridor.
    milliseconds : float
        Wall time of the call.
    fallback : tuple of str
        Solvers that failed before this one succeeded.
    utilisation : tuple of Utilisation
        How far each limit is used; empty without limits.
    steps : tuple of Step
        The search for durations, evaluation by evaluation; empty where they were fixed.
    interrupted : bool
        Whether Ctrl-C (``on_interrupt="return"``), time or work ended that search with the best plan so far.
    core : str
        Which core solved the problem: ``"native"`` (compiled) or ``"python"``.
    handed_over : str
        Why the Python core solved the problem in place of the native core; else empty.
    rungs : tuple of str
        Fallbacks that were needed, in their order; empty where the first attempt succeeded.
    notes : tuple of str
        Advice about parts of the request that make the plan slower or dearer without need.
    limits_from : float
        Instant from which the limits hold to the end [s]: 0, but for a start outside of them.
    least : LeastTime or None
        Asks how long every flight within the limits takes at least; None where the plan did not choose its time.
    duration : float
        Of the flight as it was planned [s]; 0 where that was not kept.
    known : KnownLegs or None
        Knows the legs of the flight.
    """

    solver: str
    rounds: int
    rows: int
    cost: float
    corridor_margin: float | None
    milliseconds: float
    fallback: tuple[str, ...] = ()
    utilisation: tuple[Utilisation, ...] = ()
    steps: tuple[Step, ...] = ()
    interrupted: bool = False
    core: str = "python"
    handed_over: str = ""
    rungs: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    limits_from: float = 0.0
    least: LeastTime | None = field(default=None, repr=False, compare=False)
    duration: float = field(default=0.0, repr=False)
    known: KnownLegs | None = field(default=None, repr=False, compare=False)

    def report(self, curve: Any) -> Report:
        """Return itself: what makes the report of a curve may be one."""
        return self

    @property
    def binding(self) -> Utilisation | None:
        """The limit that is used most; None without limits."""
        return max(self.utilisation, key=lambda used: used.fraction, default=None)

    @property
    def lower_bound(self) -> float | None:
        """Proved time that every flight within the limits takes at least [s], whatever its curve.

        It is computed when it is first asked for. None where durations or a total were given, and where nothing
        bounds the time; :func:`minsnap.least_time` says why.
        """
        return None if self.least is None else self.least.bound.seconds

    @property
    def gap(self) -> float | None:
        """How much longer the flight is at most than any other within the limits: duration / lower_bound - 1."""
        least = self.lower_bound
        return None if least is None else self.duration / least - 1.0

    @property
    def legs(self) -> tuple[LegUse, ...]:
        """What the flight does leg by leg, measured when it is first asked for: time, speed, limits that bind."""
        return () if self.known is None else self.known.legs

    @property
    def sensitivities(self) -> tuple[Sensitivity, ...]:
        """How much longer the flight takes for one unit more of each limit, and of room at each gate, ball and box.

        Each is searched twice, from the curve of the plan on, when this is first asked for. Empty where durations, a
        total or a price of time were given, more derivatives are continuous than k - 1, or the way leads around
        obstacles, and in a report that was copied before.
        """
        return () if self.known is None else self.known.sensitivities

    @property
    def nearness(self) -> str | None:
        """A sentence on the gap, with the limits that the bound does not know."""
        least, gap = self.least, self.gap
        if least is None or gap is None:
            return None
        *others, last = least.bound.left_out or ("",)
        left = f"{', '.join(others)} and {last}" if others else last
        without = f", {left} left out" if left else ""
        return f"at most {100.0 * gap:.2f} % longer than any flight within these limits{without}"

    def facts(self) -> list[tuple[str, str | None]]:
        """Return how the plan was made, but for its cost: names and texts, None where one does not apply."""
        margin = self.corridor_margin
        return [
            ("corridor margin", None if margin is None else f"{margin:.3g} m, at every instant"),
            *(used.fact for used in self.utilisation),
            ("solver", f"{self.solver} ({self.core} core)"),
            ("rounds", f"{self.rounds}, {self.rows} rows" if self.rounds else None),
            ("durations searched", f"{len(self.steps)} plans tried" if self.steps else None),
            ("interrupted", "yes: the best plan until then" if self.interrupted else None),
            ("fallbacks", ", ".join((*self.fallback, *self.rungs)) or None),
            ("handed over", self.handed_over or None),
            ("planned in", f"{self.milliseconds:.4g} ms"),
            ("flight time", self.nearness),
            *(("note", note) for note in self.notes),
        ]

    def __str__(self) -> str:
        """Return the card as text: cost, limits, solver and notes, one per line."""
        return labelled([("cost", f"{self.cost:.6g}"), *((name, text) for name, text in self.facts() if text)])

    def _repr_html_(self) -> str:
        """Return the card of a notebook: the facts, and the best value against the plans tried."""
        best = np.array([step.best for step in self.steps])
        drawn = len(best) > 1 and bool(np.isfinite(best).all())
        search = [strip_svg(np.arange(1.0, len(best) + 1.0), best, "best so far")] if drawn else []
        return card("Report", [("cost", f"{self.cost:.6g}"), *self.facts()], search)


class LinearSystem(NamedTuple):
    """What is known of a plan without walls when it is made; its report is made when somebody asks for it.

    Parameters
    ----------
    began, ended : float
        Readings of ``time.perf_counter`` around the plan [s].
    core : str
        Which core solved it.
    history : ndarray, shape (evaluations, 2), or None
        Of a search for durations: total time and what is minimised.
    """

    began: float
    ended: float
    core: str
    history: FloatArray | None = None

    def report(self, curve: Any) -> Report:
        """Return the report of the plan."""
        milliseconds, steps = 1e3 * (self.ended - self.began), steps_of(self.history)
        notes, known = plan_notes(curve), PlainLegs(curve)
        how: dict[str, Any] = {"steps": steps, "core": self.core, "notes": notes, "known": known}
        return Report("banded", 0, 0, curve.cost(), None, milliseconds, **how)


@dataclass(frozen=True)
class DrawingSettings:
    """How finely cards draw a path.

    Parameters
    ----------
    per_leg : int
        Instants for each leg.
    fewest : int
        Instants at least.
    most : int
        Instants at most.
    large : int
        Pieces from which greatest speeds are left out, so that a card is there at once.
    """

    per_leg: int = 24
    fewest: int = 241
    most: int = 2_401
    large: int = 20_000


DRAWN = DrawingSettings()


def path_drawings(path: Any) -> list[str]:
    """Return SVG drawings of a path: from above, and its altitude against time where that changes.

    Parameters
    ----------
    path : Path
        Any dim: a path of one coordinate is drawn against time, of more by its first two, and its third in a strip.
    """
    breaks = getattr(path, "leg_breaks", None)
    legs = 1 if breaks is None else len(breaks) - 1
    t = np.linspace(0.0, path.duration, int(np.clip(DRAWN.per_leg * legs + 1, DRAWN.fewest, DRAWN.most)))
    points = path(t)
    if path.dim == 1:
        return [strip_svg(t, points[:, 0], "x [m]")]
    dots = None if breaks is None or legs > DRAWN.most else path(breaks)[:, :2]
    flat = curve_svg(points[:, :2], dots, "the path from above: x to the right, y upwards")
    climbs = path.dim == 3 and np.ptp(points[:, 2]) > 1e-9 * np.abs(points).max()
    return [flat, strip_svg(t, points[:, 2], "z [m] against time")] if climbs else [flat]


def path_card(path: Any) -> str:
    """Return the card of any path."""
    facts = [("duration", f"{path.duration:.6g} s"), *_extents(path(np.linspace(0.0, path.duration, DRAWN.fewest)))]
    return card(type(path).__name__, facts, path_drawings(path))


def trajectory_card(path: Any) -> str:
    """Return the card of a trajectory: drawn, with its greatest speed, and how it was planned."""
    shape = f"{path.legs} of degree {path.degree}" + (f", {path.pieces} pieces each" if path.pieces > 1 else "")
    known = [("duration", f"{path.duration:.6g} s"), ("legs", shape)]
    known += [("cost", f"{path.cost():.6g} {cost_unit(path.cost_order)}")]
    if len(path.durations) <= DRAWN.large:
        known += norm_facts(norm for norm, _ in path.max_norms((1, 2, 3)))
    how = [] if path.report is None else path.report.facts()
    return card("Trajectory", [*known, *how], path_drawings(path))


def _extents(points: FloatArray) -> Facts:
    names = "xyz" if points.shape[1] <= 3 else [str(i) for i in range(points.shape[1])]
    ends = zip(names, points.min(axis=0), points.max(axis=0), strict=False)
    return [(name, f"{low:.4g} to {high:.4g} m") for name, low, high in ends]
