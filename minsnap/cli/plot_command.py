"""The command that draws a file of setpoints."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from minsnap.cli import options
from minsnap.cli.app import app


@app.command()
def plot(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="Setpoint CSV, or any file of a path.")],
    output: Annotated[
        Path, typer.Option("--output", "-o", metavar="FILE", help="Figure to write: PNG, SVG or PDF, by its ending.")
    ],
    view: options.View = None,
    frame: options.ReadFrame = None,
    waypoints: Annotated[
        Path | None, typer.Option("--waypoints", metavar="FILE", help="Waypoints to draw too, as for plan.")
    ] = None,
    corridor: options.Corridor = None,
    title: Annotated[str | None, typer.Option("--title", help="Written above; the file's name unless given.")] = None,
    no_clobber: options.NoClobber = False,
) -> None:
    """Draw a file: the path, and its position, derivatives and heading against time."""
    from minsnap.files.convert import read_samples
    from minsnap.files.waypoints import read_waypoints
    from minsnap.plot.figures import check_figure_name, plot_overview, save_figure
    from minsnap.storage.atomic import check_destination

    check_figure_name(output)
    check_destination(output, clobber=not no_clobber)
    samples = read_samples(file, frame)
    points = None if waypoints is None else read_waypoints(waypoints).points
    walls = options.parse_corridor(corridor)
    figure = plot_overview(samples, view=view or "xy", corridor=walls, waypoints=points, title=title or file.name)
    save_figure(figure, output, clobber=not no_clobber)
