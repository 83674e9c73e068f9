"""The command that plans a show of several vehicles and writes its files."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from minsnap.basics.storage.text_columns import labelled
from minsnap.cli import options
from minsnap.cli.command import command
from minsnap.cli.output import on_terminal

if TYPE_CHECKING:
    from minsnap.fleet.common_clock import Fleet
    from minsnap.fleet.fleet_certificate import FleetCertificate
    from minsnap.shows.safety_report import SafetyReport
    from minsnap.shows.show import Show


@command()
def fleet(
    show: Annotated[Path, "SHOW", "YAML: vehicles, separation, limits, home, acts."],
    *,
    output: Annotated[Path, "--output", "-o", "FOLDER", "Folder of the show."],
    to: Annotated[str, "csv, crazyswarm2, skyb, traj (compressed) or skyc."] = "csv",
    report: Annotated[Path | None, "FILE", "HTML page of what was proved, to print and sign."] = None,
    animate: Annotated[Path | None, "FILE", "Seen from above: .gif; .mp4, .webm with ffmpeg."] = None,
    no_clobber: options.NoClobber = False,
) -> int:
    """Plan the flights of a show, write them, and prove of what was written how far apart the vehicles stay.

    Each planned flight is kept in FOLDER/flights: a run that was killed goes on with them. Ctrl-C ends the
    search for one flight with the best so far. Exit status 1 if the files do not keep the show's conditions.
    """
    from minsnap.basics.storage.atomic import check_destination
    from minsnap.files.formats.skybrush import worst_distance
    from minsnap.plot.animation import animate_fleet, check_animation_name
    from minsnap.shows.fleet_files import EXACT_KINDS, KINDS, read_fleet, write_fleet
    from minsnap.shows.safety_report import SafetyReport, write_report
    from minsnap.shows.show import fly
    from minsnap.shows.show_yaml import read_show

    if to not in KINDS:
        raise typer.BadParameter(f"{to!r} is none of {', '.join(KINDS)}", param_hint="--to")
    if animate is not None:
        check_animation_name(animate)
        check_destination(animate, clobber=not no_clobber)
    described = read_show(show)
    lost = worst_distance(described.reach) if to not in EXACT_KINDS else 0.0
    progress = on_terminal(quiet=False)
    wider, kept = _wider(described, 2.0 * lost), output / "flights"
    flown = fly(wider, kept, lambda line: print(f"minsnap: {line}", file=sys.stderr, flush=True), progress)
    output.mkdir(parents=True, exist_ok=True)
    place = output / "show.skyc" if to == "skyc" else output
    written = write_fleet(
        replace(flown.fleet, separation=described.separation), place, to, flown.lights, clobber=not no_clobber
    )
    certificates = _certified(described, flown.fleet, read_fleet(place))
    page = SafetyReport(show.stem, *certificates, written.distance, flown.stages, written.files)
    if report is not None:
        write_report(page, report, clobber=not no_clobber)
    if animate is not None:
        animate_fleet(certificates[0].fleet, animate, clobber=not no_clobber, progress=progress)
    print(_summary(page, place))
    return 0 if page.ok else 1


def _wider(show: Show, more: float) -> Show:
    """Return the show with what the files may lose added to its separation."""
    from minsnap.fleet.common_clock import Separation

    apart = show.separation
    return replace(show, separation=Separation((apart.distance or 0.0) + more, apart.downwash)) if more else show


def _certified(show: Show, planned: Fleet, held: Fleet) -> tuple[FleetCertificate, FleetCertificate]:
    """Return the certificates of the files and of the plan."""
    from minsnap.fleet.fleet_certificate import certify_fleet

    named = replace(held, separation=show.separation)
    first, second = (certify_fleet(one, show.separation, show.limits, show.room) for one in (named, planned))
    return first, second


def _summary(page: SafetyReport, place: Path) -> str:
    held = page.held
    lines = [("written", str(place)), ("vehicles", str(len(held.fleet))), ("duration", f"{held.fleet.duration:.2f} s")]
    if held.pair is not None:
        names = " and ".join(held.fleet.name(vehicle) for vehicle in held.pair)
        lines.append(("least distance", f"{held.least_distance:.4f} m, {names} at {held.instant:.2f} s"))
    lines.append(("files from the plan", f"{1e3 * page.distance:.2g} mm at most"))
    planned = {used.use.name: used.use.value for used in page.planned.utilisation}
    for used in held.utilisation:
        figures = f"{planned[used.use.name]:.4g} of {used.use.limit:.4g} in the plan, {used.use.value:.4g} in the files"
        lines.append((used.use.name, figures))
    verdict = "apart at every instant, proved of the files" if page.ok else "problem: it does not hold of the files"
    cut = [stage.name for stage in page.stages if "Ctrl-C" in stage.method]
    notes = [*page.exceeded, *(f"the search for {name} was cut short: run again for a shorter flight" for name in cut)]
    return "\n".join([labelled(lines), "", verdict, *(f"note: {sentence}" for sentence in notes)])
