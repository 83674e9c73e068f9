"""Run the core's benchmarks one after another: ``python -m benchmarks [--large]``."""

import runpy
import sys
from pathlib import Path

FOLDER = Path(__file__).parent
sys.path.insert(0, str(FOLDER))

from measure import machine  # noqa: E402

for line in machine():
    print(line)
for name in ("bench_plan", "bench_corridor", "bench_scale"):
    print(f"\n## {name}\n", flush=True)
    runpy.run_path(str(FOLDER / f"{name}.py"), run_name="__main__")
