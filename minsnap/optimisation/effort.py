"""How much work one problem is worth: counted, not timed, so that it ends alike on every machine.

The unit is about a nanosecond of one processor.  A call of a solver counts by its rows and unknowns and by what the
solver was measured to take for them.
"""

from __future__ import annotations

from dataclasses import dataclass

MOST = 4e8
"""Work that ten legs are worth."""

SHARED = 0.25
"""Share of it where others work on the problem too: the native core before, or one polynomial per leg after."""

ALONE = 2.5
"""The same where stop-and-go is not inside, and where the least width that would do is looked for."""

PRICES = {
    "piqp": (1e5, 300.0, 2.0),
    "clarabel": (1e5, 300.0, 100.0),
    "native": (1e5, 600.0, 0.0),
}
"""Work of a call, for each entry of its rows, and for each of these times the entries of a row.

Other solvers count as Clarabel.
"""

ITERATED = {"daqp": (1e5, 0.2, 0.0), "nnls": (1e5, 1.0, 2.0)}
"""Work of a call, and of an iteration for each entry of the rows and for each pair of rows.

Non-negative least squares counts the rows with which it ends: it takes more iterations where it can choose among many.
"""


@dataclass(eq=False)
class Effort:
    """Work on all programmes of a problem.

    Parameters
    ----------
    legs : int
        More than ten are worth more in proportion.
    share : float
        Share of what the problem is worth that may be spent here.
    spent : float
        Work so far.
    """

    legs: int
    share: float = 1.0
    spent: float = 0.0

    @property
    def over(self) -> bool:
        """Whether the problem is worth no more."""
        return self.spent > self.share * MOST * max(1.0, self.legs / 10.0)

    def spend(self, solver: str, rows: int, unknowns: int, width: float) -> None:
        """Count one call of a solver, for rows with ``width`` entries other than zero, unless it counts its own."""
        if solver in ITERATED:
            return
        call, entry, pair = PRICES.get(solver, PRICES["clarabel"])
        self.spent += call + (rows + unknowns) * width * (entry + pair * width)

    def spend_on_iterations(self, solver: str, rows: int, unknowns: int, iterations: int) -> bool:
        """Count one call of a solver that ended after so many iterations; whether the problem is worth more."""
        call, entry, pair = ITERATED[solver]
        self.spent += call + rows * (unknowns * entry + rows * pair) * iterations
        return not self.over
