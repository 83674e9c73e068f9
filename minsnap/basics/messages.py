"""Values of any kind as short texts for messages."""

from __future__ import annotations

import re
import reprlib
from typing import Any

SHOWN = 60
"""Characters of a value that a message shows."""

MOST_BITS = 10_000
"""Bits of an integer up to which Python writes it."""


class _Shortened(reprlib.Repr):
    """Texts of values for messages: scalars of NumPy are the numbers that they are, and objects have no address."""

    def __init__(self) -> None:
        super().__init__()
        self.maxstring = self.maxother = SHOWN
        self.maxlong, self.maxlevel = 2 * SHOWN, 2

    def repr1(self, x: Any, level: int) -> str:
        """Return the text of a value, or of an entry of one."""
        if isinstance(x, int) and x.bit_length() > MOST_BITS:
            return f"an integer of {x.bit_length()} bits"
        if getattr(x, "ndim", None) == 0 and not isinstance(x, type):
            return str(x)[:SHOWN]
        return re.sub(r" at 0x[0-9a-f.]*", "", super().repr1(x, level))


def shown(value: Any) -> str:
    """Return a value as shortened text for a message; fast also for large values."""
    return _Shortened().repr(value)[: 2 * SHOWN]
