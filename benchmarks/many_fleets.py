"""Plan random fleets of 2 to 30 vehicles in rooms with obstacles, and judge each by an oracle of its own.

Run it by hand: ``nice python benchmarks/many_fleets.py [from] [to]``. It prints a row for each fleet that is refused,
and how many were certified, in which times. A fleet that does not hold ends it.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import numpy as np

TESTS = Path(__file__).parents[1] / "tests"
sys.path[:0] = [str(TESTS), str(TESTS / "helpers")]

from random_fleets import certified_or_refused  # noqa: E402


def main():
    """Print what came of the fleets of some seeds."""
    seeds = range(*map(int, sys.argv[1:3])) if sys.argv[1:] else range(1000)
    seconds, shares = [], []
    for seed in seeds:
        began = time.process_time()
        found = certified_or_refused(seed)
        seconds.append(time.process_time() - began)
        if isinstance(found, str):
            print(f"| {seed} | {found} |", flush=True)
        else:
            shares.append(found.duration / found.report.bound)
    print(f"{len(shares)} of {len(seeds)} certified; over the bound: {np.quantile(shares, [0.5, 0.9, 1.0]).round(3)}")
    print(f"processor with the oracle: {np.quantile(seconds, [0.5, 0.9, 1.0]).round(2)} s")


if __name__ == "__main__":
    main()
