"""The public names of simulation, tracking, mavlink, mocap and thesis in one namespace.

Each name belongs to the room that it comes from, and both ways of importing it give the same object.
"""

from __future__ import annotations

import importlib
from typing import Any

_ROOMS = ("simulation", "tracking", "mavlink", "mocap", "thesis")

_HOME = {name: room for room in _ROOMS for name in importlib.import_module(f"minsnap.{room}").__all__}

__all__ = sorted(_HOME)


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'minsnap.flight' has no attribute {name!r}")
    return getattr(importlib.import_module(f"minsnap.{_HOME[name]}"), name)


def __dir__() -> list[str]:
    return __all__
