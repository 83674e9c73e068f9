"""Minimum-snap trajectories, certified inside their corridor at every instant.

The public names are loaded when they are first used, so that importing the package stays quick.
"""

from typing import Any

import lazy_loader

_load, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)

_HOMES = ("plot", "routes", "errors", "corridors", "replanning", "fleet", "shows", "paths.missions")
"""Where the names are that the root does not have."""


def __getattr__(name: str) -> Any:
    try:
        return _load(name)
    except AttributeError:
        from importlib import import_module

        for home in () if name.startswith("_") else _HOMES:
            module = import_module("minsnap.paths.routes" if home == "routes" else f"minsnap.{home}")
            if name in getattr(module, "__all__", dir(module)):
                raise AttributeError(f"minsnap has no {name}: it is minsnap.{home}.{name}") from None
        raise
