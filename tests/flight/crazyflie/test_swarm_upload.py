"""Uploads to stand-ins that speak CRTP over UDP: every byte, lost packets, vehicles that disappear."""

import math
import re
import signal
import struct
from dataclasses import replace

import numpy as np
import pytest
from crtp_vehicle import CrtpVehicle

import minsnap
from minsnap.cli.app import main
from minsnap.errors import FileError, FleetError, FlightError, LinkError
from minsnap.files.formats.crazyflie import compressed
from minsnap.flight import crtp_link, swarm_flight
from minsnap.flight.high_level import LAND, GroupStart
from minsnap.flight.swarm_flight import FlightTimes
from minsnap.flight.swarm_upload import upload, uploads
from minsnap.shows.fleet_files import write_fleet
from minsnap.shows.memory_parts import parts_of, upload_of

QUICK = FlightTimes(0.02, 0.02, 0.02, 0.01, climb=math.inf, travel=math.inf, sink=math.inf)
BESIDE = (1.0, 0.0, 0.0)
"""Below the start of the second of a pair."""


@pytest.fixture(autouse=True)
def short_waits(monkeypatch):
    monkeypatch.setattr(crtp_link, "WAIT", 0.05)
    monkeypatch.setattr(crtp_link, "TRIES", 24)  # as patient as without, on a busy machine


def pair():
    """Two vehicles, short enough to wait for."""
    one = minsnap.plan([(0, 0, 1), (0.2, 0, 1.2), (0.3, 0.1, 1)], [0.1, 0.1], yaw=0.5)
    two = minsnap.plan([(1, 0, 0.8), (1.2, 0, 1)], [0.2])
    return minsnap.Fleet((one, two))


def packed(curve):
    """The firmware's bytes of polynomials: x, y, z, yaw ascending, then the duration, float32."""
    content = b""
    for i, duration in enumerate(curve.durations):
        t0 = curve.breaks[i]
        powers = [curve(t0, k) / np.prod(np.arange(1, k + 1)) for k in range(8)]
        yaw = [float(curve.yaw(t0))] + [0.0] * 7
        content += struct.pack("<33f", *(p[a] for a in range(3) for p in powers), *yaw, duration)
    return content


@pytest.mark.slow
@pytest.mark.parametrize("lossy", [False, True])
def test_every_byte_arrives_though_packets_are_lost(lossy):
    fleet = pair()
    with CrtpVehicle(lossy) as one, CrtpVehicle(lossy, at=BESIDE) as two:
        upload(fleet, [one.uri, two.uri])
    held = np.frombuffer(bytes(one.memory[:264]), "<f4")
    assert held == pytest.approx(np.frombuffer(packed(fleet[0]), "<f4"), rel=1e-5, abs=1e-3)
    assert struct.unpack("<66f", one.memory[:264])[32] == pytest.approx(0.1)
    assert set(body for _, body in one.commands) == {struct.pack("<BBBBIB", 6, 1, 1, 0, 0, 2), bytes([0, 1])}
    assert bytes(two.memory[:264]) == upload_of(fleet[1]).content, "a lone piece is two halves"


def test_a_long_trajectory_is_compressed():
    corners = np.random.default_rng(1).uniform(-1.0, 1.0, (41, 3))
    fleet = minsnap.Fleet((minsnap.plan(corners, np.full(40, 1.0)),))
    with CrtpVehicle() as one:
        upload(fleet, [one.uri])
    content = compressed(fleet[0])
    assert bytes(one.memory[: len(content)]) == content and content.endswith(bytes(3))
    assert one.commands[0][1] == struct.pack("<BBBBIB", 6, 1, 1, 1, 0, 40)


