"""The command-line application: commands from functions, which module has each, and the form of errors."""

from __future__ import annotations

import importlib
import inspect
import io
import os
import re
import sys
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import is_dataclass
from functools import lru_cache
from itertools import pairwise
from math import degrees
from pathlib import Path
from typing import Annotated, Any, NoReturn, TypeVar, get_args, get_origin

import typer
from typer.core import TyperCommand

from minsnap import errors
from minsnap.cli.quantities import number_in

COMMANDS = {
    **dict.fromkeys(("rect", "line", "circle", "helix", "eight"), "shape_commands"),
    **dict.fromkeys(("plan", "route"), "plan_commands"),
    "survey": "survey_commands",
    **dict.fromkeys(("check", "plot", "convert"), "file_commands"),
    "stream": "flight_commands",
    "tune": "tune_commands",
    **dict.fromkeys(("preflight", "limits", "relay", "upload"), "vehicle_commands"),
    **dict.fromkeys(("simulate", "experiment"), "simulation_commands"),
    **dict.fromkeys(("compare", "fit"), "log_commands"),
    **dict.fromkeys(("fleet", "studio"), "fleet_commands"),
    **dict.fromkeys(("batch", "bench"), "batch_commands"),
}
"""Commands in the order of the help, and the modules that register them with :data:`app` when they are imported."""

UNMET: tuple[type[Exception], ...] = (errors.InfeasibleError, errors.SolverError, errors.FlightError)
UNMET += (errors.ThrustError, errors.DivergenceError, errors.BatchError, errors.MagnitudeError)
"""Errors that mean that the request cannot be met: exit status 1. All others mean bad input: 2."""

app = typer.Typer(
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    invoke_without_command=True,
    context_settings={"help_option_names": ["-h", "--help"]},
)


_ALIKE = "align closed continuity corridor degree hold_below pieces solver split time_limit time_weight"
_TURNED = "yaw yaw_at_start yaw_rate"
ARGUMENTS = {name: f"--{name.replace('_', '-')}" for name in f"{_ALIKE} {_TURNED}".split()}
ARGUMENTS |= {"limits": "a limit such as --max-speed", "total_time": "--time"}
"""Arguments of functions, and the options that stand for them."""

ANGLES = {"yaw", "yaw_at_start"}
"""Those in radians, whose options take degrees."""

_GIVEN = re.compile(r"\b([a-z]+(?:_[a-z]+)*)=('[^']*'|[^\s,:;]*)")

_NAMED = re.compile(r"\b([a-z]+(?:_[a-z]+)+)\b")


@app.callback()
def _root(
    context: typer.Context,
    version: Annotated[bool, typer.Option("--version", help="Print version and core, and exit.")] = False,
    cmake_dir: Annotated[
        bool, typer.Option("--cmake-dir", help="Print where CMake finds the C++ library, and exit.")
    ] = False,
) -> None:
    """Plan minimum-snap quadrotor trajectories, certified inside their corridor at every instant.

    Exit status: 0 done, 1 the request cannot be met, 2 bad usage or bad input. The word in brackets after an error is
    its heading in docs/when_something_is_wrong.rst, which says what to do.
    """
    if version:
        from minsnap.basics.version import __version__
        from minsnap.native import describe

        print(f"minsnap {__version__}\n{describe()}")
        raise typer.Exit(0)
    if cmake_dir:
        from minsnap.native import build

        print(build.cmake_dir())
        raise typer.Exit(0)
    if context.invoked_subcommand is None:
        print(context.get_help(), file=sys.stderr)
        raise typer.Exit(2)


def load_commands(first: str = "") -> None:
    """Import the modules that register commands; none of them imports anything slow before its command runs.

    Parameters
    ----------
    first : str
        The first word of the command line: where it names a command, that command's module alone is imported.
    """
    for name in dict.fromkeys(COMMANDS.values()) if first not in COMMANDS else (COMMANDS[first],):
        importlib.import_module(f"minsnap.cli.{name}")
    order = list(COMMANDS)
    app.registered_commands.sort(key=lambda entry: order.index(str(entry.callback and entry.callback.__name__)))


def main(arguments: list[str] | None = None) -> NoReturn:
    """Run the command line and exit with its status.

    0 done, 1 the request cannot be met, 2 bad usage or bad input, 130 interrupted, 141 the reader of a pipe has closed
    it. Errors are one plain sentence on stderr.

    Parameters
    ----------
    arguments : list of str, optional
        What follows the command's name; ``sys.argv[1:]`` unless given.
    """
    words = sys.argv[1:] if arguments is None else list(arguments)
    os.environ["MPLBACKEND"] = "agg"  # figures are written into files, whatever window the environment asks for
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if stream is None:  # closed, as under some daemons: no file is to take its place
            setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))  # noqa: SIM115
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")  # a superscript must not raise on a terminal that lacks it
    warnings.showwarning = tell  # type: ignore[assignment]
    try:
        load_commands(words[0] if words else "")
        command = _built(len(app.registered_commands))
        with command.make_context("minsnap", words) as context:
            status = command.invoke(context)
        sys.stdout.flush()
    except Exception as error:
        _leave(error, words)
    except KeyboardInterrupt:
        sys.exit(130)
    sys.exit(status if isinstance(status, int) else 0)


