"""run_batch: the files of a dataset that are not there yet, then its datasheet and its manifest."""

from __future__ import annotations

import logging
import os
import secrets
import signal
import tempfile
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from functools import partial
from itertools import islice
from pathlib import Path
from time import monotonic
from typing import Any

from minsnap.basics.checks import check_number
from minsnap.basics.interrupts import noted_interrupts, started_without_interrupts
from minsnap.basics.optional_packages import optional
from minsnap.basics.storage.text import FileName
from minsnap.batch.columns import Tally
from minsnap.batch.datasheet import write_datasheet
from minsnap.batch.folder import (
    Shard,
    ShardJob,
    claimed,
    is_complete,
    kept_shard,
    make_shard,
    shard_name,
    write_manifest,
)
from minsnap.batch.spec import Spec
from minsnap.errors import BatchError, FileError

AHEAD = 2
"""Files that are handed out for each thread: one at work, one next."""

TOLD = 50.0
"""How often in a second the scheduler is told about new rows, by all threads together."""

CONFIG = {
    "distributed.worker.memory.spill": False,
    "distributed.worker.memory.target": False,
    "distributed.worker.memory.pause": False,
    "distributed.worker.memory.monitor-interval": "1s",
    "distributed.scheduler.allowed-failures": 10,
    "distributed.worker.profile.enabled": False,
    "distributed.admin.system-monitor.interval": "5s",
    "distributed.admin.tick.interval": "1s",
    "distributed.comm.timeouts.connect": "10s",
    "distributed.comm.timeouts.tcp": "30s",
}
"""Results are a few kilobytes, so that nothing is worth spilling; a worker may be lost more often than thrice; and Dask
need not watch itself many times a second."""


Counted = Callable[[dict[str, int]], None]
"""Called with the number of new rows by status, some times a second at most."""


def write_shards(job: ShardJob, numbers: Sequence[int], client: Any, counted: Counted | None = None) -> Iterator[Shard]:
    """Write the files of a batch on a cluster; a few are handed out at a time.

    Parameters
    ----------
    job : ShardJob
    numbers : sequence of int
        Of the files.
    client : distributed.Client
    counted : callable, optional

    Yields
    ------
    Shard
        Each as it is finished.

    Raises
    ------
    BatchError
        If a file cannot be written, workers die again and again, or the scheduler is lost.
    """
    from distributed import as_completed

    topic = f"minsnap-batch-{secrets.token_hex(8)}"
    left, pause = iter(numbers), _threads(client) / TOLD
    submit = partial(client.submit, _make, job, topic, pause, pure=False)
    with _named_failures(client), ExitStack() as ended:
        if counted is not None:
            client.subscribe_topic(topic, lambda event: counted(event[1]["rows"]))
            ended.callback(client.unsubscribe_topic, topic)  # the scheduler is not to tell a client that has gone
        first = [submit(number) for number in islice(left, AHEAD * _threads(client))]
        at_work = as_completed(first, loop=client.loop)
        for future in at_work:
            written = future.result()
            if isinstance(written, Exception):
                raise written
            yield written
            future.release()
            while at_work.count() < AHEAD * _threads(client) and (more := next(left, None)) is not None:
                at_work.add(submit(more))


def _make(job: ShardJob, topic: str, pause: float, number: int) -> Shard | Exception:
    """Write one file in a worker, which tells the client about its rows; return an error instead of logging it too.

    A worker that is closing ends at its next rows: nobody waits for the whole file.
    """
    from distributed import Status, get_worker

    worker = get_worker()
    with RowCounter(lambda counts: worker.log_event(topic, {"rows": counts}), pause) as told:

        def count(rows: Mapping[str, int]) -> None:
            if worker.status == Status.closing:
                raise BatchError("the run was ended")
            told(rows)

        try:
            return make_shard(job, number, count)
        except Exception as error:
            return error


class RowCounter:
    """Adds up new rows by status, and tells of them at most once in a while, and at the end.

    Parameters
    ----------
    tell : callable
    pause : float
        [s].
    clock : callable
        Returns seconds.
    """

    def __init__(self, tell: Counted, pause: float, clock: Callable[[], float] = monotonic) -> None:
        self._tell, self._pause, self._clock = tell, pause, clock
        self._counts, self._due = Counter[str](), clock() + pause

    def __enter__(self) -> RowCounter:
        return self

    def __exit__(self, *_: object) -> None:
        self._send()

    def __call__(self, counts: Mapping[str, int]) -> None:
        """Count new rows."""
        self._counts.update(counts)
        if self._clock() >= self._due:
            self._send()

    def _send(self) -> None:
        if self._counts:
            self._tell(dict(self._counts))
        self._counts, self._due = Counter(), self._clock() + self._pause


def _threads(client: Any) -> int:
    return max(1, int(sum(client.nthreads().values())))


@contextmanager
def _named_failures(client: Any) -> Iterator[None]:
    """Convert what Dask raises to errors of the library."""
    from concurrent.futures import CancelledError

    from distributed import KilledWorker, TimeoutError
    from distributed.comm import CommClosedError

    try:
        yield
    except KilledWorker as error:
        raise BatchError(
            f"workers ended several times while they wrote one file ({error}): give them more memory"
        ) from error
    except (CancelledError, CommClosedError, TimeoutError) as error:
        raise BatchError("the connection to the scheduler was lost") from error
    except OSError as error:
        raise BatchError(f"a worker stopped: {error}") from error


