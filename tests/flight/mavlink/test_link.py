"""Links: what they open, what they refuse, whom they listen to."""

import os
import socket
import struct
import subprocess
import sys
import time

import numpy as np
import pytest
from clocks import SharedClock
from standin import StandIn, mavutil

from minsnap.errors import FileError, InputError, LinkError
from minsnap.flight.mavlink import _transports
from minsnap.flight.mavlink._transports import LinkTransport, open_transport
from minsnap.flight.mavlink.link import Clock, Link, open_link, read_signing_key
from minsnap.flight.mavlink.vehicle_messages import load_dialect


@pytest.mark.parametrize("connection", ["udpin:0", "udpin::0", "udp:127.0.0.1:0", ":0", "tcpin:0"])
def test_without_a_host_the_loopback_listens(connection):
    transport = open_transport(connection)
    assert transport.address.split(":")[1] == "127.0.0.1"
    bound = socket.socket(fileno=os.dup(transport.readers()[0]))
    assert bound.getsockname()[0] == "127.0.0.1"
    bound.close()
    transport.close()


@pytest.mark.parametrize("connection", ["", "udpin", "udpin:here:there", "tcp:127.0.0.1:99999", "carrier pigeon"])
def test_what_cannot_be_understood_is_named(connection):
    with pytest.raises(LinkError, match="cannot understand the connection"):
        open_transport(connection)


@pytest.mark.parametrize("kind", ["udpin", "tcpin"])
def test_a_port_in_use_is_named(kind):
    taken = open_transport(f"{kind}:127.0.0.1:0")
    bound = socket.socket(fileno=os.dup(taken.readers()[0]))
    port = bound.getsockname()[1]
    with pytest.raises(LinkError, match=f"{kind}:127.0.0.1:{port}: another program uses that port"):
        open_transport(f"{kind}:127.0.0.1:{port}")
    bound.close()
    taken.close()


def test_nobody_at_the_other_end_of_tcp():
    with pytest.raises(LinkError, match="cannot connect to tcp:127.0.0.1:1: Connection refused"):
        open_transport("tcp:127.0.0.1:1")


def test_a_host_that_does_not_exist():
    with pytest.raises(LinkError, match="no host is called 'no.such.host.invalid'"):
        open_transport("udpout:no.such.host.invalid:14550")


def test_a_device_that_does_not_exist():
    with pytest.raises(LinkError, match="cannot open serial:/dev/nothing:57600"):
        open_transport("serial:/dev/nothing:57600")


def test_a_baud_rate_that_hangs_up_is_refused():
    ours, theirs = os.openpty()
    with pytest.raises(LinkError, match=":0: give a baud rate"):
        open_transport(f"serial:{os.ttyname(theirs)}:0")
    os.close(ours)
    os.close(theirs)


def test_a_serial_port_carries_bytes_both_ways():
    ours, theirs = os.openpty()
    port = open_transport(f"{os.ttyname(theirs)},57600")
    os.set_blocking(ours, False)
    import tty

    tty.setraw(ours)
    port.send(b"there")
    os.write(ours, b"back")
    time.sleep(0.05)
    assert (os.read(ours, 100), port.receive()[0]) == (b"there", b"back")
    port.close()
    os.close(ours)
    os.close(theirs)


def test_a_serial_port_that_was_unplugged_wakes_nobody_up():
    """It used to be read without a pause, with real-time priority, until the hold was given up."""
    ours, theirs = os.openpty()
    port = open_transport(f"{os.ttyname(theirs)},57600")
    os.close(theirs)
    assert port.receive()[0] == b"" and port.readers()
    os.close(ours)
    assert port.receive()[0] == b"" and not port.readers()
    port.close()


def own_port(listener):
    with socket.socket(fileno=os.dup(listener.readers()[0])) as bound:
        return bound.getsockname()[1]


def received(transport):
    deadline = time.monotonic() + 60.0
    while time.monotonic() < deadline:
        data = transport.receive()[0]
        if data:
            return data
    return b""


