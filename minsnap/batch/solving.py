"""Planning in a process that may be ended: too slow a problem, or a crash, costs one row."""

from __future__ import annotations

import os
import signal
import struct
import subprocess
import sys
import tempfile
import threading
from collections import Counter
from collections.abc import Iterator
from contextlib import suppress
from multiprocessing import Pipe
from multiprocessing.connection import Connection
from typing import Any

from minsnap.batch.columns import record_batch
from minsnap.batch.dataset_rows import stopped_row
from minsnap.batch.solver_process import ALARMS, FORMAT
from minsnap.batch.spec import Spec
from minsnap.errors import BatchError

ATTEMPTS = 3
"""How often a problem is tried whose process ended before its time: somebody else may have ended it."""

SINGLE = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")
"""Variables that keep linear algebra to one thread: sums in another order would change the last bits."""

_LOCAL = threading.local()


class Solving:
    """Rows of a batch, planned in a process of their own that is started again where it ends.

    Parameters
    ----------
    spec : Spec
    timeout : float
        Seconds of processor time that a problem may take.
    """

    def __init__(self, spec: Spec, timeout: float) -> None:
        if not ALARMS:
            raise BatchError("a batch needs the alarms of a POSIX system: run it on Linux, macOS or WSL")
        self.spec, self.timeout = spec, timeout
        self.marker = tempfile.TemporaryFile()
        self.process: subprocess.Popen[bytes] | None = None
        self.pipe: Connection | None = None

    def rows(self, numbers: range) -> Iterator[Any]:
        """Yield the rows of problems in their order, as pyarrow.RecordBatch of any lengths."""
        at, deaths = numbers.start, Counter[int]()
        while at < numbers.stop:
            for batch in self._sent_rows(at, numbers.stop):
                at += batch.num_rows
                yield batch
            if at == numbers.stop:
                return
            number, status, sentence = self._death(at, numbers.stop)
            for batch in self._sent_rows(at, number):  # planned, but not sent
                at += batch.num_rows
                yield batch
            deaths[number] += 1
            if at == number and (status == "timeout" or deaths[number] == ATTEMPTS):
                yield record_batch([stopped_row(self.spec, number, status, sentence)])
                at += 1

    def _sent_rows(self, first: int, last: int) -> Iterator[Any]:
        """Yield the rows that the process answers with; fewer where it ends early."""
        if first == last:
            return
        pipe = self._running()
        with suppress(EOFError, OSError):
            pipe.send((self.spec, range(first, last)))
            while (batch := pipe.recv()) is not None:
                yield batch

    def _running(self) -> Connection:
        """Return the pipe to the process, which is started where there is none."""
        if self.pipe is None or self.process is None or self.process.poll() is not None:
            self._end()
            os.pwrite(self.marker.fileno(), struct.pack(FORMAT, -1), 0)
            self.pipe, theirs = Pipe()
            passed = theirs.fileno(), self.marker.fileno()
            command = [sys.executable, "-m", "minsnap.batch.solver_process", *map(str, passed), repr(self.timeout)]
            single = os.environ | dict.fromkeys(SINGLE, "1")
            self.process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=2, pass_fds=passed, env=single)
            theirs.close()
        return self.pipe

    def _death(self, at: int, stop: int) -> tuple[int, str, str]:
        """Return which problem the process ended at, its status and the sentence."""
        assert self.process is not None
        code = self.process.wait()
        number = struct.unpack(FORMAT, os.pread(self.marker.fileno(), 8, 0))[0]
        if number not in range(at, stop):
            if code == -signal.SIGKILL:
                return at, "crashed", "the process that planned it was ended by signal 9"
            raise BatchError(f"a process that plans ended with status {code} before it planned anything: see above")
        if -code in ALARMS:
            slow = f"the problem took more than {self.timeout:g} s of processor time: raise --problem-timeout"
            return number, "timeout", slow
        why = f"was ended by signal {-code}" if code < 0 else f"ended with status {code}"
        return number, "crashed", f"the process that planned it {why}, {ATTEMPTS} times"

    def close(self) -> None:
        """End the process."""
        self._end()
        self.marker.close()

    def _end(self) -> None:
        if self.process is not None and self.pipe is not None:
            self.process.kill()
            self.process.wait()
            self.pipe.close()
        self.process = self.pipe = None


def solving(spec: Spec, timeout: float) -> Solving:
    """Return what plans for this thread; it is kept, with its process, until the next batch."""
    known: Solving | None = getattr(_LOCAL, "known", None)
    if known is not None and (known.spec, known.timeout) == (spec, timeout):
        return known
    if known is not None:
        known.close()
    made = _LOCAL.known = Solving(spec, timeout)
    return made
