"""Commands from functions: their parameters are declared once, by name, type and what the help says of them."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import fields, is_dataclass
from typing import Annotated, Any, TypeVar, get_args, get_type_hints

import typer
from typer.core import TyperCommand

from minsnap.cli.app import app

Command = TypeVar("Command", bound=Callable[..., Any])


def command(cls: type[TyperCommand] | None = None) -> Callable[[Command], Command]:
    """Return a decorator that registers a function as a command.

    Its parameters before the star are arguments of the command line, those behind it options of the same names.
    ``Annotated[float, "M", "Half-width [m]."]`` says the type, what stands for the value in the help, and the help;
    words that begin with ``-`` are other names of the option. A parameter that is a dataclass adds its fields as
    options, and is made of them when the command runs.
    """

    def registered(function: Command) -> Command:
        app.command(cls=cls)(_flat(function))
        return function

    return registered


def _flat(function: Callable[..., Any]) -> Callable[..., Any]:
    """Return a function with the signature that typer is to see: options of dataclasses come last in the help."""
    parameters = inspect.signature(function, eval_str=True).parameters
    groups: dict[str, Any] = {name: p.annotation for name, p in parameters.items() if is_dataclass(p.annotation)}
    own = [_declared(p) for name, p in parameters.items() if name not in groups]
    shared = {name: _options(group) for name, group in groups.items()}

    def run(**arguments: Any) -> Any:
        made = {
            name: group(**{option.name: arguments.pop(option.name) for option in shared[name]})
            for name, group in groups.items()
        }
        return function(**made, **arguments)

    seen = [*own, *(option for options in shared.values() for option in options)]
    run.__name__, run.__doc__, run.__module__ = function.__name__, function.__doc__, function.__module__
    run.__annotations__ = {p.name: p.annotation for p in seen}
    run.__signature__ = inspect.Signature(seen)  # type: ignore[attr-defined]
    return run


def _options(group: Any) -> list[inspect.Parameter]:
    hints, kind = get_type_hints(group, include_extras=True), inspect.Parameter.KEYWORD_ONLY
    return [
        _declared(inspect.Parameter(field.name, kind, default=field.default, annotation=hints[field.name]))
        for field in fields(group)
    ]


def _declared(parameter: inspect.Parameter) -> inspect.Parameter:
    """Return a parameter as typer reads it."""
    positional = parameter.kind is not inspect.Parameter.KEYWORD_ONLY
    kind, *words = get_args(parameter.annotation)
    if all(isinstance(word, str) for word in words):
        *names, text = words
        metavar = names.pop() if names and not names[-1].startswith("-") else None
        if positional:
            made: Any = typer.Argument(metavar=metavar, help=text)
        else:
            made = typer.Option(*(names or [f"--{parameter.name.replace('_', '-')}"]), metavar=metavar, help=text)
        parameter = parameter.replace(annotation=Annotated[kind, made])
    return parameter.replace(kind=inspect.Parameter.KEYWORD_ONLY)
