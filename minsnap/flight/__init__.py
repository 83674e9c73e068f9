"""Flying: frames, simulation, and the way from a file of setpoints to a vehicle in the air.

The names below are loaded when they are first used.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from minsnap.flight.link import open_link
    from minsnap.flight.offboard import stream
    from minsnap.flight.options import StreamOptions, StreamReport, StreamStatus
    from minsnap.flight.safety import SafetyRules
    from minsnap.flight.streaming import Streamer

_HOMES = {
    "minsnap.flight.link": ("open_link",),
    "minsnap.flight.offboard": ("stream",),
    "minsnap.flight.options": ("StreamOptions", "StreamReport", "StreamStatus"),
    "minsnap.flight.safety": ("SafetyRules",),
    "minsnap.flight.streaming": ("Streamer",),
}
_HOME = {name: home for home, names in _HOMES.items() for name in names}

__all__ = ["SafetyRules", "StreamOptions", "StreamReport", "StreamStatus", "Streamer", "open_link", "stream"]


def __getattr__(name: str) -> Any:
    """Import a public name from its module the first time it is used (PEP 562)."""
    if name not in _HOME:
        raise AttributeError(f"module 'minsnap.flight' has no attribute {name!r}")
    return getattr(importlib.import_module(_HOME[name]), name)
