"""A process beside a flight: it draws, listens for orders and plans them, so that nothing of that delays the flight.

The flight's process never waits for it: what the pipe cannot take at once is not shown. ``python -m
minsnap.cli.companion DESCRIPTOR`` is this process.
"""

from __future__ import annotations

import os
import select
import signal
import socket
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing import Pipe
from multiprocessing.connection import Connection
from time import monotonic
from typing import TYPE_CHECKING, Any

from minsnap.errors import FlightError, InputError, MinsnapError, TimingError

if TYPE_CHECKING:
    import minsnap.flight
    from minsnap.flight.mavlink.explored_stream import Exploration, Exploring
    from minsnap.flight.mavlink.offboard import Orders
    from minsnap.replanning import Change

_INTERVAL = 0.2  # of the bar, and of looking whether the flight is over [s]
_WIDTH = 30
_LARGEST = 65536
_AT_ONCE = 100  # lines that are read before they are answered


@dataclass(frozen=True, eq=False)
class Listening:
    """What is planned in flight, and where the lines come from that it is planned by.

    Parameters
    ----------
    flown : Trajectory
        What is flown at first.
    limits : Limits
    room : Room, optional
        Which all changes by orders stay in.
    exploring : Exploring, optional
        How to fly by what a sensor sees instead of by orders.
    port : str or None
        UDP, ``[HOST:]PORT``; by default the standard input.

    Raises
    ------
    InputError
        If the port cannot be listened on.
    """

    flown: minsnap.Trajectory
    limits: minsnap.Limits
    room: minsnap.Room | None = None
    exploring: Exploring | None = None
    port: str | None = None

    def answering(self, flight: RemoteFlight) -> Orders | Exploration:
        """Return what answers the lines."""
        if self.exploring is not None:
            from minsnap.flight.mavlink.explored_stream import Exploration

            return Exploration(flight, self.exploring)
        from minsnap.flight.mavlink.offboard import Orders

        return Orders(flight, self.flown, self.limits, self.room)

    def open(self) -> socket.socket | None:
        """Return the socket for datagrams."""
        if self.port is None:
            return None
        host, _, number = self.port.rpartition(":")
        made = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            made.bind((host or "127.0.0.1", int(number)))
        except (OSError, ValueError, OverflowError) as error:
            made.close()
            raise InputError(f"cannot listen on {self.port}: {error}") from None
        return made


class Companion:
    """The flight's end of the pipe.

    Parameters
    ----------
    listening : Listening, optional
        Take orders.
    """

    def __init__(self, listening: Listening | None = None) -> None:
        self._pipe, theirs = Pipe()
        orders = None if listening is None else listening.open()
        inherited = [end.fileno() for end in (theirs, orders) if end is not None]
        command = [sys.executable, "-m", "minsnap.cli.companion", *map(str, inherited)]
        before = signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C stops the flight and not what shows it
        try:
            self._process = subprocess.Popen(command, pass_fds=inherited)
        finally:
            signal.signal(signal.SIGINT, before)
        for end in (theirs, orders):
            if end is not None:
                end.close()
        self._next_bar, self._gone, self._listening = 0.0, False, listening is not None
        self._first: float | None = None
        self.streamer: minsnap.flight.Streamer | None = None
        self._send("listen", listening)

    def __enter__(self) -> Companion:
        return self

    def __exit__(self, *raised: object) -> None:
        self._pipe.close()
        try:
            self._process.wait(2.0)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()

    def event(self, text: str) -> None:
        """Show a sentence."""
        self._send("event", text)

    def status(self, status: minsnap.flight.StreamStatus) -> None:
        """Show the status of the flight, and take over what was ordered."""
        if monotonic() >= self._next_bar:
            self._next_bar = monotonic() + _INTERVAL
            self._send("bar", progress_line(status))
        if self.streamer is None:
            return
        if self.streamer.first != self._first:
            self._first = self.streamer.first
            self._send("first", self._first)
        while not self._gone and self._pipe.poll():
            self._obey(self.streamer)
        if self._gone and self._listening:
            self._end_input(self.streamer)

    def _end_input(self, streamer: minsnap.flight.Streamer) -> None:
        """Take the end of the process for the end of the orders; it shows nothing any more, so it is said here."""
        self._listening = False
        streamer.finish()
        with suppress(OSError):
            print("minsnap: what took the orders has ended: the flight ends where its plan does", file=sys.stderr)

    def _obey(self, streamer: minsnap.flight.Streamer) -> None:
        try:
            name, change = self._pipe.recv()
        except (EOFError, OSError):
            self._gone = True
            return
        if name != "change":
            getattr(streamer, name)()
            return
        try:
            streamer.change(change)
            self._send("taken", streamer.began)
        except MinsnapError as error:
            self._send("refused", (isinstance(error, TimingError), str(error)))

    def _send(self, name: str, content: Any) -> None:
        """Send if the pipe takes it at once."""
        try:
            if not self._gone and select.select([], [self._pipe], [], 0.0)[1]:
                self._pipe.send((name, content))
        except OSError:
            self._gone = True


