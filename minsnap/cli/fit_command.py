"""The command that fits a vehicle's coefficients to measurements or to the log of a flight."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from minsnap.cli import options
from minsnap.cli.command import command
from minsnap.cli.summary import as_json
from minsnap.errors import InputError


@command()
def fit(
    file: Annotated[Path, "FILE", "Log of a flight (.ulg, .bin, of stream --log), or a CSV with --form."],
    *,
    form: Annotated[
        str | None,
        "For a CSV with a header: thrust, torque (columns speed_rpm and thrust [N] or torque [N m]); "
        "parasitic, reduced, linear, propeller, consistent (columns pitch_deg, velocity [m/s], speed_rpm as the "
        "form needs, and drag [N]).",
    ] = None,
    output: Annotated[Path | None, "--output", "-o", "FILE", "Vehicle YAML with the drag of a flight."] = None,
    base: Annotated[Path | None, "FILE", "Vehicle YAML with all else; by default PX4's simulated quadrotor."] = None,
    mass: Annotated[float | None, "KG", "By default the base's."] = None,
    lead: options.FlownLead = None,
    plot: options.Plot = None,
    json: options.Json = False,
) -> None:
    """Fit drag, wind, hover throttle and delay to a flight; or rotor coefficients or a drag surface to a table.

    With standard errors. Drag is per mass; -o writes a vehicle with it, which stream, plan and the shapes take as
    --vehicle.
    """
    if form is not None:
        if output is not None or base is not None or mass is not None:
            raise InputError("--output, --base and --mass are for logs of flights: leave them out with --form")
        _fit_table(file, form, plot, json)
        return
    from minsnap.basics.storage.atomic import refuse_source
    from minsnap.flight.tracking.flight_fit import default_name, fit_flight
    from minsnap.vehicle import read_vehicle

    refuse_source(output, file)
    refuse_source(plot, file, base)
    flight_fit = fit_flight(file, lead)
    if plot is not None:
        from minsnap.flight.tracking.tracking_plot import plot_flight_fit
        from minsnap.plot.figures import save_figure

        save_figure(plot_flight_fit(flight_fit), plot)
    if output is not None:
        flight_fit.vehicle(None if base is None else read_vehicle(base), mass, default_name(file)).to_yaml(output)
    print(as_json(flight_fit.as_dict()) if json else flight_fit)


def _fit_table(file: Path, form: str, plot: Path | None, json: bool) -> None:
    from minsnap.flight.thesis.drag_fits import fit_table, plot_table_fit

    table_fit = fit_table(file, form)
    if plot is not None:
        from minsnap.plot.figures import save_figure

        save_figure(plot_table_fit(table_fit).figure, plot)
    print(as_json(table_fit.as_dict()) if json else table_fit)
