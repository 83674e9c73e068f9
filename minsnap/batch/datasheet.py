"""The datasheet of a dataset: what it is, how it was made, counts, ranges and figures."""

from __future__ import annotations

import json
from collections.abc import Sequence
from itertools import islice
from pathlib import Path
from typing import Any

from minsnap.basics.storage.atomic import atomic_write, make_folder, write_file
from minsnap.batch.columns import BINS, UNITS, Tally, planned_curves
from minsnap.batch.folder import DATASHEET, Shard, made_with, shard_name
from minsnap.batch.spec import Spec
from minsnap.plot.style import Axes
from minsnap.trajectory import Trajectory

DRAWN = ("duration", "cost", "max_speed", "max_acceleration")
"""Columns whose histograms are drawn."""

EXAMPLES = 9
"""Trajectories that are drawn."""


def write_datasheet(folder: Path, spec: Spec, tally: Tally, shards: Sequence[Shard]) -> None:
    """Write ``_datasheet/README.md`` and its figures.

    Parameters
    ----------
    folder : Path
    spec : Spec
    tally : Tally
        Of all rows.
    shards : sequence of Shard
    """
    sheet = make_folder(folder / DATASHEET)
    _draw_histograms(sheet / "histograms.png", tally)
    _draw_examples(sheet / "examples.png", folder / shard_name(0))
    write_file(sheet / "README.md", datasheet(spec, tally, shards))


def datasheet(spec: Spec, tally: Tally, shards: Sequence[Shard]) -> str:
    """Return the text of the datasheet, in Markdown."""
    statuses = "\n".join(f"| {name} | {count} |" for name, count in sorted(tally.statuses.items()))
    rows = [(name, *tally.ranges[name], unit) for name, unit in UNITS.items() if name in tally.ranges]
    ranges = "\n".join(f"| {name} | {low:.6g} | {high:.6g} | {unit} |" for name, low, high, unit in rows)
    facts: dict[str, Any] = {"count": spec.count, "done": tally.statuses.get("done", 0), "certified": tally.certified}
    facts |= {"files": len(shards), "megabytes": sum(shard.size for shard in shards) / 1e6}
    words = made_with() | {"name": spec.name(), "spec": json.dumps(spec.identity(), indent=1)}
    text = Path(__file__).with_name("datasheet.md.txt").read_text(encoding="utf-8")
    return text.format(**facts, **words, statuses=statuses, ranges=ranges)


def _draw_histograms(path: Path, tally: Tally) -> None:
    import numpy as np
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 6.0))
    figure.subplots_adjust(0.08, 0.09, 0.98, 0.97, 0.2, 0.3)
    for ax, name in zip(figure.subplots(2, 2).flat, DRAWN, strict=True):
        low, counts = tally.histogram(name)
        ax.bar(np.log10(low), counts, width=1.0 / BINS, align="edge", color="#0072b2")
        decades = np.arange(np.floor(np.log10(low[0])), np.ceil(np.log10(low[-1])) + 1.0) if len(low) else np.zeros(0)
        decades = decades[:: 1 + len(decades) // 8]
        ax.set_xticks(decades, [f"{10.0**decade:g}" for decade in decades])
        ax.set(xlabel=f"{name} [{UNITS[name]}]", ylabel="problems")
    _save(figure, path)


def _draw_examples(path: Path, shard: Path) -> None:
    """Draw the first trajectories from above, each to its own scale."""
    from matplotlib.figure import Figure

    planned = (curve for curve in planned_curves(shard) if curve.dim > 1)
    figure = Figure(figsize=(9.0, 9.0))
    ax = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    ax.set(xlim=(0.0, 3.0), ylim=(0.0, 3.0))
    ax.set_axis_off()
    for place, curve in enumerate(islice(planned, EXAMPLES)):
        _draw_path(ax, curve, (place % 3 + 0.5, 2.5 - place // 3))
    _save(figure, path)


def _draw_path(ax: Axes, curve: Trajectory, center: tuple[float, float]) -> None:
    """Draw x and y of a curve and its knots, 0.9 wide, around a place."""
    import numpy as np

    positions, knots = (curve(t)[:, :2] for t in (np.linspace(0.0, curve.duration, 300), curve.leg_breaks))
    low, high = positions.min(axis=0), positions.max(axis=0)
    for points, style in ((positions, "-"), (knots, "o")):
        shown = (points - (low + high) / 2.0) * (0.9 / max((high - low).max(), 1e-9)) + center
        ax.plot(shown[:, 0], shown[:, 1], style, color="#8a1c3b", markersize=3.0)


def _save(figure: Any, path: Path) -> None:
    with atomic_write(path, "wb") as file:
        figure.savefig(file, format="png", dpi=100, metadata={"Software": None})
