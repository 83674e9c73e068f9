"""Complete figures: the path with its profiles; atomic saving of a figure; printable pages with tables and figures."""

from __future__ import annotations

import io
from collections.abc import Sequence
from html import escape
from math import ceil
from pathlib import Path as FilePath
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.storage.atomic import atomic_write, write_file
from minsnap.basics.storage.text import FileName
from minsnap.corridors import Avoided
from minsnap.errors import FileError, InputError
from minsnap.limits import Limits, VehicleLimits, utilisation_curves
from minsnap.plot import profiles
from minsnap.plot.geometry import FLATTEST, Corridor, Waypoints, check_view, plot_path, view_coordinates
from minsnap.plot.obstacles import drawn_places
from minsnap.plot.style import Figure, dense_samples, styled
from minsnap.trajectory import Path, Samples

FORMATS: dict[str, dict[str, None]] = {".png": {}, ".svg": {"Date": None}, ".pdf": {"CreationDate": None}}
"""Endings of figures, with the metadata left out so that equal figures are equal files."""


DPI = 200
"""Pixels an inch of a PNG: two for each of a screen's, which shows 100 of them."""

PROFILES, ROW, BESIDE = 6.4, 1.25, 2.3
"""Width of the curves against time, height of one, and what names and scales take beside the places [in]."""

FLAT = 0.45
"""Height of the places, for their width, below which the curves against time stand below them in two columns."""


