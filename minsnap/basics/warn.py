"""Warnings that name the user's line."""

from __future__ import annotations

import sys
import warnings
from pathlib import Path

PACKAGE = str(Path(__file__).parents[1])
"""Folder of the library: its own lines are nobody's to change."""


def warn_caller(message: str, category: type[Warning] = UserWarning) -> None:
    """Warn at the first line on the stack that is not the library's own.

    Frames without a file, as of a dataclass's ``__init__``, are passed over too.
    """
    frame, depth = sys._getframe(1), 2
    while frame is not None and frame.f_back is not None and _inner(frame.f_code.co_filename):
        frame, depth = frame.f_back, depth + 1
    warnings.warn(message, category, stacklevel=depth)


def warn_deprecated(old: str, new: str, last: str) -> None:
    """Warn at the user's line that a name or an argument goes: the policy of docs/upgrading.rst.

    Parameters
    ----------
    old, new : str
        What was written, and what to write.
    last : str
        The last version that takes it.
    """
    warn_caller(f"{old} is deprecated, and {last} is the last version that has it: write {new}", DeprecationWarning)


def _inner(name: str) -> bool:
    return name.startswith((PACKAGE, "<string>", "<frozen"))
