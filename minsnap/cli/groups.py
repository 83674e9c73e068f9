"""Groups of options: a dataclass as parameter of a command adds its fields as options."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import fields, is_dataclass
from typing import Any, get_type_hints


def grouped(command: Callable[..., Any]) -> Callable[..., Any]:
    """Replace each parameter that is annotated with a dataclass by the fields of the dataclass.

    When the command runs, the dataclass is constructed from its options first.

    Parameters
    ----------
    command : callable
        Its other parameters are options and arguments of its own, and come first in the help.

    Returns
    -------
    callable
        With the signature that typer is to see.
    """
    parameters = inspect.signature(command, eval_str=True).parameters
    groups: dict[str, Any] = {name: p.annotation for name, p in parameters.items() if is_dataclass(p.annotation)}
    own = [p.replace(kind=p.KEYWORD_ONLY) for name, p in parameters.items() if name not in groups]
    shared = {name: _options(group) for name, group in groups.items()}

    def run(**arguments: Any) -> Any:
        made = {
            name: group(**{option.name: arguments.pop(option.name) for option in shared[name]})
            for name, group in groups.items()
        }
        return command(**made, **arguments)

    seen = [*own, *(option for options in shared.values() for option in options)]
    run.__name__, run.__doc__, run.__module__ = command.__name__, command.__doc__, command.__module__
    run.__annotations__ = {p.name: p.annotation for p in seen}
    run.__signature__ = inspect.Signature(seen)  # type: ignore[attr-defined]
    return run


def _options(group: Any) -> list[inspect.Parameter]:
    hints = get_type_hints(group, include_extras=True)
    kind = inspect.Parameter.KEYWORD_ONLY
    return [
        inspect.Parameter(field.name, kind, default=field.default, annotation=hints[field.name])
        for field in fields(group)
    ]
