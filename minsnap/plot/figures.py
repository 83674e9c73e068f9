"""Complete figures: the path with its profiles; atomic saving of a figure."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path as FilePath
from typing import TYPE_CHECKING, Any

import numpy as np

from minsnap.basics.storage.atomic import atomic_write
from minsnap.corridors.keep_out import Obstacle
from minsnap.errors import FileError, InputError
from minsnap.limits.limits import Limits, VehicleLimits
from minsnap.plot.geometry import VIEWS, check_view, plot_path
from minsnap.plot.limit_use import plot_utilisation, utilisation_curves
from minsnap.plot.outlines import Corridor
from minsnap.plot.profiles import available_orders, heading_rows, plot_heading, plot_profiles
from minsnap.plot.race import plot_rotors
from minsnap.plot.style import dense_samples, styled
from minsnap.plot.waypoint_marks import Waypoints
from minsnap.trajectory.path import Path
from minsnap.trajectory.samples import Samples

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FORMATS: dict[str, dict[str, None]] = {".png": {}, ".svg": {"Date": None}, ".pdf": {"CreationDate": None}}
"""Endings of figures, with the metadata left out so that equal figures are equal files."""


DPI = 200
"""Pixels an inch of a PNG: two for each of a screen's, which shows 100 of them."""

PROFILES = 6.4
"""Width of the curves against time [in]."""


@styled
def plot_overview(
    path: Path | Samples,
    figure: Figure | None = None,
    *,
    view: str = "xy",
    corridor: Corridor | None = None,
    waypoints: Waypoints | None = None,
    tolerance: Any = None,
    avoid: Sequence[Obstacle] = (),
    limits: Any = None,
    colour_by: str | None = None,
    title: str | None = None,
) -> Figure:
    """Draw a path, and its position, derivatives, heading and use of limits against time.

    From above, a path that climbs is drawn from the side as well. The heading is left out where it is zero throughout.

    Parameters
    ----------
    path : Path or Samples
        dim 2 or 3.
    figure : matplotlib Figure, optional
        Where to draw; a new one, that no window shows, unless given.
    view, corridor, waypoints, tolerance, avoid, colour_by
        As :func:`plot_path` takes them.
    limits
        As :func:`plot_profiles` takes them.
    title : str, optional
        Written above.

    Returns
    -------
    matplotlib Figure
    """
    check_view(view)
    samples = dense_samples(path)
    rows = _rows(samples, limits) + (["rotors"] if _has_rotors(path, limits) else [])
    side = view == "xy" and _climbs(samples)
    drawn = _figure(samples, view, side, len(rows)) if figure is None else figure
    left, right = np.asarray(drawn.subfigures(1, 2, width_ratios=(drawn.get_figwidth() - PROFILES, PROFILES)))
    how: dict[str, Any] = {"corridor": corridor, "waypoints": waypoints, "tolerance": tolerance}
    how |= {"avoid": avoid, "colour_by": colour_by}
    _draw_place(left, path, view, side, how)
    stack = right.subplots(len(rows), 1, sharex=True, squeeze=False)[:, 0]
    _draw_against_time(stack, rows, path, limits)
    right.align_ylabels(stack)
    if title:
        drawn.suptitle(title)
    return drawn


def _rows(samples: Samples, limits: Any) -> list[Any]:
    """Return what is drawn against time: orders of derivatives, then names of what else is known."""
    known = heading_rows(samples)
    heading = [name for name, _, _ in known] if any(np.any(values) for _, _, values in known) else []
    return [*available_orders(samples), *heading, *(["limits"] if _can_show(limits, samples) else [])]


def _has_rotors(path: Path | Samples, limits: Any) -> bool:
    """Whether the limits are those of a vehicle's rotors, whose thrusts are drawn too."""
    return isinstance(limits, VehicleLimits) and isinstance(path, Path)


def _can_show(limits: Any, samples: Samples) -> bool:
    """Whether the samples have what the limits bound."""
    if not isinstance(limits, Limits) or not limits.given():
        return False
    try:
        utilisation_curves(samples, limits)
    except InputError:
        return False
    return True


def _climbs(samples: Samples) -> bool:
    """Whether a path in space changes its altitude by more than a hundredth of its extent."""
    return samples.dim == 3 and bool(np.ptp(samples.position[:, 2]) > 0.01 * np.ptp(samples.position, axis=0).max())


def _figure(samples: Samples, view: str, side: bool, rows: int) -> Figure:
    """Return a new figure whose left part has about the shape of what is drawn there."""
    from minsnap.plot.shown_figure import ShownFigure

    high = max(5.0, 1.25 * rows)
    spans = np.ptp(samples.position, axis=0)
    across, up = (spans[list(VIEWS[view])][:2]) if view != "3d" else (1.2, 1.0)
    up = up + spans[2] if side else up
    most = 9.0 if view == "3d" else 12.0
    wide = float(np.clip((high - 1.0) * across / max(up, 1e-9 * across, 1e-300) + 1.8, 5.0, most))
    return ShownFigure(figsize=(wide + PROFILES, high), layout="constrained")


def _draw_place(panel: Any, path: Path | Samples, view: str, side: bool, how: dict[str, Any]) -> None:
    """Draw the path in its view and, where it climbs, from the side below that, on the same scale."""
    if not side:
        plot_path(path, panel.add_subplot(projection="3d" if view == "3d" else None), view=view, **how)
        return
    above, below = panel.subplots(2, 1, sharex=True)
    plot_path(path, above, view="xy", **how)
    plot_path(path, below, view="xz", **how)
    below.get_legend().remove()
    above.set_xlabel("")
    above.get_gridspec().set_height_ratios([float(np.ptp(ax.get_ylim())) for ax in (above, below)])


def _draw_against_time(stack: Any, rows: list[Any], path: Path | Samples, limits: Any) -> None:
    orders = [row for row in rows if isinstance(row, int)]
    plot_profiles(path, stack[: len(orders)], orders=orders, limits=limits)
    turning = len([row for row in rows if row in ("yaw", "yaw rate")])
    if turning:
        plot_heading(path, stack[len(orders) : len(orders) + turning])
    if "limits" in rows:
        plot_utilisation(path, limits, stack[rows.index("limits")])
    if "rotors" in rows and isinstance(path, Path):
        plot_rotors(path, limits.vehicle, stack[-1])
    for ax in stack[:-1]:
        ax.set_xlabel("")


def save_figure(figure: Figure, path: str | os.PathLike[str], *, clobber: bool = True) -> None:
    """Write a figure as PNG, SVG or PDF, by the ending of its name, in one atomic step.

    Raises
    ------
    FileError
        If the ending is another, or the destination cannot be written.
    """
    suffix = check_figure_name(path)
    with atomic_write(path, "wb", clobber=clobber) as file:
        figure.savefig(file, format=suffix[1:], dpi=DPI, metadata=FORMATS[suffix])


def check_figure_name(path: str | os.PathLike[str]) -> str:
    """Return the ending of a figure's name in lower case, or raise FileError if it is not supported."""
    suffix = FilePath(path).suffix.lower()
    if suffix not in FORMATS:
        raise FileError(f"{path} does not end in {', '.join(FORMATS)}: a figure is written as one of these")
    return suffix
