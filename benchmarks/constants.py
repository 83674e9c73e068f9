"""What each constant of the reference does: costs, rounds and time at ten times and a tenth of it.

Run it by hand: ``MINSNAP_CORE=python python benchmarks/constants.py [--count 6]``.  It prints the table of
docs/constants.rst.  Costs are those of the trajectories, against the plans with the constants as they are.
"""

from __future__ import annotations

import argparse
import sys
import time
from contextlib import contextmanager

import numpy as np
from problems import DURATIONS, RECTANGLE, corridor, walk

import minsnap
from minsnap.basics import tolerances
from minsnap.errors import MinsnapError
from minsnap.optimisation import least_slacks, linear_rows, qp, reference_core, solve, unconstrained
from minsnap.polynomials import extrema
from minsnap.refusals import infeasibility

CONSTANTS = (
    (tolerances, "GAP"),
    (reference_core, "NEARLY_INSIDE"),
    (reference_core, "MOST_INWARD"),
    (reference_core, "ROUNDS"),
    (reference_core, "STALLED"),
    (linear_rows, "DENSE"),
    (qp, "ACCURACY"),
    (unconstrained, "DIGITS"),
    (least_slacks, "ACCURACY"),
    (least_slacks, "ROUNDS"),
    (least_slacks, "STALLED"),
    (infeasibility, "NOTICEABLE"),
    (infeasibility, "WIDTH_ROOM"),
    (extrema, "PARTS"),
    (extrema, "REFINED_BELOW"),
    (extrema, "STEPS"),
    (tolerances, "EXACT"),
    (tolerances, "ROUNDING"),
)


@contextmanager
def scaled(module, name, factor):
    """Multiply a constant wherever a module of the package took it from there, defaults of arguments included."""
    value = getattr(module, name)
    changed = value * factor if isinstance(value, float) else max(1, round(value * factor))
    homes = [m for k, m in sys.modules.items() if k.startswith("minsnap.") and vars(m).get(name) == value]
    takers = {"GAP": [solve.solve]}.get(name, [])
    defaults = [taker.__defaults__ for taker in takers]
    for home in homes:
        setattr(home, name, changed)
    for taker, known in zip(takers, defaults, strict=True):
        taker.__defaults__ = tuple(changed if entry is value else entry for entry in known)
    try:
        yield changed
    finally:
        for home in homes:
            setattr(home, name, value)
        for taker, known in zip(takers, defaults, strict=True):
            taker.__defaults__ = known


def problems(count):
    """Rectangles wide and narrow, a walk, refusals, corridors of the soak and some with extreme durations."""
    asked = [{"waypoints": RECTANGLE, "durations": DURATIONS, "corridor": width} for width in (1.0, 0.3, 0.01, 1e-5)]
    asked += [asked[1] | {"continuity": 5, "corridor": 1e-3}]
    points, durations, widths = walk(60)
    asked += [{"waypoints": points, "durations": durations, "corridor": widths}]
    for seed in range(2 * count):
        points, durations, widths = corridor(np.random.default_rng(seed))
        if seed >= count:
            durations = durations * 10.0 ** np.random.default_rng(seed).uniform(-1.0, 1.0, len(durations))
        asked.append({"waypoints": points, "durations": durations, "corridor": widths})
    return asked


def answers(asked):
    """Cost (or the smallest width that a refusal names) and rounds of every problem, and the time of all [s]."""
    began, found = time.process_time(), []
    for given in asked:
        try:
            traj = minsnap.plan(**given)
            found.append((traj.cost(), traj.report.rounds))
        except MinsnapError as error:
            found.append((getattr(error, "smallest_width", None) or np.inf, 0))
    return np.array(found), time.process_time() - began


def said(usual, now):
    """One cell of the table."""
    (before, took), (after, takes) = usual, now
    change = after[:, 0] / before[:, 0] - 1.0
    rounds = after[:, 1].sum() / before[:, 1].sum()
    return f"{change.min():+.0e} to {change.max():+.0e}; rounds × {rounds:.2f}; time × {takes / took:.1f}"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=6, help="corridors, and as many with extreme durations")
    asked = problems(parser.parse_args().count)
    answers(asked[:1])
    usual = answers(asked)
    for module, name in CONSTANTS:
        cells = []
        for factor in (2.0, 0.5) if name == "PARTS" else (10.0, 0.1):  # a proof without parts does not end
            with scaled(module, name, factor):
                cells.append(said(usual, answers(asked)))
        where = f"{module.__name__.rsplit('.', 1)[1]}.{name}"
        print(f"   * - ``{where}`` = {getattr(module, name):g}\n     - {cells[0]}\n     - {cells[1]}", flush=True)


if __name__ == "__main__":
    main()
