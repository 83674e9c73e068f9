"""The command that draws a file of setpoints."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

from minsnap.cli import options
from minsnap.cli.command import command
from minsnap.cli.output import on_terminal
from minsnap.errors import InputError


@command()
def plot(
    file: Annotated[Path, "FILE", "Setpoint CSV, any file of a path, or a fleet."],
    *,
    output: Annotated[Path, "--output", "-o", "FILE", "PNG, SVG or PDF; an animation: .gif, .mp4."],
    view: options.View = None,
    colour_by: options.ColourBy = None,
    frame: options.ReadFrame = None,
    waypoints: Annotated[Path | None, "FILE", "Waypoints to draw too, as for plan."] = None,
    corridor: options.Corridor = None,
    title: Annotated[str | None, "Written above; by default the file's name."] = None,
    no_clobber: options.NoClobber = False,
) -> None:
    """Draw a file: the path, and its position, derivatives and heading against time; or the flight, moving."""
    from minsnap.basics.storage.atomic import check_destination, refuse_source
    from minsnap.files.convert import read_samples
    from minsnap.files.waypoints import read_waypoints
    from minsnap.plot.animation import ENDINGS, animate_fleet, animate_path, check_animation_name
    from minsnap.plot.figures import check_figure_name, plot_overview, save_figure
    from minsnap.plot.fleet_figures import plot_fleet
    from minsnap.shows.fleet_files import is_fleet, read_fleet

    if corridor is not None and waypoints is None:
        raise InputError("--corridor is around the legs between waypoints: give them with --waypoints FILE")
    moving = output.suffix.lower() in ENDINGS
    if moving:
        check_animation_name(output, view or "xy")
    else:
        check_figure_name(output)
    check_destination(output, clobber=not no_clobber)
    refuse_source(output, file, waypoints)
    how: dict[str, Any] = {"clobber": not no_clobber, "progress": on_terminal(quiet=False)}
    if is_fleet(file):
        fleet = read_fleet(file)
        if moving:
            animate_fleet(fleet, output, view=view or "xy", title=title or file.name, **how)
        else:
            figure: Any = plot_fleet(fleet, view or "xy").figure
            save_figure(figure, output, clobber=not no_clobber)
        return
    samples = read_samples(file, frame)
    points = None if waypoints is None else read_waypoints(waypoints).points
    drawn: dict[str, Any] = {"corridor": options.parse_corridor(corridor), "waypoints": points}
    drawn |= {"view": view or "xy", "title": title or file.name}
    if moving:
        if colour_by is not None:
            raise InputError("--colour-by is of a figure: an animation has one colour")
        animate_path(samples, output, **how, **drawn)
    else:
        save_figure(plot_overview(samples, colour_by=colour_by, **drawn), output, clobber=not no_clobber)
