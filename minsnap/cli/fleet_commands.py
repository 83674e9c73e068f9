"""The commands of fleets and of the page: fleet plans a show, studio opens the page in a browser."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

import minsnap
from minsnap.basics.messages import labelled
from minsnap.basics.storage.atomic import check_destination, check_folder, refuse_source
from minsnap.basics.storage.text import name_as_text
from minsnap.cli import options
from minsnap.cli.app import command, tell
from minsnap.cli.file_commands import separation_of
from minsnap.cli.output import on_terminal
from minsnap.errors import InputError

if TYPE_CHECKING:
    from minsnap.files.formats import Lights
    from minsnap.fleet import FleetCertificate
    from minsnap.shows.failures import Failures
    from minsnap.shows.returns import Returns
    from minsnap.shows.safety_report import SafetyReport
    from minsnap.shows.show import FlownShow, Show
    from minsnap.studio.browser_page import Page


@command()
def fleet(
    show: Annotated[Path, "SHOW", "YAML: vehicles, separation, limits, home, acts; or a zip or folder of frames."],
    *,
    output: Annotated[
        Path | None, "--output", "-o", "FOLDER", "Folder of the show; of the same name beside a .zip (Skybrush's CSV)."
    ] = None,
    to: Annotated[str, "csv, crazyswarm2, skyb, traj (compressed) or skyc."] = "csv",
    report: Annotated[Path | None, "FILE", "Page of what was proved, to print and sign: .html or .pdf."] = None,
    animate: Annotated[Path | None, "FILE", "Seen from above: .gif; .mp4, .webm with ffmpeg."] = None,
    preview: Annotated[Path | None, "FILE", "Picture of each act from the audience; alone, nothing is planned."] = None,
    export: Annotated[list[Path] | None, "FILE", "To be played: .zip (Skybrush's CSV), .vviz or .kmz."] = None,
    separation: Annotated[float | None, "M", "Of frames: least distance of two vehicles [m]."] = None,
    downwash: Annotated[float | None, "W", "Of frames: heights are divided by it, by default 1."] = None,
    max_speed: Annotated[float | None, "M/S", "Of frames: limit on the speed [m/s]."] = None,
    max_acceleration: Annotated[float | None, "M/S²", "Of frames: limit on the acceleration [m/s²]."] = None,
    slower: Annotated[float | None, "N", "Of frames: how many times as long they last."] = None,
    without: Annotated[str | None, "N,...", "Vehicles that are missing: all others fly as they do."] = None,
    returns: Annotated[bool, "Prove a way home of all from every second; skyb and skyc hold them."] = False,
    no_clobber: options.NoClobber = False,
) -> int:
    """Plan a show of several vehicles, and certify its files.

    The least distance between vehicles is proved from the written files, and flights are slowed until these keep the
    limits. Each planned flight is kept in FOLDER/flights; a run that was killed continues from there. Ctrl-C ends the
    search for one flight with the best so far. Exit status 1 if the files violate a condition of the show.
    """
    from minsnap.plot.animation import animate_fleet
    from minsnap.shows.firmware_take_off import take_off_note
    from minsnap.shows.fleet_files import RETURNING, read_fleet, read_lights, write_fleet
    from minsnap.shows.safety_report import SafetyReport, write_report
    from minsnap.shows.show import SKYBRUSH, fly
    from minsnap.shows.show_exports import export_show

    exports = list(export or [])
    if output is not None and output.suffix.lower() == ".zip":
        exports.append(output)
        output = output.with_suffix("")
    _check_names(show, to, report, animate, preview, exports)
    described, of_frames = _described(show, separation, downwash, max_speed, max_acceleration, slower)
    missing = [] if without is None else _missing(without)
    _check_described(described, to, exports, missing, returns=returns)
    pages = [*filter(None, (report, animate)), *exports]
    drawn_alone = preview is not None and output is None and not (pages or returns or missing)
    if output is None and not drawn_alone:
        raise InputError("a show is written into a folder: give -o FOLDER, or --preview FILE alone")
    place = Path() if output is None else _check_places(output, to, pages, clobber=not no_clobber)
    if preview is not None:
        _draw_acts(described, preview, clobber=not no_clobber)
    if output is None:
        return 0
    if exports and exports[-1].with_suffix("") == output:
        tell(f"{exports[-1]} is to be played; what is proved lies in {output}")
    progress, title = on_terminal(quiet=False), name_as_text(show.stem)
    flown = fly(described, output / "flights", tell, progress, to) if of_frames is None else of_frames
    flown = flown.without(missing)
    sheet = flown.sheet(described, title)
    home = _home(described, flown.fleet, to) if returns else (None, None)
    written = write_fleet(
        *(flown.fleet, place, to, flown.lights),
        sheet=sheet,
        returns=home[0] if to in RETURNING else None,
        clobber=not no_clobber,
    )
    held = read_fleet(place)
    certificates = _certified(described, flown.fleet, held, to)
    late = take_off_note(held) if to in SKYBRUSH else None
    beyond = [] if late is None else [late]
    place_of = (described.origin, described.fence, *home, described.energy, described.room)
    proved = (*certificates, written.distance, flown.stages, written.files, beyond)
    safety = replace(SafetyReport(title, *proved, *place_of), lights=read_lights(place), cues=sheet.cues)
    if report is not None:
        write_report(safety, report, clobber=not no_clobber)
    for file in exports:
        export_show(certificates[0].fleet, file, flown.lights, sheet=sheet, clobber=not no_clobber)
    if animate is not None:
        animate_fleet(certificates[0].fleet, animate, clobber=not no_clobber, progress=progress)
    print("\n".join([_summary(safety, place), *(f"note: {sentence}" for sentence in written.notes)]))
    return 0 if safety.ok else 1


def _check_names(
    show: Path, to: str, report: Path | None, animate: Path | None, preview: Path | None, exports: Sequence[Path]
) -> None:
    """Refuse a format that is not known, endings that are not written, and one file for two things."""
    from minsnap.plot.animation import check_animation_name
    from minsnap.plot.figures import check_figure_name
    from minsnap.plot.pages import check_page_name
    from minsnap.shows.fleet_files import KINDS
    from minsnap.shows.show_exports import check_export_name

    if to not in KINDS:
        raise typer.BadParameter(f"{to!r} is none of {', '.join(KINDS)}", param_hint="--to")
    checks: list[tuple[Path | None, Callable[[Path], object]]] = [
        (report, check_page_name),
        (animate, check_animation_name),
        (preview, check_figure_name),
        *((file, check_export_name) for file in exports),
    ]
    taken = set()
    for file, check in checks:
        if file is None:
            continue
        refuse_source(file, show)
        check(file)
        if file.resolve() in taken:
            raise InputError(f"{file} is to be written twice: give each file a name of its own")
        taken.add(file.resolve())


def _check_described(
    described: Show, to: str, exports: Sequence[Path], missing: Sequence[int], *, returns: bool
) -> None:
    """Refuse what a show has not: vehicles, a place on the earth, homes to which all can return at once."""
    from minsnap.shows.crazyswarm_folder import refuse_many
    from minsnap.shows.show import those_left
    from minsnap.shows.show_exports import check_export
    from minsnap.shows.skyc import ShowSheet

    left = those_left(len(described.home), missing)
    if to == "crazyswarm2":
        refuse_many(len(left))
    if returns and described.turns is not None:
        raise InputError("--returns needs homes that are as far apart as vehicles in flight: these are left in turn")
    for file in exports:
        check_export(file, ShowSheet(origin=described.origin))


def _check_places(output: Path, to: str, pages: Sequence[Path], *, clobber: bool) -> Path:
    """Return what is written, a folder or a show in it; refuse places that cannot be, or must not be, written to."""
    from minsnap.shows.fleet_files import MANIFEST

    if output.suffix.lower() == ".skyc":
        raise InputError(f"{output} would be a folder: give another name; --to skyc writes show.skyc into it")
    check_folder(output)
    for page in pages:
        if output.is_dir() or page.parent.resolve() != output.resolve():
            check_destination(page, clobber=clobber)
    place = output / "show.skyc" if to == "skyc" else output
    if output.is_dir():
        check_destination(place if to == "skyc" else place / MANIFEST, clobber=clobber)
    return place


def _described(
    file: Path,
    separation: float | None,
    downwash: float | None,
    speed: float | None,
    acceleration: float | None,
    slower: float | None,
) -> tuple[Show, FlownShow | None]:
    """Return the show of a file, and the curves of one that is frames alone."""
    from minsnap.shows.frame_show import is_frames, show_of_frames
    from minsnap.shows.show_yaml import read_show

    given = {"separation": separation, "downwash": downwash, "max-speed": speed, "max-acceleration": acceleration}
    given["slower"] = slower
    if not is_frames(file):
        said = [name for name, value in given.items() if value is not None]
        if said:
            raise InputError(f"--{said[0]} is of frames, and {file} says it itself: leave it out")
        return read_show(file), None
    if separation is None:
        raise InputError(f"{file} is frames, which say no separation: give --separation M")
    apart = minsnap.Separation(separation, 1.0 if downwash is None else downwash)
    limits = minsnap.Limits(speed=speed, acceleration=acceleration)
    return show_of_frames(file, apart, limits, slower=1.0 if slower is None else slower)


def _draw_acts(show: Show, picture: Path, *, clobber: bool) -> None:
    from minsnap.plot import save_figure
    from minsnap.shows.preview import draw_preview, pictures_of

    save_figure(draw_preview(pictures_of(show)), picture, clobber=clobber)
    tell(f"{picture} shows the acts")


def _missing(without: str) -> list[int]:
    try:
        return [int(word) for word in without.split(",")]
    except ValueError:
        raise typer.BadParameter(
            f"{without!r} are no numbers of vehicles: give such as 17,18", param_hint="--without"
        ) from None


def _home(show: Show, planned: minsnap.Fleet, to: str) -> tuple[Returns, Failures | None]:
    """Return how all fly home from every second of what the files hold, and what one meets that fails."""
    from minsnap.shows.failures import failures_of
    from minsnap.shows.file_limits import ROUNDED_KINDS, played
    from minsnap.shows.returns import plan_returns

    flown = minsnap.Fleet(tuple(played(curve, to) for curve in planned)) if to in ROUNDED_KINDS else planned
    returns = plan_returns(flown, show.separation, show.limits, show.take_off, level=to == "skyc")
    why = "; a .skyc holds those at which all are at one height, skyb all" if to == "skyc" and returns.unproved else ""
    tell(f"returns: {len(returns.plans)} of {len(returns.plans) + len(returns.unproved)} seconds{why}")
    return returns, failures_of(flown, show.separation) if len(flown) > 1 else None


def _certified(
    show: Show, planned: minsnap.Fleet, held: minsnap.Fleet, to: str
) -> tuple[FleetCertificate, FleetCertificate]:
    """Return the certificates of the files and of the plan."""
    from minsnap.shows.file_limits import certify_files

    named = replace(held, separation=show.separation)
    files = certify_files(named, show.separation, show.limits, show.room, to)
    return files, minsnap.certify_fleet(planned, show.separation, show.limits, show.room)


def _summary(page: SafetyReport, place: Path) -> str:
    held = page.held
    lines = [("written", str(place)), ("vehicles", str(len(held.fleet))), ("duration", f"{held.fleet.duration:.2f} s")]
    over = [(stage.longer, stage.name) for stage in page.stages if stage.longer is not None]
    if over:
        most, which = max(over)
        lines.append(("flights", f"at most {most:.1%} longer than any of their slowest vehicle ({which})"))
    near = held.closest
    if near is not None:
        names = held.fleet.names_of(near.pair)
        lines.append(("least distance", f"{near.distance:.4f} m, {names} at {near.instant:.2f} s"))
    if page.fence is not None:
        lines.append(("inside the fence", f"{page.fence.margin_of(held.fleet):.3f} m beyond its margins at least"))
    lines.append(("files from the plan", f"{1e3 * page.distance:.2g} mm at most"))
    files = {used.use.name: f"{used.use.value:.4g} in the files" for used in held.utilisation}
    for used in page.planned.utilisation:
        reached = files.get(used.use.name, "of the plan alone")
        lines.append((used.use.name, f"{used.use.value:.4g} of {used.use.limit:.4g} in the plan, {reached}"))
    if page.energy is not None:
        most = float(page.energy.energies(held.fleet).max())
        share = "" if page.energy.battery is None else f", {most / page.energy.battery:.0%} of the battery"
        lines.append(("energy", f"{most:.2f} Wh at most{share}, {page.energy.hover:.1f} W in hover"))
    lines += _home_lines(page)
    verdict = "apart at every instant, proved of the files" if page.apart else "problem: it does not hold of the files"
    cut = [stage.name for stage in page.stages if "Ctrl-C" in stage.method]
    problems = [f"problem: {sentence}" for sentence in page.exceeded]
    notes = [f"note: the search for {name} was cut short: run again for a shorter flight" for name in cut]
    return "\n".join([labelled(lines), "", verdict, *problems, *notes])


def _home_lines(page: SafetyReport) -> list[tuple[str, str]]:
    returns, failures = page.returns, page.failures
    if returns is None:
        return []
    seconds = len(returns.plans) + len(returns.unproved)
    said = f"from {len(returns.plans)} of {seconds} seconds, {returns.longest_wait} s to the next at most"
    lines = [("returns", said if returns.least is None else f"{said}; {returns.least.distance:.4f} m apart")]
    if failures is not None:
        lines.append(("any one may fail", f"in {failures.seconds_apart} of {seconds} seconds, proved"))
    return lines


@command()
def studio(
    file: Annotated[Path | None, "[FILE]", "Scene (YAML, CSV, .plan), show, or fleet (folder, .skyc)."] = None,
    *,
    port: Annotated[int, typer.Option("--port", metavar="N", min=0, max=65535, help="0: any that is free.")] = 8080,
    host: Annotated[str, "ADDRESS", "Address to listen on."] = "127.0.0.1",
    no_browser: Annotated[bool, "Do not open the browser."] = False,
    obstacles: Annotated[Path | None, "FILE", "Grid or points to avoid: .npz, CSV; floor: map YAML."] = None,
    clearance: Annotated[float | None, "M", "Room around those of --obstacles, by default 0.3 [m]."] = None,
    folder: Annotated[Path, "DIR", "Where files are saved."] = Path("."),
    separation: Annotated[float | None, "M", "Of a fleet: pairs that come near are red [m]."] = None,
    downwash: options.Downwash = None,
) -> None:
    """Draw, drag and fly plans in the browser.

    Prints its address; only this machine reaches it, unless --host says otherwise. Ends with Ctrl-C or SIGTERM.
    """
    import webbrowser

    from minsnap.studio.browser_page import check_server
    from minsnap.studio.fleet_studio import FleetStudio

    if clearance is not None and obstacles is None:
        raise InputError(f"--clearance {clearance:g} is around obstacles: give --obstacles FILE with it")
    check_server(host, port)
    fleet = None if file is None else _fleet(file, separation, downwash, folder, obstacles)
    ended = threading.Event()
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, lambda *_: ended.set())
    scene = partial(_page, file, folder, host, port, obstacles, clearance)
    page = scene() if fleet is None else FleetStudio(fleet[0], host, port, fleet[1])
    try:
        print(f"studio: {page.url}  (Ctrl-C ends it)", flush=True)
        if not no_browser:
            webbrowser.open(page.url)
        while not ended.wait(0.5):
            pass
    finally:
        page.close()


def _flown_of(show: Show, folder: Path) -> tuple[minsnap.Fleet, Sequence[Lights | None]]:
    """Return what flies of a show: the files that a folder holds of it, else the flights planned for a ``.skyc``."""
    from minsnap.shows.fleet_files import MANIFEST, read_fleet, read_lights
    from minsnap.shows.show import fly

    kept = folder / "flights"
    written = folder.is_dir() and ((folder / MANIFEST).is_file() or (folder / "show.skyc").is_file())
    if written and kept.is_dir():
        place = folder if (folder / MANIFEST).is_file() else folder / "show.skyc"
        held, lights = read_fleet(place), read_lights(place)
        if len(held) == len(show.home):
            tell(f"{place} is what is shown")
            return held, fly(show, kept).lights if lights is None else lights
    flown = fly(show, kept if kept.is_dir() else None, tell, to="skyc")
    return flown.fleet, flown.lights


def _page(
    file: Path | None, folder: Path, host: str, port: int, obstacles: Path | None, clearance: float | None = None
) -> Page:
    from minsnap.studio.documents import WorkingFolder, example_scene, open_scene
    from minsnap.studio.ground_view import read_obstacles
    from minsnap.studio.obstacle_view import CLEARANCE
    from minsnap.studio.studio import Studio

    request = example_scene() if file is None else open_scene(file)
    shown = None if obstacles is None else read_obstacles(obstacles)
    room = CLEARANCE if clearance is None else clearance
    kept = WorkingFolder(folder, file, obstacles)
    return Studio(request, kept, host, port, obstacles=shown, clearance=room, welcome=file is None)


def _fleet(
    file: Path, separation: float | None, downwash: float | None, folder: Path, obstacles: Path | None = None
) -> tuple[minsnap.Fleet, Sequence[Lights | None] | None] | None:
    """Return the fleet of a folder, a ``.skyc`` or a show, and its lights; None for a scene."""
    from minsnap.shows.fleet_files import is_fleet, read_fleet, read_lights
    from minsnap.shows.show_yaml import is_show, read_show

    held, described = is_fleet(file), not is_fleet(file) and is_show(file)
    if not (held or described):
        if separation is not None or downwash is not None:
            raise InputError(f"{file} is one vehicle: --separation and --downwash are for a fleet")
        return None
    if obstacles is not None:
        raise InputError(f"{file} is a fleet, whose page shows no --obstacles: leave them out")
    if described:
        show = read_show(file)
        apart = separation_of(show.separation, separation, downwash)  # before anything is planned
        fleet, lights = _flown_of(show, folder)
        return replace(fleet, separation=apart), lights
    fleet = read_fleet(file)
    apart = separation_of(fleet.separation, separation, downwash)
    if apart is None and downwash is not None:
        raise InputError(f"{file} does not say how far apart its vehicles must be: --downwash needs --separation")
    return replace(fleet, separation=apart), read_lights(file)
