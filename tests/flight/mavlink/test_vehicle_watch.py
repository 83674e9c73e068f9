"""The state of a vehicle before a flight: what it estimates, what keeps it from arming, its battery, place and link."""

from collections import Counter
from contextlib import ExitStack
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from clocks import SharedClock
from flying import PATH, START
from px4_parameters import PX4
from px4_reports import event, report
from standin import PointMass, StandIn, mavlink

from minsnap.flight.mavlink.link import open_link
from minsnap.flight.mavlink.preflight import VehicleWatch, check_vehicle, flight_needs
from minsnap.flight.mavlink.setpoints import FeedForward
from minsnap.flight.mavlink.stream_options import StreamOptions
from minsnap.flight.mavlink.vehicle_messages import AUTOPILOTS
from minsnap.shows.site import ShowOrigin

GOOD = 1 | 2 | 4 | 8 | 16 | 32
SENSORS = 0x1 | 0x2 | 0x4 | 0x200000 | 0x10000000


def estimate(flags):
    return mavlink.MAVLink_estimator_status_message(0, flags, *(0.0,) * 8)


def system(health=SENSORS, battery=90):
    return mavlink.MAVLink_sys_status_message(SENSORS, SENSORS, health, 0, 12000, 0, battery, *(0,) * 6)


NO_PLACE = ("no horizontal velocity", "no horizontal position", "its position is assumed constant")


def checked(samples=PATH, parameters=PX4, body=START, stack="px4", options=None, told=print, stands=None, **settings):
    clock = SharedClock()
    with StandIn(autopilot=stack, clock=clock, body=PointMass(body), parameters=parameters, **settings) as vehicle:
        link = open_link(f"udpout:127.0.0.1:{vehicle.port}", clock)
        link.wait_for_vehicle(30.0)
        found = check_vehicle(link, clock, AUTOPILOTS[stack], samples, options=options, stands=stands, told=told)
        link.close()
    return {finding.name: finding for finding in found}


def test_a_vehicle_that_is_ready_has_no_problem():
    found = checked(telemetry=[estimate(GOOD), system()])
    assert [name for name, one in found.items() if one.problem and name != "link"] == []
    assert found["mode"].seen == "POSITION, armed" and found["battery"].seen == "90 %"
    assert found["position"].seen == "0.0 m from the start" and "messages" in found["link"].seen


@pytest.mark.parametrize(
    ("telemetry", "name", "says"),
    [
        ([estimate(GOOD & ~24)], "estimate", "no horizontal position"),
        ([estimate(GOOD | 1024)], "estimate", "GPS glitches"),
        ([system(health=SENSORS & ~0x200000)], "estimate", "not estimated well"),
        ([system(health=SENSORS & ~0x10000004)], "arming checks", "not ready to arm: compass"),
        ([system(battery=12)], "battery", "12 % are left"),
    ],
)
def test_what_is_wrong_is_said(telemetry, name, says):
    found = checked(telemetry=telemetry)
    assert says in found[name].problem and found[name].grave == (name == "estimate")


class Booting:
    """The estimate of a vehicle that has a position after some heartbeats."""

    def __init__(self, until):
        self.sent, self.until = 0, until

    def __iter__(self):
        self.sent += 1
        yield estimate(GOOD if self.sent > self.until else 1 | 4 | 32 | 128)


@pytest.mark.parametrize(("until", "fit"), [(20, True), (1000, False)])
def test_an_estimate_that_comes_is_waited_for_before_a_flight(until, fit):
    """A flight was refused where it began within half a minute of booting."""
    waited, options = [], StreamOptions(wait=40.0)
    started = {"telemetry": Booting(until), "armed": False}
    found = checked(options=options, told=waited.append, **started)
    assert (found["estimate"].problem is None) == fit
    assert waited == ["waiting: the estimate is not fit to fly by: " + ", ".join(NO_PLACE)]
    assert checked(**started | {"telemetry": Booting(until)})["estimate"].problem, "a check alone does not wait"


@pytest.mark.parametrize("vehicles", [1, 2, 3])
@pytest.mark.parametrize("burst", [1, 5])
@pytest.mark.parametrize("loss", [0.0, 0.3])
def test_vehicles_that_share_an_id_on_one_link_are_told_from_loss(vehicles, burst, loss):
    """Their numbers take turns, which was shown as a loss of 99.2 %."""
    vehicle, clock, random = SimpleNamespace(system=7, component=1), SharedClock(), np.random.default_rng(1)
    watch = VehicleWatch(SimpleNamespace(vehicle=vehicle, ignored=Counter(), unknown=0), clock)
    for k in range(200):
        for first in range(vehicles):
            for number in range(burst * k, burst * (k + 1)):
                if random.random() >= loss:
                    told = (90 * first + number) % 256
                    watch.take(SimpleNamespace(get_seq=lambda told=told: told, get_type=lambda: "ATTITUDE"))
    problem, seen = watch._quality()
    assert ("two vehicles have the MAVLink system id 7" in (problem or "")) == (vehicles > 1), problem
    assert ("lost" in seen) == (vehicles == 1) and (problem is None) == (vehicles == 1 and loss == 0.0)


