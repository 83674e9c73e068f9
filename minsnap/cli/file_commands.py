"""The commands that check, draw and convert files of a path, a plan or a fleet."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import minsnap
from minsnap.basics.messages import aligned, labelled
from minsnap.basics.storage.atomic import check_destination, refuse_source
from minsnap.basics.storage.text import name_as_text
from minsnap.cli import options
from minsnap.cli.app import command, told_warnings
from minsnap.cli.output import as_json, on_terminal
from minsnap.errors import InputError

if TYPE_CHECKING:
    from minsnap.files import AxisFigures, ConsistencyReport, Membership, PlanFile
    from minsnap.fleet import FleetCertificate
    from minsnap.paths.missions import CourseCheck
    from minsnap.vehicle import Loop

LISTED = 10
"""Pairs that are shown."""


@command()
def check(
    file: Annotated[Path, "FILE", "Setpoint CSV, or any file of a path."],
    *,
    frame: options.ReadFrame = None,
    waypoints: Annotated[Path | None, "FILE", "Waypoints of the corridor, as for plan."] = None,
    corridor: options.Corridor = None,
    exact: Annotated[bool, "Prove a plan's margin and maxima again in exact rational arithmetic; slow."] = False,
    separation: Annotated[float | None, "M", "Of a fleet: how far apart any two must stay [m]."] = None,
    downwash: options.Downwash = None,
    ground: options.Ground = None,
    course: Annotated[Path | None, "FILE", "A course: prove how near the flight is to its least time."] = None,
    columns: options.Columns = None,
    origin: options.Origin = None,
    tracking: options.Tracking = None,
    wind: options.WindChange = 0.0,
    json: options.Json = False,
) -> int:
    """Check a file: its rate, its derivatives and its corridor.

    Prints the range and the top rates of each axis. A plan in .json or .yaml is certified again: it must keep the
    corridor, obstacles, gates, limits, waypoints and joints that the file states, and each margin is printed.

    With --course, any planner's flight is held against the course: where it passes each stop and gate, how far it uses
    each limit, and how much longer it is at most than any flight within these limits, proved.

    For a folder with one file per vehicle, or a Skybrush show (.skyc), it proves the least distance between the
    vehicles at every instant. Vehicles whose files are setpoints are taken to fly the curves between them.

    With --tracking the vehicle in its control loop, not only the plan, must keep all of that while the wind changes by
    at most --wind.

    Exit status 1 if the check fails.
    """
    from minsnap.cli.kept import course_figures, course_lines, kept_figures, kept_lines, tube_figures, tube_lines
    from minsnap.files import check_samples, frame_of, map_samples, origin_of, read_to_check, resolution_of, torn
    from minsnap.shows.fleet_files import is_fleet

    loop = options.loop_of(tracking, wind)
    if is_fleet(file):
        if columns is not None or origin is not None or course is not None:
            raise InputError(f"{file} is a fleet: --columns, --origin and --course are for the file of one vehicle")
        return check_fleet(file, separation, downwash, json, frame, loop, wind, ground)
    if separation is not None or downwash is not None or ground is not None:
        raise InputError(f"{file} is one vehicle: --separation, --downwash and --ground are for a folder or a .skyc")
    options.check_corridor(corridor, waypoints)
    named = options.parse_named(columns)
    samples, axes = read_to_check(file, frame, named, origin), frame_of(file, frame)
    report = check_samples(map_samples(samples, "enu", axes), resolution=resolution_of(file))
    inside = membership(samples, waypoints, corridor)
    plan = _plan(file, exact)
    if plan is None and loop is not None:
        raise InputError(f"{file} holds no plan: --tracking takes .json or .yaml of polynomials, or a fleet")
    tube = None if plan is None or loop is None else plan.in_loop(loop, wind)
    certificate, faults = (None, []) if plan is None else plan.certified()
    proved = _proved(certificate) if exact and certificate is not None else None
    if proved is not None and not proved["holds"]:
        faults.insert(0, "the figures of the certificate are not proved in exact arithmetic")
    faults += [tube.fault] if tube is not None and tube.fault is not None else []
    tear = torn(file)
    problems = [*([tear] if tear else report.problems), *_escape(inside), *faults]
    named_rows = map_samples(samples, "enu", axes) if named or origin is not None else None
    flown = None if course is None else _against(course, file, frame, named_rows)
    problems += [] if flown is None else flown.problems
    if json:
        verdict = {"problems": problems, "ok": not problems, "frame": axes, "origin": origin_of(file)}
        kept = None if plan is None else kept_figures(plan)
        known = {"corridor": inside and asdict(inside), "exact": proved, "certified": kept}
        known["vehicle"] = None if tube is None else tube_figures(tube)
        known |= {} if flown is None else {"course": course_figures(flown)}
        print(as_json(asdict(report) | verdict | known))
    else:
        kept_by = ([] if plan is None else kept_lines(plan)) + ([] if tube is None else tube_lines(tube))
        against = [] if flown is None else course_lines(flown)
        print(_as_text(report, inside, [*kept_by, *_exact_lines(proved)], problems, axes, against))
    return 1 if problems else 0


def _against(course: Path, file: Path, frame: str | None, samples: minsnap.Samples | None) -> CourseCheck:
    """Hold the flight of a file, or of samples that were read with names of columns, against a course."""
    from minsnap.files import read_any, resolution_of
    from minsnap.paths.missions import check_course, read_course

    content = read_any(file, frame) if samples is None else samples
    return check_course(content, read_course(course), resolution_of(file))


def _plan(file: Path, exact: bool) -> PlanFile | None:
    """Return the plan of a file of polynomials, None of another."""
    from minsnap.files.formats import is_polynomials, read_polynomials

    if is_polynomials(file):
        return read_polynomials(file)
    if exact:
        raise InputError(f"{file} holds no plan to prove: --exact takes .json or .yaml of polynomials")
    return None


def _proved(certificate: minsnap.Certificate) -> dict[str, Any]:
    """Prove a certificate again without rounding: its margins, greatest norms and waypoint error.

    ``exceeded`` are limits that the plan does not keep, as certified, without a proof in exact arithmetic.
    """
    known = {name: getattr(certificate, name) for name in ("corridor_margin", "obstacle_margin", "waypoint_error")}
    exceeded = [asdict(used) for used in certificate.utilisation if not used.kept]
    return {"holds": certificate.verify(), **known, "exceeded": exceeded}


def membership(samples: minsnap.Samples, waypoints: Path | None, corridor: str | None) -> Membership | None:
    """Return how samples keep a corridor around the legs of a file, None where none is given."""
    if waypoints is None:
        return None
    from minsnap.files import check_membership

    return check_membership(samples, minsnap.read_waypoints(waypoints).points, options.parse_corridor(corridor))


def _escape(inside: Membership | None) -> list[str]:
    if inside is None or inside.ok:
        return []
    return [f"the path leaves the corridor of leg {inside.leg} by {-inside.margin:.3g} m at t = {inside.instant:.6g} s"]


def _as_text(
    report: ConsistencyReport,
    inside: Membership | None,
    kept: list[tuple[str, str]],
    problems: list[str],
    frame: str,
    against: list[tuple[str, str]],
) -> str:
    words = {None: "unknown", True: "yes", False: "no"}
    lines = [
        ("frame", frame),
        ("rows", str(report.rows)),
        ("duration", f"{report.duration:.6g} s at {report.rate:.6g} Hz"),
        ("at rest", f"{words[report.starts_at_rest]} at the start, {words[report.ends_at_rest]} at the end"),
        ("largest step", f"{report.largest_jump:.4g} m, at {report.jump_time:.6g} s"),
    ]
    if report.feed_forward is not None:
        lines.append(("feed-forward", f"up to {report.feed_forward:.4g} m/s^2 beside the acceleration"))
    if report.lead:
        lines.append(("lead", f"sent {report.lead:g} s before the instants that they are planned for"))
    if inside is not None:
        lines.append(("corridor margin", f"{inside.margin:.3g} m at the samples, least at {inside.instant:.6g} s"))
    certified = ["", "certified again, at every instant", labelled(kept)] if kept else []
    certified += ["", "against the course", labelled(against)] if against else []
    axes = ["", _table(report.axes)] if report.axes else []
    notes = [f"note: {note}" for note in report.notes]
    verdict = [f"problem: {problem}" for problem in problems] or ["consistent"]
    return "\n".join([labelled(lines), *axes, *certified, "", *notes, *verdict])


def _exact_lines(proved: dict[str, Any] | None) -> list[tuple[str, str]]:
    """Return what is proved in exact arithmetic."""
    if proved is None:
        return []
    margins = {"corridor": proved["corridor_margin"], "obstacle": proved["obstacle_margin"]}
    said = "".join(f", {name} margin {least:.3g} m" for name, least in margins.items() if least is not None)
    lines = [("exact proof", f"{'holds' if proved['holds'] else 'does not hold'}{said}, at every instant")]
    error = proved["waypoint_error"]
    return [*lines, ("waypoint error", f"{error:.3g} m at most")] if error else lines


def _table(axes: tuple[AxisFigures, ...]) -> str:
    """Return figures in a table: metres and seconds, radians for yaw."""
    rows = [["axis", "least", "greatest", "top rate", "top acceleration"]]
    for axis in axes:
        figures = (axis.lowest, axis.highest, axis.fastest, axis.hardest)
        rows.append([axis.name, *("-" if figure is None else f"{figure:.4g}" for figure in figures)])
    return aligned(rows)


def separation_of(
    own: minsnap.Separation | None, separation: float | None, downwash: float | None, ground: float | None = None
) -> minsnap.Separation | None:
    """Return a fleet's own separation with what is given in place of it; None where neither says one."""
    if separation is not None:
        return minsnap.Separation(separation, 1.0 if downwash is None else downwash, ground=ground)
    if own is None or (downwash is None and ground is None):
        return own
    heights, stands = own.downwash if downwash is None else downwash, own.ground if ground is None else ground
    return minsnap.Separation(own.distance, heights, radii=own.radii, ground=stands)


