"""Many legs in a corridor, certified at every instant: time, memory, and how both grow.

Run it by hand: ``python benchmarks/bench_scale.py [--large]``; ``--large`` adds 10,000 legs.
"""

from __future__ import annotations

import sys
from functools import partial

from measure import median_time, peak_memory, table, text
from problems import walk

import minsnap

SIZES = (10, 30, 100, 300, 1_000, 3_000)


class TimeLegs:
    """What asv calls: one certified plan through that many legs."""

    params = SIZES

    def setup(self, legs):
        self.asked = walk(legs)

    def time_certified(self, legs):
        points, durations, widths = self.asked
        return minsnap.plan(points, durations, corridor=widths)


def measure(legs):
    case = TimeLegs()
    case.setup(legs)
    points, _, widths = case.asked
    took = median_time(partial(case.time_certified, legs), seconds=4.0, least=1 if legs > 5_000 else 3)
    traj = case.time_certified(legs)
    certificate = minsnap.certify(traj, points, widths)
    report = traj.report
    return (
        legs,
        text(took),
        f"{1e3 * took / legs:.3f} ms",
        report.rounds,
        report.rows,
        report.solver,
        f"{certificate.corridor_margin:.1e} m",
        f"{peak_memory():.2f} GiB",
    )


def main():
    sizes = (*SIZES, 10_000) if "--large" in sys.argv else SIZES
    table(("legs", "certified", "a leg", "rounds", "rows", "solver", "margin", "peak"), (measure(n) for n in sizes))


if __name__ == "__main__":
    main()
