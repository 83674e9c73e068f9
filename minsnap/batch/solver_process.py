"""The process that plans: ``python -m minsnap.batch.solver_process``, one for each thread of a worker.

It reads requests from its standard input, a line of JSON each, and writes rows as Arrow streams to its standard output,
each after its length in 8 bytes; a length of zero ends a request.  Before every problem it writes the problem's number
to a file and sets two alarms whose default action ends the process: one of processor time, and a later one by the clock
for a problem that waits without computing.  That works in compiled code too, which no exception reaches, and nothing
has to watch.  An idle process ends when its input is closed, a busy one at its next row, or by an alarm.
"""

from __future__ import annotations

import json
import os
import signal
import sys
from dataclasses import dataclass
from typing import IO

from minsnap.batch.columns import record_batch
from minsnap.batch.dataset_rows import Row, planned_row
from minsnap.batch.spec import Spec, read_mapping
from minsnap.certificate import certify
from minsnap.planning.planner import plan

ALARMS = tuple(getattr(signal, name) for name in ("SIGPROF", "SIGALRM") if hasattr(signal, name))
"""What ends the process of a problem that takes too long; none where the system has no alarms."""


@dataclass(frozen=True)
class AnswerSettings:
    """When rows are sent, and how long a problem may take.

    Parameters
    ----------
    rows : int
        Rows that are sent together.
    seconds : float
        Time after which fewer are sent [s].
    patience : float
        Seconds by the clock for each second of processor time that a problem may take: processors may be shared.
    """

    rows: int = 1024
    seconds: float = 0.5
    patience: float = 10.0


ANSWERS = AnswerSettings()


FORMAT = ">q"
"""How a number is written where a problem is marked, and before a stream."""


def main(marker: int, timeout: float) -> None:
    """Answer requests until there are none.

    Parameters
    ----------
    marker : int
        Descriptor of the file in which the number of the problem at hand is written.
    timeout : float
        Seconds of processor time that a problem may take.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the program that asks, whose end closes the input
    for alarm in ALARMS:
        signal.signal(alarm, signal.SIG_DFL)
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what a library prints must not get between the rows
    spec: Spec | None = None
    certify(plan(((0.0, 0.0), (1.0, 1.0)), durations=(1.0,), corridor=0.1))  # no problem has to wait for imports
    for line in sys.stdin:
        question = json.loads(line)
        if spec is None:
            spec = read_mapping(question["spec"])
        _answer(spec, range(question["first"], question["last"]), marker, timeout, answers)


def _answer(spec: Spec, numbers: range, marker: int, timeout: float, answers: IO[bytes]) -> None:
    from time import monotonic

    rows: list[Row] = []
    sent = monotonic()
    for number in numbers:
        rows.append(_timed(spec, number, marker, timeout))
        if len(rows) >= ANSWERS.rows or monotonic() - sent > ANSWERS.seconds:
            _send(rows, answers)
            rows, sent = [], monotonic()
    if rows:
        _send(rows, answers)
    answers.write(bytes(8))
    answers.flush()


def _timed(spec: Spec, number: int, marker: int, timeout: float) -> Row:
    import struct

    os.pwrite(marker, struct.pack(FORMAT, number), 0)
    signal.setitimer(signal.ITIMER_PROF, timeout)
    signal.setitimer(signal.ITIMER_REAL, ANSWERS.patience * timeout)
    row = planned_row(spec, number)
    signal.setitimer(signal.ITIMER_PROF, 0.0)
    signal.setitimer(signal.ITIMER_REAL, 0.0)
    return row


def _send(rows: list[Row], answers: IO[bytes]) -> None:
    import pyarrow

    sink, batch = pyarrow.BufferOutputStream(), record_batch(rows)
    with pyarrow.ipc.new_stream(sink, batch.schema) as writer:
        writer.write_batch(batch)
    stream = sink.getvalue()
    answers.write(len(stream).to_bytes(8, "big"))
    answers.write(stream)
    answers.flush()


if __name__ == "__main__":
    try:
        main(int(sys.argv[1]), float(sys.argv[2]))
    except BrokenPipeError:
        os._exit(1)
