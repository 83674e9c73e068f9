"""Random corridors, many: every one solved or refused for a reason, none outside by any amount.

Run it by hand: ``python benchmarks/soak.py [--count 10000] [--seed 0]``.  Each question has its own seed, so that what
is reported can be asked again: ``python benchmarks/soak.py --seed 1234 --count 1``.  The status is 1
if anything failed.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections import Counter

import numpy as np
from problems import corridor

import minsnap
from minsnap.errors import InfeasibleError, MinsnapError

BAR = 40


def ask(seed):
    """Ask one question: what became of it, its margin in widths, and its time [s]."""
    points, durations, widths = corridor(np.random.default_rng(seed))
    began = time.perf_counter()
    try:
        traj = minsnap.plan(points, durations, corridor=widths)
    except InfeasibleError:
        return "refused, though three continuous derivatives always fit", np.nan, time.perf_counter() - began
    except MinsnapError as error:
        return f"failed: {type(error).__name__}", np.nan, time.perf_counter() - began
    except Exception as error:  # whatever else comes out is a defect to be counted, not an end of the run
        return f"crashed: {type(error).__name__}", np.nan, time.perf_counter() - began
    took = time.perf_counter() - began
    certificate = minsnap.certify(traj, points, widths)
    if certificate.corridor_margin < 0.0:
        return "outside", certificate.corridor_margin, took
    if not certificate.ok or certificate.continuity < 3:
        return "missed a waypoint or a derivative", certificate.corridor_margin, took
    return "solved after a fallback" if traj.report.fallback else "solved", certificate.corridor_margin, took


def bar(done, count, began):
    """Draw how far it is on standard error, where that is a terminal."""
    if not sys.stderr.isatty():
        return
    share = done / count
    left = (time.perf_counter() - began) * (1.0 / share - 1.0)
    filled = "#" * round(BAR * share)
    print(f"\r[{filled:<{BAR}}] {done}/{count}, {left:.0f} s left ", end="", file=sys.stderr, flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=10_000, help="how many corridors")
    parser.add_argument("--seed", type=int, default=0, help="seed of the first; the next ones count up")
    given = parser.parse_args()
    outcomes, times, margins, odd = Counter(), [], [], []
    began = time.perf_counter()
    for index in range(given.count):
        outcome, margin, took = ask(given.seed + index)
        outcomes[outcome] += 1
        times.append(took)
        margins.append(margin)
        if outcome != "solved":
            odd.append((given.seed + index, outcome))
        bar(index + 1, given.count, began)
    summary(given, outcomes, np.array(times), np.array(margins), odd)
    wrong = given.count - outcomes["solved"] - outcomes["solved after a fallback"]
    return 1 if wrong else 0


def summary(given, outcomes, times, margins, odd):
    print(f"\n{given.count} corridors from seed {given.seed}:")
    for outcome, number in outcomes.most_common():
        print(f"  {number:6d} {outcome}")
    print(f"  least margin {np.nanmin(margins):.3g} m")
    middle, late = 1e3 * np.median(times), 1e3 * np.quantile(times, 0.99)
    print(f"  median {middle:.1f} ms, 99 % {late:.1f} ms, most {times.max():.2f} s")
    for seed, outcome in odd[:20]:
        print(f"  seed {seed}: {outcome}")


if __name__ == "__main__":
    sys.exit(main())
