"""Fleets that do not fit the memories of Crazyflies: parts from rest to rest, each written while another is flown."""

import math
import struct

import numpy as np
import pytest
from crazyflie_planner import least_distance
from crazyradio_dongle import Dongle, RadioVehicle
from crtp_vehicle import CrtpVehicle

import minsnap
from minsnap.cli.app import main
from minsnap.errors import FileError
from minsnap.files.formats import curve_of_bytes, curve_of_rows
from minsnap.flight import crtp_link
from minsnap.flight.swarm_flight import FlightTimes
from minsnap.flight.swarm_upload import upload
from minsnap.shows.fleet_files import read_acts, read_fleet, write_fleet
from minsnap.shows.memory_parts import ALIGNED, COMPRESSED, MEMORY, parts_of
from minsnap.shows.skyc import ShowSheet

QUICK = FlightTimes(0.15, 0.15, 0.15, 0.05, climb=math.inf, travel=math.inf, sink=math.inf)
APART = minsnap.Separation(0.3)
ACTS = tuple((f"act {i}", 0.95 * (i + 1)) for i in range(14))


def wandering(vehicles=3, acts=14):
    """Flights of seven legs each on lanes of their own, with rests of 0.2 s: more than a memory holds in any form."""
    random, curves = np.random.default_rng(2), []
    for lane in range(vehicles):
        home, pieces = np.array([0.0, lane, 1.0]), []
        for _ in range(acts):
            points = home + np.vstack([np.zeros(3), random.uniform(-0.2, 0.2, (6, 3)), np.zeros(3)])
            rest = minsnap.Trajectory(np.tile(home, (1, 8, 1)), [0.2])
            pieces += [rest, minsnap.plan(points, durations=np.full(7, 0.75 / 7))]
        points, durations = zip(*((each.control_points, each.durations) for each in pieces), strict=True)
        curves.append(minsnap.Trajectory(np.concatenate(points), np.concatenate(durations)))
    return minsnap.Fleet(tuple(curves), None, APART)


@pytest.fixture(autouse=True)
def patient(monkeypatch):
    monkeypatch.setattr(crtp_link, "TRIES", 40)


@pytest.fixture(scope="module")
def fleet():
    return wandering()


def held(part, vehicle):
    """Return the curve that lies in a vehicle's memory."""
    own = part.uploads[vehicle]
    if own.kind == COMPRESSED:
        return curve_of_bytes(own.content)
    return curve_of_rows(np.roll(np.frombuffer(own.content, "<f4").astype(float).reshape(-1, 33), 1, axis=1))


def test_parts_follow_the_fleet_from_rest_to_rest_and_two_neighbours_share_a_memory(fleet):
    parts = parts_of(fleet)
    assert len(parts) >= 3 and [part.slot for part in parts] == [1 + i % 2 for i in range(len(parts))]
    now = 0.0
    for one, two in zip(parts, [*parts[1:], None], strict=True):
        rests = np.linspace(now, one.begins, 20)
        assert np.abs(fleet(rests, 1)).max() < 1e-3, "all rest between two parts"
        now = one.ends
        for vehicle, curve in enumerate(fleet):
            t = np.linspace(0.0, one.ends - one.begins, 200)
            flown = held(one, vehicle)
            assert np.abs(flown(np.minimum(t, flown.duration)) - curve(one.begins + t)).max() < 1e-3
            own = one.uploads[vehicle]
            assert own.offset % ALIGNED == 0 and own.offset + len(own.content) <= MEMORY
            other = None if two is None else two.uploads[vehicle]
            if other is not None:
                low, high = sorted((own, other), key=lambda each: each.offset)
                assert low.offset + len(low.content) <= high.offset
    assert now == pytest.approx(fleet.duration, abs=1e-6)


def test_what_fits_is_one_part():
    short = wandering(acts=2)
    (part,) = parts_of(short)
    assert (part.begins, part.ends, part.slot, part.uploads[0].offset) == (0.0, short.duration, 1, 0)


