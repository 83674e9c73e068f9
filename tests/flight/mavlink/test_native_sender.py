"""The thread that sends: what arrives, in which order and with which numbers, and what must not leave."""

import os
import socket
import time
import tty

import pytest
from pymavlink.dialects.v20 import common

from minsnap.flight.mavlink.native_sender import LONGEST, NativeSender
from minsnap.native.library import core, using

pytestmark = pytest.mark.skipif(core().library is None, reason="the native core is not in use")

RATE, MAX_GAP = 100.0, 0.3
MESSAGE = common.MAVLink_set_position_target_local_ned_message
CODEC = common.MAVLink(None, srcSystem=7, srcComponent=9)


def datagram(number):
    place = (0.5 * number, -number, 3.0)
    return bytes(MESSAGE(number, 1, 1, 1, 0, *place, *(0.0,) * 6, 0.25, 0.125).pack(CODEC))


class Line:
    """A sender and the socket that it sends to."""

    def __init__(self, delay=0.1):
        self.receiver = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.receiver.bind(("127.0.0.1", 0))
        self.receiver.setblocking(False)
        self.port = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.start = time.monotonic() + delay
        self.sender = NativeSender.open(self.port.fileno(), RATE, self.start, MAX_GAP, MESSAGE.crc_extra)
        self.parser = common.MAVLink(None)
        self.running = True

    def supply(self, first, numbers, flying=True, **changes):
        packed = [b"" if number is None else datagram(number) for number in numbers]
        return self.sender.supply(first, packed, [flying] * len(packed), self.receiver.getsockname())

    def supply_until(self, flying, seen):
        return supply_until(self.sender, self.start, self.receiver.getsockname(), flying, seen)

    def stop(self):
        if self.running:
            self.sender.stop()
        self.running = False

    def arrived(self):
        """Messages that have come, read by pymavlink, which checks their checksums."""
        found = []
        while True:
            try:
                found += self.parser.parse_buffer(self.receiver.recv(LONGEST)) or []
            except BlockingIOError:
                return found

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.stop()
        self.sender.close()
        self.port.close()
        self.receiver.close()


def wait_until(instant):
    time.sleep(max(0.0, instant - time.monotonic()))


def supply_until(sender, start, target, flying, seen, count=20):
    """Prepare the next slots again and again, however late this thread or the sender's is, until something is seen.

    Returns the last slot prepared.
    """
    for _ in range(3000):
        first = max(0, int((time.monotonic() - start) * RATE) + 2)
        packed = [datagram(number) for number in range(first, first + count)]
        if seen(sender.supply(first, packed, [flying] * count, target)):
            return first + count - 1
        time.sleep(0.01)
    raise AssertionError("the sender's thread has done nothing for half a minute")


def test_slots_leave_in_order_never_early_and_as_they_were_given():
    served = []

    def several(taken):
        served.extend(line.sender.drain())
        return len(served) > 5

    with Line() as line:
        line.supply_until(True, several)
        line.stop()
        served, arrived = [*served, *line.sender.drain()], line.arrived()
    assert [message.time_boot_ms for message in arrived] == [each.slot for each in served]
    assert len(served) > 1 and [each.slot for each in served] == sorted({each.slot for each in served})
    assert all(each.time >= line.start + each.slot / RATE for each in served)
    for message in arrived:
        number = message.time_boot_ms
        assert (message.x, message.y, message.z, message.yaw, message.yaw_rate) == (
            0.5 * number,
            -number,
            3,
            0.25,
            0.125,
        )
        assert (message.get_srcSystem(), message.get_srcComponent()) == (7, 9)


def test_messages_leave_through_a_serial_port():
    ours, theirs = os.openpty()
    tty.setraw(theirs)
    start = time.monotonic() + 0.3
    sender = NativeSender.open(theirs, RATE, start, MAX_GAP, MESSAGE.crc_extra)
    served = []

    def some(taken):
        served.extend(each.slot for each in sender.drain())
        return served

    supply_until(sender, start, None, False, some)
    sender.stop()
    served += [each.slot for each in sender.drain()]
    sender.close()
    arrived = common.MAVLink(None).parse_buffer(os.read(ours, 65536))
    assert [message.time_boot_ms for message in arrived] == served
    os.close(ours)
    os.close(theirs)


@pytest.mark.slow
def test_sequence_numbers_are_shared_and_wrap():
    numbers, others = [], []

    def wrapped(taken):
        numbers.extend(message.get_seq() for message in line.arrived())
        if len(numbers) >= 25 * (len(others) + 1):
            others.append(line.sender.sequence())
        return len(numbers) > 260

    with Line(delay=0.02) as line:
        line.supply_until(False, wrapped)
        line.stop()
        numbers += [message.get_seq() for message in line.arrived()]
    assert len(others) >= 10
    assert sorted([*numbers, *others]) == sorted(k % 256 for k in range(len(numbers) + len(others)))


def test_what_is_prepared_can_be_replaced_until_it_leaves():
    for _ in range(20):  # until all is replaced before it leaves, and the sender's thread is awake meanwhile
        with Line(delay=0.5) as line:
            line.supply(0, range(30))
            line.supply(5, [100 + k for k in range(25)])
            line.supply(7, [None] * 2)
            in_time = time.monotonic() < line.start
            wait_until(line.start + 0.4)
            line.stop()
            numbers = {message.time_boot_ms for message in line.arrived()}
            served = {each.slot for each in line.sender.drain()}
        if in_time and len(numbers) > 2 and served & {7, 8}:
            break
    assert numbers <= {*range(5), 100, 101, *range(104, 125)} and len(numbers) > 2
    assert not {102, 103} & numbers and served - numbers


def test_after_a_long_gap_no_setpoint_of_the_flight_leaves_until_the_gap_was_seen():
    with Line(delay=0.05) as line:
        last = line.supply_until(True, lambda taken: line.arrived() and line.sender.drain())
        wait_until(line.start + (last + 1) / RATE + MAX_GAP)
        line.sender.drain(), line.arrived()
        before = line.sender.generation
        line.supply_until(True, lambda taken: not taken)  # prepared slots were thrown away, and no more are taken
        assert line.arrived() == [] and line.sender.drain() == []
        assert line.sender.generation == before + 1
        line.supply_until(False, lambda taken: line.arrived())


def test_nothing_leaves_after_the_stop():
    with Line(delay=0.02) as line:
        line.supply(0, range(200))
        wait_until(line.start + 0.2)
        line.stop()
        line.arrived()
        time.sleep(0.1)
        assert line.arrived() == []


def test_what_makes_no_sense_is_refused():
    with Line() as line:
        target = line.receiver.getsockname()
        assert not line.sender.supply(0, [b"x" * 40], [False], target)
        assert not line.sender.supply(0, [datagram(1)[:11]], [False], target)
        assert not line.sender.supply(-1, [datagram(1)], [False], target)
        assert not line.sender.supply(0, [b""] * 257, [False] * 257, target)


def test_without_the_native_core_there_is_none():
    with using("python"), socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as port:
        assert NativeSender.open(port.fileno(), 50.0, 1.0, 0.5, 143) is None


@pytest.mark.parametrize(("rate", "start", "gap"), [(0.0, 1.0, 1.0), (float("nan"), 1.0, 1.0), (50.0, -1.0, 1.0)])
def test_a_schedule_that_makes_no_sense_is_refused(rate, start, gap):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as port:
        assert NativeSender.open(port.fileno(), rate, start, gap, 143) is None
