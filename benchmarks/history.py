"""How the library changes from version to version: a few ratios, each against a bound or a peer in the same run.

A ratio against a bound or an optimum is the same on every machine. One against a peer compares processor times of the
same process, so that machine and load matter little; none of them is a time.

Run it by hand, or as the release does: ``python benchmarks/history.py --add`` appends a row for each ratio to
docs/benchmark_history.csv, and ``--draw FILE`` draws what that file holds.
"""

from __future__ import annotations

import argparse
import csv
import datetime
import os
from collections.abc import Callable
from pathlib import Path

os.environ["OPENBLAS_NUM_THREADS"] = "1"

import numpy as np
from measure import least_times, machine, table
from problems import DURATIONS, RECTANGLE

import minsnap

HISTORY = Path(__file__).parents[1] / "docs" / "benchmark_history.csv"
COLUMNS = ("date", "version", "name", "ratio")

OPTIMUM = 1557.0050
"""Cost of the rectangle within 0.3 m at every instant, by sums of squares [m^2/s^7]."""


def cost_over_optimum(seconds: float) -> float:
    """Cost of the rectangle in its corridor over the optimum, which sums of squares know."""
    return minsnap.plan(RECTANGLE, DURATIONS, corridor=0.3).cost() / OPTIMUM


def shortest_over_bound(seconds: float) -> float:
    """Median flight time of twelve random courses over what is proved to be the least of any curve."""
    ratios = []
    for seed in range(12):
        draw = np.random.default_rng(seed)
        points = np.cumsum(draw.normal(size=(int(draw.integers(3, 9)), 3)) * (3, 3, 1), axis=0)
        limits = minsnap.Limits(speed=draw.uniform(2, 8), acceleration=draw.uniform(3, 12))
        path = minsnap.plan(points, limits=limits)
        ratios.append(path.duration / minsnap.least_time(points, limits).seconds)
    return float(np.median(ratios))


def plan_over_spline(seconds: float) -> float:
    """Processor time of a plan of ten legs without walls over that of SciPy's spline through the same points."""
    from scipy.interpolate import make_interp_spline

    points = np.cumsum(np.random.default_rng(1).normal(size=(11, 3)) * 3.0, axis=0)
    times, breaks = np.full(10, 2.0), np.arange(11) * 2.0
    ends = [(order, np.zeros(3)) for order in (1, 2, 3)]
    calls = [
        lambda: [minsnap.plan(points, times) for _ in range(100)],
        lambda: [make_interp_spline(breaks, points, k=7, bc_type=(ends, ends)) for _ in range(100)],
    ]
    (ours, theirs), _ = least_times(calls, seconds)
    return ours / theirs


def certain_over_sampled(seconds: float) -> float:
    """Processor time of the rectangle inside at every instant over that of Clarabel for twenty instants a leg."""
    import qpsolvers

    full = minsnap.build_qp(RECTANGLE, DURATIONS, corridor=0.3, samples=20)
    problem = qpsolvers.Problem(full.P, full.q, full.G, full.h, full.A, full.b)
    calls = [
        lambda: [minsnap.plan(RECTANGLE, DURATIONS, corridor=0.3) for _ in range(20)],
        lambda: qpsolvers.solve_problem(problem, solver="clarabel"),
    ]
    (ours, theirs), _ = least_times(calls, seconds)
    return ours / 20.0 / theirs


def many_over_one(seconds: float) -> float:
    """Processor time of a thousand plans in one call on one thread over that of a thousand calls."""
    points = np.cumsum(np.random.default_rng(2).normal(size=(1000, 5, 3)), axis=1)
    times = np.full(4, 2.0)
    calls = [
        lambda: minsnap.plan_many(points, times, corridor=0.5, threads=1),
        lambda: [minsnap.plan(each, times, corridor=0.5) for each in points],
    ]
    (many, each), _ = least_times(calls, seconds)
    return many / each


RATIOS: tuple[Callable[[float], float], ...] = (
    cost_over_optimum,
    shortest_over_bound,
    plan_over_spline,
    certain_over_sampled,
    many_over_one,
)
"""Each of the seconds for which its peers are measured; the documentation of each is the title of its drawing."""


def measured(seconds: float) -> list[dict[str, str]]:
    """Measure all ratios; return a row of the history for each."""
    today = datetime.date.today().isoformat()
    return [
        {"date": today, "version": minsnap.__version__, "name": ratio.__name__, "ratio": f"{ratio(seconds):.8g}"}
        for ratio in RATIOS
    ]


def read_history(file: Path = HISTORY) -> list[dict[str, str]]:
    """Return the rows that are kept, the oldest first."""
    if not file.exists():
        return []
    with file.open(newline="", encoding="utf-8") as lines:
        return list(csv.DictReader(lines))


def add(rows: list[dict[str, str]], file: Path = HISTORY) -> None:
    """Append rows; those of the same day and version take the place of earlier ones."""
    made = {(row["date"], row["version"]) for row in rows}
    kept = [row for row in read_history(file) if (row["date"], row["version"]) not in made]
    with file.open("w", newline="", encoding="utf-8") as lines:
        writer = csv.DictWriter(lines, COLUMNS, lineterminator="\n")
        writer.writeheader()
        writer.writerows([*kept, *rows])


def draw(rows: list[dict[str, str]], picture: Path) -> None:
    """Draw every ratio over the dates."""
    from matplotlib.dates import AutoDateFormatter, AutoDateLocator
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8.0, 1.9 * len(RATIOS)), layout="constrained")
    for ax, ratio in zip(figure.subplots(len(RATIOS), sharex=True), RATIOS, strict=True):
        own = [row for row in rows if row["name"] == ratio.__name__]
        dates = [datetime.date.fromisoformat(row["date"]) for row in own]
        values = [float(row["ratio"]) for row in own]
        ax.plot(dates, values, "o-", color="C0", markersize=4)
        for row, date, value in zip(own, dates, values, strict=True):
            ax.annotate(row["version"], (date, value), (0, 5), textcoords="offset points", ha="center", fontsize=7)
        ax.set_title(str(ratio.__doc__).rstrip("."), fontsize=8, loc="left")
        ax.margins(x=0.1, y=0.4)
        ax.grid(alpha=0.3)
        locator = AutoDateLocator(minticks=1, maxticks=6)
        ax.xaxis.set_major_locator(locator)
        ax.xaxis.set_major_formatter(AutoDateFormatter(locator))
    figure.savefig(picture, dpi=130)


def main() -> None:
    """Measure, print, and keep or draw what was asked for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--add", action="store_true", help="append to docs/benchmark_history.csv")
    parser.add_argument("--draw", type=Path, metavar="FILE", help="draw what is kept, and measure nothing unless --add")
    parser.add_argument("--seconds", type=float, default=5.0, help="how long peers are measured")
    asked = parser.parse_args()
    if asked.add or asked.draw is None:
        rows = measured(asked.seconds)
        print(*machine(), sep="\n")
        table(COLUMNS, [row.values() for row in rows])
        if asked.add:
            add(rows)
    if asked.draw is not None:
        draw(read_history(), asked.draw)


if __name__ == "__main__":
    main()
