"""Two stand-in autopilots on one clock: they begin at the same instant, and what stops one stops both."""

import threading
from dataclasses import replace

import pytest
from clocks import SharedClock, enter, leave
from flying import START, excursion, patient_rules
from standin import POSCTL, PointMass, StandIn

import minsnap
from minsnap.cli.flight_commands import links_of, systems_of
from minsnap.errors import FlightError, InputError
from minsnap.flight.mavlink.link import open_link
from minsnap.flight.mavlink.offboard import prepare, stream_together
from minsnap.flight.mavlink.stream_options import StreamOptions
from minsnap.flight.mavlink.streaming import Streamer

PATHS = excursion(5.0, reach=2.0), excursion(7.0, reach=2.0)


class Pair:
    """Both vehicles at the start, and their flight in threads that share the clock."""

    def __init__(
        self, monkeypatch, paths=PATHS, behind_one_port=False, places=(START, START), separation=None, begin=None, **how
    ):
        self.clock, self.said, self.found = SharedClock(), [], None
        fly = Streamer.run

        def run(streamer):
            try:
                return fly(streamer)
            finally:
                leave(self.clock)

        monkeypatch.setattr(Streamer, "run", run)
        self.vehicles = [StandIn(clock=self.clock, body=PointMass(place), **(begin or {})) for place in places]
        options = [StreamOptions(trigger="now", rules=patient_rules(), **how) for _ in PATHS]
        ports = [(self.vehicles[0] if behind_one_port else vehicle).port for vehicle in self.vehicles]
        self.links = [open_link(f"udpout:127.0.0.1:{port}", self.clock) for port in ports]
        tables = [prepare(path, option) for path, option in zip(paths, options, strict=True)]
        how = (tables, self.links, options, ("first", "second"), self.clock, self.said.append)
        named = {"begun": self.begun, "separation": separation}
        self.thread = threading.Thread(target=lambda: setattr(self, "found", stream_together(*how, **named)))

    def begun(self, stop):
        self.stop = stop

    def __enter__(self):
        for vehicle in self.vehicles:
            vehicle.__enter__()
            enter(self.clock)
        self.thread.start()
        return self

    def __exit__(self, *_):
        for _ in range(2):
            self.stop()
        self.join()
        for link in self.links:
            link.close()
        for vehicle in self.vehicles:
            vehicle.__exit__()

    def join(self):
        while self.thread.is_alive():
            self.clock.wait(self.clock.now() + 0.01)

    def both_enter(self):
        self.vehicles[0].enter()
        self.vehicles[1].until(lambda v: len(v.setpoints) > 60)
        assert not any("flying" in text for text in self.said), "the first waits for the second"
        self.vehicles[1].enter()
        self.vehicles[1].until(lambda v: all(f"{name}: flying" in self.said for name in ("first", "second")))

    def leave(self):
        for vehicle in self.vehicles:
            vehicle.enter(POSCTL)
        self.join()
        return self.found


@pytest.mark.slow
def test_they_begin_in_the_same_slot_and_end_each_at_its_end(monkeypatch):
    with Pair(monkeypatch) as pair:
        pair.both_enter()
        pair.vehicles[1].until(lambda v: {"first: holding the end", "second: holding the end"} <= set(pair.said))
        begins = [vehicle.setpoints for vehicle in pair.vehicles]
        found = pair.leave()
    assert [report.completed for report in found] == [True, True]
    first = [next(t for t, m in one if m.vy) for one in begins]
    assert first[0] == pytest.approx(first[1], abs=0.021), "the stand-ins look every hundredth of a second"


@pytest.mark.slow
def test_a_fleet_on_one_map_is_flown_by_autopilots_that_each_count_from_their_own_place(monkeypatch):
    apart = [replace(path, position=path.position + [2.0 * k, 2.0 * k, 0.0]) for k, path in enumerate(PATHS, 1)]
    with Pair(monkeypatch, apart, relative=True) as pair:
        pair.both_enter()
        pair.vehicles[1].until(lambda v: {"first: holding the end", "second: holding the end"} <= set(pair.said))
        sent = [[(m.x, m.y, m.z) for _, m in vehicle.setpoints] for vehicle in pair.vehicles]
        found = pair.leave()
    assert [report.completed for report in found] == [True, True]
    for path, places in zip(PATHS, sent, strict=True):
        assert max(place[1] for place in places) == pytest.approx(path.position[:, 0].max(), abs=1e-5)
        assert places[0] == pytest.approx(START, abs=1e-5)


@pytest.mark.slow
def test_what_stops_one_stops_the_other_where_it_is(monkeypatch):
    with Pair(monkeypatch) as pair:
        pair.both_enter()
        pair.vehicles[0].until(lambda v: any(m.vy for _, m in v.setpoints))
        pair.vehicles[0].enter(POSCTL)
        pair.vehicles[1].until(
            lambda v: any(text.startswith("second: stopped: first has stopped") for text in pair.said)
        )
        held = pair.vehicles[1].setpoints[-1][1]
        found = pair.leave()
    assert all(isinstance(one, FlightError) for one in found)
    assert "the vehicle left OFFBOARD" in str(found[1]) and (held.vx, held.vy, held.vz) == (0.0, 0.0, 0.0)


