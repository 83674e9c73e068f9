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


def _inner(name: str) -> bool:
    return name.startswith((PACKAGE, "<string>", "<frozen"))
