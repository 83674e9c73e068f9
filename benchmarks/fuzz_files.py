"""Fuzz the readers of files: every input must be read or refused with one exception, soon.

    python benchmarks/fuzz_files.py --inputs 1000000 --seed 0

prints inputs, refusals and the longest time for each reader; what gets past the rule is kept beside this script.  An
input that takes more than five seconds of processor time breaks the rule too; the process may have 3 GB of memory.
"""

from __future__ import annotations

import argparse
import resource
import sys
import tempfile
import time
import warnings
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "helpers"))

from file_seeds import mutated, readers, refusals, seeds  # noqa: E402

SLOW, MEMORY = 5.0, 3 << 30


def main() -> int:
    """Go through the readers in turn, and leave with 1 if an input broke the rule."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--inputs", type=int, default=10_000)
    parser.add_argument("--seed", type=int, default=0)
    asked = parser.parse_args()
    warnings.simplefilter("ignore")
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    with tempfile.TemporaryDirectory() as name:
        broken = sum(_fuzz(Path(name), *entry, asked) for entry in readers().items())
    return int(broken > 0)


def _fuzz(folder: Path, name: str, read, asked: argparse.Namespace) -> int:
    (folder / "seeds").mkdir(exist_ok=True)
    seed, random = seeds(folder / "seeds")[name], np.random.default_rng(asked.seed)
    path, count, refused, broken, longest = folder / name, asked.inputs // len(readers()), 0, 0, 0.0
    for _ in range(count):
        content = mutated(seed, random)
        path.write_bytes(content)
        began, wrong = time.process_time(), None
        try:
            read(path)
        except refusals():
            refused += 1
        except Exception as error:
            wrong = f"{type(error).__name__}: {error}"
        spent = time.process_time() - began
        longest = max(longest, spent)
        if wrong or spent > SLOW:
            broken += 1
            Path(f"broken-{broken}-{name}").write_bytes(content)
            print(f"{name}: {wrong or f'{spent:.1f} s'}")
    print(f"{name:<14} {count} inputs, {refused} refused, {broken} broken, longest {1e3 * longest:.1f} ms", flush=True)
    return broken


if __name__ == "__main__":
    sys.exit(main())
