"""How a call of the compiled core ended."""

from __future__ import annotations

from enum import IntEnum


class Status(IntEnum):
    """The same numbers as in ``src/basics/status.hpp``; why a problem is handed over, in words that end a sentence."""

    reason: str

    def __new__(cls, number: int, reason: str = "") -> Status:
        """Return a status that is its number."""
        status = int.__new__(cls, number)
        status._value_, status.reason = number, reason
        return status

    DONE = 0, "nothing is missing"
    BAD_SIZE = 1, "the problem has more values than the native core takes"
    BAD_NUMBER = 2, "a number is not finite or out of range"
    NO_MEMORY = 3, "the native core found no memory"
    UNSUPPORTED = 4, "the native core does not solve this kind of problem"
    SINGULAR = 5, "a pivot of the native core was not positive to working precision"
    NOT_PROVED = 6, "the native core did not prove its answer"
    INFEASIBLE = 7, "the native core found no answer"
    NO_PROGRESS = 8, "the native core made no progress"
    SPENT = 9, "the native core worked on it for as long as a problem is worth"


GAVE_UP = frozenset(
    status.reason
    for status in (Status.SINGULAR, Status.NOT_PROVED, Status.INFEASIBLE, Status.NO_PROGRESS, Status.SPENT)
)
"""Reasons of problems that the native core takes, and did not solve."""
