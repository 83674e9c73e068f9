"""How a call of the compiled core ended."""

from __future__ import annotations

from enum import IntEnum


class Status(IntEnum):
    """The same numbers as in ``src/status.hpp``."""

    DONE = 0
    BAD_SIZE = 1
    BAD_NUMBER = 2
    NO_MEMORY = 3
    UNSUPPORTED = 4
    SINGULAR = 5
    NOT_PROVED = 6
    INFEASIBLE = 7
    NO_PROGRESS = 8
    SPENT = 9

    @property
    def reason(self) -> str:
        """Why a problem is handed over, in words that end a sentence."""
        return _REASONS[self]


_REASONS = {
    Status.DONE: "nothing is missing",
    Status.BAD_SIZE: "the problem has more values than the native core takes",
    Status.BAD_NUMBER: "a number is not finite or out of range",
    Status.NO_MEMORY: "the native core found no memory",
    Status.UNSUPPORTED: "the native core does not solve this kind of problem",
    Status.SINGULAR: "a pivot of the native core was not positive to working precision",
    Status.NOT_PROVED: "the native core did not prove its answer",
    Status.INFEASIBLE: "the native core found no answer",
    Status.NO_PROGRESS: "the native core made no progress",
    Status.SPENT: "the native core worked on it for as long as a problem is worth",
}

GAVE_UP = frozenset(
    status.reason
    for status in (Status.SINGULAR, Status.NOT_PROVED, Status.INFEASIBLE, Status.NO_PROGRESS, Status.SPENT)
)
"""Reasons of problems that the native core takes, and did not solve."""