def progress_line(status: minsnap.flight.StreamStatus) -> str:
    """Return one line: the phase, a bar, the time, the tracking error."""
    share = status.elapsed / status.duration if status.duration else 1.0
    bar = "#" * round(_WIDTH * share)
    error = "" if status.error is None else f"  {status.error:.2f} m from its setpoint"
    return f"{status.phase.value} [{bar:<{_WIDTH}}] {status.elapsed:.1f}/{status.duration:.1f} s{error}"


class RemoteFlight:
    """The flight, as the companion sees it through the pipe."""

    def __init__(self, pipe: Connection) -> None:
        self._pipe = pipe
        self._first: float | None = None
        self._answer: tuple[str, Any] | None = None
        self._bar = sys.stderr.isatty()
        self.began = 0.0
        self.listening: Listening | None = None

    @property
    def now(self) -> float | None:
        """Instant on the clock of the trajectory that is flown [s]; None unless it is flying."""
        return None if self._first is None else max(monotonic() - self._first, 0.0) - self.began

    def change(self, change: Change) -> minsnap.Trajectory:
        """Hand a change over; return what is flown from its splice on."""
        chosen = change.trajectory if change.certified else change.stop
        self._pipe.send(("change", change))
        self._answer = None
        while self._answer is None:
            self.hear()
        name, content = self._answer
        if name == "refused":
            raise (TimingError if content[0] else FlightError)(content[1])
        self.began = content
        assert chosen is not None
        return chosen

    def stop(self) -> None:
        """Stop and hold."""
        self._pipe.send(("stop", None))

    def finish(self) -> None:
        """End the flight at the end of what is flown."""
        self._pipe.send(("finish", None))

    def hear(self) -> None:
        """Take one message of the flight; EOFError when it is over."""
        name, content = self._pipe.recv()
        if name in ("event", "bar"):
            self._show(name, content)
        elif name == "first":
            self._first = content
        elif name == "listen":
            self.listening = content
        else:
            self._answer = name, content

    def _show(self, name: str, text: str) -> None:
        if name == "bar" and not self._bar:
            return
        clear = "\r\x1b[K" if self._bar else ""
        sys.stderr.write(f"{clear}{text}" + ("\n" if name == "event" else ""))
        sys.stderr.flush()


class OrderLines:
    """Lines from the standard input, or datagrams, each with a way to answer."""

    def __init__(self, descriptor: int | None, printed: bool) -> None:
        self._socket = None if descriptor is None else socket.socket(fileno=descriptor)
        self._printed = printed or descriptor is None
        self._rest = b""
        self.over = False

    def fileno(self) -> int:
        """Return the file descriptor that is readable once a line is there."""
        return sys.stdin.fileno() if self._socket is None else self._socket.fileno()

    def take(self, answers: Callable[[list[str]], Iterator[str]]) -> None:
        """Read all that has come and answer it."""
        lines, senders = self._waiting()
        for index, answered in enumerate(answers([line.decode(errors="replace") for line in lines])):
            if self._printed:
                print(answered, flush=True)
            if self._socket is not None:
                with suppress(OSError):  # too long for a datagram, or nobody is there
                    self._socket.sendto(answered.encode(), senders[index])

    def _waiting(self) -> tuple[list[bytes], list[Any]]:
        """Return the lines that have come, and of datagrams who sent them."""
        if self._socket is not None:
            came = [self._socket.recvfrom(_LARGEST)]
            while len(came) < _AT_ONCE and select.select([self._socket], [], [], 0.0)[0]:
                came.append(self._socket.recvfrom(_LARGEST))
            return [data for data, _ in came], [sender for _, sender in came]
        data = os.read(self.fileno(), _LARGEST)
        while select.select([self.fileno()], [], [], 0.0)[0] and data.count(b"\n") < _AT_ONCE:
            more = os.read(self.fileno(), _LARGEST)
            data += more
            if not more:
                self.over = True
                break
        self.over = self.over or not data
        *lines, self._rest = (self._rest + data + (b"\n" if self.over and self._rest else b"")).split(b"\n")
        return [line for line in lines if line.strip()], []


def main(descriptor: int, orders: int | None = None) -> None:
    """Show and listen until the flight is over."""
    pipe = Connection(descriptor)
    flight = RemoteFlight(pipe)
    try:
        flight.hear()
        if flight.listening is None:
            while True:
                flight.hear()
        printed = flight.listening.exploring is not None
        _listen(pipe, flight, flight.listening, OrderLines(orders, printed))
    except (EOFError, OSError):  # the flight is over, or the terminal is closed
        return


def _listen(pipe: Connection, flight: RemoteFlight, listening: Listening, lines: OrderLines) -> None:
    beside = listening.answering(flight)
    while True:
        ends = [pipe.fileno(), *([] if lines.over else [lines.fileno()])]
        ready = select.select(ends, [], [], _INTERVAL)[0]
        if pipe.fileno() in ready:
            flight.hear()
        elif ready:
            lines.take(beside.answers)
            if lines.over:
                beside.ended()
        said = beside.quiet()
        if said is not None:
            print(said, flush=True)


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
