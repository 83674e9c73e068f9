"""Routes under the name that users import; the room itself is ``minsnap.paths.routes``."""

from typing import Any

from minsnap.paths import routes

__all__ = routes.__all__


def __getattr__(name: str) -> Any:
    return getattr(routes, name)


def __dir__() -> list[str]:
    return list(__all__)