def check_fleet(
    path: Path,
    separation: float | None,
    downwash: float | None,
    json: bool,
    frame: str | None = None,
    loop: Loop | None = None,
    wind: float = 0.0,
    ground: float | None = None,
) -> int:
    """Print how far apart the vehicles of files stay, over all time; return 1 if that is less than their separation."""
    fleet = minsnap.shows.read_fleet(path, between=True, frame=frame)
    apart = separation_of(fleet.separation, separation, downwash, ground)
    if apart is None:
        raise InputError(f"{path} does not say how far apart its vehicles must be: give --separation M")
    certificate = minsnap.certify_fleet(fleet, apart, tracking=loop, wind=wind)
    print(_fleet_json(certificate) if json else _fleet_text(certificate))
    return 0 if certificate.ok else 1


def pair_rows(certificate: FleetCertificate) -> list[list[str]]:
    """Return the pairs that come nearest, as rows of text under a heading."""
    from minsnap.basics.checks import point_text

    rows = [["vehicles", "", "distance [m]", "separation [m]", "at [s]", "between [m]"]]
    for near in certificate.nearest[:LISTED]:
        names = [certificate.fleet.name(vehicle) for vehicle in near.pair]
        figures = f"{near.distance:.4f}", f"{near.required:.4g}", f"{near.instant:.2f}"
        rows.append([*names, *figures, point_text(certificate.middle_of(near).round(2) + 0.0)])
    return rows


