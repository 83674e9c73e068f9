import os
import signal
import struct
import threading
import time

import pyarrow
import pytest
from batches import good_row, long_row, walks, write_problems

from minsnap.batch.columns import record_batch
from minsnap.batch.dataset_rows import planned_row
from minsnap.batch.solver_process import FORMAT
from minsnap.batch.solving import Solving
from minsnap.batch.spec import read_mapping


@pytest.fixture
def solving():
    made = []

    def make(spec, timeout=60.0):
        made.append(Solving(spec, timeout))
        return made[-1]

    yield make
    for one in made:
        one.close()


def table_of(batches):
    return pyarrow.Table.from_batches(list(batches)).combine_chunks()


def marked(solving):
    """Return the number of the problem that the process is at."""
    return struct.unpack(FORMAT, os.pread(solving.marker.fileno(), 8, 0))[0]


@pytest.mark.slow
def test_rows_are_those_of_this_process(solving):
    spec = walks()
    alone = pyarrow.Table.from_batches([record_batch([planned_row(spec, number) for number in range(3, 30)])])
    assert table_of(solving(spec).rows(range(3, 30))).equals(alone)


@pytest.mark.slow
def test_a_problem_that_takes_too_long_in_compiled_code_is_one_row(solving, tmp_path):
    write_problems(tmp_path / "p.csv", [good_row(0), long_row(), good_row(2), good_row(3)])
    spec = read_mapping({"table": str(tmp_path / "p.csv")})
    rows = table_of(solving(spec, 1.5).rows(range(4))).to_pylist()
    assert [row["status"] for row in rows] == ["done", "timeout", "done", "done"]
    assert rows[1]["error"] == "the problem took more than 1.5 s of processor time: raise --problem-timeout"
    assert [row["problem"] for row in rows] == [0, 1, 2, 3]


@pytest.mark.slow
def test_a_process_that_somebody_ends_changes_no_row(solving):
    spec = walks(count=150)
    quiet = table_of(solving(spec).rows(range(150)))
    one, ended = solving(spec), threading.Event()

    def kill_twice():
        for _ in range(2):
            while one.process is None or one.process.poll() is not None or marked(one) < 20:
                time.sleep(0.001)
            one.process.send_signal(signal.SIGKILL)
            one.process.wait()
        ended.set()

    threading.Thread(target=kill_twice, daemon=True).start()
    assert table_of(one.rows(range(150))).equals(quiet) and ended.is_set()


@pytest.mark.slow
def test_a_problem_that_crashes_its_process_each_time_is_one_row(solving, tmp_path):
    write_problems(tmp_path / "p.csv", [good_row(0), long_row(), good_row(2)])
    one = solving(read_mapping({"table": str(tmp_path / "p.csv")}))
    done = threading.Event()

    def crash_at_problem_1():
        while not done.is_set():
            if one.process is not None and one.process.poll() is None and marked(one) == 1:
                one.process.send_signal(signal.SIGSEGV)
                one.process.wait()
            time.sleep(0.001)

    thread = threading.Thread(target=crash_at_problem_1)
    thread.start()
    rows = table_of(one.rows(range(3))).to_pylist()
    done.set()
    thread.join()
    assert [row["status"] for row in rows] == ["done", "crashed", "done"]
    assert rows[1]["error"] == "the process that planned it was ended by signal 11, 3 times"


@pytest.mark.slow
def test_the_process_ends_with_the_one_that_asks(solving):
    one = solving(walks())
    list(one.rows(range(1)))
    process = one.process
    one.pipe.close()
    assert process.wait(20.0) == 0
