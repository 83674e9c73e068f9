"""The command that fits a vehicle's coefficients to measurements or to the log of a flight."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from minsnap.cli import options
from minsnap.cli.app import app
from minsnap.errors import InputError

if TYPE_CHECKING:
    from minsnap.flight.thesis.fit_table import TableFit
    from minsnap.flight.tracking.flight_fit import FlightFit
    from minsnap.flight.tracking.regression import FittedNumber


@app.command()
def fit(
    file: Annotated[
        Path,
        typer.Argument(metavar="FILE", help="Log of a flight (.ulg, .bin, of stream --log), or a CSV with --form."),
    ],
    form: Annotated[
        str | None,
        typer.Option(
            "--form",
            help="For a CSV with a header: thrust, torque (columns speed_rpm and thrust [N] or torque [N m]); "
            "parasitic, reduced, linear, propeller, consistent (columns pitch_deg, velocity [m/s], speed_rpm as the "
            "form needs, and drag [N]).",
        ),
    ] = None,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", metavar="FILE", help="Vehicle YAML with the drag of a flight.")
    ] = None,
    base: Annotated[
        Path | None,
        typer.Option(
            "--base", metavar="FILE", help="Vehicle YAML with all else; PX4's simulated quadrotor unless given."
        ),
    ] = None,
    mass: Annotated[float | None, typer.Option("--mass", metavar="KG", help="The base's unless given.")] = None,
    lead: options.FlownLead = None,
    plot: options.Plot = None,
    json: options.Json = False,
) -> None:
    """Fit drag, wind, hover throttle and delay to a flight; or rotor coefficients or a drag surface to a table.

    With standard errors. Drag is per mass; -o writes a vehicle with it, which stream, plan and the shapes take as
    --vehicle.
    """
    if form is None:
        _fit_flight(file, output, base, mass, lead, plot, json)
        return
    if output is not None or base is not None or mass is not None:
        raise InputError("--output, --base and --mass are for logs of flights: leave them out with --form")
    from minsnap.flight.thesis.fit_table import fit_table, plot_table_fit

    found = fit_table(file, form)
    if plot is not None:
        from minsnap.plot.figures import save_figure

        save_figure(plot_table_fit(found).figure, plot)
    _say(found, json)


def _fit_flight(
    file: Path,
    output: Path | None,
    base: Path | None,
    mass: float | None,
    lead: float | None,
    plot: Path | None,
    json: bool,
) -> None:
    from minsnap.flight.tracking.flight_fit import default_name, fit_flight
    from minsnap.vehicle import read_vehicle

    found = fit_flight(file, lead)
    if plot is not None:
        from minsnap.flight.tracking.flight_fit_plot import plot_flight_fit
        from minsnap.plot.figures import save_figure

        save_figure(plot_flight_fit(found), plot)
    if output is not None:
        found.vehicle(None if base is None else read_vehicle(base), mass, default_name(file)).to_yaml(output)
    _say_flight(found, json)


def _say_flight(found: FlightFit, json: bool) -> None:
    if json:
        from minsnap.cli.summary import as_json

        print(as_json(found.as_dict()))
        return
    print(f"fitted to {found.source}")
    for name, axis in zip("xyz", found.axes, strict=True):
        print(f"  drag along {name:<12}{_number(axis.linear, '1/s')}, quadratic {_number(axis.quadratic, '1/m')}")
    if found.wind is not None:
        print(f"  wind {_number(found.wind[0], 'm/s')} along x, {_number(found.wind[1], 'm/s')} along y")
    print(f"  hover throttle        {_number(found.hover, '')}")
    print(f"  delay of the position {_number(found.delay, 's')} after its setpoint{_offset(found)}")
    for note in found.notes:
        print(f"note: {note}")


def _offset(found: FlightFit) -> str:
    """Say how much of the delay the lead of the flight offset, and which lead offsets all of it."""
    if found.delay is None or not found.lead:
        return ""
    left, whole = found.delay.value - found.lead, found.delay.value
    return f", of which its lead offset {found.lead:g} s: {left:.3f} s are left, and --lead {whole:.2f} offsets all"


def _number(number: FittedNumber | None, unit: str) -> str:
    return "not told" if number is None else f"{number.value:.4g} ± {number.error:.2g} {unit}".rstrip()


def _say(found: TableFit, json: bool) -> None:
    if json:
        from minsnap.cli.summary import as_json

        print(as_json(found.as_dict()))
        return
    figures: dict[str, Any] = found.as_dict()
    print(
        f"{figures['form']}: {figures['points']} points, R² = {figures['r_squared']:.4f}, residual {figures['rms']:.3g}"
    )
    for term in figures["terms"]:
        error = "" if term["standard_error"] is None else f" ± {term['standard_error']:.2g}"
        print(f"  {term['name']:<28}{term['value']: .6g}{error}")
    for name, (low, high) in figures["measured"].items():
        print(f"  measured for {name} from {low:g} to {high:g}")