def test_a_vehicle_that_comes_back_is_heard_though_its_old_connection_was_never_closed(monkeypatch):
    server = open_transport("tcpin:127.0.0.1:0")
    place = "127.0.0.1", own_port(server)
    with socket.create_connection(place) as old, socket.create_connection(place) as new:
        monkeypatch.setattr(_transports, "_PATIENCE", 1e9)
        old.sendall(b"old")
        assert received(server) == b"old"
        new.sendall(b"new")
        assert server.receive()[0] == b"", "one that speaks is kept"
        monkeypatch.setattr(_transports, "_PATIENCE", 0.0)
        assert received(server) == b"new"
    server.close()


def test_the_host_of_tcp_is_looked_up_once(monkeypatch):
    """A name that could not be looked up any more was an error in flight, and the hold was given up."""
    monkeypatch.setattr(_transports, "resolve", lambda host, address: "127.0.0.1")
    server = open_transport("tcpin:127.0.0.1:0")
    client = open_transport(f"tcp:vehicle.invalid:{own_port(server)}")
    server.close()
    for _ in range(3):
        assert client.receive()[0] == b""
    client.close()


@pytest.mark.slow
def test_tcp_comes_back_after_the_other_end_was_gone():
    server = open_transport("tcpin:127.0.0.1:0")
    bound = socket.socket(fileno=os.dup(server.readers()[0]))
    port = bound.getsockname()[1]
    bound.close()
    client = open_transport(f"tcp:127.0.0.1:{port}")

    def exchange(server):
        deadline = time.monotonic() + 120.0
        while time.monotonic() < deadline:
            client.receive()
            client.send(b"x")
            if b"x" in server.receive()[0]:
                return True
            time.sleep(0.01)
        return False

    assert exchange(server)
    server.close()
    for _ in range(20):
        client.receive()
        client.send(b"lost")
    again = open_transport(f"tcpin:127.0.0.1:{port}")
    assert exchange(again)
    client.close()
    again.close()


def test_our_heartbeat_goes_out_every_second_and_not_in_bursts():
    clock = SharedClock()
    receiver = mavutil.mavlink_connection("udpin:127.0.0.1:0")
    link = open_link(f"udpout:127.0.0.1:{receiver.port.getsockname()[1]}", clock)
    began = clock.now()
    for _ in range(10):
        list(link.pump(clock.now() + 1.0))
    clock.skip(5.0)
    for _ in range(10):
        list(link.pump(clock.now()))
    took = clock.now() - began
    beats = []
    while (message := receiver.recv_msg()) is not None:
        beats.append(message)
    assert {m.get_type() for m in beats} == {"HEARTBEAT"}
    assert took - 6.5 <= len(beats) <= took - 2, "the pause of 5 s is not made up for"
    assert (beats[0].type, beats[0].autopilot, beats[0].get_srcComponent()) == (18, 8, 191)
    link.close()
    receiver.close()


def test_no_heartbeat_says_how_long_and_where():
    link = open_link("udpin:127.0.0.1:0", SharedClock())
    with pytest.raises(LinkError, match=r"no heartbeat of a vehicle within 5 s on udpin:127.0.0.1:0$"):
        link.wait_for_vehicle(5.0)
    link.close()


@pytest.mark.parametrize("wait", [-1.0, float("nan")])
def test_a_wait_that_never_ends_or_is_over_is_refused(wait):
    link = open_link("udpin:127.0.0.1:0", SharedClock())
    with pytest.raises(InputError, match="the wait for a vehicle is .* s: it must be 0 or more"):
        link.wait_for_vehicle(wait)
    link.close()


def test_who_sends_to_a_port_that_nobody_answers_is_told_to_listen_there():
    link = open_link("udpout:127.0.0.1:9", SharedClock())
    with pytest.raises(LinkError, match=r"sends to a port is heard on it: try udpin:127.0.0.1:9$"):
        link.wait_for_vehicle(5.0)
    link.close()


