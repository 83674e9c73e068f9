"""The start of all vehicles: by broadcasts through cflib and a dongle's bytes, or link by link; what is not heard."""

import struct
from math import inf

import pytest
from crazyradio_dongle import Dongle, RadioVehicle
from crtp_vehicle import CrtpVehicle

import minsnap
from minsnap.errors import FlightError, LinkError
from minsnap.flight.crtp_link import channel_of, open_link
from minsnap.flight.high_level import Volleys, planned_ways, start_group
from minsnap.flight.swarm_flight import FlightTimes
from minsnap.flight.swarm_upload import upload
from minsnap.shows.memory_parts import upload_of

VOLLEYS = Volleys(hearing=0.5)
QUICK = FlightTimes(0.02, 0.02, 0.02, 0.01, VOLLEYS, climb=inf, travel=inf, sink=inf)
START = struct.pack("<BBBBBBf", 13, 1, 0, 0, 0, 1, 1.0)


@pytest.fixture
def plug(monkeypatch):
    """Plug in a dongle with vehicles around it."""
    drivers, radios = pytest.importorskip("cflib.crtp"), pytest.importorskip("cflib.drivers.crazyradio")

    def plugged(*vehicles):
        dongle = Dongle(*vehicles)
        monkeypatch.setattr(drivers, "CLASSES", [])
        monkeypatch.setattr(radios, "_find_devices", lambda serial=None: [dongle] * (dongle.number + 1))
        return dongle

    return plugged


def fleet_of(count):
    return minsnap.Fleet([minsnap.plan([(i, 0, 1), (i, 0.2, 1.1)], [0.2]) for i in range(count)])


def starts(vehicle):
    return [body for _, body in vehicle.commands if body[0] == 13]


def test_addresses_say_which_broadcast_reaches_them(monkeypatch):
    assert channel_of("radio://0/80/2M/E7E7E7E701?rate_limit=100") == "radio://0/80/2M"
    assert channel_of("radio://1/90/250K") == "radio://1/90/250K" and channel_of("radio://0") == "radio://0/2/2M"
    assert channel_of("udp://127.0.0.1:19850") is None and channel_of("usb://0") is None
    uris = ["radio://0/80/2M/E7E7E7E701", "radio://0/80/2M/E7E7E7E702", "radio://0/90/1M/E7E7E7E703"]
    assert planned_ways(uris) == "by a broadcast on radio://0/80/2M, radio://0/90/1M"
    assert planned_ways([*uris[:1], "usb://0"]).endswith("2M and link by link (1 without a broadcast)")
    monkeypatch.setenv("USE_CFLINK", "cpp")
    assert planned_ways(uris) == "link by link (3 without a broadcast)"


def test_vehicles_on_links_of_their_own_are_told_one_after_the_other():
    with CrtpVehicle() as one, CrtpVehicle(lossy=True) as two:
        links = [open_link(vehicle.uri) for vehicle in (one, two)]
        how = start_group(links, VOLLEYS)
        for link in links:
            link.close()
    assert (how.ways, how.volleys) == ("link by link (2 without a broadcast)", 1)
    assert str(how).startswith("started link by link (2 without a broadcast), all within ")
    assert starts(one) == [START] * VOLLEYS.copies and set(starts(two)) == {START}
    told = [when for vehicle in (one, two) for when, _ in vehicle.commands]
    assert how.spread >= (VOLLEYS.copies - 1) * VOLLEYS.pause and min(told) <= max(told)


def test_all_are_told_again_where_one_heard_nothing_and_a_silent_one_is_an_error():
    class Once(CrtpVehicle):
        """A vehicle that hears nothing of the first volley."""

        def answer(self, port, channel, body):
            return None if self.seen <= VOLLEYS.copies else super().answer(port, channel, body)

    with CrtpVehicle() as one, Once() as two:
        links = [open_link(vehicle.uri) for vehicle in (one, two)]
        how = start_group(links, VOLLEYS)
        assert how.volleys == 2 and str(how).endswith(", told 2 times")
        two.lasts = two.seen
        with pytest.raises(LinkError, match=f"^{two.uri} does not answer to the start"):
            start_group(links, VOLLEYS)
        for link in links:
            link.close()
    assert len(starts(one)) == (2 + VOLLEYS.most) * VOLLEYS.copies


def test_a_vehicle_that_refuses_to_start_is_named():
    class Refuses(CrtpVehicle):
        def answer(self, port, channel, body):
            return super().answer(port, channel, body)[:3] + b"\x08"

    with Refuses() as one:
        link = open_link(one.uri)
        with pytest.raises(FlightError, match=f"{one.uri} refuses to start with error 8"):
            start_group([link], VOLLEYS)
        link.close()


@pytest.mark.slow
def test_radios_start_their_vehicles_by_one_broadcast_a_channel(plug):
    places = [(80, "2M", 1), (80, "2M", 2), (90, "1M", 3)]
    radio = [RadioVehicle(*place, at=(i, 0, 0)) for i, place in enumerate(places)]
    dongle, fleet, told = plug(*radio), fleet_of(4), []
    with CrtpVehicle(at=(3, 0, 0)) as simulated:
        vehicles = [*radio, simulated]
        upload(fleet, [one.uri for one in vehicles], start=True, timing=QUICK, told=told.append)
    packet = bytes([0x8C]) + START
    assert dongle.sent == [(80, packet), (90, packet)] * VOLLEYS.copies
    for vehicle, curve in zip(vehicles, fleet, strict=True):
        content = upload_of(curve).content
        assert bytes(vehicle.memory[: len(content)]) == content
        assert list(dict.fromkeys(body[0] for _, body in vehicle.commands)) == [6, 0, 7, 12, 13, 8]
    assert [len(starts(one)) for one in vehicles] == [4 * VOLLEYS.copies] * 3 + [VOLLEYS.copies]
    radios, rest = (
        ", ".join(f"radio://{dongle.number}/{part}" for part in ("80/2M", "90/1M")),
        "link by link (1 without a broadcast)",
    )
    assert told[4].startswith(f"started by a broadcast on {radios} and {rest}, all within")


@pytest.mark.slow
def test_a_broadcast_that_one_did_not_hear_is_sent_again_to_all(plug):
    copies = 4 * VOLLEYS.copies
    one, two = RadioVehicle(80, "2M", 1), RadioVehicle(80, "2M", 2, deaf=copies, at=(1, 0, 0))
    dongle, told = plug(one, two), []
    upload(fleet_of(2), [one.uri, two.uri], start=True, timing=QUICK, told=told.append)
    assert len(dongle.sent) == 2 * VOLLEYS.copies and told[4].endswith("told 2 times")
    assert (len(starts(one)), len(starts(two))) == (2 * copies, copies)


@pytest.mark.slow
def test_who_hears_no_broadcast_makes_all_land(plug):
    one, two = RadioVehicle(80, "2M", 1), RadioVehicle(80, "2M", 2, deaf=1000, at=(1, 0, 0))
    plug(one, two)
    with pytest.raises(LinkError, match=f"{two.uri} does not answer to the start"):
        upload(fleet_of(2), [one.uri, two.uri], start=True, timing=QUICK)
    assert one.commands[-1][1][0] == two.commands[-1][1][0] == 8
