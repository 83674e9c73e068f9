"""A page of all commands, each with an example and its options, written from the commands themselves."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import typer
from example_pages import write_page
from sphinx.application import Sphinx

EXAMPLES = {
    "rect": "minsnap rect --corridor 0.3 -o traj.csv --plot traj.png",
    "line": "minsnap line --start 0 0 1 --goal 20 0 1 --max-speed 4 -o line.csv",
    "circle": "minsnap circle --radius 2 --period 8 --laps 3 -o circle.csv",
    "helix": "minsnap helix --radius 2 --pitch 1 --laps 3 -o helix.csv",
    "eight": "minsnap eight --max-speed 3 --max-acceleration 4 -o eight.csv",
    "plan": "minsnap plan waypoints.csv --corridor 0.5 --max-speed 3 --legs -o flight.csv",
    "survey": "minsnap survey field.csv --spacing 20 --height 40 -o survey.csv",
    "route": "minsnap route map.npy --resolution 0.1 --start 1 1 --goal 9 7 --clearance 0.3 -o route.csv",
    "check": "minsnap check flight.csv",
    "plot": "minsnap plot flight.csv -o flight.gif",
    "convert": "minsnap convert frames.csv flight.traj --tolerance 5mm",
    "stream": "minsnap stream flight.csv --connect udpin:127.0.0.1:14540 --arm",
    "tune": "minsnap tune flight.csv log.ulg -o next.csv",
    "preflight": "minsnap preflight flight.csv --connect udpin:127.0.0.1:14540",
    "limits": "minsnap limits --connect udpin:127.0.0.1:14540 -o vehicle_limits.yaml",
    "relay": "minsnap relay --from natnet:192.168.1.5 --to udpout:192.168.1.10:14550 --body 1",
    "upload": "minsnap upload out/ --uri radio://0/80/2M/E7E7E7E701 --start",
    "simulate": "minsnap simulate flight.csv --wind 3 0 0 --plot flown.png",
    "experiment": "minsnap experiment circle",
    "compare": "minsnap compare flight.csv log.ulg --report tracking.html",
    "fit": "minsnap fit log.ulg",
    "fleet": "minsnap fleet show.yaml -o out/ --report report.html",
    "studio": "minsnap studio waypoints.csv",
    "batch": "minsnap batch spec.yaml -o dataset/",
    "bench": "minsnap bench",
}
"""One call of each command."""


def commands() -> dict[str, Any]:
    """Return the commands in the order of the help, as click has them."""
    from minsnap.cli.app import app, load_commands

    load_commands()
    group: Any = typer.main.get_command(app)
    return dict(group.commands)


def _options(command: Any) -> Iterator[tuple[str, str]]:
    """Yield what is given to a command, and what it means."""
    context = typer.Context(command)
    for parameter in command.params:
        flag = getattr(parameter, "is_flag", False)
        value = "" if flag else f" {parameter.make_metavar(context)}"
        if parameter.param_type_name == "argument":
            name = parameter.make_metavar(context).strip("[]")
        else:
            name = ", ".join([*parameter.opts, *parameter.secondary_opts]) + value
        default = getattr(parameter, "default", None)
        told = "" if flag or default in (None, (), [], "", ...) else f" Default: {_shown(default)}."
        yield f"``{name}``", f"{_plain(parameter.help or '')}{told}"


def _shown(default: Any) -> str:
    return " ".join(map(str, default)) if isinstance(default, list | tuple) else str(default)


def _plain(text: str) -> str:
    """Return text in one line, without marks that reStructuredText would read."""
    marked = re.sub(r"([*`|_\\])", r"\\\1", " ".join(text.split()))
    return re.sub(r"(?<![\w-])(--[a-z][a-z-]*[a-z])", r"``\1``", marked)


def section(name: str, command: Any) -> str:
    """Return what the page says of a command."""
    title = f"minsnap {name}"
    paragraphs = "\n\n".join(_plain(part) for part in (command.help or "").split("\n\n"))
    rows = "".join(f"   * - {given}\n     - {meaning}\n" for given, meaning in _options(command))
    table = f".. list-table::\n   :widths: 32 68\n\n{rows}"
    return f"{title}\n{'-' * len(title)}\n\n{paragraphs}\n\n::\n\n    {EXAMPLES[name]}\n\n{table}\n"


def write_commands(app: Sphinx) -> None:
    """Write ``docs/commands.rst``."""
    story = "Each with an example, and all that it takes. :doc:`cli` says how they go together."
    head = f"All commands\n============\n\n{story}"
    found = commands()
    contents = "\n\n.. contents::\n   :local:\n   :depth: 1\n\n"
    text = head + contents + "\n".join(section(name, command) for name, command in found.items())
    write_page(Path(app.srcdir) / "commands.rst", text)


def arguments(example: str) -> list[str]:
    """Return the arguments of an example after the command's name."""
    return shlex.split(example)[2:]


def setup(app: Sphinx) -> dict[str, Any]:
    """Write the page before Sphinx looks for it."""
    app.connect("builder-inited", write_commands)
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}
