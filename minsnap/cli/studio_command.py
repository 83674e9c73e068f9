"""The command that opens the studio."""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from minsnap.cli.command import command
from minsnap.errors import InputError

if TYPE_CHECKING:
    from minsnap.files.formats.skybrush import Lights
    from minsnap.fleet.common_clock import Fleet
    from minsnap.studio.browser_page import Page

    Shown = tuple[Fleet, Sequence[Lights | None] | None]
    """A fleet, and the lights of its vehicles if the file has them."""


@command()
def studio(
    file: Annotated[Path | None, "[FILE]", "Scene (YAML, CSV, .plan), show, or fleet (folder, .skyc)."] = None,
    *,
    port: Annotated[int, typer.Option("--port", metavar="N", min=0, max=65535, help="0: any that is free.")] = 8080,
    host: Annotated[str, "ADDRESS", "Address to listen on."] = "127.0.0.1",
    no_browser: Annotated[bool, "Do not open the browser."] = False,
    obstacles: Annotated[Path | None, "FILE", "Grid or points: .npz, CSV; floor: map YAML."] = None,
    folder: Annotated[Path, "DIR", "Where files are saved."] = Path("."),
    separation: Annotated[float | None, "M", "Of a fleet: pairs that come near are red [m]."] = None,
    downwash: Annotated[float, "Heights are divided by it."] = 1.0,
) -> None:
    """Draw, drag and fly plans in the browser; on this machine only, unless --host says otherwise.

    Prints its address. Ends with Ctrl-C or SIGTERM.
    """
    import webbrowser

    fleet = None if file is None else _fleet(file, separation, downwash)
    ended = threading.Event()
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, lambda *_: ended.set())
    page = _page(file, folder, host, port, obstacles) if fleet is None else _fleet_page(fleet, host, port)
    try:
        print(f"studio: {page.url}  (Ctrl-C ends it)", flush=True)
        if not no_browser:
            webbrowser.open(page.url)
        while not ended.wait(0.5):
            pass
    finally:
        page.close()


def _page(file: Path | None, folder: Path, host: str, port: int, obstacles: Path | None) -> Page:
    from minsnap.studio.documents import example_scene, open_scene
    from minsnap.studio.ground_view import read_obstacles
    from minsnap.studio.studio import Studio

    request = example_scene() if file is None else open_scene(file)
    return Studio(request, str(folder), host, port, obstacles=None if obstacles is None else read_obstacles(obstacles))


def _fleet_page(shown: Shown, host: str, port: int) -> Page:
    from minsnap.studio.fleet_studio import FleetStudio

    return FleetStudio(shown[0], host, port, shown[1])


def _fleet(file: Path, separation: float | None, downwash: float) -> Shown | None:
    """Return the fleet of a folder or a ``.skyc``, or of a show, which is planned, and its lights; None for a scene."""
    from minsnap.fleet.common_clock import Separation
    from minsnap.shows.fleet_files import is_fleet, read_fleet, read_skyc
    from minsnap.shows.show import fly
    from minsnap.shows.show_yaml import is_show, read_show

    lights: Sequence[Lights | None] | None = None
    if file.suffix.lower() == ".skyc":
        held = read_skyc(file)
        fleet, lights = held.fleet, held.lights
    elif is_fleet(file):
        fleet = read_fleet(file)
    elif is_show(file):
        flown = fly(read_show(file), None, lambda line: print(f"minsnap: {line}", file=sys.stderr))
        fleet, lights = flown.fleet, flown.lights
    elif separation is not None:
        raise InputError(f"{file} is one vehicle: --separation is for a fleet")
    else:
        return None
    return fleet if separation is None else replace(fleet, separation=Separation(separation, downwash)), lights
