"""Output of a command: setpoints, figure, and one set of figures as text or as JSON."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path as FilePath
from typing import TYPE_CHECKING, Annotated, Any, cast

import minsnap
from minsnap.basics.limit_kinds import KIND, KINDS
from minsnap.basics.messages import finite, labelled
from minsnap.basics.progress import rewritable
from minsnap.basics.storage.atomic import check_destination
from minsnap.cli import options
from minsnap.errors import FileError, InputError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from minsnap.corridors import Avoided
    from minsnap.files import Format, PassedStop
    from minsnap.trajectory import Sensitivity
    from minsnap.vehicle import Loop

_LINES = (
    ("duration", "duration", "{:.6g} s"),
    ("start", "start", "{}"),
    ("standing", "from standing", "{:.6g} s, from rest to rest"),
    ("nearness", "flight time", "{}"),
    ("legs", "legs", "{}"),
    ("cost", "cost", "{:.6g} {cost_unit}"),
    *((f"max_{kind.name}", f"max {kind.label}", f"{{:.4g}} {kind.unit}") for kind in KINDS[:3]),
    ("corridor_margin", "corridor margin", "{:.3g} m, at every instant"),
    ("obstacle_distance", "obstacle distance", "{}"),
    ("tube", "tracking error", "{:.3g} m at most, in a wind that changes by {wind:g} m/s"),
    ("strongest_wind", "strongest wind", "{:.3g} m/s of change, in which the vehicle keeps all that is asked"),
    ("altitude", "altitude", "{:g} m in files of setpoints: give --start X Y Z to choose it"),
    ("parts", "parts", "{}"),
    ("lines", "lines", "{}"),
    ("solver", "solver", "{}"),
    ("rounds", "rounds", "{}"),
    ("milliseconds", "planned in", "{:.1f} ms"),
    ("interrupted", "interrupted", "{} (the best plan until then)"),
    ("note", "note", "{}"),
    ("output", "written", "{}"),
    ("unwritten", "written", "{}"),
    ("beside", "beside it", "{}"),
    ("frame", "frame", "{}"),
    ("plot", "drawn", "{}"),
)

BINDING = 0.999
"""Share of a limit from which it binds."""

STANDING = 1e-6
"""Speed up to which a path begins at rest [m/s]."""

TOLD = 60
"""Legs up to which a summary tells how near a flight is to the shortest one: a second or so is not more than a plan."""

_LIMITS_AFTER = 9
"""Limits stand below the greatest speed, acceleration and jerk."""


def summarise(
    path: minsnap.Path,
    corridor: Any = None,
    waypoints: Any = None,
    limits: minsnap.Limits | None = None,
    avoid: Sequence[Avoided] = (),
    tracking: Loop | None = None,
    wind: float = 0.0,
) -> dict[str, Any]:
    """Return the figures of a path; figures that do not apply are None.

    Exact over all time; for a shape that is not a polynomial, those of polynomials within a micrometre of it.

    Parameters
    ----------
    path : Path
        A plan or a shape.
    corridor, waypoints, limits, avoid, tracking, wind
        What it was planned with.

    Returns
    -------
    dict
        duration [s], lower_bound [s], gap and nearness (see :class:`~minsnap.Report`), legs, cost [cost_unit],
        max_speed [m/s], max_acceleration [m/s^2], max_jerk [m/s^3],
        corridor_margin [m], solver, rounds, milliseconds, limits: for each, how far it is used, and where
        most; binding: those used up; tube [m], wind and strongest_wind [m/s] of a vehicle in its loop;
        obstacle_distance [m], obstacle: which one, obstacle_name, obstacle_instant [s], obstacle_place.
    """
    known: dict[str, Any] = dict.fromkeys(name for name, _, _ in _LINES[:-5])
    asked = {"waypoints": waypoints, "corridor": corridor, "limits": limits, "avoid": avoid}
    certificate = minsnap.certify(path, **asked, tracking=tracking, wind=wind)
    known |= {"tube": certificate.tube, "strongest_wind": certificate.wind, "wind": tracking and wind}
    known |= {name: getattr(certificate, name) for name in ("max_speed", "max_acceleration", "max_jerk")}
    known |= {"duration": path.duration, "cost_unit": None}
    known["corridor_margin"] = None if corridor is None else certificate.corridor_margin
    near = certificate.nearest_obstacle
    if near is not None:
        known |= nearest_place(path, near.value, near.instant, near.obstacle) | {"obstacle_name": near.name}
    known["limits"] = [asdict(used) for used in certificate.utilisation]
    known["binding"] = [used.name for used in certificate.utilisation if used.fraction >= BINDING]
    return known | (_of_plan(path) if isinstance(path, minsnap.Trajectory) else {})


def nearest_place(path: minsnap.Path, distance: float, instant: float | None, obstacle: int | None) -> dict[str, Any]:
    """Return how near a path comes to an obstacle [m], to which, when [s] and where [m]."""
    place = None if instant is None else path(min(instant, path.duration)).tolist()
    named = {"obstacle_instant": instant, "obstacle_place": place, "obstacle": obstacle}
    return {"obstacle_distance": distance} | named


def as_text(figures: Mapping[str, Any]) -> str:
    """Return the figures that are not None, one per line."""
    from minsnap.cli.kept import passage_text
    from minsnap.corridors import GatePassage
    from minsnap.trajectory import Utilisation

    limits = [Utilisation(**used).fact for used in figures["limits"]]
    if limits:
        limits.append(("limits that bind", ", ".join(KIND[name].label for name in figures["binding"]) or "none"))
    gates = [(f"gate {passed['gate']}", passage_text(GatePassage(**passed))) for passed in figures.get("gates") or ()]
    return labelled(_lines(figures, _LINES[:_LIMITS_AFTER]) + limits + gates + _lines(figures, _LINES[_LIMITS_AFTER:]))


def _lines(figures: Mapping[str, Any], wanted: tuple[tuple[str, str, str], ...]) -> list[tuple[str, str]]:
    """Return labels and texts of the figures that are not None."""
    return [(label, _line(figures, name, form)) for name, label, form in wanted if figures.get(name) is not None]


def _line(figures: Mapping[str, Any], name: str, form: str) -> str:
    if name == "parts":
        return ", ".join(f"{part['name']} {part['duration']:.4g} s" for part in figures[name])
    if name == "obstacle_distance":
        return _beside_obstacle(figures)
    return form.format(figures[name], **figures)


def _beside_obstacle(figures: Mapping[str, Any]) -> str:
    """Return how near to an obstacle a path comes, to which, when and where."""
    import numpy as np

    from minsnap.basics.checks import point_text

    which = f" from {figures['obstacle_name']}" if figures.get("obstacle_name") else ""
    text = f"{figures['obstacle_distance']:.4g} m{which}, at every instant"
    if figures.get("obstacle_instant") is None:
        return text
    place = point_text(np.round(figures["obstacle_place"], 2) + 0.0)
    return f"{text}, least at {figures['obstacle_instant']:.4g} s, at {place}"


def as_json(figures: Mapping[str, Any]) -> str:
    """Return the figures as one JSON object; those that are missing or not finite are null."""
    return json.dumps(finite(dict(figures)), indent=2, allow_nan=False)


def _of_plan(path: minsnap.Trajectory) -> dict[str, Any]:
    """Return the figures that a shape does not have."""
    from minsnap.trajectory import cost_unit

    speed = sum(float(part) ** 2 for part in path(0.0, 1)) ** 0.5
    start = f"flying, at {speed:.4g} m/s: a vehicle has to reach it first" if speed > STANDING else None
    figures: dict[str, Any] = {"legs": path.legs, "start": start, "cost": path.cost()}
    figures["cost_unit"], report = cost_unit(path.cost_order), path.report
    if report is None:
        return figures
    figures |= {name: getattr(report, name) for name in ("solver", "rounds", "milliseconds")}
    if path.legs <= TOLD:
        figures |= {name: getattr(report, name) for name in ("lower_bound", "gap", "nearness")}
    return figures | {"interrupted": "yes" if report.interrupted else None, "note": "; ".join(report.notes) or None}


STANDARD_OUTPUT = FilePath("-")


def on_terminal(quiet: bool) -> bool:
    """Whether progress is shown: on a terminal that can, unless it is to be quiet."""
    return rewritable(sys.stderr) and not quiet


@dataclass(frozen=True)
class Destination:
    """What to write, and how; the constructor checks that the files can be written.

    Parameters
    ----------
    output, plot : path or None
        File of the path, in the format of its ending ("-": setpoints to standard output), and figure.
    view, colour_by : str or None
        Of the figure, as :func:`minsnap.plot.plot_path` takes them.
    rate : float
        Setpoints a second [Hz].
    frame : str
        Axes of setpoints and tables.
    format : str or None
        Name of the output's format, where its ending does not tell.
    json : bool
        Print the summary as JSON.
    legs : bool
        Tell what the flight does leg by leg, and how its time depends on limits and gates.
    no_clobber : bool
        Refuse to replace files.
    force : bool
        Write a path that no vehicle flies, too.
    drag, vehicle, lead : float, str or None, float
        What to offset by feed-forward in setpoints (:class:`~minsnap.flight.mavlink.setpoints.FeedForward`).

    Raises
    ------
    FileError
        If a file must not be replaced, has an ending that is not known, or is a standard output that is closed.
    FrameError
        If the frame is unknown.
    TimingError
        If the rate is not positive.
    InputError
        If the view is unknown, no figure is drawn, or an option says how a file is written and there is none.
    """

    output: options.Output = None
    plot: options.Plot = None
    view: options.View = None
    colour_by: options.ColourBy = None
    rate: options.Rate = 20.0
    frame: Annotated[str, "Axes of the file: enu, ned, flu, frd or optitrack."] = "enu"
    json: options.Json = False
    legs: Annotated[bool, "Print a table of the legs, and what each limit and gate costs."] = False
    no_clobber: options.NoClobber = False
    force: options.Force = False
    format: options.Format = None
    drag: options.OffsetDrag = 0.0
    vehicle: options.OffsetVehicle = None
    lead: options.Lead = 0.0

    def __post_init__(self) -> None:
        from minsnap.files import get_frame
        from minsnap.trajectory import sample_times

        get_frame(self.frame)
        sample_times(1.0, self.rate)
        check_figure(self.plot, self.view, self.colour_by)
        named = ("format", "frame", "rate", "drag", "vehicle", "lead", "force")
        options.refuse_unwritten(self.output, **{n: getattr(self, n) != getattr(Destination, n) for n in named})
        files = [file for file in (self.output, self.plot) if file is not None and file != STANDARD_OUTPUT]
        if len({check_destination(file, clobber=not self.no_clobber) for file in files}) < len(files):
            raise FileError(f"{self.plot} is the file of -o and of --plot: choose another name for one of them")
        if self.output == STANDARD_OUTPUT and self.format not in (None, "setpoints"):
            raise FileError(f"standard output takes setpoints only: write {self.format} to a file")
        if self.output == STANDARD_OUTPUT and sys.__stdout__ is None:
            raise FileError("standard output is closed: give the name of a file to write")
        if self._other is not None:
            self._other.check_frame(self.frame)
            if self._other.holds != "samples" and self.rate != Destination.rate:
                raise InputError(f"{self.output} holds polynomials: --rate is of files of setpoints; leave it out")
        if not self._offsets:
            return
        options.feed_forward_of(self)
        if self._other is not None and self._other.holds != "samples":
            raise InputError("polynomials hold no feed-forward: write setpoints, such as -o FILE.csv")

    @property
    def search(self) -> dict[str, Any]:
        """How a search behaves: it shows its progress on a terminal, and Ctrl-C takes the best plan so far."""
        return {"on_interrupt": "return", "progress": on_terminal(self.json)}

    @property
    def _offsets(self) -> bool:
        return bool(self.drag) or self.vehicle is not None or bool(self.lead)

    @property
    def _other(self) -> Format | None:
        """The format of the file, if one is written and not as a CSV of setpoints, which needs no other one loaded."""
        if self.output is None or self.output == STANDARD_OUTPUT:
            return None
        if self.output.suffix.lower() == ".csv" and self.format in (None, "setpoints"):
            return None
        from minsnap.files import format_of

        return format_of(self.output, self.format)

    def check_mission(self, origin: Sequence[float] | None, within: float | None) -> None:
        """Raise InputError for a mission without an origin, or a distance of what is no mission."""
        options.check_mission(self._other, origin, within)

    def deliver(
        self,
        path: minsnap.Path,
        corridor: Any = None,
        waypoints: Any = None,
        limits: minsnap.Limits | None = None,
        further: Mapping[str, Any] | None = None,
        draw: Callable[..., Figure] | None = None,
        origin: Sequence[float] | None = None,
        avoid: Sequence[Avoided] = (),
        gates: Mapping[int, minsnap.Gate] | None = None,
        tolerance: Any = None,
        pins: Mapping[int, Mapping[str, Any]] | None = None,
        stops: Sequence[PassedStop] = (),
        note: str = "",
        sensitivities: Callable[[], Sequence[Sensitivity]] | None = None,
        tracking: Loop | None = None,
        wind: float = 0.0,
        within: float | None = None,
    ) -> None:
        """Write the requested files, then print the summary: on stderr when standard output carries the setpoints.

        ``further`` are figures for the summary beside those of the path; ``draw`` makes the figure to write, that of
        :func:`minsnap.plot.plot_overview` unless given; ``origin`` is what :func:`minsnap.write_csv` takes. How
        ``gates`` are passed is told, by their numbers. ``tolerance`` of the waypoints, ``pins`` and the ``stops`` of a
        course are for the file of a plan. ``note`` joins the others. ``sensitivities`` are those of the flight time,
        by default those of the plan's report. ``tracking`` and ``wind`` are for the summary. ``within`` is how far a
        mission's lines may be from the path [m].
        """
        self.check_mission(origin, within)
        figures = (
            summarise(path, corridor, waypoints, limits, avoid, tracking, wind)
            | _passed(path, gates)
            | dict(further or {})
        )
        known = {"waypoints": waypoints, "corridor": corridor, "limits": limits, "avoid": avoid, "tolerance": tolerance}
        notes = [figures["note"], note]
        if self.output is not None and not self.force:
            from minsnap.cli.implausible import refuse_implausible

            refuse_implausible(path, figures)
        if self.plot is not None:
            draw = draw or partial(minsnap.plot.plot_overview, path, **known)
            figure = draw(view=self.view or "xy", colour_by=self.colour_by)
            minsnap.plot.save_figure(figure, self.plot, clobber=not self.no_clobber)
        frame = beside = None
        if self.output is not None:
            facts = known | {"gates": gates, "pins": pins, "stops": stops, "command": ("minsnap", *sys.argv[1:])}
            lost, beside = self._write(path, facts, origin, within)
            notes.append(lost)
            frame = (self._other and self._other.frame) or self.frame.lower()
        figures["note"] = "; ".join(filter(None, notes)) or None
        named = {"output": self.output, "plot": self.plot}
        figures |= {name: None if file is None else str(file) for name, file in named.items()}
        figures |= {"frame": frame, "beside": beside}
        if self.output is None and not self.json:
            figures["unwritten"] = "nothing: give -o FILE, such as path.csv, .json or .traj"
        if self.legs:
            from minsnap.cli.leg_text import figures_of_legs, leg_text

            figures |= figures_of_legs(path, limits, sensitivities)
        text = as_json(figures) if self.json else as_text(figures)
        if self.legs and not self.json:
            text = f"{text}\n\n{leg_text(figures)}"
        print(text, file=sys.stderr if self.output == STANDARD_OUTPUT else sys.stdout)

    def _write(
        self, path: minsnap.Path, facts: dict[str, Any], origin: Sequence[float] | None, within: float | None
    ) -> list[str | None]:
        """Write the path; return a sentence on data that its format cannot hold, and the file written beside it."""
        from minsnap.files import csv_lines, in_space, noted_beside

        assert self.output is not None
        source: minsnap.Path | minsnap.Samples = path
        note = beside = None
        if self._offsets:
            samples, feed_forward = in_space(path.sample(self.rate)), options.feed_forward_of(self)
            source, note = feed_forward.stated(samples), feed_forward.describe(samples)
        if self.output == STANDARD_OUTPUT:
            sys.stdout.writelines(csv_lines(source, self.rate, self.frame))
            sys.stdout.flush()
        elif self._other is None:
            minsnap.write_csv(source, self.output, self.rate, self.frame, clobber=not self.no_clobber, origin=origin)
            beside = noted_beside(self.output)
        else:
            from minsnap.files import write_any

            how: dict[str, Any] = {"clobber": not self.no_clobber, "facts": facts}
            how |= {"origin": origin, "within": within}
            lost = write_any(source, self.output, self.format, self.rate, self.frame, **how)[1]
            note = "; ".join(filter(None, (note, lost)))
        return [note, beside]


def _passed(path: minsnap.Path, gates: Mapping[int, minsnap.Gate] | None) -> dict[str, Any]:
    """Return when, how fast and how far from its edges each gate is passed; nothing without gates."""
    if not gates:
        return {}
    from minsnap.corridors import gate_passages

    return {"gates": [asdict(passed) for passed in gate_passages(cast("minsnap.Trajectory", path), gates)]}


def check_figure(plot: FilePath | None, view: str | None, colour_by: str | None = None) -> None:
    """Check the name and the view of a figure before anything is computed.

    Raises
    ------
    FileError
        If the ending is not that of a figure.
    InputError
        If the view is unknown, or there is no figure to show it.
    """
    if colour_by is not None and (plot is None or colour_by != "speed"):
        raise InputError(f"--colour-by {colour_by}: give speed, with --plot FILE")
    if view is not None:
        from minsnap.plot.geometry import check_view

        check_view(view)
        if plot is None:
            raise InputError(f"--view {view} is of a figure: give --plot with it")
    if plot is not None:
        from minsnap.plot.figures import check_figure_name

        check_figure_name(plot)
