"""The MAVLink 2 message set, through pymavlink; the numbers used here are those of MAVLink's common message set."""

from __future__ import annotations

from types import ModuleType
from typing import Any

Message = Any
"""A message of pymavlink."""


def load_dialect() -> ModuleType:
    """Return pymavlink's MAVLink 2 ``common`` dialect.

    Raises
    ------
    ImportError
        If pymavlink is not installed; the sentence names the extra.
    """
    try:
        from pymavlink.dialects.v20 import common
    except ImportError:
        raise ImportError("talking to a vehicle needs pymavlink: pip install minsnap[mavlink]") from None
    dialect: ModuleType = common
    return dialect
