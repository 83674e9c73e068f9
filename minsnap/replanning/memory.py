"""What a Replanner keeps of its last answer: its question, and from where the next search can begin."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.corridors.constraint import Walls
from minsnap.optimisation.task import Task
from minsnap.replanning.splice import Splice
from minsnap.trajectory.trajectory import Trajectory


@dataclass(frozen=True, eq=False)
class Memory:
    """The last answer.

    Parameters
    ----------
    answer : Trajectory
        That was returned.
    leg_start : ndarray, shape (dim,)
        Where its first leg begins, for corridors that run along legs [m].
    legs : list of bytes
        The conditions of every leg.
    settled : bool
        Whether the search behind it ended by itself.
    guess : Trajectory or None
        The last planned curve for these legs, where it was not returned.
    """

    answer: Trajectory
    leg_start: FloatArray
    legs: list[bytes]
    settled: bool
    guess: Trajectory | None = None

    def same(self, splice: Splice, legs: list[bytes]) -> bool:
        """Whether every leg ahead has the same conditions as for this answer, and its search had ended."""
        return self.settled and self.answer is splice.flown and self.legs[splice.passed :] == legs

    def first_guess(self, splice: Splice, legs: int) -> Trajectory | None:
        """Return the rest of the last curve, if it has that number of legs."""
        if self.guess is None or self.answer is not splice.flown:
            return None
        rest = Splice(self.guess, splice.instant, splice.half).rest
        return rest if rest is not None and rest.legs == legs else None


def leg_start_of(splice: Splice, memory: Memory | None) -> FloatArray:
    """Where the leg being flown begins, (dim,) [m]: before earlier splices, too."""
    known = memory is not None and memory.answer is splice.flown and splice.passed == 0
    return memory.leg_start if known and memory is not None else splice.leg_start


def leg_conditions(task: Task) -> list[bytes]:
    """All conditions of each leg, in a form that can be compared."""
    ends = [task.waypoints[1:].tobytes(), task.lower[1:].tobytes(), task.upper[1:].tobytes()]
    size = len(ends[0]) // task.legs
    parts = [[end[leg * size : (leg + 1) * size] for end in ends] for leg in range(task.legs)]
    for wall in task.walls:
        for leg, part in enumerate(parts):
            part.append(_wall_of_leg(wall, leg))
    return [b"".join(part) for part in parts]


def _wall_of_leg(wall: Walls, leg: int) -> bytes:
    own = np.flatnonzero(wall.leg == leg)
    values: Sequence[object] = [getattr(wall, entry.name) for entry in fields(wall) if entry.name != "leg"]
    return b"".join(value[own].tobytes() if isinstance(value, np.ndarray) else repr(value).encode() for value in values)
