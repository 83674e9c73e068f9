"""The command that opens the studio."""

from __future__ import annotations

import signal
import threading
from pathlib import Path
from typing import Annotated

import typer

from minsnap.cli.app import app


@app.command()
def studio(
    file: Annotated[
        Path | None, typer.Argument(metavar="[FILE]", help="Scene: YAML, waypoints in CSV, or a QGroundControl .plan.")
    ] = None,
    port: Annotated[int, typer.Option("--port", metavar="N", min=0, max=65535, help="0: any that is free.")] = 8080,
    host: Annotated[str, typer.Option("--host", metavar="ADDRESS", help="Address to listen on.")] = "127.0.0.1",
    no_browser: Annotated[bool, typer.Option("--no-browser", help="Do not open the browser.")] = False,
    obstacles: Annotated[
        Path | None, typer.Option("--obstacles", metavar="FILE", help="Grid or points to show: .npz or x,y,z CSV.")
    ] = None,
    folder: Annotated[Path, typer.Option("--folder", metavar="DIR", help="Where files are saved.")] = Path("."),
) -> None:
    """Draw, drag and fly plans in the browser; on this machine only, unless --host says otherwise.

    Prints its address. Ends with Ctrl-C or SIGTERM.
    """
    import webbrowser

    from minsnap.studio.documents import example_scene, open_scene
    from minsnap.studio.obstacles import read_obstacles
    from minsnap.studio.studio import Studio

    request = example_scene() if file is None else open_scene(file)
    seen = None if obstacles is None else read_obstacles(obstacles)
    ended = threading.Event()
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, lambda *_: ended.set())
    page = Studio(request, str(folder), host, port, obstacles=seen)
    try:
        print(f"studio: {page.url}  (Ctrl-C ends it)", flush=True)
        if not no_browser:
            webbrowser.open(page.url)
        while not ended.wait(0.5):
            pass
    finally:
        page.close()