def test_a_wrong_system_is_not_listened_to_and_is_named():
    clock = SharedClock()
    with StandIn(clock=clock, system=3) as vehicle:
        link = open_link(f"udpout:127.0.0.1:{vehicle.port}", clock, system=1)
        with pytest.raises(LinkError, match="no heartbeat of system 1 .*; heard only system 3: check the system id"):
            link.wait_for_vehicle(4.0)
        link.close()


def test_other_systems_and_ground_stations_are_ignored():
    clock = SharedClock()
    link = open_link("udpin:127.0.0.1:0", clock)
    bound = socket.socket(fileno=os.dup(link._transport.readers()[0]))
    address = f"udpout:127.0.0.1:{bound.getsockname()[1]}"
    bound.close()
    ground = mavutil.mavlink_connection(address, source_system=255)
    ground.mav.heartbeat_send(6, 8, 0, 0, 4)
    with StandIn(address, clock=clock, system=7) as vehicle:
        assert link.wait_for_vehicle(20.0).system == 7
        with StandIn(address, clock=clock, system=9) as other:
            other.body.position = [99.0, 99.0, 99.0]
            while not link.ignored[(9, 1)]:
                messages = list(link.pump(clock.now() + 0.2))
                assert all(m.get_srcSystem() == 7 for m in messages)
        vehicle.until(lambda v: link.vehicle.position is not None or not list(link.pump(clock.now() + 0.1)))
        assert link.vehicle.position == (0.0, 0.0, 0.0)
        assert link.ignored[(255, 0)] == 1
    link.close()
    ground.close()


def test_messages_in_the_name_of_the_vehicle_from_another_address_are_ignored_while_it_is_heard():
    """A forged heartbeat would turn the setpoints to its sender, and a forged position end the flight."""
    clock = SharedClock()
    link = open_link("udpin:127.0.0.1:0", clock)
    bound = socket.socket(fileno=os.dup(link._transport.readers()[0]))
    address = f"udpout:127.0.0.1:{bound.getsockname()[1]}"
    bound.close()
    forger = mavutil.mavlink_connection(address, source_system=7, source_component=1)
    with StandIn(address, clock=clock, system=7) as vehicle:
        assert link.wait_for_vehicle(20.0).system == 7
        home = link.outlet()
        while link.ignored[(7, 1)] < 3:
            forger.mav.heartbeat_send(2, 12, 0, 0, 4)
            forger.mav.local_position_ned_send(0, 99.0, 99.0, 99.0, 0.0, 0.0, 0.0)
            list(link.pump(clock.now() + 0.2))
            assert link.vehicle.position in (None, (0.0, 0.0, 0.0)) and link.outlet() == home
        vehicle.until(lambda v: link.vehicle.position is not None or not list(link.pump(clock.now() + 0.1)))
    while link.outlet() == home:
        forger.mav.heartbeat_send(2, 12, 0, 0, 4)
        list(link.pump(clock.now() + 0.5))
    link.close()
    forger.close()


class Fed(LinkTransport):
    """Gives datagrams of a list, all from one address."""

    address = "fed"

    def __init__(self):
        self.waiting = []

    def send(self, data):
        pass

    def receive(self):
        return (self.waiting.pop(0), ("here", 1)) if self.waiting else (b"", None)

    def readers(self):
        return []

    def close(self):
        pass


def forged(draw, dialect):
    """Return a message of any kind with any numbers in the name of the vehicle, a fifth of them with a flipped bit."""
    kinds = list(dialect.mavlink_map.values())
    while True:
        kind = kinds[draw.integers(len(kinds))]
        counts = dict(zip(kind.ordered_fieldnames, kind.array_lengths, strict=True))
        fields = [number(draw, of, counts[name]) for name, of in zip(kind.fieldnames, kind.fieldtypes, strict=True)]
        try:
            data = bytearray(kind(*fields).pack(dialect.MAVLink(None, srcSystem=1, srcComponent=1)))
        except (TypeError, struct.error):  # a kind of field that is not drawn
            continue
        if draw.random() < 0.2:
            data[draw.integers(len(data))] ^= 1 << draw.integers(8)
        return bytes(data)


