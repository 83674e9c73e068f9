"""The process that plans: ``python -m minsnap.batch.solver_process``, one for each thread of a worker.

Requests come through a pipe, and rows go back, as record batches; None ends those of a request.  Before every problem
it writes the problem's number to a file and sets two alarms whose default action ends the process: one of processor
time, and a later one by the clock for a problem that waits without computing.  That works in compiled code too, which
no exception reaches, and nothing has to watch.  An idle process ends when the pipe is closed, a busy one at its next
row, or by an alarm.
"""

from __future__ import annotations

import os
import signal
import struct
import sys
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection
from time import monotonic

from minsnap.batch.columns import record_batch
from minsnap.batch.dataset_rows import Row, planned_row
from minsnap.batch.spec import Spec
from minsnap.certificate import certify
from minsnap.planning import plan

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
"""How a number is written where a problem is marked."""


def main(pipe: int, marker: int, timeout: float) -> None:
    """Answer requests until there are none.

    Parameters
    ----------
    pipe : int
        Descriptor of this end of the pipe.
    marker : int
        Descriptor of the file in which the number of the problem at hand is written.
    timeout : float
        Seconds of processor time that a problem may take.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the program that asks, whose end closes the pipe
    for alarm in ALARMS:
        signal.signal(alarm, signal.SIG_DFL)
    certify(plan(((0.0, 0.0), (1.0, 1.0)), durations=(1.0,), corridor=0.1))  # no problem has to wait for imports
    with Connection(pipe) as answers, suppress(EOFError, ConnectionError):  # until who asks closes it
        while True:
            spec, numbers = answers.recv()
            _answer(spec, numbers, marker, timeout, answers)


def _answer(spec: Spec, numbers: range, marker: int, timeout: float, answers: Connection) -> None:
    rows: list[Row] = []
    sent = monotonic()
    for number in numbers:
        rows.append(_timed(spec, number, marker, timeout))
        if len(rows) >= ANSWERS.rows or monotonic() - sent > ANSWERS.seconds:
            answers.send(record_batch(rows))
            rows, sent = [], monotonic()
    if rows:
        answers.send(record_batch(rows))
    answers.send(None)


def _timed(spec: Spec, number: int, marker: int, timeout: float) -> Row:
    os.pwrite(marker, struct.pack(FORMAT, number), 0)
    signal.setitimer(signal.ITIMER_PROF, timeout)
    signal.setitimer(signal.ITIMER_REAL, ANSWERS.patience * timeout)
    row = planned_row(spec, number)
    signal.setitimer(signal.ITIMER_PROF, 0.0)
    signal.setitimer(signal.ITIMER_REAL, 0.0)
    return row


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]), float(sys.argv[3]))
