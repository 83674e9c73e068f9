"""A corridor that is kept at samples only, for comparison with planners that do so."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy.typing as npt

from minsnap.basics.arrays import set_fields
from minsnap.basics.checks import MOST_PER_PIECE, is_whole
from minsnap.basics.messages import shown
from minsnap.corridors.constraint import Constraint
from minsnap.errors import CorridorError


@dataclass(frozen=True, eq=False)
class Sampled:
    """A corridor that holds at equally spaced instants of every polynomial, and may be left between them.

    Parameters
    ----------
    corridor : float, array_like, Constraint or sequence of Constraint, optional
        As :func:`minsnap.plan` takes it.
    samples : int
        Instants per polynomial.

    Raises
    ------
    CorridorError
        If the number of samples is not a whole one from 1 to 100,000.
    """

    corridor: npt.ArrayLike | Constraint | Sequence[Constraint] | None
    samples: int = 20

    def __post_init__(self) -> None:
        if not is_whole(self.samples) or not 1 <= self.samples <= MOST_PER_PIECE:
            raise CorridorError(
                f"samples is {shown(self.samples)}: give a whole number of instants per polynomial, at least 1 and at "
                f"most {MOST_PER_PIECE}"
            )
        set_fields(self, samples=int(self.samples))


def unsampled(corridor: Any, limited: bool) -> tuple[Any, int | None]:
    """Return a corridor and its samples per polynomial; None where it holds at every instant.

    Raises
    ------
    CorridorError
        If a sampled corridor goes with limits, which hold at every instant.
    """
    if not isinstance(corridor, Sampled):
        return corridor, None
    if limited:
        raise CorridorError("a Sampled corridor does not go with limits, which hold at every instant: leave one out")
    return corridor.corridor, corridor.samples