def test_what_is_held_is_within_its_stated_distance_or_refused():
    """A leg of 70 s beside one of 0.4 s was off by metres in float32, without a word."""
    corners = np.array([(0.0, 0.0, 1.0), (2.0, 0.0, 1.0), (2.0, 0.1, 1.0)])
    with pytest.raises(FileError, match=r"up to 0\.\d+ m from the planned one"):
        upload_of(minsnap.plan(corners, [70.0, 0.4]))
    curve = minsnap.plan(corners, [15.0, 0.4])
    upload = upload_of(curve)
    rows = np.frombuffer(upload.content, "<f4").astype(float).reshape(2, 33)
    t, start, off = np.linspace(0.0, 1.0, 2001), 0.0, 0.0
    for row in rows:
        held = np.stack(
            [np.polynomial.polynomial.polyval(t * row[32], row[8 * axis : 8 * axis + 8]) for axis in range(3)]
        )
        off = max(off, np.linalg.norm(held.T - curve(np.minimum(start + t * row[32], curve.duration)), axis=1).max())
        start += row[32]
    assert 1e-4 < off <= upload.distance < 0.01


def test_a_memory_that_reads_otherwise_is_an_error_and_nothing_takes_off():
    with CrtpVehicle() as one, CrtpVehicle(corrupt=100, at=BESIDE) as two:
        with pytest.raises(FlightError, match=f"{two.uri}: byte 100 reads"):
            upload(pair(), [one.uri, two.uri], start=True, timing=QUICK)
    assert all(body[0] in (0, 6) for _, body in one.commands)


@pytest.mark.slow
@pytest.mark.parametrize("lossy", [False, True])
def test_a_flight_takes_off_goes_to_its_starts_starts_and_lands(lossy):
    fleet, told = pair(), []
    with CrtpVehicle(lossy) as one, CrtpVehicle(lossy, at=BESIDE) as two:
        upload(fleet, [one.uri, two.uri], start=True, timing=QUICK, told=told.append)
    for vehicle, curve in ((one, fleet[0]), (two, fleet[1])):
        bodies = list(dict.fromkeys(body for _, body in vehicle.commands))
        assert [body[0] for body in bodies] == [6, 0, 7, 12, 13, 8]
        assert struct.unpack("<BBff?f", bodies[2])[2] == pytest.approx(curve(0.0)[2])
        assert struct.unpack("<BBBBfffff", bodies[3])[4:7] == pytest.approx(curve(0.0))
        assert bodies[4] == struct.pack("<BBBBBBf", 13, 1, 0, 0, 0, 1, 1.0)
    assert "2 memories written and read back" in told[0] and told[-1] == "landing"


def largest_speed(way, duration):
    """The greatest speed of a polynomial of degree 7 from rest to rest, with no acceleration and jerk at its ends."""
    t = np.linspace(0.0, 1.0, 2001)
    return way / duration * np.gradient(35 * t**4 - 84 * t**5 + 70 * t**6 - 20 * t**7, t).max()


@pytest.mark.parametrize(("height", "far"), [(1.0, 0.0), (6.0, 0.0), (6.0, 8.0)])
@pytest.mark.parametrize("lost", [False, True])
def test_ways_around_the_flight_last_as_long_as_their_lengths_need(monkeypatch, height, far, lost):
    """They used to last 2.5 to 3 s whatever their length: a vehicle fell from 6 m at 4 m/s, in an emergency too."""
    given, slept = [], []
    monkeypatch.setattr(swarm_flight, "command", lambda link, body: given.append(body))
    monkeypatch.setattr(swarm_flight, "start_group", lambda *_: 1 / 0 if lost else GroupStart("", 0.0, 1))
    fleet, times = minsnap.Fleet((minsnap.plan([(far, 0, height), (far, 1, height)], [2.0]),)), FlightTimes()
    approach = swarm_flight.proved_approach(fleet, np.zeros((1, 3)), times)
    try:
        swarm_flight._Flight(fleet, ["link"], times, approach, slept.append, str, parts_of(fleet), iter).fly()
    except ZeroDivisionError:
        assert lost
    up, there, down = given
    climb, approach, landing = (struct.unpack("<f", body[-4:])[0] for body in (up, there, down))
    assert (up[0], there[0], down[0]) == (7, 12, 8)
    assert climb >= times.take_off and approach >= times.approach and landing >= times.landing
    assert slept[:2] == pytest.approx([climb + times.settle, approach + times.settle])
    speeds = largest_speed(height, climb), largest_speed(far, approach), largest_speed(height, landing)
    assert (np.array(speeds) <= np.array([1.0, 1.0, 0.8]) + 1e-4).all()
    if height == 1.0:
        assert (climb, approach, landing) == (2.5, 3.0, 3.0)


