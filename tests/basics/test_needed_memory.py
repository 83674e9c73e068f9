"""Memory that is short is one sentence that says how much was needed."""

import subprocess
import sys

import numpy as np
import pytest

import minsnap
from minsnap.basics.needed_memory import planned_bytes, size_text
from minsnap.errors import MinsnapError, OutOfMemoryError

SHORT = """
import resource, numpy as np, minsnap
minsnap.plan([(0, 0), (1, 1)], durations=[1.0])
points = np.random.default_rng(0).random((1_500_000, 3))
used = int(open("/proc/self/statm").read().split()[0]) * resource.getpagesize()
resource.setrlimit(resource.RLIMIT_AS, (used + 150 * 2**20,) * 2)
for plan, asked in ((minsnap.plan, points), (minsnap.plan_many, points.reshape(-1, 3, 3))):
    try:
        plan(asked, np.ones(len(points) - 1) if plan is minsnap.plan else [1.0, 1.0])
    except minsnap.MinsnapError as error:
        print(type(error).__name__, error)
"""


@pytest.mark.parametrize(
    "asked",
    [{"durations": [1, 1]}, {"durations": [1, 1], "corridor": 0.3}, {"limits": minsnap.Limits(speed=3)}],
    ids=str,
)
def test_a_batch_of_a_million_million_plans_is_refused(asked):
    """Broadcast waypoints take no memory, their plans 384 tebibytes."""
    points = np.broadcast_to(np.array([(0.0, 0, 0), (1, 1, 1), (2, 0, 1)]), (2**40, 3, 3))
    with pytest.raises(OutOfMemoryError, match="this batch of plans takes at least 384 TiB of memory") as refused:
        minsnap.plan_many(points, **asked)
    assert refused.value.needed == planned_bytes(points, degree=7)
    assert isinstance(refused.value, MinsnapError) and isinstance(refused.value, MemoryError)


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="limits the address space as Linux does")
def test_memory_that_a_process_may_not_take_is_named():
    """In a process that may take 150 MiB more."""
    done = subprocess.run([sys.executable, "-c", SHORT], capture_output=True, text=True, check=True)
    single, many = done.stdout.splitlines()
    assert single.startswith("OutOfMemoryError this plan takes at least 274.7 MiB of memory")
    assert many.startswith("OutOfMemoryError this batch of plans takes at least 183.1 MiB of memory")


def test_bytes_are_counted_by_shape():
    assert planned_bytes([(0, 0), (1, 1), (2, 0)], degree=3) == 8 * 4 * 4
    assert planned_bytes([[(0, 0), (1, 1)], [(0, 0), (1, 1), (2, 0)]]) == 8 * 8 * 2 * 3
    assert (size_text(0), size_text(1023), size_text(2**20 * 1.5)) == ("0 B", "1023 B", "1.5 MiB")