@pytest.mark.slow
def test_two_links_to_one_vehicle_are_refused_unless_each_names_its_own(monkeypatch):
    """As behind a router: both used to fly whichever was heard first, along two paths at once."""
    with Pair(monkeypatch, behind_one_port=True) as pair:
        pair.join()
    assert all(
        "first and second both lead to system 1" in str(one) or "second and first" in str(one) for one in pair.found
    )
    assert not any(m.vy for vehicle in pair.vehicles for _, m in vehicle.setpoints)


BESIDE = [minsnap.plan([(x, 0, 1.5), (x, 3, 1.5)], [4.0]).sample(20.0) for x in (0.0, 1.2)]
"""Two lines that are 1.2 m apart."""


@pytest.mark.slow
def test_nothing_is_sent_to_vehicles_that_stand_too_near_their_ways(monkeypatch):
    """Two vehicles within a metre of their starts flew to them through each other, with exit status 0."""
    places = [(0.0, 0.7, -1.5), (0.0, 0.5, -1.5)]  # within a metre of their starts, past each other
    with Pair(monkeypatch, BESIDE, places=places, separation=minsnap.Separation(1.0, 2.0)) as pair:
        pair.join()
    for one in pair.found:
        assert isinstance(one, FlightError)
        assert "first and second would come as near as 0 m, and 1 m are asked" in str(one)
        assert str(one).endswith("; nothing was sent")
    assert not any(vehicle.setpoints for vehicle in pair.vehicles)


@pytest.mark.slow
def test_vehicles_below_their_starts_fly(monkeypatch):
    places = [(0.0, 0.0, -1.5), (0.0, 1.2, -1.5)]
    with Pair(monkeypatch, BESIDE, places=places, separation=minsnap.Separation(1.0, 2.0)) as pair:
        pair.both_enter()
        pair.vehicles[1].until(lambda v: {"first: holding the end", "second: holding the end"} <= set(pair.said))
        found = pair.leave()
    assert [report.completed for report in found] == [True, True]


def test_each_vehicle_has_its_link():
    assert links_of("udpin:127.0.0.1:14540+", 2) == ["udpin:127.0.0.1:14540", "udpin:127.0.0.1:14541"]
    assert links_of("tcp:a:1,serial:/dev/x:57600", 2) == ["tcp:a:1", "serial:/dev/x:57600"]
    for wrong, why in (("udpin:0", "1 links for 2 vehicles"), ("serial:/dev/x+", "no port that could count up")):
        with pytest.raises(InputError, match=why):
            links_of(wrong, 2)


def test_each_vehicle_has_its_system():
    assert systems_of(None, 2) == [None, None] and systems_of("1,7", 2) == [1, 7] and systems_of("9", 1) == [9]
    for wrong, count in (("9", 2), ("1,2", 1), ("0,1", 2), ("1,256", 2), ("1.5", 1), ("nan", 1), ("", 1)):
        with pytest.raises(InputError, match="--system is"):
            systems_of(wrong, count)


def test_one_rate_for_all():
    options = [StreamOptions(trigger="now"), StreamOptions(trigger="now", rate=50.0)]
    tables = [prepare(path, option) for path, option in zip(PATHS, options, strict=True)]
    with pytest.raises(InputError, match="one rate"):
        stream_together(tables, [], options, ("a", "b"), SharedClock())


@pytest.mark.slow
@pytest.mark.parametrize("land", [False, True])
def test_a_fleet_on_the_ground_is_armed_at_once_and_leaves_before_it_disarms_itself(monkeypatch, land):
    """The first armed itself, waited for the second, and was disarmed by PX4 after ten seconds."""
    stops = tuple(minsnap.Stop(point) for point in ((0, 0, 2), (2, 0, 2)))
    course = minsnap.Course(stops, takeoff=True, limits=minsnap.Limits(speed=2, acceleration=2, jerk=20))
    path = minsnap.plan_mission(course).trajectory.sample(20.0)
    begin, places = {"floor": 0.3, "armed": False}, [(0.0, 0.0, 0.3)] * 2
    with Pair(monkeypatch, (path, path), places=places, begin=begin, arm=True, land=land) as pair:
        pair.vehicles[1].refuses_modes = True
        pair.vehicles[0].until(lambda v: len(v.setpoints) > 300)
        assert not pair.vehicles[0].armed
        pair.vehicles[1].refuses_modes = False
        pair.vehicles[1].until(lambda v: {"first: holding the end", "second: holding the end"} <= set(pair.said))
        if not land:
            for vehicle in pair.vehicles:
                vehicle.enter(POSCTL)
        pair.join()
        found, armed = pair.found, [vehicle.armed_at for vehicle in pair.vehicles]
    assert [one.completed for one in found] == [True, True]
    assert not any(vehicle.failsafes for vehicle in pair.vehicles) and abs(armed[0] - armed[1]) < 0.3