def test_an_act_that_does_not_fit_is_named():
    waypoints = np.random.default_rng(1).uniform(-1, 1, (120, 3))
    long = minsnap.plan(waypoints, durations=np.full(119, 0.7))
    both = minsnap.plan([waypoints[-1], (0, 0, 2)], durations=[1.0])
    fleet = minsnap.Fleet((long.then(both),))
    with pytest.raises(FileError, match=r"the flight to 'wild' from 0\.00 to 83\.30 s: .* bytes"):
        parts_of(fleet, [("wild", long.duration), ("end", fleet.duration)])


@pytest.mark.slow
def test_all_parts_are_flown_one_after_the_other_and_written_in_turn(fleet):
    places, told = fleet(0.0) * (1.0, 1.0, 0.0), []
    vehicles = [CrtpVehicle(at=tuple(place)) for place in places]
    try:
        for vehicle in vehicles:
            vehicle.__enter__()
        upload(fleet, [each.uri for each in vehicles], start=True, timing=QUICK, told=told.append)
    finally:
        for vehicle in vehicles:
            vehicle.__exit__()
    parts = parts_of(fleet)
    flown = [line for line in told if line.startswith("part ") and "started" in line]
    assert [line.split(" started")[0] for line in flown] == [f"part {i + 1} of {len(parts)}" for i in range(len(parts))]
    assert least_distance([each.planner for each in vehicles]) > 0.3 - 0.02
    for vehicle, curve in zip(vehicles, fleet, strict=True):
        starts = [body[5] for _, body in vehicle.commands if body[0] == 13]
        changes = [one for one, two in zip(starts, [*starts[1:], 0], strict=True) if one != two]
        assert changes == [part.slot for part in parts]
        defined = [struct.unpack("<BBBBIB", body) for _, body in vehicle.commands if body[0] == 6]
        assert len(defined) >= len(parts)
        assert vehicle.planner(math.inf) == pytest.approx(curve(curve.duration) * (1, 1, 0), abs=1e-3)
        when = [at for at, pieces in vehicle.planner.flown if len(pieces) > 1]
        assert when[-1] - when[0] >= parts[-1].begins - parts[0].begins - 0.05, "none begins before its time"


@pytest.mark.slow
def test_parts_are_started_by_broadcasts(monkeypatch, fleet):
    drivers, radios = pytest.importorskip("cflib.crtp"), pytest.importorskip("cflib.drivers.crazyradio")
    places = fleet(0.0) * (1.0, 1.0, 0.0)
    radio = [RadioVehicle(80, "2M", i + 1, at=tuple(place)) for i, place in enumerate(places)]
    dongle = Dongle(*radio)
    monkeypatch.setattr(drivers, "CLASSES", [])
    monkeypatch.setattr(radios, "_find_devices", lambda serial=None: [dongle] * (dongle.number + 1))
    told = []
    upload(fleet, [one.uri for one in radio], start=True, timing=QUICK, told=told.append)
    parts = parts_of(fleet)
    assert sum("by a broadcast" in line for line in told) == len(parts)
    for vehicle, curve in zip(radio, fleet, strict=True):
        assert vehicle.planner(math.inf) == pytest.approx(curve(curve.duration) * (1, 1, 0), abs=1e-3)


def test_the_command_says_which_parts_it_writes(tmp_path, capsys, fleet):
    sheet = ShowSheet("lanes", cues=tuple((at, name) for name, at in ACTS))
    write_fleet(fleet, tmp_path / "show", sheet=sheet)
    assert read_acts(tmp_path / "show") == ACTS
    with pytest.raises(SystemExit) as ended:
        main(["upload", str(tmp_path / "show"), "--dry-run"])
    said = capsys.readouterr().out
    assert ended.value.code == 0 and f"part 2 of {len(parts_of(read_fleet(tmp_path / 'show')))}, from" in said