@pytest.mark.parametrize("first", [0, 100])
def test_messages_that_overtake_each_other_and_those_of_unknown_types_are_not_lost(first):
    """One pair in the wrong order made 70 % of loss, and ArduPilot's own messages counted as lost."""
    vehicle, clock = SimpleNamespace(system=7, component=1), SharedClock()
    link = SimpleNamespace(vehicle=vehicle, ignored=Counter(), unknown=0)
    watch = VehicleWatch(link, clock)
    numbers = [*range(first, first + 200)]
    numbers[150], numbers[152] = numbers[152], numbers[150]
    for k, number in enumerate(numbers):
        if k % 5 == 3:
            link.unknown += 1
        else:
            watch.take(SimpleNamespace(get_seq=lambda told=number: told % 256, get_type=lambda: "ATTITUDE"))
    problem, seen = watch._quality()
    assert problem is None and seen.startswith("160 messages, 0.0 % lost")


def test_messages_of_a_type_that_is_not_known_are_counted_for_their_sender():
    clock = SharedClock()
    link = open_link("udpin:127.0.0.1:0", clock)
    link.vehicle = replace(link.vehicle, system=7, component=1)
    for system, seen in ((7, 1), (8, 1), (7, 2)):
        sender = mavlink.MAVLink(None, srcSystem=system, srcComponent=1)
        raw = bytearray(mavlink.MAVLink_wind_cov_message(0, *(0.0,) * 8).pack(sender))
        raw[7:10] = (163).to_bytes(3, "little")  # AHRS, of ArduPilot alone
        for message in link._parser("peer").parse_buffer(raw):
            assert not link._is_from_vehicle(message, "peer")
        assert link.unknown == seen
    link.close()


def test_vehicles_that_share_an_id_from_two_addresses_are_told():
    """The second was not heard, and the first said to fit."""
    clock = SharedClock()
    link = open_link("udpin:127.0.0.1:0", clock)
    port = link._transport._socket.getsockname()[1]
    with ExitStack() as flying:
        for _ in range(2):
            flying.enter_context(StandIn(f"udpout:127.0.0.1:{port}", clock=clock, parameters=PX4))
        link.wait_for_vehicle(30.0)
        found = {one.name: one for one in check_vehicle(link, clock, AUTOPILOTS["px4"])}
    link.close()
    assert "two vehicles have the MAVLink system id 1" in found["link"].problem and not found["link"].grave


def test_what_is_not_told_is_not_known():
    found = checked(positions=False)
    assert not any(found[name].known for name in ("estimate", "arming checks", "battery", "home"))
    assert "no LOCAL_POSITION_NED" in found["position"].problem


def test_a_fence_that_ends_before_the_plan_and_a_start_far_away_are_said():
    fence = {"GF_ACTION": 2, "GF_MAX_HOR_DIST": 2.0, "GF_MAX_VER_DIST": 0.0}
    found = checked(parameters=PX4 | fence, body=(0.0, 7.0, -1.5))
    assert "the fence ends 2 m from home" in found["GF_MAX_HOR_DIST"].problem and found["GF_MAX_HOR_DIST"].grave
    assert found["GF_MAX_VER_DIST"].problem is None
    assert "7.0 m from the start" in found["position"].problem


FENCES = {
    "px4": {"GF_ACTION": 1, "GF_MAX_HOR_DIST": 6.0, "GF_MAX_VER_DIST": 4.0},
    "ardupilot": {"FENCE_ENABLE": 1, "FENCE_TYPE": 3, "FENCE_RADIUS": 6.0, "FENCE_ALT_MAX": 4.0},
}


def home(north, east, down):
    return mavlink.MAVLink_home_position_message(0, 0, 0, north, east, down, [1, 0, 0, 0], 0, 0, 0)