@lru_cache(maxsize=1)
def _built(commands: int) -> Any:
    """Return the command line of all commands registered so far, whose number tells one from the next."""
    return typer.main.get_command(app)


def tell(message: object, *_: object) -> None:
    """Print one line on stderr: an error, a warning, or what is done at the moment."""
    print(f"minsnap: {message}", file=sys.stderr, flush=True)


@contextmanager
def told_warnings() -> Iterator[None]:
    """Print all warnings at once, such as those about the part of a damaged log that could not be read."""
    with warnings.catch_warnings():
        warnings.simplefilter("always")
        warnings.showwarning = tell  # type: ignore[assignment]
        yield


def fail(message: str, status: int) -> NoReturn:
    """Print ``message`` on stderr and exit with ``status``."""
    tell(message)
    sys.exit(status)


def exit_status(error: errors.MinsnapError) -> int:
    """Return the exit status of an error: 1 where the request cannot be met, 2 for bad input."""
    return 1 if isinstance(error, UNMET) else 2


def _leave(error: Exception, words: list[str]) -> NoReturn:
    """Convert an exception to its message and exit status; an unexpected one keeps its traceback."""
    cause = error.__cause__
    if isinstance(cause, KeyboardInterrupt | SystemExit):  # which compiled modules turn into an ImportError
        sys.exit(getattr(cause, "code", 130))
    if isinstance(error, errors.MinsnapError):
        sentence = str(error) if isinstance(error, errors.FileError) else in_options(str(error), words)
        fail(f"{sentence} [{error.code}]", exit_status(error))
    if isinstance(error, BrokenPipeError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # so that nothing is flushed into it at exit
        sys.exit(141)
    if isinstance(error, OSError):
        fail(f"{error.filename or 'the standard output'}: {error.strerror or error} [file]", 2)
    if isinstance(error, ImportError):
        fail(str(error), 2)
    if isinstance(error, typer.Exit):
        sys.exit(error.exit_code)
    if isinstance(error, typer.Abort):
        sys.exit(130)
    if hasattr(error, "format_message"):  # typer's own usage errors, whichever package it takes them from
        fail(_usage(error, words), 2)
    raise error


def _usage(error: Exception, words: list[str]) -> str:
    """Return typer's message in one line, with a hint on the help option."""
    sentence = " ".join(error.format_message().split())  # type: ignore[attr-defined]
    context = getattr(error, "ctx", None)
    sentence = _hinted(sentence, getattr(error, "option_name", None), words)
    command = context.command_path if context else " ".join(["minsnap", *words[:1]])
    return f"{sentence} (see {command} --help)"


SOUGHT = {
    "--max-speed": ("--speed", "--vmax", "--velocity", "--max-velocity", "--v"),
    "--max-acceleration": ("--acceleration", "--amax", "--accel", "--max-accel"),
    "--period": ("--time", "--duration"),
    "--time": ("--duration", "--total-time"),
    "--output": ("--out", "--file", "--save"),
    "--plot": ("--figure", "--png", "--draw"),
    "--avoid": ("--obstacle", "--obstacles"),
    "--from-frame": ("--ned", "--frame"),
    "--altitude": ("--height", "--z"),
    "--goal": ("--end", "--target", "--destination", "--stop", "--finish"),
    "--start": ("--from", "--begin", "--source"),
    "--pitch": ("--climb", "--rise", "--ascent"),
    "--radius": ("--diameter", "--r"),
    "--laps": ("--turns", "--revolutions", "--rounds", "--loops"),
}
"""Options, and the names by which others are looked for."""


def _hinted(sentence: str, option: str | None, words: list[str]) -> str:
    """Return the sentence of a usage error with what is meant: another option, or numbers with commas."""
    number = re.compile(r"-?\.?\d")
    meant = next(
        (real for real, others in SOUGHT.items() if option in others and real in (_options_of(words) or ())), None
    )
    if meant is not None:
        return f"No such option: {option}: did you mean {meant}?"
    if sentence.startswith("No such command") and words:
        return _command_meant(sentence, words[0])
    extra = re.search(r"extra argument(?:\(s\)|s)? \((?P<first>[^)\s]+)", sentence)
    if (option and number.match(option)) or (extra and number.match(extra["first"])):
        stray = option or (extra["first"] if extra else "")
        place = next((at for at, word in enumerate(words) if word.startswith(stray)), 0)
        ahead = [word for word in words[:place] if word.startswith("--")]
        if not ahead:
            if _arguments_of(words):
                return sentence
            return f"{sentence}: each number has an option before it, such as {_first_numbers(words, place)}"
        asked = ahead[-1].split("=")[0]
        return f"{sentence}: several numbers of one option are joined by commas, as in {asked}=0.3,0.5"
    return sentence


COMMANDS_SOUGHT = {
    "stream": ("fly", "send", "execute", "offboard"),
    "simulate": ("sim", "run"),
    "plan": ("waypoints", "generate", "optimize", "optimise", "trajectory", "mission"),
    "check": ("verify", "validate", "certify", "info"),
    "plot": ("draw", "show", "view", "figure", "animate"),
    "convert": ("export", "import", "translate"),
    "rect": ("rectangle", "square", "box"),
    "eight": ("lemniscate", "figure8", "figure-8", "infinity"),
    "helix": ("spiral",),
    "circle": ("orbit", "loiter"),
    "route": ("map", "navigate", "path"),
    "survey": ("grid", "lawnmower", "mapping", "facade"),
    "fleet": ("swarm", "drones", "multi"),
    "compare": ("error", "evaluate", "diff", "analyse", "analyze"),
    "fit": ("identify", "sysid"),
    "studio": ("gui", "web", "ui", "edit"),
    "bench": ("benchmark",),
}
"""Commands, and the names by which others are looked for."""


def _command_meant(sentence: str, word: str) -> str:
    """Return the sentence of a command that is none with what is meant."""
    meant = next((real for real, others in COMMANDS_SOUGHT.items() if word.lower() in others), None)
    return sentence if meant is None else f"No such command {word!r}: did you mean {meant!r}?"


def _arguments_of(words: Sequence[str]) -> list[Any]:
    """Return the arguments of the command that words name, which are no options."""
    command = _built(len(app.registered_commands)).commands[words[0]]
    return [each for each in command.params if each.param_type_name == "argument"]


def _first_numbers(words: list[str], place: int) -> str:
    """Return the stray numbers behind the options of their command that take lengths or places, the first of them."""
    numbers = [word for word in words[place:] if re.fullmatch(r"-?\.?\d[\d.]*", word)]
    command, said = _built(len(app.registered_commands)).commands[words[0]], list[str]()
    for each in command.params:
        if (each.metavar == "M" or each.nargs > 1) and len(numbers) >= each.nargs:
            said += [each.opts[0], *numbers[: each.nargs]]
            numbers = numbers[each.nargs :]
    return " ".join(said)


def in_options(sentence: str, words: Sequence[str] = ()) -> str:
    """Return a sentence with ``closed=True`` as ``--closed``, ``yaw='tilt'`` as ``--yaw tilt``, and so on.

    A word that is also plain English, such as "corridor", is left as it is where no value follows. Where the words of
    the command line name a plan file, its keys ``time_limit`` and ``split: distance`` are told as it says them, unless
    an option says them in their place; so is every word for which their command has no option.
    """
    alone = [word for before, word in pairwise(words) if "-" not in (before[:1], word[:1])]  # not what an option takes
    in_file = words[:1] == ["plan"] and any(word.lower().endswith((".yaml", ".yml")) for word in alone)
    typed, able = {word.split("=")[0] for word in words}, _options_of(words)
    said = {name: option for name, option in ARGUMENTS.items() if not in_file or option in typed}
    options = {name: option for name, option in said.items() if able is None or option.split()[-1] in able}

    def with_value(match: re.Match[str]) -> str:
        name, value = match[1], match[2].strip("'")
        if name not in ARGUMENTS:
            return match[0]
        if name not in options:
            return f"{name}: {value.lower()}" if value else name
        if name in ANGLES:
            with suppress(ValueError):
                value = f"{degrees(float(value)):g}"
        return options[name] if value in ("", "True") else f"{options[name]} {value}"

    return _NAMED.sub(lambda match: options.get(match[1], match[1]), _GIVEN.sub(with_value, sentence))


def _options_of(words: Sequence[str]) -> set[str] | None:
    """Return the options of the command that words name; None where they name none that is loaded."""
    command = _built(len(app.registered_commands)).commands.get(words[0]) if words else None
    return None if command is None else {option for each in command.params for option in each.opts}


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
    parameters = inspect.signature(group, eval_str=True).parameters.values()
    return [_declared(field.replace(kind=field.KEYWORD_ONLY)) for field in parameters]


def _named(name: str) -> Path:
    """Return a file or a folder; an empty name, as of a variable that is not set, would be the current folder."""
    if not name:
        raise typer.BadParameter("it is empty: give a name")
    return Path(name)


def _declared(parameter: inspect.Parameter) -> inspect.Parameter:
    """Return a parameter as typer reads it."""
    positional = parameter.kind is not inspect.Parameter.KEYWORD_ONLY
    kind, *words = get_args(parameter.annotation)
    if all(isinstance(word, str) for word in words):
        *names, text = words
        how: dict[str, Any] = {"help": text}
        how["metavar"] = names.pop() if names and not names[-1].startswith("-") else None
        if Path in (kind, *get_args(kind)):
            how["parser"] = _named
        elif float in (kind, *get_args(kind)) and get_origin(kind) is not tuple:
            how["parser"] = number_in(how["metavar"])
        if positional:
            made: Any = typer.Argument(**how)
        else:
            made = typer.Option(*(names or [f"--{parameter.name.replace('_', '-')}"]), **how)
        parameter = parameter.replace(annotation=Annotated[kind, made])
    return parameter.replace(kind=inspect.Parameter.KEYWORD_ONLY)
