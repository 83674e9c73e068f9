"""Report: how a plan was found, attached to the trajectory it is about."""

from __future__ import annotations

from dataclasses import dataclass


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
    """

    solver: str
    rounds: int
    rows: int
    cost: float
    corridor_margin: float | None
    milliseconds: float
    fallback: tuple[str, ...] = ()
