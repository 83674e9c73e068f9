"""The time that an answer may take, on a monotonic clock."""

from __future__ import annotations

from collections import defaultdict, deque

from minsnap.basics.checks import is_number
from minsnap.basics.messages import shown
from minsnap.errors import InputError, TimingError

ANSWERS = 50
"""Answers whose times are remembered."""

SKIPS = 25
"""Answers in a row for which a part is left out because of them."""

MARGIN = 1.25
"""Factor on them for what is yet to come."""


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
        """Return the longest known time of a part; ``first`` before it has run."""
        known = self._known[part]
        return MARGIN * max(known) if known else first

    def usual(self, part: str, first: float = 0.0) -> float:
        """Return the same but for one answer in ten, and for one of a few."""
        known = sorted(self._known[part])
        return MARGIN * known[9 * (len(known) - 1) // 10] if known else first


def due_of(called: float, now: float, seconds: float, began: float | None) -> float:
    """Return when an answer is due: ``seconds`` after its call, or at the splice where the flight's clock is known.

    Parameters
    ----------
    called : float
        Reading of the clock at the call [s].
    now, seconds : float
        Instant on the flown plan's clock, and the budget [s].
    began : float or None
        Reading of the clock at time 0 of the flown plan [s].

    Raises
    ------
    InputError
        If ``began`` is no number.
    TimingError
        If the splice has passed already.
    """
    if began is None:
        return called + seconds
    if not is_number(began):
        raise InputError(f"began is {shown(began)}: give a number of seconds")
    due = began + now + seconds
    if called >= due:
        raise TimingError(
            f"the splice at {now + seconds:.6g} s of the flown plan passed {called - due:.4g} s ago: replan earlier"
        )
    return due
