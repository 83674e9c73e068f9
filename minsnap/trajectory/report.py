"""Report: how a plan was found and how far it uses its limits, attached to the trajectory it is about."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from minsnap.time_allocation.least_cost import Step


@dataclass(frozen=True)
class Utilisation:
    """How far a limit is used, at the instant where it is used most.

    Parameters
    ----------
    name : str
        Which limit.
    value : float
        Largest value over all time, in the limit's unit (smallest for a lower limit).
    limit : float
    fraction : float
        1 is fully used; more is violated.
    leg : int
        Leg where that is.
    instant : float
        When [s].
    method : {"exact", "interval", "sampled"}
        How it was found: from exact extrema, as a bound that interval arithmetic proves, or at many instants.
    """

    name: str
    value: float
    limit: float
    fraction: float
    leg: int
    instant: float
    method: str = "exact"


@dataclass(frozen=True)
class Report:
    """How a plan was found.

    Parameters
    ----------
    solver : str
        What solved it: ``"banded"`` for the linear system, else the name of the QP solver.
    rounds : int
        QP solves until the certificate held; 0 without a QP.
    rows : int
        Inequality rows of the last QP.
    cost : float
        Integral of the squared norm of the k-th derivative for degree 2k - 1.
    corridor_margin : float or None
        Least distance to a wall over all time [m]; None without a corridor.
    milliseconds : float
        Wall time of the call.
    fallback : tuple of str
        Solvers that were tried before this one and failed.
    utilisation : tuple of Utilisation
        How far each limit is used; empty without limits.
    steps : tuple of Step
        The search for durations, evaluation by evaluation; empty where they were given.
    interrupted : bool
        Whether that search was stopped by Ctrl-C; the plan is the best it had found.
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

    @property
    def binding(self) -> Utilisation | None:
        """The limit that is used most; None without limits."""
        return max(self.utilisation, key=lambda used: used.fraction, default=None)
