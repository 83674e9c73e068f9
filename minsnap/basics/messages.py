"""Short texts for messages and reports, and unknown names of arguments answered with the one that was meant."""

from __future__ import annotations

import inspect
import math
import re
import reprlib
from collections.abc import Callable, Iterable, Mapping, Sequence
from difflib import get_close_matches
from functools import wraps
from typing import Any, TypeVar, cast

from minsnap.errors import ArgumentNameError, MinsnapError

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


def finite(content: Any) -> Any:
    """Return mappings, lists and tuples of plain values with None for numbers that are not finite: JSON has none."""
    if isinstance(content, Mapping):
        return {name: finite(value) for name, value in content.items()}
    if isinstance(content, (list, tuple)):
        return [finite(value) for value in content]
    return None if isinstance(content, float) and not math.isfinite(content) else content


Called = TypeVar("Called", bound=Callable[..., Any])


def explains_names(
    moved: Mapping[str, str],
    short_of_memory: Callable[..., Exception] | None = None,
    positional: int | None = None,
    last: str = "",
) -> Callable[[Called], Called]:
    """Make a function or class answer unknown keywords with a sentence.

    Parameters
    ----------
    moved : mapping
        What to write in place of names that are not parameters, by name.
    short_of_memory : callable, optional
        Returns what is raised in place of a MemoryError, from the same arguments.
    positional : int, optional
        How many arguments may stand without their names; of more, each is taken with a warning that it goes.
    last : str
        The last version that takes more.

    Returns
    -------
    callable
        A decorator; what it returns has the same signature and raises ArgumentNameError for an unknown name. Of a
        function that passes keywords on, only names in ``moved`` are unknown.
    """

    def explained(called: Called) -> Called:
        target: Callable[..., Any] = vars(called)["__init__"] if isinstance(called, type) else called
        parameters = inspect.signature(target).parameters
        passes_on = any(one.kind is one.VAR_KEYWORD for one in parameters.values())
        known, names = frozenset(parameters), tuple(parameters)
        most = len(names) if positional is None else positional + isinstance(called, type)

        @wraps(target)
        def checked(*args: Any, **kwargs: Any) -> Any:
            for name in kwargs:
                if name not in known and (name in moved or not passes_on):
                    raise _unknown(called.__name__, name, known, moved)
            if len(args) > most:
                args, kwargs = _by_name(called.__name__, names, args, most, kwargs, last)
            try:
                return target(*args, **kwargs)
            except MemoryError as error:
                if short_of_memory is None or isinstance(error, MinsnapError):
                    raise
            raise short_of_memory(*args, **kwargs)

        if isinstance(called, type):
            type.__setattr__(called, "__init__", checked)
            return called
        return cast(Called, checked)

    return explained


def _by_name(
    called: str, names: Sequence[str], args: tuple[Any, ...], most: int, kwargs: dict[str, Any], last: str
) -> tuple[tuple[Any, ...], dict[str, Any]]:
    """Return arguments with those beyond the first ``most`` by their names, and warn that they are to be named."""
    named = dict(zip(names[most:], args[most:], strict=False))
    if len(args) > len(names) or named.keys() & kwargs.keys():
        return args, kwargs  # which Python refuses
    from minsnap.basics.warn import warn_deprecated

    first = next(iter(named))
    warn_deprecated(f"{called} with {first} by its place", f"{first}=, and so for what follows it,", last)
    return args[:most], kwargs | named


def _unknown(called: str, name: str, known: frozenset[str], moved: Mapping[str, str]) -> ArgumentNameError:
    if name in moved:
        return ArgumentNameError(f"{called} has no argument {name}: write {moved[name]}")
    stem = name.removeprefix("max_")
    near = [stem] if stem in known else get_close_matches(name, known - {"self"}, 1)
    hint = f"did you mean {near[0]}?" if near else f"it takes {', '.join(sorted(known - {'self'}))}"
    return ArgumentNameError(f"{called} has no argument {shown(name)}: {hint}")


def aligned(rows: Sequence[Sequence[str]]) -> str:
    """Return rows of text as aligned columns: the first column left-aligned, the others right-aligned."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    cells = ([row[0].ljust(widths[0]), *map(str.rjust, row[1:], widths[1:])] for row in rows)
    return "\n".join("  ".join(row).rstrip() for row in cells)


def labelled(lines: Iterable[tuple[str, Any]]) -> str:
    """Return one line for each label and its value."""
    return "\n".join(f"{label:<19} {value}" for label, value in lines)
