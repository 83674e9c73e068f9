"""The tube of a vehicle: what certify, certify_fleet and plan say of it, and simulated flights in it."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

import minsnap
from minsnap import Gate, Limits, Loop, Room
from minsnap.errors import InfeasibleError, VehicleError
from minsnap.flight import CascadeController, simulate
from minsnap.vehicle import BodyDrag, Quadrotor

CORNERS = [(0, 0, 1), (8, 0, 1), (8, 4, 1), (0, 4, 1), (0, 0, 1)]
CALM = Limits(speed=2.0, acceleration=2.5, jerk=12.0)
PATH = minsnap.plan(CORNERS, corridor=0.5, total_time=20.0)
LOOP = Loop.px4()


def asked(**changed):
    return {"waypoints": CORNERS, "corridor": 1.5, "tracking": LOOP, "wind": 1.0} | changed


def test_the_vehicle_is_counted_where_the_plan_alone_is_inside():
    one = minsnap.certify(PATH, **asked())
    assert one.ok
    assert one.tube == pytest.approx(one.vehicle.flight.lag + one.vehicle.widths.error)
    far = minsnap.certify(PATH, **asked(wind=one.wind * 1.01))
    assert not far.ok
    assert "corridor" in far.vehicle.fault
    assert minsnap.certify(PATH, **asked(wind=one.wind * 0.99)).ok
    assert minsnap.certify(PATH, CORNERS, corridor=1.5).tube is None


def test_still_air_has_the_lag_alone_and_twice_the_wind_twice_the_rest():
    still, one, two = (minsnap.certify(PATH, **asked(wind=wind)) for wind in (0.0, 1.0, 2.0))
    lag = still.vehicle.flight.lag
    assert still.tube == lag > 0.0
    assert two.tube - lag == pytest.approx(2.0 * (one.tube - lag))
    assert still.wind == one.wind == two.wind


def test_nothing_is_bounded_where_the_loop_saturates():
    lame = replace(LOOP, tilt=0.1)
    cert = minsnap.certify(PATH, **asked(tracking=lame, wind=4.0))
    assert not cert.ok
    assert cert.tube == np.inf
    assert cert.vehicle.saturated == ("the autopilot's tilt",)
    assert "the autopilot's tilt" in cert.vehicle.fault
    assert minsnap.certify(PATH, tracking=replace(LOOP, speed=0.5)).vehicle.saturated == ("the autopilot's speed",)


def test_limits_of_thrust_and_tilt_are_asked_of_what_feedback_commands():
    most = minsnap.certify(PATH, limits=Limits(tilt=0.5)).utilisation[0].value
    tight = Limits(tilt=most * 1.01)
    assert minsnap.certify(PATH, limits=tight).ok
    cert = minsnap.certify(PATH, limits=tight, tracking=LOOP, wind=2.0)
    assert not cert.ok
    assert "the tilt" in cert.vehicle.fault
    assert np.isfinite(cert.tube)


def test_obstacles_room_and_gates_are_asked_of_the_vehicle():
    pillar = minsnap.Cylinder((4.0, 0.9), 0.2)
    assert minsnap.certify(PATH, avoid=pillar).ok
    assert "obstacles" in minsnap.certify(PATH, avoid=pillar, tracking=LOOP, wind=4.0).vehicle.fault
    low = Room((-2, -2, 0.5), (10, 6, 1.5))
    assert minsnap.certify(PATH, corridor=low, tracking=LOOP, wind=1.0).ok
    assert "room" in minsnap.certify(PATH, corridor=low, tracking=LOOP, wind=3.0).vehicle.fault
    through = [(0, 0, 1), Gate((4, 0, 1), (1, 0, 0), 2.0, 2.0), (8, 0, 1)]
    path = minsnap.plan(through, total_time=8.0)
    wide = minsnap.certify(path, through, tracking=LOOP, wind=1.0)
    assert wide.ok
    assert 1.0 < wide.wind < 1.0 / LOOP.wind_gain
    narrow = [through[0], Gate((4, 0, 1), (1, 0, 0), 0.4, 0.4), through[2]]
    assert "gate 1" in minsnap.certify(path, narrow, tracking=LOOP, wind=1.0).vehicle.fault


@dataclass(frozen=True)
class Gusts:
    """The worst gust of a loop in one direction, its end at an instant of the flight; or a wind that switches."""

    loop: Loop
    strength: float
    angle: float
    end: float
    seed: int | None = None

    def sample(self, count, step):
        t = step * np.arange(count)
        if self.seed is None:
            known, worst = self.loop.worst_gust(self.end, 1.0 / step)
            along = np.interp(t, known, worst, right=0.0)
        else:
            draw = np.random.default_rng(self.seed)
            along = np.sign(np.sin(draw.uniform(0.2, 3.0) * t + draw.uniform(0.0, 6.0)))
        return self.strength * along[:, None] * np.array([np.cos(self.angle), np.sin(self.angle), 0.0])


def vehicle_with(drag):
    base = Quadrotor.px4_sih()
    return replace(base, drag=BodyDrag(np.full(3, drag) * base.mass))


@pytest.mark.parametrize("wind", [1.0, 3.0])
def test_simulated_vehicles_stay_within_their_tube_and_the_worst_gust_nearly_fills_it(wind):
    drag = 0.4
    loop = Loop.px4(drag=drag, latency=0.0, descent_speed=5.0)
    tube = minsnap.certify(PATH, tracking=loop, wind=wind).tube
    worst = 0.0
    for angle in (0.0, 0.7 * np.pi):
        for end, seed in ((13.0, None), (1.0, 3)):
            gusts = Gusts(loop, wind, angle, end, seed)
            flight = simulate(vehicle_with(drag), CascadeController(), PATH, wind=gusts)
            worst = max(worst, float(np.linalg.norm(flight.error, axis=1).max()))
    assert worst <= tube
    assert worst >= tube / 1.5


def test_a_plan_leaves_room_for_the_loop():
    for request in (
        {"waypoints": CORNERS, "corridor": 1.2, "limits": CALM},
        {"waypoints": CORNERS, "corridor": 0.6, "total_time": 40.0},
        {"waypoints": CORNERS[:2], "avoid": [minsnap.Cylinder((4, 0.1), 0.5)], "limits": CALM},
        {"waypoints": [(0, 0, 1), Gate((4, 0, 1), (1, 0, 0), 2.0, 2.0), (8, 0, 1)], "limits": CALM},
        {
            "waypoints": CORNERS[:2],
            "avoid": [minsnap.Prism([(3, -2), (5, -2), (5, 0.4), (4, 0.8), (3, 0.4)])],
            "limits": CALM,
        },
        {
            "waypoints": CORNERS[:2],
            "avoid": [minsnap.Prism([(-2, -2), (10, -2), (10, 2), (-2, 2)], inclusion=True)],
            "limits": CALM,
        },
        {"waypoints": CORNERS[:2], "corridor": Room((-2, -2, 0), (10, 2, 2)), "limits": CALM},
    ):
        path = minsnap.plan(**request, tracking=LOOP, wind=1.0)
        kept = {name: value for name, value in request.items() if name != "total_time"}
        cert = minsnap.certify(path, **kept, tracking=LOOP, wind=1.0)
        assert cert.ok
        assert cert.wind >= 1.0
        assert "in a wind that changes by 1 m/s" in path.report.notes[0]


def test_a_plan_that_leaves_none_is_refused_and_says_what_the_loop_needs():
    with pytest.raises(InfeasibleError, match=r"changes by 4 m/s, where its loop needs 1\.14 m"):
        minsnap.plan(CORNERS, corridor=0.3, limits=CALM, tracking=LOOP, wind=4.0)
    with pytest.raises(InfeasibleError, match="the corridor"):
        minsnap.plan(CORNERS, corridor=0.3, total_time=10.0, tracking=LOOP, wind=0.5)
    with pytest.raises(VehicleError, match="leave nothing beside it"):
        minsnap.plan(CORNERS, limits=CALM, tracking=replace(LOOP, max_thrust=1.05), wind=10.0)


@pytest.mark.parametrize("call", [minsnap.plan, lambda *a, **k: minsnap.certify(PATH, *a[1:], **k)])
def test_malformed_loops_and_winds_are_refused(call):
    with pytest.raises(VehicleError, match="tracking=Loop"):
        call(CORNERS, wind=2.0)
    with pytest.raises(minsnap.InputError, match="Loop"):
        call(CORNERS, tracking="px4")
    with pytest.raises(VehicleError, match="from 0 to 100"):
        call(CORNERS, tracking=LOOP, wind=-1.0)


def test_trajectories_that_no_loop_is_computed_for_are_refused():
    with pytest.raises(VehicleError, match="up to 3600 s"):
        minsnap.certify(minsnap.plan(CORNERS, total_time=1e5), tracking=LOOP)
    with pytest.raises(VehicleError, match="two or three coordinates"):
        minsnap.certify(minsnap.plan([[0.0], [1.0]], total_time=2.0), tracking=LOOP)


def test_vehicles_of_a_fleet_keep_apart_in_their_loops():
    lanes = [[(0, y, 1), (6, y, 1)] for y in (0.0, 2.0, 5.0)]
    fleet = minsnap.plan_fleet(lanes, limits=CALM, separation=0.5)
    cert = minsnap.certify_fleet(fleet, tracking=LOOP, wind=1.0, room=((-2, -2, 0), (8, 7, 3)))
    assert cert.ok
    assert 1.0 < cert.wind < 5.0
    far = minsnap.certify_fleet(fleet, tracking=LOOP, wind=cert.wind * 1.02)
    assert not far.ok
    assert "vehicle 0 and vehicle 1" in far.fault
    mixed = minsnap.certify_fleet(fleet, tracking=[LOOP, LOOP, replace(LOOP, lead=0.05)], wind=1.0)
    assert mixed.ok
    with pytest.raises(minsnap.InputError, match="2 loops for 3 vehicles"):
        minsnap.certify_fleet(fleet, tracking=[LOOP, LOOP])
    with pytest.raises(VehicleError, match="tracking"):
        minsnap.certify_fleet(fleet, wind=1.0)


def test_obstacles_that_move_are_met_where_the_vehicle_is_then():
    crossing = minsnap.Moving([(0.0, 4.0, -3.0, 1.0), (10.0, 4.0, 4.0, 1.0)], 0.4)
    path = minsnap.plan(CORNERS[:2], limits=CALM, avoid=crossing, tracking=LOOP, wind=0.5)
    led = replace(LOOP, lead=0.1)
    assert minsnap.certify(path, limits=CALM, avoid=crossing, tracking=LOOP, wind=0.5).ok
    far = minsnap.certify(path, avoid=crossing, tracking=replace(led, descent_speed=9.0), wind=5.0)
    assert "obstacles that move" in far.vehicle.fault
