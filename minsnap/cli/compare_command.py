"""The command that compares flights with their reference."""

from __future__ import annotations

import sys
import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from minsnap.cli import options
from minsnap.cli.app import app

if TYPE_CHECKING:
    from minsnap.tracking.comparison import Comparison
    from minsnap.trajectory.samples import Samples


@app.command()
def compare(
    reference: Annotated[Path, typer.Argument(metavar="REFERENCE", help="Setpoint CSV, or a log to take it from.")],
    flights: Annotated[
        list[Path], typer.Argument(metavar="FLIGHT...", help="CSV, ULog (.ulg) or dataflash log (.bin).")
    ],
    align: Annotated[
        bool, typer.Option("--align", help="Find the offset between the clocks first, as logs need.")
    ] = False,
    max_delay: Annotated[float, typer.Option("--max-delay", metavar="S", help="Longest delay looked for [s].")] = 2.0,
    frame: Annotated[str, typer.Option("--frame", help="Axes of CSV files: enu, ned, flu, frd or optitrack.")] = "enu",
    plot: options.Plot = None,
    json: options.Json = False,
) -> None:
    """Compare flights with what they were to fly: error per axis, delay, error in shape apart from error in time."""
    from minsnap.tracking import comparison as tracking

    wanted, flown = _read(reference, flights, frame)
    found = {name: tracking.compare(wanted, flight, align=align, max_delay=max_delay) for name, flight in flown.items()}
    if plot is not None:
        from minsnap.plot.figures import save_figure
        from minsnap.tracking.tracking_plot import plot_tracking

        moved = {name: tracking.moved(flight, found[name].offset) for name, flight in flown.items()}
        save_figure(plot_tracking(wanted, moved), plot)
    _say(found, json)


def _read(reference: Path, flights: list[Path], frame: str) -> tuple[Samples, dict[str, Samples]]:
    """Read all files; what is damaged in a log is said on standard error."""
    from minsnap.files.flights import load_flight, load_reference

    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        wanted = load_reference(reference, frame)
        flown = {_name(path, flights): load_flight(path, frame) for path in flights}
    for warning in caught:
        print(f"minsnap: {warning.message}", file=sys.stderr)
    return wanted, flown


def _name(path: Path, flights: list[Path]) -> str:
    """Return a file's name, with its folder where two of them are named alike."""
    alike = [other for other in flights if other.name == path.name]
    return path.name if len(alike) == 1 else str(path)


def _say(found: dict[str, Comparison], json: bool) -> None:
    if json:
        from minsnap.cli.summary import as_json

        print(as_json({name: comparison.as_dict() for name, comparison in found.items()}))
    else:
        from minsnap.tracking.comparison_table import comparison_text

        print(comparison_text(found))