@pytest.mark.parametrize("stack", FENCES)
@pytest.mark.parametrize(
    ("shift", "told", "outside"),
    [
        ((0, 0, 0), None, False),
        ((5, 0, 0), None, True),
        ((5, 0, 0), home(0.0, 5.0, 0.0), False),
        ((0, 0, 0), home(0.0, 9.0, 0.0), True),
        ((0, 0, 2), None, True),
        ((0, 0, 2), home(0.0, 0.0, -2.0), False),
    ],
)
def test_fences_are_measured_from_home(stack, shift, told, outside):
    """They used to be measured from the file's start, and their height from the local origin."""
    path = replace(PATH, position=PATH.position + shift)
    found = checked(path, FENCES[stack], stack=stack, telemetry=[] if told is None else [told])
    problems = [name for name in FENCES[stack] if name in found and found[name].problem and found[name].grave]
    assert bool(problems) == outside, problems


FAR = "7.6 m from its place in the show, 7.0 m east and 3.0 m south"


@pytest.mark.parametrize(("east", "north", "said"), [(0.0, 1.0, None), (7.0, -3.0, FAR)])
def test_how_far_home_is_from_the_place_in_a_show_is_said(east, north, said):
    origin = ShowOrigin(47.4733, 19.0621, 110.0, 59.0)
    stands = origin.geodetic((12.0, 30.0, 0.0))
    turned = np.array([east, north, 0.0]) @ origin.axes  # in the frame of the show
    latitude, longitude, _ = origin.geodetic(np.array([12.0, 30.0, 0.0]) + turned)
    degrees = round(1e7 * latitude), round(1e7 * longitude)
    told = mavlink.MAVLink_home_position_message(*degrees, 0, 0.0, 0.0, 0.0, [1, 0, 0, 0], 0, 0, 0)
    found = checked(stands=stands[:2], telemetry=[told])["place"]
    assert (found.problem is None) == (said is None) and (said is None or said in found.problem) and not found.grave
    assert not checked(stands=stands[:2])["place"].known


@pytest.mark.parametrize("stack", FENCES)
@pytest.mark.parametrize(("body", "outside"), [((2.0, 2.0, -1.5), False), ((0.0, 5.0, -1.5), True)])
def test_a_flight_that_begins_at_the_vehicle_is_checked_where_it_is_flown(stack, body, outside):
    """The vehicle's distance to the file's own start used to be told, and fences used to be held against that path."""
    found = checked(PATH, FENCES[stack], body, stack, StreamOptions(relative=True))
    assert found["position"].problem is None and found["position"].seen == "0.0 m from the start"
    assert any(found[name].problem for name in FENCES[stack] if name in found) == outside


def test_tilt_counts_what_is_really_commanded():
    plain, sent = flight_needs(PATH), flight_needs(FeedForward(drag=3.0).stated(PATH))
    pull = PATH.acceleration + 3.0 * PATH.velocity
    most = np.arctan2(np.hypot(pull[:, 0], pull[:, 1]), 9.80665 + pull[:, 2]).max()
    assert sent.tilt == pytest.approx(most, abs=1e-3) and sent.tilt > plain.tilt + 0.1
    assert sent.acceleration == plain.acceleration


def test_the_checks_that_fail_are_named_by_its_events():
    failed = report(event("check_modes_local_pos"))
    found = checked(telemetry=[estimate(GOOD), system(), *failed])
    assert found["arming checks"].problem == "it is not ready to arm: no valid local position"


EVERY_MODE, INFO = 0xFFFFFFFF, 6


def test_what_keeps_no_vehicle_from_arming_is_not_said_to():
    """PX4 1.17 before a stream, as it was recorded: it arms at once. Optional checks concern every mode by its word."""
    told = report(
        event(0x012F1DC7), event("check_rc_dl_no_dllink", EVERY_MODE, INFO), event("check_modes_manual_control", 1 << 2)
    )
    assert checked(telemetry=[estimate(GOOD), system(), *told])["arming checks"].problem is None
    busy = report(event(0x012F1DC7), event(0x0110288C, EVERY_MODE))
    found = checked(telemetry=[estimate(GOOD), system(), *busy])
    assert found["arming checks"].problem == "it is not ready to arm: the processor is too busy"


def test_an_arducopter_that_says_nothing_unasked_is_asked_for_its_state():
    well = mavlink.MAVLink_ekf_status_report_message(831, 0.01, 0.01, 0.0, 0.01, 0.0, 0.0)
    told = [well, system(), home(0.0, 0.0, 0.0)]
    found = checked(telemetry=told, parameters={}, stack="ardupilot", silent_unasked=True)
    seen = {name: found[name].seen for name in ("estimate", "arming checks", "battery", "position", "home")}
    assert seen["estimate"] == "flags 831" and seen["arming checks"] == "SYS_STATUS" and seen["battery"] == "90 %"
    assert seen["position"] == "0.0 m from the start" and "above" in seen["home"]
    assert not any(found[name].problem for name in seen)
