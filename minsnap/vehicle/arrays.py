"""Arrays that a value owns: copied when it is made, and read-only from then on."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import numpy as np


def own_arrays(value: Any) -> None:
    """Replace every array field of a frozen dataclass by a read-only copy; called from ``__post_init__``."""
    for field in fields(value):
        array = getattr(value, field.name)
        if isinstance(array, np.ndarray):
            owned = array.copy()
            owned.flags.writeable = False
            object.__setattr__(value, field.name, owned)
