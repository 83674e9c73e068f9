"""The whole mission of a fleet of Crazyflies, measured by the firmware's planner: take-off, ways, curves, landing."""

import math
import re
import time
from dataclasses import replace

import numpy as np
import pytest
import yaml
from crazyflie_planner import least_distance
from crtp_vehicle import CrtpVehicle

import minsnap
from minsnap.cli.app import main
from minsnap.errors import FlightError, LinkError
from minsnap.flight import crazyflie_log, crtp_link
from minsnap.flight.swarm_flight import FlightTimes
from minsnap.flight.swarm_upload import upload
from minsnap.shows.fleet_files import write_fleet

QUICK = FlightTimes(0.15, 0.15, 0.15, 0.05, climb=math.inf, travel=math.inf, sink=math.inf)
SEPARATION = minsnap.Separation(0.3, downwash=2.0)


@pytest.fixture(autouse=True)
def patient(monkeypatch):
    monkeypatch.setattr(crtp_link, "TRIES", 40)


def lines(starts, goals, seconds=1.0, separation=SEPARATION):
    return minsnap.Fleet(
        [minsnap.plan(np.array(ends, dtype=float), [seconds]) for ends in zip(starts, goals, strict=True)],
        None,
        separation,
    )


def ring(count=8):
    """Starts on a ring, and curves along it to the next start but a half: never across."""
    angles = 2.0 * np.pi * np.arange(count) / count
    places = [np.stack([2.0 * np.cos(at), 2.0 * np.sin(at), np.ones(count)], axis=1) for at in (angles, angles + 0.3)]
    return lines(*places), places[0]


def flown(fleet, places, timing=QUICK, after=lambda vehicles: lambda line: None):
    """Upload and fly; return the stand-ins."""
    vehicles = [CrtpVehicle(at=tuple(place)) for place in places]
    try:
        for vehicle in vehicles:
            vehicle.__enter__()
        upload(fleet, [each.uri for each in vehicles], start=True, timing=timing, told=after(vehicles))
    finally:
        for vehicle in vehicles:
            vehicle.__exit__()
    return vehicles


def kinds(vehicle):
    return [body[0] for _, body in vehicle.commands]


@pytest.mark.slow
@pytest.mark.parametrize("moved", ["below", "opposite", "edited"])
def test_a_ring_of_eight_is_apart_from_the_ground_to_the_ground(moved):
    """Under the opposite starts all eight flew through the center at once, 1.5 mm apart, and the exit status was 0."""
    fleet, starts = ring()
    flat = starts * (1.0, 1.0, 0.0)
    places = {"below": flat, "opposite": -flat, "edited": flat + np.array([0.4, 0.0, 0.0])}[moved]
    vehicles = flown(fleet, places)
    assert least_distance([each.planner for each in vehicles], 2.0) > 0.3 - 1e-3
    for vehicle, curve in zip(vehicles, fleet, strict=True):
        started = next(t for t, pieces in vehicle.planner.flown if len(pieces) > 1)
        assert vehicle.planner(started - 1e-6) == pytest.approx(curve(0.0), abs=1e-5), "at its start when all begin"
        assert vehicle.planner(math.inf) == pytest.approx([*curve(curve.duration)[:2], 0.0], abs=1e-4)
        assert kinds(vehicle).count(8) == 1


@pytest.mark.slow
def test_starts_and_ends_above_each_other_are_flown_apart_and_all_return():
    """The landing of two vehicles that end above each other was 5.5 mm apart."""
    ways = np.array([[(0, 0, 0.8), (1, 1, 1.8)], [(0, 0, 1.8), (1, 1, 0.8)], [(1, 0, 1), (0, 0, 1.3)]])
    fleet = minsnap.plan_fleet(ways, minsnap.Limits(speed=1.0, acceleration=2.0), SEPARATION)
    places = [(0, 0, 0), (0, 0.4, 0), (1, 0, 0)]
    vehicles = flown(fleet, places)
    assert least_distance([each.planner for each in vehicles], 2.0) > 0.3 - 1e-3
    for vehicle, place in zip(vehicles, places, strict=True):
        assert vehicle.planner(math.inf) == pytest.approx(place, abs=1e-4)


