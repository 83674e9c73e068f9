"""The figure of ways home: how near they come and how long they take, by the second of the call; and who may fail."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from minsnap.plot.shown_figure import ShownFigure
from minsnap.shows.failures import Failures
from minsnap.shows.returns import Returns


def return_figure(returns: Returns, failures: Failures | None) -> ShownFigure:
    """Draw least distance and duration of each return, and how many vehicles may fail, against the second."""
    figure = ShownFigure(figsize=(9.5, 4.6 if failures is not None else 3.2), layout="constrained")
    rows = figure.subplots(2 if failures is None else 3, 1, sharex=True)
    seconds = np.array([plan.second for plan in returns.plans])
    near = np.array([plan.distance if np.isfinite(plan.distance) else np.nan for plan in returns.plans])
    rows[0].plot(seconds, near, ".", color="tab:blue", markersize=4)
    highest = np.nanmax(near) if np.isfinite(near).any() else 1.0
    rows[0].set(ylabel="least\ndistance [m]", ylim=(0.0, 1.1 * highest))
    rows[1].plot(seconds, [plan.duration for plan in returns.plans], ".", color="tab:green", markersize=4)
    rows[1].set(ylabel="above\nhome after [s]", ylim=(0.0, None))
    for row in rows[:2]:
        for second in returns.unproved:
            row.axvspan(second - 0.5, second + 0.5, color="tab:red", alpha=0.25, linewidth=0.0)
    if failures is not None:
        clear = failures.clear.sum(axis=1)
        rows[2].fill_between(np.arange(len(clear)), clear, step="mid", color="tab:purple", alpha=0.5, linewidth=0.0)
        rows[2].set(ylabel="may fail\n[vehicles]", ylim=(0.0, 1.05 * failures.clear.shape[1]))
    rows[-1].set(xlabel="called at [s]")
    return figure


def spans_text(seconds: Sequence[int]) -> str:
    """Return seconds that ascend in words, those in a row as a span: ``3, 7 to 9``."""
    rows = np.split(np.array(seconds), np.flatnonzero(np.diff(seconds) > 1) + 1)
    return ", ".join(f"{row[0]}" if len(row) == 1 else f"{row[0]} to {row[-1]}" for row in rows)