@contextmanager
def connected(workers: int | None, scheduler: str | None) -> Iterator[Any]:
    """Yield a distributed.Client of a scheduler, or of workers on this machine that are started and ended here.

    Parameters
    ----------
    workers : int or None
        Processes on this machine; by default as many as it has processors.
    scheduler : str or None
        Address of a scheduler, such as ``tcp://host:8786``.

    Raises
    ------
    BatchError
        If there is no scheduler at the address.
    ImportError
        If Dask is not there.
    """
    names, need = ("dask", "distributed"), "a batch needs dask[distributed]"
    dask, distributed = (optional(name, need, "batch") for name in names)
    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    with ExitStack() as stack:
        stack.enter_context(dask.config.set(CONFIG))
        where = scheduler if scheduler is not None else stack.enter_context(_here(workers))
        try:
            # a client of what is no address takes 10 s to end, with a traceback
            if scheduler is not None and distributed.comm.parse_address(scheduler)[0] not in ("inproc", "ucx"):
                distributed.comm.get_address_host_port(scheduler)
            client = stack.enter_context(distributed.Client(where, set_as_default=False, timeout="5s"))
        except (OSError, ValueError) as error:
            raise BatchError(f"there is no scheduler at {scheduler}: {error}") from error
        yield client


@contextmanager
def _here(workers: int | None) -> Iterator[Any]:
    """Yield a cluster of processes on this machine, over TCP; interrupts are for this program, which ends them."""
    from dask.system import CPU_COUNT
    from distributed import LocalCluster

    pressed: list[int] = []
    with tempfile.TemporaryDirectory(prefix="minsnap-batch-") as scratch:
        with noted_interrupts(pressed, ends=True), started_without_interrupts():  # half a cluster cannot be ended
            cluster = LocalCluster(
                n_workers=workers or CPU_COUNT,
                threads_per_worker=1,
                processes=True,
                protocol="tcp://",
                host="127.0.0.1",
                dashboard_address="127.0.0.1:0",
                worker_dashboard_address="127.0.0.1:0",
                local_directory=scratch,
                silence_logs=logging.CRITICAL,
            )
        with cluster:
            if pressed:
                signal.raise_signal(pressed[0])
            yield cluster


TIMEOUT = 60.0
"""Seconds of processor time that a problem may take, unless told otherwise."""

Watch = Callable[[int], Counted]
"""Called once with the number of rows that are there already; returns what is called with new rows."""


@dataclass(frozen=True)
class BatchResult:
    """A dataset that is complete.

    Parameters
    ----------
    folder : Path
    rows : int
        Problems.
    shards : int
        Files.
    statuses : dict of str to int
        Problems by status.
    present : int
        Files that were there already.
    """

    folder: Path
    rows: int
    shards: int
    statuses: dict[str, int]
    present: int


def run_batch(
    spec: Spec,
    folder: FileName,
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    problem_timeout: float = TIMEOUT,
    resume: bool = True,
    watch: Watch | None = None,
) -> BatchResult:
    """Plan every problem of a batch, and write the dataset.

    The bytes of its files do not depend on the number of workers, on their order, or on how often the run was killed.

    Parameters
    ----------
    spec : Spec
    folder : str or path
        Where the dataset is written; files that are there already are kept.
    workers : int, optional
        Processes on this machine; by default as many as it has processors.
    scheduler : str, optional
        Address of a Dask scheduler instead; its workers must reach the folder under the same name.
    problem_timeout : float
        Seconds of processor time after which a problem is given up; ten times as many by the clock end one that only
        waits.
    resume : bool
        Whether a folder that was begun already is taken.
    watch : callable, optional

    Returns
    -------
    BatchResult

    Raises
    ------
    FileError
        If the folder is that of another batch, or cannot be written.
    BatchError
        If the batch could not go on; whatever is finished is kept, and the same call goes on from there.
    ImportError
        If Dask or pyarrow is not there.
    """
    if workers is not None:
        check_number("workers", workers, 1, 1024, "use 1 to 1024", whole=True)
    check_number("the timeout of a problem", problem_timeout, 1e-3, 1e6, "use 0.001 to 1000000 seconds")
    if not os.fspath(folder):
        raise FileError("the folder of a dataset has no name: give one")
    where = Path(folder).resolve()
    job = ShardJob(where, spec, float(problem_timeout))
    with claimed(where, spec, resume):
        kept = [one for one in (kept_shard(where, spec.name(), n) for n in range(spec.shards)) if one is not None]
        if is_complete(where, spec, kept):
            return _result(where, spec, kept, len(kept))
        try:
            counted = None if watch is None else watch(sum(shard.rows for shard in kept))
            with connected(workers, scheduler) as client:
                written = write_shards(job, range(spec.shards), client, counted)
                shards = sorted(written, key=lambda shard: shard.number)
            result = _result(where, spec, shards, len(kept))
            write_datasheet(where, spec, _joined(shards), shards)
            write_manifest(where, spec, shards, result.statuses)
        except (BatchError, FileError) as error:
            there = sum((where / shard_name(number)).exists() for number in range(spec.shards))
            state = f"{there} of {spec.shards} files are finished, and the same command goes on from there"
            raise BatchError(f"{error}; {state}") from error
    return result


def _result(folder: Path, spec: Spec, shards: list[Shard], present: int) -> BatchResult:
    return BatchResult(folder, spec.count, spec.shards, _joined(shards).statuses, present)


def _joined(shards: list[Shard]) -> Tally:
    tally = Tally()
    for shard in shards:
        tally.join(Tally(shard.tally))
    return tally
