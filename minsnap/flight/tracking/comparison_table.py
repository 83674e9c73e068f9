"""Comparisons as a text table."""

from __future__ import annotations

from collections.abc import Mapping

from minsnap.basics.storage.text_columns import aligned
from minsnap.flight.tracking.comparison import Comparison


def comparison_text(found: Mapping[str, Comparison]) -> str:
    """Return one row per flight: errors per axis and in 3-D, greatest error, delay, errors in shape and in time."""
    count = max(comparison.error.shape[1] for comparison in found.values())
    axes = list("xyz"[:count]) if count <= 3 else [str(axis) for axis in range(count)]
    head = ["along", "across", "greatest", "at [s]", "delay [s]", "less delay", "from the curve", "in time"]
    rows = [["flight", *axes, "3-D", *head]]
    for name, one in found.items():
        path = [one.along_rmse, one.across_rmse, one.max_error, one.worst_instant]
        figures = [*one.rmse, one.rmse_3d, *path, one.delay, one.late_rmse_3d, one.path_rmse, one.time_rmse]
        rows.append([name, *(f"{value:.4f}" for value in figures)])
    return "\n".join(["Root mean squared error [m]", aligned(rows)])
