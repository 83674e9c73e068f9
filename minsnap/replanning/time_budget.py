"""The time that an answer may take, on a monotonic clock."""

from __future__ import annotations

from collections import defaultdict, deque
from dataclasses import dataclass

from minsnap.deadline import Clock
from minsnap.errors import TimingError

ANSWERS = 50
"""Answers whose times are remembered."""

SKIPS = 25
"""Answers in a row for which a part is left out because of them."""

MARGIN = 1.25
"""Factor on them for what is yet to come."""


@dataclass(frozen=True, eq=False)
class TimeBudget:
    """When an answer is due.

    Parameters
    ----------
    clock : callable
        Reads the clock [s].
    called, due : float
        Readings when the answer was asked for, and at which it is due [s].
    """

    clock: Clock
    called: float
    due: float

    @property
    def left(self) -> float:
        """Seconds until the answer is due; negative once it is late."""
        return self.due - self.clock()

    @property
    def took(self) -> float:
        """Seconds since it was asked for."""
        return self.clock() - self.called


class Takes:
    """How long parts of the last answers took [s]."""

    def __init__(self) -> None:
        self._known: defaultdict[str, deque[float]] = defaultdict(lambda: deque(maxlen=ANSWERS))
        self._skipped: defaultdict[str, int] = defaultdict(int)

    def add(self, part: str, seconds: float) -> None:
        """Count one more."""
        self._known[part].append(seconds)
        self._skipped[part] = 0

    def skip(self, part: str) -> None:
        """Count an answer without a part; after some in a row what is known is forgotten, so that it is tried again."""
        self._skipped[part] += 1
        if self._skipped[part] >= SKIPS:
            self._known[part].clear()
            self._skipped[part] = 0

    def most(self, part: str, first: float = 0.0) -> float:
        """Return what a part takes at most, as far as is known; ``first`` where nothing is."""
        known = self._known[part]
        return MARGIN * max(known) if known else first

    def usual(self, part: str, first: float = 0.0) -> float:
        """Return the same but for one answer in ten."""
        known = sorted(self._known[part])
        return MARGIN * known[9 * len(known) // 10] if known else first


def budget_of(clock: Clock, now: float, seconds: float, began: float | None) -> TimeBudget:
    """Return when an answer is due: ``seconds`` after this call, or at the splice where the flight's clock is known.

    Parameters
    ----------
    clock : callable
    now, seconds : float
        Instant on the flown plan's clock, and the budget [s].
    began : float or None
        Reading of ``clock`` at time 0 of the flown plan [s].

    Raises
    ------
    TimingError
        If the splice has passed already.
    """
    called = clock()
    if began is None:
        return TimeBudget(clock, called, called + seconds)
    late = called - (began + now + seconds)
    if late >= 0.0:
        raise TimingError(
            f"the splice at {now + seconds:.6g} s of the flown plan passed {late:.4g} s ago: replan earlier"
        )
    return TimeBudget(clock, called, began + now + seconds)