@pytest.mark.slow
def test_a_curve_that_begins_on_the_ground_takes_off_by_itself():
    """Its vehicle was told to take off to height 0, and to go there."""
    with CrtpVehicle() as one, CrtpVehicle(at=BESIDE) as two:
        fleet = minsnap.Fleet((minsnap.plan([(0, 0, 0), (0, 0, 1)], [0.4]), pair()[1]))
        upload(fleet, [one.uri, two.uri], start=True, timing=QUICK)
    assert not {7, 12} & {body[0] for _, body in one.commands} and {7, 12} <= {body[0] for _, body in two.commands}


@pytest.mark.slow
def test_a_vehicle_that_disappears_on_the_ground_keeps_all_there():
    with CrtpVehicle() as one, CrtpVehicle(lasts=10, at=BESIDE) as two:
        with pytest.raises(LinkError, match=f"{two.uri} does not answer"):
            upload(pair(), [one.uri, two.uri], start=True, timing=QUICK)
    assert 7 not in [body[0] for _, body in one.commands]


@pytest.mark.slow
def test_a_vehicle_that_disappears_in_the_air_lands_the_others():
    told = []
    with CrtpVehicle() as one, CrtpVehicle(at=BESIDE) as two:
        settled = replace(QUICK, take_off=0.3)

        class Watched(list):
            def append(self, entry):
                super().append(entry)
                if entry[1][0] == 7:
                    two.lasts = two.seen

        two.commands = Watched()
        with pytest.raises(LinkError, match=f"{two.uri} does not answer"):
            upload(pair(), [one.uri, two.uri], start=True, timing=settled, told=told.append)
    sent = [body[0] for _, body in one.commands]
    assert sent[-1] == 8 and 13 not in sent
    assert told[-1] == f"told all that fly to land; no answer from {two.uri}"


def test_addresses_must_fit_the_vehicles():
    with pytest.raises(FleetError, match="1 addresses for 2 vehicles"):
        uploads(pair(), ["udp://127.0.0.1:1"])
    with pytest.raises(FleetError, match="stands twice"):
        uploads(pair(), ["udp://127.0.0.1:1"] * 2)


@pytest.mark.parametrize("uri", ["udp://", "udp://127.0.0.1", "udp://127.0.0.1:70000", "udp://:5"])
def test_an_address_without_host_or_port_is_said_in_a_sentence(uri):
    with pytest.raises(LinkError, match=r"cannot be reached: (give udp://HOST:PORT|Port out of range)"):
        crtp_link.open_link(uri)


def test_the_command_says_what_it_would_write_or_writes_it(tmp_path, capsys):
    write_fleet(pair(), tmp_path / "folder", "crazyswarm2")
    with pytest.raises(SystemExit) as left:
        main(["upload", str(tmp_path / "folder"), "--dry-run"])
    assert left.value.code in (0, None)
    said = capsys.readouterr().out
    assert re.search("E7E7E7E702: 2 pieces, 264 bytes, polynomials, at most .* mm from the curve", said)
    assert "\nstart: by a broadcast on radio://0/80/2M\nways: 2 stages to the starts, 1 to the ground, " in said
    with CrtpVehicle() as one, CrtpVehicle(at=BESIDE) as two:
        with pytest.raises(SystemExit) as left:
            main(["upload", str(tmp_path / "folder"), "--uri", one.uri, "--uri", two.uri])
    assert left.value.code in (0, None) and "2 memories written" in capsys.readouterr().err
    with pytest.raises(SystemExit) as left:
        main(["upload", str(tmp_path / "folder"), "--uri", "udp://127.0.0.1:9"])
    assert left.value.code == 2 and "1 addresses for 2 vehicles" in capsys.readouterr().err


