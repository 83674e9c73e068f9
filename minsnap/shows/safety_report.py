"""The report of a show: one printable page of what was proved of its files, for the one who signs for it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.checks import point_text
from minsnap.basics.storage.text import FileName, digest_of
from minsnap.basics.tolerances import EXACT
from minsnap.files.formats import STEP_TIME, Lights
from minsnap.fleet import REACH, FleetCertificate, Separation, certify_fleet, extent_of
from minsnap.limits import Limits
from minsnap.plot.fleet_figures import legend_above, plot_fleet, plot_homes, plot_separation
from minsnap.plot.page_files import write_parts
from minsnap.plot.pages import Drawing, Note, Part, Signature, Table, Verdict
from minsnap.plot.style import styled
from minsnap.shows.energy import PowerModel, aloft
from minsnap.shows.failures import SINKS, Failures
from minsnap.shows.file_limits import largest_step
from minsnap.shows.light_figure import light_figure
from minsnap.shows.preview import AT_ONCE, Picture, at_once, draw_preview
from minsnap.shows.return_figure import return_figure, spans_text
from minsnap.shows.returns import Returns
from minsnap.shows.site import Fence, ShowOrigin
from minsnap.shows.timeline import Stage

if TYPE_CHECKING:
    from minsnap.plot.style import Axes, Figure

PAIRS = 20
"""Pairs in the table of those that come nearest."""

SETTLED = 0.1
"""How long after the arrival an act is drawn: lights have changed by then [s]."""

PICTURES = 12
"""Acts in one drawing."""

FAINT_STEP = 1e-5
"""Step of a velocity that is none: numbers are written with few digits [m/s]."""

VALIDATED = ("horizontal_speed", "vertical_speed", "horizontal_acceleration", "vertical_acceleration")
"""Limits whose use over all time is read from a certificate."""

VALIDATION: dict[str, tuple[str, float | None, float | None, float | None]] = {
    "altitude": ("m", 150.0, 150.0, 6.0),
    "horizontal_speed": ("m/s", 8.0, 10.0, 2.5),
    "vertical_speed": ("m/s", 3.0, 2.0, 1.0),
    "horizontal_acceleration": ("m/s²", 4.0, None, None),
    "vertical_acceleration": ("m/s²", 4.0, None, None),
    "distance": ("m", 3.0, 3.0, 0.5),
}
"""What Skybrush Studio and Viewer, outdoors and indoors, warn of: all are at most, and the distance at least."""


@dataclass(frozen=True, eq=False)
class SafetyReport:
    """What the page says.

    Parameters
    ----------
    title : str
    held : FleetCertificate
        Of what was read back from the files: separation, room, and how far each limit is used.
    planned : FleetCertificate
        Of the plan: its limits are those of the show.
    distance : float
        How far the files may be from the plan [m].
    stages : sequence of Stage
    files : sequence of Path
    beyond : sequence of str
        What else keeps the show from being flown as it was proved, a sentence each.
    origin : ShowOrigin, optional
        Where on the earth it is flown.
    fence : Fence, optional
        Walls that the files are to stay inside of.
    returns, failures : Returns and Failures, optional
        How all return when they are called, and what one meets that fails.
    energy : PowerModel, optional
        What power a vehicle takes.
    room : pair of corners, optional
        Of the show [m].
    lights : sequence of Lights or None, optional
        What the lamp of each vehicle shows by the files; None where they hold no lights.
    cues : sequence of (float, str)
        When each act is reached [s], and its name.
    """

    title: str
    held: FleetCertificate
    planned: FleetCertificate
    distance: float
    stages: Sequence[Stage]
    files: Sequence[Path]
    beyond: Sequence[str] = ()
    origin: ShowOrigin | None = None
    fence: Fence | None = None
    returns: Returns | None = None
    failures: Failures | None = None
    energy: PowerModel | None = None
    room: tuple[FloatArray, FloatArray] | None = None
    lights: Sequence[Lights | None] | None = None
    cues: Sequence[tuple[float, str]] = ()

    @property
    def ok(self) -> bool:
        """Whether separation, room and limits hold of the files, and nothing else is in the way."""
        return self.apart and not self.exceeded

    @property
    def apart(self) -> bool:
        """Whether separation and room hold of the files, and everything of the plan."""
        inside = self.fence is None or self.fence.margin_of(self.held.fleet) >= -EXACT
        return inside and replace(self.held, utilisation=()).ok and self.planned.ok

    @property
    def exceeded(self) -> list[str]:
        """What the files use beyond the limits, by rounding and cubics, and what else is beyond: a sentence each."""
        files = [
            f"the files reach {used.use.name} {used.use.value:.4g} of {used.use.limit:.4g}: give a limit on the jerk, "
            "or plan within less"
            for used in self.held.utilisation
            if not used.kept
        ]
        return [*files, *self.beyond]


def write_report(report: SafetyReport, path: FileName, *, clobber: bool = True) -> None:
    """Write the page as HTML, or as PDF by the ending of its name, with its figures inside, in one atomic step."""
    held = report.held
    parts: list[Part] = [_verdict(report), _facts(report), Drawing(_figures(report)), *_fence(report)]
    parts += [_limits(report), _validation(held), _stages(report), *_lights(report), *_home(report)]
    parts += [_pairs(held), *_vehicles(report), _files(report.files), Signature()]
    write_parts(path, report.title, parts, clobber=clobber)


def _verdict(report: SafetyReport) -> Verdict:
    held = report.held
    words = "one vehicle"
    near = held.closest
    if near is not None:
        words = f"{held.fleet.names_of(near.pair)} come nearest: {near.distance:.4f} m at {near.instant:.2f} s"
    title = "Apart at every instant" if report.apart else "Does not hold"
    title += ", and beyond its limits" if report.apart and report.exceeded else ""
    good = None if report.apart and report.exceeded else report.ok
    return Verdict(good, title, f"{words}. Proved, not sampled.", report.exceeded)


def _facts(report: SafetyReport) -> Table:
    held, separation = report.held, report.held.separation
    points = np.concatenate([curve.control_points.reshape(-1, 3) for curve in held.fleet])
    rows = [("vehicles", str(len(held.fleet))), ("duration", f"{held.fleet.duration:.2f} s")]
    if separation is not None:
        apart = "radii of each vehicle" if separation.distance is None else f"{separation.distance:g} m"
        stands = "" if separation.ground is None else f"; {separation.ground:g} m while one of two stands on the ground"
        rows.append(("separation", f"{apart}, heights divided by {separation.downwash:g}{stands}"))
    rows.append(("files from the plan", f"{1e3 * report.distance:.2g} mm at most, included in every figure below"))
    step = largest_step(held.fleet)
    counted = f"{step:.2g} m/s at a knot, which counts as {step / STEP_TIME:.2g} m/s² on the acceleration there"
    rows.append(("steps of the velocity", counted if step > FAINT_STEP else "none"))
    for axis, name in enumerate(("x", "y", "altitude")):
        rows.append((name, f"within {_range(points[:, axis])} m"))
    rows += _walls(report)
    if report.origin is not None:
        rows.append(("origin", _place(report.origin)))
    return Table("What was checked", ["", ""], rows)


def _walls(report: SafetyReport) -> list[tuple[str, str]]:
    """Return how near all come to the sides and the ceiling of the room; on its floor they stand."""
    if report.room is None:
        return []
    ends = [extent_of(curve.control_points) for curve in report.held.fleet]
    low, high = (np.stack(each) for each in zip(*ends, strict=True))
    fleet, rows = report.held.fleet, []
    away = {
        "distance to the sides of the room": np.concatenate(
            (low[:, :2] - report.room[0][:2], report.room[1][:2] - high[:, :2]), axis=1
        ).min(axis=1),
        "distance to its ceiling": report.room[1][2] - high[:, 2],
        "distance to its floor, where they stand": low[:, 2] - report.room[0][2],
    }
    for name, distances in away.items():
        if np.isfinite(distances).any():
            vehicle = int(distances.argmin())
            rows.append((name, f"{round(float(distances[vehicle]), 3) + 0.0:.3f} m at least, {fleet.name(vehicle)}"))
    return rows


def _geodetic(origin: ShowOrigin, place: FloatArray) -> str:
    latitude, longitude, _ = origin.geodetic(place).tolist()
    return f"{latitude:.7f}, {longitude:.7f}"


def _range(values: FloatArray) -> str:
    """Say from where to where values reach; a trace below zero is no minus."""
    low, high = (round(float(value), 2) + 0.0 for value in (values.min(), values.max()))
    return f"{low:.2f} to {high:.2f}"


def _figures(report: SafetyReport) -> Figure:
    from minsnap.plot.shown_figure import ShownFigure

    held = report.held
    figure = ShownFigure(figsize=(9.5, 7.8), layout="constrained")
    above, aside, homes, apart = figure.subplots(2, 2).ravel()
    plot_fleet(held.fleet, ax=above)
    plot_fleet(held.fleet, "xz", ax=aside)
    plot_homes(held.fleet, ax=homes)
    if report.fence is not None:
        _draw_fence(above, report.fence)
    if held.pair is not None:
        plot_separation(held, ax=apart)
    else:
        apart.set_axis_off()
    return figure


@styled
def _draw_fence(axes: Axes, fence: Fence) -> None:
    """Draw walls seen from above with their numbers, and how far the margins let vehicles come."""
    whole, kept = (np.concatenate((corners, corners[:1])) for corners in (fence.corners, fence.inside))
    axes.plot(*whole.T, color="tab:red", linewidth=1.2, label="fence")
    if fence.margins.any():
        axes.plot(*kept.T, color="tab:red", linewidth=0.8, linestyle="--", label="margin")
    for wall, place in enumerate(0.5 * (whole[1:] + whole[:-1])):
        box = {"facecolor": "white", "edgecolor": "none", "pad": 0.8}
        axes.text(
            float(place[0]), float(place[1]), f"{wall}", ha="center", va="center", fontsize=7, color="tab:red", bbox=box
        )
    legend_above(axes)


def _lights(report: SafetyReport) -> list[Part]:
    """Return the lights of all vehicles, and each act as the audience sees it when it is reached."""
    if report.lights is None:
        return [Note("Lights: files of this kind hold none.")]
    held, last = report.held.fleet, report.held.fleet.duration
    parts: list[Part] = [Drawing(light_figure(report.lights, last, report.cues))]
    pictures = []
    for instant, name in at_once(report.cues, AT_ONCE):
        t = np.array(min(instant + SETTLED, last))
        colours = [np.zeros(3) if lamp is None else lamp(t) for lamp in report.lights]
        pictures.append(Picture(f"{name}, {instant:.1f} s", held(float(t)), np.stack(colours)))
    parts += [Drawing(draw_preview(pictures[i : i + PICTURES])) for i in range(0, len(pictures), PICTURES)]
    return [Note("Lights as the files hold them: of each vehicle, and as the audience sees the acts."), *parts]


def _place(origin: ShowOrigin) -> str:
    height = "" if origin.altitude is None else f", height 0 is {origin.altitude:g} m above sea"
    place = f"latitude {origin.latitude:.7f}°, longitude {origin.longitude:.7f}°"
    return f"{place}, x points to {origin.orientation:g}°{height}"


def _fence(report: SafetyReport) -> list[Part]:
    """Return the distance to each wall of the fence, and who comes nearest."""
    fence = report.fence
    if fence is None:
        return []
    distances, rows = fence.distances(report.held.fleet), []
    for wall, corner in enumerate(fence.corners):
        vehicle = int(distances[:, wall].argmin())
        ends = f"{point_text(corner)} to {point_text(fence.corners[(wall + 1) % len(fence.corners)])}"
        nearest, margin = float(distances[vehicle, wall]), float(fence.margins[wall])
        said = "kept" if nearest >= margin - EXACT else "not kept"
        rows.append((str(wall), ends, f"{margin:g}, {said}", f"{nearest:.3f}", report.held.fleet.name(vehicle)))
    return [Table("Fence", ["wall", "corners [m]", "margin [m]", "nearest [m]", "vehicle"], rows)]


def _limits(report: SafetyReport) -> Table:
    files = {used.use.name: used for used in report.held.utilisation}
    rows = []
    for used in report.planned.utilisation:
        name, held = used.use.name, files.get(used.use.name)
        reached = "of the plan alone" if held is None else f"{held.use.value:.4g}"
        who = report.held.fleet.name((held or used).vehicle)
        rows.append((name, f"{used.use.limit:.4g}", f"{used.use.value:.4g}", reached, who))
    return Table("Limits", ["limit", "bound", "plan", "files", "vehicle"], rows)


def _validation(held: FleetCertificate) -> Table:
    """Return the checks that Skybrush makes at samples: exact figures over all time beside its thresholds."""
    limits = Limits(**{name: 1.0 for name in VALIDATED})  # type: ignore[arg-type]
    certificate = certify_fleet(held.fleet, Separation(1.0), limits)
    figures = {used.use.name: used.use.value for used in certificate.utilisation}
    figures["altitude"] = max(float(extent_of(curve.control_points)[1][2]) for curve in held.fleet)
    rows = []
    for what, (unit, *bounds) in VALIDATION.items():
        value, least = figures.get(what, certificate.least_distance), what == "distance"
        if value is None:
            continue
        kept = [bound is None or (value >= bound if least else value <= bound) for bound in bounds]
        told = zip(bounds, kept, strict=True)
        cells = ["none" if bound is None else f"{bound:g}, {'kept' if good else 'warns'}" for bound, good in told]
        rows.append((f"{what.replace('_', ' ')} [{unit}]", f"{value:.4g}", *cells))
    return Table("Checks of Skybrush, exact", ["", "files", "Studio", "Viewer outdoors", "Viewer indoors"], rows)


def _stages(report: SafetyReport) -> Table:
    rows = []
    for stage in report.stages:
        name = f"{stage.group}: {stage.name}" if stage.group else stage.name
        longer = "" if stage.longer is None else f"{stage.longer:.1%}"
        rows.append((name, f"{stage.start:.2f}", f"{stage.arrival:.2f}", f"{stage.end:.2f}", longer))
    columns = [
        "act",
        "leaves [s]",
        "arrives [s]",
        "until [s]",
        "longer than any flight of the slowest vehicle, at most",
    ]
    return Table("Timeline", columns, rows)


def _home(report: SafetyReport) -> list[Part]:
    """Return what is proved of the ways home from each second, with a figure."""
    returns, failures = report.returns, report.failures
    if returns is None:
        return []
    names, least = report.held.fleet, returns.least
    rows = [("seconds with a proved return", f"{len(returns.plans)} of {len(returns.plans) + len(returns.unproved)}")]
    if returns.unproved:
        rows.append(("seconds without one", spans_text(returns.unproved)))
    rows.append(("from a call to the next one", f"{returns.longest_wait} s at most; all fly the show until then"))
    rows.append(("until all are above their homes", f"{max(plan.duration for plan in returns.plans)} s at most"))
    if least is not None and least.pair is not None:
        who = f"{names.names_of(least.pair)}, called at {least.second} s"
        rows.append(("least distance on the ways", f"{least.distance:.3f} m, {who}"))
    if failures is not None:
        count, clear = len(failures.distances), failures.clear
        rows.append(("any single vehicle may fail", f"in {failures.seconds_apart} of {count} seconds"))
        worst = int(clear.sum(axis=1).argmin())
        rows.append(("fewest that may fail", f"{int(clear[worst].sum())} of {len(names)} vehicles, at {worst} s"))
    note = (
        "All stand, then fly straight to above a home, proved apart, and land. How vehicles brake that move when "
        "they are called is taken as one smooth swing. One that fails comes straight down, falling freely or sinking "
        f"at {SINKS:g} m/s at least, while all others fly on: it may fail where the separation is proved."
    )
    return [Table("Home from every second", ["", ""], rows), Note(note), Drawing(return_figure(returns, failures))]


def _pairs(held: FleetCertificate) -> Table:
    rows = []
    for near in sorted(held.nearest[:PAIRS], key=lambda pair: pair.instant):
        place = point_text(held.middle_of(near).round(2) + 0.0)
        figures = (f"{near.instant:.2f}", place, f"{near.distance:.4f}", f"{near.required:.4g}")
        rows.append((held.fleet.names_of(near.pair), *figures))
    columns = ["vehicles", "at [s]", "between [m]", "distance [m]", "separation [m]"]
    return Table("Nearest pairs, by time", columns, rows)


def _vehicles(report: SafetyReport) -> list[Part]:
    held = report.held
    least: dict[int, float] = {}
    for near in held.nearest:
        for vehicle in near.pair:
            least[vehicle] = min(least.get(vehicle, np.inf), near.distance)
    energies = None if report.energy is None else report.energy.energies(held.fleet)
    rows = []
    for i, curve in enumerate(held.fleet):
        begins, ends = aloft(curve)
        flies = f"{ends - begins:.1f}" if ends > begins else "stays"
        speeds = (f"{curve.max_norm(1)[0]:.2f}", f"{curve.max_norm(2)[0]:.2f}")
        near_by = f"{least[i]:.3f}" if i in least else f"over {REACH:g} separations"
        takes = () if energies is None else (f"{energies[i]:.2f}",)
        home = () if report.origin is None else (_geodetic(report.origin, curve(0.0)),)
        rows.append((held.fleet.name(i), *home, flies, *takes, *speeds, _range(curve.control_points[..., 2]), near_by))
    takes = () if energies is None else ("energy [Wh]",)
    home = () if report.origin is None else ("home [°]",)
    columns = [
        "vehicle",
        *home,
        "flies [s]",
        *takes,
        "top speed [m/s]",
        "top acceleration [m/s²]",
        "altitude within [m]",
    ]
    return [Table("Vehicles", [*columns, "nearest other [m]"], rows), *_model(report)]


def _model(report: SafetyReport) -> list[Part]:
    """Return what the energies are made of."""
    model = report.energy
    if model is None:
        return []
    rotors = f"{model.rotors} rotors of radius {model.rotor_radius:g} m"
    text = (
        f"Energy: {model.mass:g} kg on {rotors} by momentum theory, at the thrust of each instant, with an efficiency "
        f"of {model.efficiency:g}: {model.hover:.1f} W in hover. Drag, wind and what level flight saves are left out."
    )
    if model.battery is not None:
        most = float(model.energies(report.held.fleet).max())
        text += (
            f" The most that a vehicle takes is {most:.2f} Wh, {most / model.battery:.0%} of its {model.battery:g} Wh."
        )
    return [Note(text)]


def _files(files: Sequence[Path]) -> Table:
    return Table("Files", ["file", "SHA-256"], [(file.name, digest_of(file)) for file in files], hashes=True)
