"""Small batches for tests: specifications, tables of problems, and what a dataset holds."""

import hashlib
import json
from pathlib import Path

import numpy as np

from minsnap.batch.spec import read_mapping

WALKS = {"generator": "walks", "count": 40, "seed": 7, "legs": [2, 5], "corridor": [0.2, 0.5], "shard_rows": 8}


def walks(**changes):
    return read_mapping(WALKS | changes)


def digests(folder):
    """SHA-256 of every Parquet file of a folder, by name."""
    return {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in sorted(Path(folder).glob("*.parquet"))}


def write_problems(path, rows):
    """Write problems to a CSV whose cells are JSON."""
    import csv

    names = sorted({name for row in rows for name in row})
    with open(path, "w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(names)
        writer.writerows([[json.dumps(row[name]) if name in row else "" for name in names] for row in rows])


def good_row(seed=0, legs=3):
    rng = np.random.default_rng(seed)
    points = np.cumsum(rng.normal(size=(legs + 1, 3)), axis=0)
    return {"waypoints": points.tolist(), "durations": rng.uniform(0.8, 1.5, legs).tolist(), "corridor": 0.4}


def long_row(legs=20_000):
    """Return a problem on which the native core works for half a minute, without a return to Python."""
    rng = np.random.default_rng(1)
    points = np.cumsum(rng.uniform(0.5, 1.5, (legs + 1, 3)), axis=0)
    return {"waypoints": points.tolist(), "total_time": 1.5 * legs, "corridor": 0.4}