@pytest.mark.parametrize("places", [[(0, 0, 0), (0.2, 0, 0)], [(0, 0, 0), (0, 0, 0)]])
def test_vehicles_that_stand_too_near_are_refused_with_the_pair_and_the_distance_before_anything_moves(places):
    fleet = lines([(0, 0, 1), (1, 0, 1)], [(0, 1, 1), (1, 1, 1)])
    vehicles = [CrtpVehicle(at=place) for place in places]
    with vehicles[0], vehicles[1]:
        said = rf"vehicles 0 and 1 would come as near as {math.dist(*places):g} m, and 0\.3 m are asked"
        with pytest.raises(FlightError, match=said):
            upload(fleet, [each.uri for each in vehicles], start=True, timing=QUICK)
    assert not {7, 8, 12, 13} & set(kinds(vehicles[0]) + kinds(vehicles[1]))


def test_a_curve_from_the_ground_wants_its_vehicle_there():
    fleet = lines([(0, 0, 0), (1, 0, 0)], [(0, 0, 1), (1, 0, 1)])
    with CrtpVehicle() as one, CrtpVehicle(at=(1.4, 0, 0)) as two:
        with pytest.raises(FlightError, match=r"vehicle 1 stands 0\.40 m from its start, which is on the ground"):
            upload(fleet, [one.uri, two.uri], start=True, timing=QUICK)
    assert not {7, 13} & set(kinds(one) + kinds(two))


@pytest.mark.parametrize(
    ("state", "said"), [({"power": 3}, "has a low battery"), ({"supervisor": 1 << 6}, "is locked")]
)
def test_a_vehicle_that_cannot_fly_keeps_all_on_the_ground(state, said):
    fleet = lines([(0, 0, 1), (1, 0, 1)], [(0, 1, 1), (1, 1, 1)])
    with CrtpVehicle() as one, CrtpVehicle(at=(1, 0, 0)) as two:
        vars(two).update(state)
        with pytest.raises(FlightError, match=f"not flown: {two.uri} {said}; nothing moved"):
            upload(fleet, [one.uri, two.uri], start=True, timing=QUICK)
    assert not {7, 13} & set(kinds(one) + kinds(two))


@pytest.mark.slow
@pytest.mark.parametrize("fault", ["silent", "tumbled"])
def test_one_that_is_lost_in_flight_ends_the_others_at_once_and_each_is_told_once(monkeypatch, fault):
    """It was noticed at the end of the curves, a minute later, and the others were told to land twice."""
    monkeypatch.setattr(crtp_link, "TRIES", 8)
    fleet = lines([(0, 0, 1), (1, 0, 1)], [(0, 1, 1), (1, 1, 1)], seconds=30.0)
    told, lost = [], []

    def after(vehicles):
        def say(line):
            told.append(line)
            if line.startswith("started"):
                lost.append(time.monotonic())
                vars(vehicles[1]).update({"lasts": 0} if fault == "silent" else {"supervisor": 1 << 5})

        return say

    vehicles = []

    def keep(made):
        vehicles.extend(made)
        return after(made)

    with pytest.raises((LinkError, FlightError), match="has been silent for" if fault == "silent" else "has tumbled"):
        flown(fleet, [(0, 0, 0), (1, 0, 0)], after=keep)
    landings = [(t, body) for t, body in vehicles[0].commands if body[0] == 8]
    assert len(landings) == 1 and landings[0][0] - lost[0] < 15.0, "half of its flight"
    assert told[-1].startswith("told all that fly to land")
    assert any("all land straight down, proved apart at any instant" in line for line in told)