@pytest.mark.parametrize("names", [None, ("left", "right")])
def test_a_dry_run_needs_no_addresses_and_an_upload_says_what_has_them(tmp_path, capsys, names):
    """A folder of plain CSV, as fleet writes it, was refused without addresses of a radio."""
    write_fleet(replace(pair(), names=names), tmp_path / "folder")
    with pytest.raises(SystemExit) as left:
        main(["upload", str(tmp_path / "folder"), "--dry-run"])
    *parts, start, ways, _, _ = capsys.readouterr().out.splitlines()
    assert left.value.code in (0, None) and start == "start: as the addresses say, of --uri or crazyflies.yaml"
    assert ways.endswith("up to 1.00 m high; all land in place")
    expected = names or ("vehicle 0", "vehicle 1")
    assert [part.split(",")[0] for part in parts] == [f"{name}: 2 pieces" for name in expected]
    with pytest.raises(SystemExit) as left:
        main(["upload", str(tmp_path / "folder")])
    assert left.value.code == 2 and "as fleet --to crazyswarm2 writes it: give --uri" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("vehicles", "separation", "sentence"),
    [((0, 1), 1.5, r"vehicles \(0, 1\) come as near as 0\.898"), ((2,), None, "vehicle 0 jumps by 3.24 m at 0.2 s")],
)
def test_a_fleet_that_comes_too_near_or_jumps_is_not_flown(tmp_path, capsys, vehicles, separation, sentence):
    one, two = pair()
    jumping = minsnap.Trajectory(np.concatenate((one.control_points, one.control_points + 2)), [0.1] * 4)
    fleet = minsnap.Fleet(tuple((one, two, jumping)[i] for i in vehicles))
    apart = None if separation is None else minsnap.Separation(separation)
    write_fleet(replace(fleet, separation=apart), tmp_path / "folder")
    with CrtpVehicle() as here, CrtpVehicle() as there:
        addresses = [f"--uri={each.uri}" for each in (here, there)[: len(fleet)]]
        with pytest.raises(SystemExit) as left:
            main(["upload", str(tmp_path / "folder"), *addresses, "--start"])
        assert left.value.code == 1 and not any(here.memory) and not there.commands
    assert re.search(sentence, capsys.readouterr().err)
    if len(fleet) == 1:
        with pytest.raises(FileError, match=r"piece 1 ends 3\.24 m from piece 2"):
            parts_of(fleet)


def test_cflibs_own_driver_carries_the_same_bytes(monkeypatch):
    drivers = pytest.importorskip("cflib.crtp")
    udp = pytest.importorskip("cflib.crtp.udpdriver")
    monkeypatch.setattr(drivers, "init_drivers", lambda: None)
    monkeypatch.setattr(drivers, "CLASSES", [udp.UdpDriver])
    held = []
    for link in (crtp_link.UdpLink, crtp_link.RadioLink):
        monkeypatch.setattr("minsnap.flight.swarm_upload.open_link", link)
        with CrtpVehicle() as one, CrtpVehicle(at=BESIDE) as two:
            upload(pair(), [one.uri, two.uri], start=True, timing=QUICK)
        held.append([(bytes(each.memory), [body for _, body in each.commands]) for each in (one, two)])
    assert held[0] == held[1]


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP])
def test_a_request_to_terminate_lands_all(monkeypatch, number):
    """It used to end the program alone, and the vehicles flew on and hovered where their curves end."""
    before = signal.signal(number, signal.SIG_DFL)

    def told(line):
        if line.startswith("started"):
            signal.raise_signal(number)

    try:
        with CrtpVehicle() as one, CrtpVehicle(at=BESIDE) as two:
            with pytest.raises(SystemExit, match=str(128 + number)):
                upload(pair(), [one.uri, two.uri], start=True, timing=QUICK, told=told)
            assert [vehicle.commands[-1][1][0] for vehicle in (one, two)] == [LAND] * 2
        assert signal.getsignal(number) is signal.SIG_DFL
    finally:
        signal.signal(number, before)
