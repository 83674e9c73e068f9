"""Writing of one file: its rows pass through in groups, so that memory does not grow with the file."""

import weakref
from pathlib import Path

import numpy as np
import pyarrow
import pytest
from batches import walks

from minsnap.batch import folder
from minsnap.batch.columns import record_batch
from minsnap.batch.folder import claimed
from minsnap.errors import BatchError

PART = 256
"""Rows that a process answers with at a time."""


@pytest.fixture(scope="module")
def rows():
    points = np.zeros((10, 8, 3))
    return [{"problem": 0, "seed": 1, "status": "done", "control_points": points, "certified": True}] * PART


def peak_of(rows, groups, path):
    """Write a file of so many groups; return the most parts alive and the most bytes of Arrow's memory."""
    alive, most = weakref.WeakValueDictionary(), [0, 0]
    before = pyarrow.total_allocated_bytes()

    def answered(numbers):
        for first in range(numbers.start, numbers.stop, PART):
            part = record_batch(rows)
            alive[first] = part
            most[0] = max(most[0], len(alive))
            most[1] = max(most[1], pyarrow.total_allocated_bytes() - before)
            yield part

    folder._write(path, answered, range(groups * folder.GROUP_ROWS), {}, None)
    return most


def test_a_file_of_any_length_takes_the_memory_of_one_group(rows, tmp_path):
    short, long = (peak_of(rows, groups, tmp_path / f"{groups}.parquet") for groups in (2, 12))
    assert short[0] == long[0] <= folder.GROUP_ROWS // PART + 1
    assert 0 < long[1] <= 1.2 * short[1]
    assert pyarrow.parquet.ParquetFile(tmp_path / "12.parquet").metadata.num_rows == 12 * folder.GROUP_ROWS


def test_of_runs_that_begin_at_once_one_is_kept_out(tmp_path, monkeypatch):
    """Each looked before the other wrote what the folder is begun with, and both wrote datasets into it."""
    with claimed(tmp_path, walks(), True), monkeypatch.context() as late:
        late.setattr(Path, "exists", lambda path: False)
        with pytest.raises(BatchError, match="another run writes into"):
            with claimed(tmp_path, walks(), True):
                pass