def _fleet_text(certificate: FleetCertificate) -> str:
    from minsnap.cli.kept import tube_lines

    fleet = certificate.fleet
    fastest, hardest = (max(curve.max_norm(order)[0] for curve in fleet) for order in (1, 2))
    lines = [("vehicles", str(len(fleet))), ("duration", f"{fleet.duration:.6g} s")]
    lines += [("top speed", f"{fastest:.4g} m/s"), ("top acceleration", f"{hardest:.4g} m/s^2")]
    if certificate.vehicles is not None:
        lines += tube_lines(certificate.vehicles)
    table = ["", aligned(pair_rows(certificate))] if certificate.nearest else []
    return "\n".join([labelled(lines), *table, "", _verdict(certificate)])


def _verdict(certificate: FleetCertificate) -> str:
    near = certificate.closest
    if certificate.vehicles is not None and certificate.vehicles.fault is not None:
        return f"problem: {certificate.vehicles.fault}"
    if certificate.jump is not None:
        vehicle, instant, jump = certificate.jump
        return f"problem: {certificate.fleet.name(vehicle)} jumps by {jump:.3g} m at {instant:.4g} s"
    if near is None:
        return "one vehicle: there is no pair"
    nearest = f"{certificate.fleet.names_of(near.pair)} come within {near.distance:.4f} m at {near.instant:.2f} s"
    return f"apart at every instant: {nearest}" if certificate.ok else f"problem: {nearest}"


def _fleet_json(certificate: FleetCertificate) -> str:
    from minsnap.cli.kept import tube_figures

    near = [vars(pair) | {"between": certificate.middle_of(pair).tolist()} for pair in certificate.nearest]
    fleet = certificate.fleet
    facts = {"ok": certificate.ok, "vehicles": [fleet.name(i) for i in range(len(fleet))], "duration": fleet.duration}
    least = {name: getattr(certificate, name) for name in ("least_distance", "pair", "instant")}
    tubes = None if certificate.vehicles is None else tube_figures(certificate.vehicles)
    return as_json(facts | least | {"nearest": near, "jump": certificate.jump, "vehicle": tubes})


