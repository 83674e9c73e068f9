"""How much work one problem is worth: counted, not timed, so that it ends alike on every machine."""

from __future__ import annotations

from dataclasses import dataclass

from minsnap.optimisation.qp import DENSE

MOST = 5e7
"""Work for ten legs, in units of one to some ten nanoseconds."""

AT_ONCE = 30.0
"""How much less a QP takes that the first solver answers."""

ALONE = 20.0
"""How much more a problem is worth for which no simpler curve is known."""


@dataclass(eq=False)
class Effort:
    """Work on all QPs of a problem.

    Parameters
    ----------
    legs : int
        More than ten are worth more in proportion.
    spent : float
        Work so far.
    alone : bool
        Whether no curve inside all walls is known that could be taken instead.
    """

    legs: int
    spent: float = 0.0
    alone: bool = False

    @property
    def over(self) -> bool:
        """Whether the problem is worth no more."""
        worth = MOST * (ALONE if self.alone else 1.0)
        return self.spent > worth * max(1.0, self.legs / 10.0)

    def spend(self, rows: int, unknowns: int, width: int, at_once: bool) -> None:
        """Count one call of a solver, for rows with ``width`` entries other than zero."""
        self.spent += (rows + unknowns) * width * (width + DENSE) / (AT_ONCE if at_once else 1.0)