@styled
def plot_overview(
    path: Path | Samples,
    figure: Figure | None = None,
    *,
    view: str = "xy",
    corridor: Corridor | None = None,
    waypoints: Waypoints | None = None,
    tolerance: Any = None,
    avoid: Sequence[Avoided] = (),
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
        Where to draw; by default a new one, that no window shows.
    view, corridor, waypoints, tolerance, avoid, colour_by
        As :func:`plot_path` takes them.
    limits
        As :func:`plot_profiles` takes them.
    title : str, optional
        Written above.
    """
    check_view(view)
    samples = dense_samples(path)
    rotors = isinstance(limits, VehicleLimits) and isinstance(path, Path)
    rows = _rows(samples, limits) + (["rotors"] if rotors else [])
    side = view == "xy" and _climbs(samples)
    shape = _shape(samples, view, side, avoid)
    drawn, (place, beside), columns = _panels(figure, shape, view, len(rows))
    how: dict[str, Any] = {"corridor": corridor, "waypoints": waypoints, "tolerance": tolerance}
    how |= {"avoid": avoid, "colour_by": colour_by}
    _draw_place(place, path, view, side, how)
    _draw_against_time(_columns(beside, len(rows), columns), rows, path, limits)
    if title:
        drawn.suptitle(title)
    return drawn


def _rows(samples: Samples, limits: Any) -> list[Any]:
    """Return the rows against time: orders of derivatives, then names of other known quantities."""
    known = profiles.heading_rows(samples)
    heading = [name for name, _, _ in known] if any(np.any(values) for _, _, values in known) else []
    return [*profiles.available_orders(samples), *heading, *(["limits"] if _can_show(limits, samples) else [])]


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


def _shape(samples: Samples, view: str, side: bool, avoid: Sequence[Avoided]) -> float:
    """Return how high what is drawn of the places is, for its width."""
    if view == "3d":
        return 1.0 / 1.2
    chosen = view_coordinates(view, samples.dim)
    across, up = _spans(samples, chosen, avoid)
    across = max(across, FLATTEST * up)
    if across == 0.0:
        return 1.0
    heights = (up, _spans(samples, [0, 2], avoid)[1]) if side else (up,)
    return float(sum(max(height, FLATTEST * across) for height in heights) / across)


def _spans(samples: Samples, chosen: list[int], avoid: Sequence[Avoided]) -> FloatArray:
    """Return the extents of a path with the obstacles near it, shape (2,) [m]."""
    return np.asarray(np.ptp(drawn_places(samples.position[:, chosen], avoid, chosen), axis=0))


def _panels(figure: Figure | None, shape: float, view: str, rows: int) -> tuple[Figure, Any, int]:
    """Return a figure, a new one in the shape of the places, its panels of places and of curves, and their columns.

    The curves against time stand beside the places in one column, or below flat ones in two.
    """
    from minsnap.plot.shown_figure import ShownFigure

    high, below = max(5.0, ROW * rows), shape < FLAT
    heights = ((2.0 * PROFILES - BESIDE) * shape + 1.0, ROW * ceil(rows / 2))
    wide = float(np.clip((high - 1.0) / shape + BESIDE, 5.0, 9.0 if view == "3d" else 12.0))
    size = (2.0 * PROFILES, sum(heights)) if below else (wide + PROFILES, high)
    drawn = ShownFigure(figsize=size, layout="constrained") if figure is None else figure
    if below:
        return drawn, drawn.subfigures(2, 1, height_ratios=heights), 2
    return drawn, drawn.subfigures(1, 2, width_ratios=(drawn.get_figwidth() - PROFILES, PROFILES)), 1


def _columns(panel: Any, rows: int, count: int) -> list[Any]:
    """Return columns of axes for rows of curves against time, from above, the first column first."""
    each = -(-rows // count)
    lengths = [min(each, rows - first) for first in range(0, rows, each)]
    grid = panel.add_gridspec(1, len(lengths))
    places = zip(grid, lengths, strict=True)
    return [place.subgridspec(length, 1).subplots(sharex=True, squeeze=False)[:, 0] for place, length in places]


def _draw_place(panel: Any, path: Path | Samples, view: str, side: bool, how: dict[str, Any]) -> None:
    """Draw the path in its view and, where it climbs, from the side below that, on the same scale."""
    if not side:
        plot_path(path, panel.add_subplot(projection="3d" if view == "3d" else None), view=view, **how)
        return
    above, below = panel.subplots(2, 1, sharex=True)
    plot_path(path, above, view="xy", **how)
    plot_path(path, below, view="xz", **how)
    below.get_legend().remove()
    for scale in below.child_axes:
        scale.remove()
    above.set_xlabel("")
    above.get_gridspec().set_height_ratios([float(np.ptp(ax.get_ylim())) for ax in (above, below)])


def _draw_against_time(columns: list[Any], rows: list[Any], path: Path | Samples, limits: Any) -> None:
    stack = np.concatenate(columns)
    orders = [row for row in rows if isinstance(row, int)]
    profiles.plot_profiles(path, stack[: len(orders)], orders=orders, limits=limits)
    turning = len([row for row in rows if row in ("yaw", "yaw rate")])
    if turning:
        profiles.plot_heading(path, stack[len(orders) : len(orders) + turning])
    if "limits" in rows:
        profiles.plot_utilisation(path, limits, stack[rows.index("limits")])
    if "rotors" in rows and isinstance(path, Path):
        profiles.plot_rotors(path, limits.vehicle, stack[-1])
    for column in columns:
        for ax in column:
            ax.set_xlabel("")
        column[-1].set_xlabel("time [s]")
        column[0].figure.align_ylabels(column)


def save_figure(figure: Figure, path: FileName, *, clobber: bool = True) -> None:
    """Write a figure as PNG, SVG or PDF, by the ending of its name, in one atomic step.

    Raises
    ------
    FileError
        If the ending is another, or the destination cannot be written.
    """
    suffix, stream = check_figure_name(path), io.BytesIO()  # a full disk is to be no fault of matplotlib
    _lay_out(figure)
    figure.savefig(stream, format=suffix[1:], dpi=DPI, metadata=FORMATS[suffix])
    write_file(path, stream.getvalue(), clobber=clobber)


def _lay_out(figure: Figure) -> None:
    """Lay a figure out once before it is drawn.

    The layout leaves room beside axes of equal scales for what stands there as wide as they are before it: the second
    one knows how wide they become.
    """
    if figure.get_layout_engine() is not None:
        figure.draw_without_rendering()


def check_figure_name(path: FileName) -> str:
    """Return the ending of a figure's name in lower case, or raise FileError if it is not supported."""
    suffix = FilePath(path).suffix.lower()
    if suffix not in FORMATS:
        raise FileError(f"{path} does not end in {', '.join(FORMATS)}: a figure is written as one of these")
    return suffix


def write_page(path: FileName, title: str, parts: Sequence[str], *, clobber: bool = True) -> None:
    """Write a page of HTML parts under a title, in one atomic step."""
    head = f'<!doctype html><html lang="en"><meta charset="utf-8"><title>{escape(title)}</title>'
    with atomic_write(path, clobber=clobber, errors="replace") as file:  # names of files may be no text
        style = FilePath(__file__).with_name("page.css").read_text(encoding="utf-8")
        file.write(f"{head}<style>\n{style}</style><h1>{escape(title)}</h1>{''.join(parts)}</html>\n")


def verdict(good: bool | None, html: str) -> str:
    """Return the paragraph that says whether all is well, or that something is beyond its limit (None)."""
    return f'<p class="{"exceeds" if good is None else "holds" if good else "fails"}">{html}</p>'


def table(title: str, columns: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a table of texts under a heading; nothing without rows."""
    if not rows:
        return ""
    head = "".join(f"<th>{escape(name)}</th>" for name in columns) if any(columns) else ""
    body = "".join("<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>" for row in rows)
    return f"<h2>{escape(title)}</h2><table>{f'<thead><tr>{head}</tr></thead>' if head else ''}{body}</table>"


def picture(figure: Figure) -> str:
    """Return a figure as SVG."""
    stream = io.StringIO()
    _lay_out(figure)
    figure.savefig(stream, format="svg")
    drawn = stream.getvalue()
    return drawn[drawn.index("<svg") :]