def number(draw, kind, count):
    if kind == "char":
        return draw.bytes(max(count, 1))
    if kind in ("float", "double"):
        own = [float("nan"), float("inf"), -float("inf"), 0.0, 1e38, -1e38, 1.5]
    else:
        bits = int("".join(filter(str.isdigit, kind.split("_")[0])))
        signed = not kind.startswith("u")
        own = [0, 1, 2 ** (bits - signed) - 1, -(2 ** (bits - 1)) if signed else 2 ** (bits - 1)]
    drawn = [own[draw.integers(len(own))] for _ in range(max(count, 1))]
    return drawn if count else drawn[0]


@pytest.mark.slow
def test_forged_messages_of_every_kind_leave_a_state_of_numbers():
    """No message raises, positions stay finite, and texts can be printed."""
    dialect, clock, draw = load_dialect(), Clock(), np.random.default_rng(1)
    fed = Fed()
    link = Link(fed, clock)
    beat = dialect.MAVLink_heartbeat_message(2, 12, 81, 0, 4, 3)
    fed.waiting = [bytes(beat.pack(dialect.MAVLink(None, srcSystem=1, srcComponent=1)))]
    heard = {message.get_type() for message in link.pump(clock.now())}
    for _ in range(4000):
        fed.waiting = [forged(draw, dialect)]
        heard |= {message.get_type() for message in link.pump(clock.now())}
        known = link.vehicle
        assert known.position is None or np.isfinite([*known.position, *known.velocity]).all()
        assert all(text.isprintable() and len(text) <= 500 for text in known.warnings)
    assert {"HEARTBEAT", "LOCAL_POSITION_NED", "COMMAND_ACK", "STATUSTEXT"} <= heard and link.refused


KEY = bytes(range(32))


@pytest.mark.parametrize(("theirs", "heard"), [(KEY, True), (bytes(32), False), (None, False)])
def test_signed_links_hear_only_their_own_key(theirs, heard):
    clock = SharedClock()
    with StandIn(clock=clock) as vehicle:
        if theirs is not None:
            vehicle.link.setup_signing(theirs, allow_unsigned_callback=lambda *_: False)
        link = open_link(f"udpout:127.0.0.1:{vehicle.port}", clock, signing_key=KEY)
        if heard:
            assert link.wait_for_vehicle(20.0).system == 1
            vehicle.until(lambda v: any(kind == "HEARTBEAT" for _, kind, _ in v.heard) or link._beat())
        else:
            with pytest.raises(LinkError, match="messages were damaged or not signed with this key"):
                link.wait_for_vehicle(4.0)
        link.close()


def test_signing_keys_are_read_raw_and_in_hexadecimal(tmp_path):
    raw, text, bad = tmp_path / "raw", tmp_path / "hex", tmp_path / "bad"
    raw.write_bytes(KEY)
    text.write_text(KEY.hex() + "\n")
    bad.write_text("secret")
    assert read_signing_key(raw) == read_signing_key(text) == KEY
    with pytest.raises(FileError, match="holds no MAVLink signing key: it must be 32 bytes, or 64 hexadecimal"):
        read_signing_key(bad)


def test_noise_does_not_disturb():
    clock = Clock()
    link = open_link("udpin:127.0.0.1:0", clock)
    bound = socket.socket(fileno=os.dup(link._transport.readers()[0]))
    noise = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    for size in (1, 7, 280, 1400):
        noise.sendto(b"\xfd" + os.urandom(size), bound.getsockname())
    time.sleep(0.05)
    assert list(link.pump(clock.now())) == [] and not link.vehicle.known
    with StandIn(f"udpout:127.0.0.1:{bound.getsockname()[1]}", beat_period=0.1):
        assert link.wait_for_vehicle(10.0).system == 1
    noise.close()
    bound.close()
    link.close()


def test_a_missing_pymavlink_names_the_extra():
    code = (
        "import sys; sys.modules['pymavlink'] = None\n"
        "from minsnap.flight.mavlink.link import open_link\n"
        "try: open_link('udpin:0')\n"
        "except ImportError as error: print(error)"
    )
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert said.strip() == "talking to a vehicle needs pymavlink: pip install 'minsnap[mavlink]'"
