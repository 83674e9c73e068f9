"""Planning in a process that may be ended: too slow a problem, or a crash, costs one row."""

from __future__ import annotations

import json
import os
import signal
import struct
import subprocess
import sys
import tempfile
import threading
from collections import Counter
from collections.abc import Iterator
from typing import Any

from minsnap.batch.columns import record_batch
from minsnap.batch.dataset_rows import stopped_row
from minsnap.batch.solver_process import ALARMS, FORMAT
from minsnap.batch.spec import Spec
from minsnap.errors import BatchError, MinsnapError

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
        process = self._running()
        assert process.stdin is not None and process.stdout is not None
        line = json.dumps({"spec": self.spec.plain(), "first": first, "last": last})
        try:
            process.stdin.write(line.encode() + b"\n")
            process.stdin.flush()
        except BrokenPipeError:
            return
        while size := int.from_bytes(process.stdout.read(8), "big"):
            stream = process.stdout.read(size)
            if len(stream) < size:
                return
            yield from _batches(stream)

    def _running(self) -> subprocess.Popen[bytes]:
        if self.process is not None and self.process.poll() is not None:
            self.process.communicate()
            self.process = None
        if self.process is None:
            os.pwrite(self.marker.fileno(), struct.pack(FORMAT, -1), 0)
            command = [sys.executable, "-m", "minsnap.batch.solver_process", str(self.marker.fileno())]
            self.process = subprocess.Popen(
                [*command, repr(self.timeout)],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                pass_fds=(self.marker.fileno(),),
                env=os.environ | dict.fromkeys(SINGLE, "1"),
            )
        return self.process

    def _death(self, at: int, stop: int) -> tuple[int, str, str]:
        """Return which problem the process ended at, its status and the sentence."""
        assert self.process is not None
        self.process.communicate()
        code = self.process.returncode
        number = struct.unpack(FORMAT, os.pread(self.marker.fileno(), 8, 0))[0]
        if number not in range(at, stop):
            if code == -signal.SIGKILL:
                return at, "crashed", "the process that planned it was ended by signal 9"
            raise BatchError(f"a process that plans ended with status {code} before it planned anything: see above")
        if -code in ALARMS:
            return (
                number,
                "timeout",
                f"the problem took more than {self.timeout:g} s of processor time: raise --problem-timeout",
            )
        why = f"was ended by signal {-code}" if code < 0 else f"ended with status {code}"
        return number, "crashed", f"the process that planned it {why}, {ATTEMPTS} times"

    def close(self) -> None:
        """End the process."""
        if self.process is not None:
            self.process.kill()
            self.process.communicate()
        self.marker.close()


def solving(spec: Spec, timeout: float) -> Solving:
    """Return what plans for this thread; it is kept, with its process, until the next batch."""
    known: Solving | None = getattr(_LOCAL, "known", None)
    if known is not None and (known.spec, known.timeout) == (spec, timeout):
        return known
    if known is not None:
        known.close()
    made = _LOCAL.known = Solving(spec, timeout)
    return made


def _batches(stream: bytes) -> Iterator[Any]:
    import pyarrow

    try:
        with pyarrow.ipc.open_stream(stream) as reader:
            yield from reader
    except pyarrow.ArrowException as error:
        raise MinsnapError(f"rows of a process could not be read: {error}") from error