@pytest.mark.slow
def test_one_that_stands_on_the_ground_is_not_told_to_land():
    """Its motors would have begun to turn."""
    fleet = lines([(0, 0, 0), (1, 0, 1)], [(0, 0, 1), (1, 1, 1)])
    with CrtpVehicle() as one, CrtpVehicle(at=(1, 0, 0)) as two:

        def told(line):
            if line.startswith("ways"):
                two.supervisor = 1 << 5

        with pytest.raises(FlightError, match="has tumbled"):
            upload(fleet, [one.uri, two.uri], start=True, timing=replace(QUICK, take_off=3.0), told=told)
    assert not {7, 8, 13} & set(kinds(one)) and [kind for kind in kinds(two) if kind > 6] == [7, 8]


def test_curves_that_are_not_apart_are_not_flown():
    fleet = lines([(0, 0, 1), (1, 0, 1)], [(1, 0, 1), (0, 0, 1)])
    with CrtpVehicle() as one, CrtpVehicle(at=(1, 0, 0)) as two:
        with pytest.raises(FlightError, match=r"not flown: vehicles \(0, 1\) come as near as .* nothing moved"):
            upload(fleet, [one.uri, two.uri], start=True, timing=QUICK)


@pytest.mark.slow
def test_a_repeated_take_off_that_the_planner_refuses_was_taken():
    """Its answer was lost: all were told to land."""

    class Deaf(CrtpVehicle):
        def answer(self, port, channel, body):
            said = super().answer(port, channel, body)
            return None if port == 8 and body[0] in (7, 8) and kinds(self).count(body[0]) == 1 else said

    fleet = lines([(0, 0, 1)], [(0, 1, 1)])
    with Deaf() as one:
        upload(fleet, [one.uri], start=True, timing=QUICK)
    assert kinds(one).count(7) == kinds(one).count(8) == 2
    assert one.planner(math.inf) == pytest.approx([0, 1, 0], abs=1e-4)


def run(capsys, *arguments):
    with pytest.raises(SystemExit) as left:
        main([str(each) for each in arguments])
    return left.value.code or 0, capsys.readouterr()


@pytest.mark.slow
def test_a_dry_run_says_what_is_proved_of_the_places_in_the_file_or_refuses_them(tmp_path, capsys):
    """It was silent about eight vehicles under the opposite starts."""
    fleet, starts = ring()
    write_fleet(fleet, tmp_path, "crazyswarm2")
    status, said = run(capsys, "upload", tmp_path, "--dry-run")
    assert status == 0 and "ways: 2 stages to the starts, 1 to the ground" in said.out
    assert "whenever each is told, 0.3 m are asked" in said.out and "proved apart at any instant" in said.out
    file = tmp_path / "crazyflies.yaml"
    robots = yaml.safe_load(file.read_text())
    for robot, place in zip(robots["robots"].values(), -starts, strict=True):
        robot["initial_position"] = [*place[:2].tolist(), 0.0]
    file.write_text(yaml.safe_dump(robots, sort_keys=False))
    status, said = run(capsys, "upload", tmp_path, "--dry-run")
    stages = int(re.search(r"ways: (\d+) stages", said.out)[1])
    assert status == 0 and stages > 4 and "up to 1.60 m high" in said.out
    robots["robots"]["cf2"]["initial_position"] = list(robots["robots"]["cf1"]["initial_position"])
    file.write_text(yaml.safe_dump(robots, sort_keys=False))
    for option in ("--dry-run", "--prove"):
        status, said = run(capsys, "upload", tmp_path, option)
        assert status == 1 and "vehicles 0 and 1 would come as near as 0 m" in said.err


def test_the_log_of_a_firmware_without_places_is_refused(monkeypatch):
    monkeypatch.setattr("crtp_vehicle.LOGGED", ("pm.vbat", "pm.state"))
    with CrtpVehicle() as one:
        link = crtp_link.open_link(one.uri)
        with pytest.raises(FlightError, match=r"does not log stateEstimate\.x, stateEstimate\.y, stateEstimate\.z"):
            crazyflie_log.FleetWatch([link])
        link.close()
