"""The command that fits a vehicle's coefficients to measurements."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from minsnap.cli import options
from minsnap.cli.app import app

if TYPE_CHECKING:
    from minsnap.thesis.fit_table import TableFit


@app.command()
def fit(
    table: Annotated[Path, typer.Argument(metavar="TABLE", help="CSV with a header; see --form for its columns.")],
    form: Annotated[
        str,
        typer.Option(
            "--form",
            help="thrust, torque (columns speed_rpm and thrust [N] or torque [N m]); parasitic, reduced, linear, "
            "propeller, consistent (columns pitch_deg, velocity [m/s], speed_rpm as the form needs, and drag [N]).",
        ),
    ],
    plot: options.Plot = None,
    json: options.Json = False,
) -> None:
    """Fit rotor coefficients or a drag surface to measurements, with their uncertainty."""
    from minsnap.thesis.fit_table import fit_table, plot_table_fit

    found = fit_table(table, form)
    if plot is not None:
        from minsnap.plot.figures import save_figure

        save_figure(plot_table_fit(found).figure, plot)
    _say(found, json)


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
