"""Properties that are computed once, without a lock."""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from functools import cached_property
else:

    class cached_property(functools.cached_property):  # noqa: N801 - the name of the standard library's
        """That of ``functools`` as it is from Python 3.12 on.

        Before, one lock for all instances makes threads wait for each other, and a process that is forked meanwhile
        waits for ever. Two threads may compute a value at once; the first one is kept.
        """

        def __get__(self, instance: Any, owner: Any = None) -> Any:
            """Return the value of the instance."""
            if instance is None:
                return self
            return instance.__dict__.setdefault(self.attrname, self.func(instance))


__all__ = ["cached_property"]
