"""The process beside a flight: what the flight hears of it, and what it hears of the flight, through one pipe."""

import socket
from multiprocessing import Pipe
from types import SimpleNamespace

import pytest

from minsnap.cli.companion import Companion, Listening, OrderLines, RemoteFlight, progress_line
from minsnap.errors import FlightError, InputError, TimingError


class Streamer:
    """What the flight's end calls."""

    first, began = None, 0.0

    def __init__(self):
        self.taken, self.error = [], None

    def change(self, change):
        if self.error is not None:
            raise self.error
        self.taken.append(change)
        self.began = 1.5

    def stop(self):
        self.taken.append("stop")

    def finish(self):
        self.taken.append("finish")


@pytest.fixture
def ends():
    """The flight's end, without a process, and the other."""
    ours, theirs = Pipe()
    companion = Companion.__new__(Companion)
    companion._pipe, companion._next_bar, companion._gone, companion._first = ours, float("inf"), False, None
    companion._listening, companion.streamer = True, Streamer()
    yield companion, RemoteFlight(theirs)
    ours.close()
    theirs.close()


def served(companion, flight, call):
    """Let the flight's end answer each wait of the other."""
    hear = flight.hear
    flight.hear = lambda: (companion.status(None), hear())
    try:
        return call()
    finally:
        flight.hear = hear


def test_a_change_is_taken_over_and_both_know_when_it_began(ends):
    companion, flight = ends
    change = SimpleNamespace(trajectory="new", stop="stop", certified=True)
    assert flight.now is None
    companion.streamer.first = 100.0
    assert served(companion, flight, lambda: flight.change(change)) == "new" and flight.began == 1.5
    assert len(companion.streamer.taken) == 1 and flight.now is not None
    uncertain = SimpleNamespace(trajectory="new", stop="stop", certified=False)
    assert served(companion, flight, lambda: flight.change(uncertain)) == "stop"


@pytest.mark.parametrize("error", [TimingError("too late"), FlightError("no flight")])
def test_what_the_flight_refuses_is_raised_as_it_was(ends, error):
    companion, flight = ends
    companion.streamer.error = error
    with pytest.raises(type(error), match=str(error)):
        served(companion, flight, lambda: flight.change(SimpleNamespace(trajectory=1, stop=2, certified=True)))


def test_stops_are_passed_on_and_a_companion_that_is_gone_is_not_waited_for(ends):
    companion, flight = ends
    flight.stop()
    flight.finish()
    companion.status(None)
    assert companion.streamer.taken == ["stop", "finish"]
    flight._pipe.close()
    companion.status(None)
    companion.event("nobody hears this")


def test_the_end_of_the_process_is_that_of_the_orders_and_is_said(ends, capsys):
    """Orders used to end without a word, and a flight that stays went on for ever."""
    companion, flight = ends
    flight._pipe.close()
    for _ in range(3):
        companion.status(None)
    assert companion.streamer.taken == ["finish"]
    assert capsys.readouterr().err == "minsnap: what took the orders has ended: the flight ends where its plan does\n"


def test_an_answer_that_no_datagram_holds_ends_nothing():
    """It used to end the process that reads orders."""
    lines = OrderLines(None, printed=True)
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as orders,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender,
    ):
        orders.bind(("127.0.0.1", 0))
        sender.bind(("127.0.0.1", 0))
        sender.settimeout(10.0)
        lines._socket = orders
        for answer in ("x" * 70000, "ok"):
            sender.sendto(b"stop", orders.getsockname())
            lines.take(lambda asked, answer=answer: [answer])
        assert sender.recv(100) == b"ok"


def test_lines_are_answered_one_by_one_however_they_come(capfd, monkeypatch):
    import os

    out, into = os.pipe()
    lines = OrderLines(None, printed=True)
    monkeypatch.setattr(OrderLines, "fileno", lambda self: out)
    os.write(into, b"stop\n\nfin")
    lines.take(lambda asked: map(str.upper, asked))
    os.write(into, b"ish")
    os.close(into)
    lines.take(lambda asked: map(str.upper, asked))
    lines.take(lambda asked: map(str.upper, asked))
    os.close(out)
    assert capfd.readouterr().out.split() == ["STOP", "FINISH"] and lines.over


def test_a_port_that_cannot_be_listened_on_is_told():
    for port in ("a:b", "999999", "8.8.8.8:5"):
        with pytest.raises(InputError, match=f"cannot listen on {port}"):
            Listening(None, None, port=port).open()


def test_the_bar_says_phase_time_and_error():
    status = SimpleNamespace(elapsed=3.0, duration=6.0, error=0.25, phase=SimpleNamespace(value="flying"))
    assert progress_line(status) == f"flying [{'#' * 15:<30}] 3.0/6.0 s  0.25 m from its setpoint"