@command()
def plot(
    file: Annotated[Path, "FILE", "Setpoint CSV, any file of a path, or a fleet."],
    *,
    output: Annotated[Path, "--output", "-o", "FILE", "PNG, SVG or PDF; an animation: .gif, .mp4, .webm."],
    view: options.View = None,
    colour_by: options.ColourBy = None,
    frame: options.ReadFrame = None,
    waypoints: Annotated[Path | None, "FILE", "Waypoints to draw too, as for plan."] = None,
    corridor: options.Corridor = None,
    title: Annotated[str | None, "Written above; by default the file's name."] = None,
    no_clobber: options.NoClobber = False,
) -> None:
    """Draw the path and its profiles, or animate the flight.

    A plan in .json or .yaml is drawn with the waypoints, gates, corridor, obstacles and limits that its file holds.
    """
    from minsnap.files import read_samples
    from minsnap.plot.animation import ENDINGS, animate_fleet, animate_path, check_animation_name
    from minsnap.plot.figures import check_figure_name, plot_overview, save_figure
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
        fleet = read_fleet(file, between=True, frame=frame)
        if moving:
            animate_fleet(fleet, output, view=view or "xy", title=name_as_text(title or file.name), **how)
        else:
            figure: Any = minsnap.plot.plot_fleet(fleet, view or "xy").figure
            save_figure(figure, output, clobber=not no_clobber)
        return
    points = None if waypoints is None else minsnap.read_waypoints(waypoints).points
    stored = _plan(file, False) if points is None and frame is None else None
    drawn: dict[str, Any] = {"corridor": options.parse_corridor(corridor), "waypoints": points}
    drawn = drawn if stored is None else stored.drawn
    drawn |= {"view": view or "xy", "title": name_as_text(title or file.name)}
    path = read_samples(file, frame) if stored is None else stored.trajectory
    if moving:
        if colour_by is not None:
            raise InputError("--colour-by is of a figure: an animation has one colour")
        animate_path(path, output, **how, **drawn)
    else:
        limits = None if stored is None else stored.limits
        save_figure(plot_overview(path, colour_by=colour_by, limits=limits, **drawn), output, clobber=not no_clobber)


@command()
def convert(
    source: Annotated[Path, "IN", f"{options.READABLE}."],
    target: Annotated[Path, "OUT", f"{options.WRITABLE}."],
    *,
    to: Annotated[str | None, f"{options.FORMATS}; else by the ending."] = None,
    rate: Annotated[float | None, "HZ", "Setpoints per second of a trajectory, by default 20."] = None,
    frame: Annotated[str, "--to-frame", "--frame", "Axes of the setpoints or table written."] = "enu",
    from_frame: Annotated[str | None, "Axes of a setpoint CSV, if it does not say so itself."] = None,
    columns: options.Columns = None,
    origin: options.Origin = None,
    tolerance: Annotated[str | None, "LENGTH", "Fit samples with few polynomials this near: 5mm, 1cm, 0.1m."] = None,
    within: options.Within = None,
    ends: Annotated[str, "With --tolerance: rest, or free where the samples move at their ends."] = "rest",
    no_clobber: options.NoClobber = False,
) -> int:
    """Convert trajectories, setpoints and logs to another format.

    A trajectory is sampled at --rate for a format of samples. Samples keep their instants; for a format of polynomials
    they are fitted to 1 mm, or with --tolerance by least squares with as few polynomials as it allows.
    """
    from minsnap.files import RATE, file_formats, format_of, read_any, write_any

    chosen = format_of(target, to)
    chosen.check_frame(frame)
    refuse_source(target, source)
    options.check_mission(chosen, origin, within)
    near = None if tolerance is None else options.parse_length("--tolerance", tolerance)
    if ends not in ("rest", "free") or (ends == "free" and near is None):
        raise InputError(f"--ends is {ends!r}: it is rest or free, with --tolerance")
    with told_warnings():
        if columns is None and (origin is None or chosen.geodetic):
            content = read_any(source, from_frame)
        else:
            content = minsnap.read_csv(source, from_frame, columns=options.parse_named(columns), origin=origin)
    kept = isinstance(content, minsnap.Samples)
    if rate is not None and not (chosen.holds == "samples" and (near is not None or not kept)):
        fitted = "; leave it out" + ", or give --tolerance 1mm with it" * (kept and chosen.holds == "samples")
        held = "samples, which keep their instants" if kept else "a trajectory, which is kept"
        raise InputError(f"{source} holds {held}: --rate is of a trajectory that is sampled{fitted}")
    how: dict[str, Any] = {"clobber": not no_clobber, "tolerance": near, "rest": ends == "rest"}
    how |= {"origin": origin, "within": within}
    name, lost = write_any(content, target, to, RATE if rate is None else rate, frame, **how)
    print(f"{target}: {name}, frame {file_formats()[name].frame or frame}{f'; {lost}' if lost else ''}")
    return 0
