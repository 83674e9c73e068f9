"""Where a show is flown: origin, surveyed homes, and a fence whose distances are proved."""

import json
import re
import zipfile

import numpy as np
import pytest

import minsnap
from minsnap.cli.app import main
from minsnap.errors import FileError, FleetError, UnprovedError
from minsnap.shows.acts import Act, Show
from minsnap.shows.fleet_files import read_fleet, read_origin
from minsnap.shows.formations import circle
from minsnap.shows.moves import Move
from minsnap.shows.show import fly
from minsnap.shows.show_yaml import read_show
from minsnap.shows.site import Fence, ShowOrigin, read_survey
from minsnap.shows.skyc import ShowSheet, read_skyc

LIMITS = minsnap.Limits(speed=3, acceleration=2)
NORTH = ShowOrigin(47.0, 19.0, 100.0, 0.0)
SQUARE = [[-6, -6], [6, -6], [6, 6], [-6, 6]]


def test_places_on_the_earth_are_along_the_axes_of_the_show():
    """A degree of latitude is 111.2 km there, and one of longitude 76.1 km (WGS 84, at 47 degrees)."""
    north, east = (47.001, 19.0, 103.0), (47.0, 19.001, 100.0)
    assert NORTH.local(north) == pytest.approx([111.17, 0.0, 3.0], abs=0.02)
    assert NORTH.local(east) == pytest.approx([0.0, -76.06, 0.0], abs=0.02)
    assert ShowOrigin(47.0, 19.0, 100.0).local(east) == pytest.approx([76.06, 0.0, 0.0], abs=0.02), "x is east"
    turned = ShowOrigin(47.0, 19.0, 100.0, 45.0)
    assert turned.local(north)[:2] == pytest.approx([78.61, 78.61], abs=0.03), "north is to the left of north-east"


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("latitude,longitude\n19,47\n", r"place 0 is .* km from the origin of the show"),
        ("x,y\n1,2\n", "latitude"),
        ("altitude\n2\n", "altitude"),
        ("latitude,altitude\n47,2\n", "give latitude and longitude"),
        ("", "is empty"),
    ],
)
def test_surveys_that_cannot_be_are_refused(tmp_path, text, sentence):
    (tmp_path / "homes.csv").write_text(text)
    with pytest.raises(FileError, match=sentence):
        read_survey(tmp_path / "homes.csv", NORTH)
    with pytest.raises(FileError, match="give the show an origin"):
        read_survey(tmp_path / "homes.csv", None)
    for wrong in ({"latitude": 91.0, "longitude": 0.0}, {"latitude": np.nan, "longitude": 0.0}):
        with pytest.raises(FleetError, match="latitude of the origin"):
            ShowOrigin(**wrong)


def test_surveys_have_heights_where_the_origin_has_one(tmp_path):
    (tmp_path / "homes.csv").write_text("47.0001;19.0;101\n47.0;19.0;100\n")
    homes = read_survey(tmp_path / "homes.csv", NORTH)
    assert homes == pytest.approx(np.array([[11.12, 0, 1], [0, 0, 0]]), abs=0.01)
    assert (read_survey(tmp_path / "homes.csv", ShowOrigin(47.0, 19.0))[:, 2] == 0.0).all()


def test_distances_to_walls_are_those_of_the_curve():
    fence = Fence([[-6, -6], [6, -6], [8, 0], [6, 6], [-6, 6]], [0, 0, 0, 1, 0])
    curve = minsnap.plan([(0, 0, 1), (5, 3, 1), (0, 0, 1)], total_time=6.0)
    held = fence.distances(minsnap.Fleet((curve,)))[0]
    points = curve(np.linspace(0.0, 6.0, 60_001))[:, :2]
    for wall, (one, two) in enumerate(zip(fence.corners, np.roll(fence.corners, -1, axis=0), strict=True)):
        side = (two - one) / np.linalg.norm(two - one)
        inside = side[0] * (points - one)[:, 1] - side[1] * (points - one)[:, 0]
        assert held[wall] == pytest.approx(inside.min(), abs=1e-6) and held[wall] <= inside.min()
    assert fence.margin_of(minsnap.Fleet((curve,))) == pytest.approx((held - fence.margins).min())
    mirrored = Fence(fence.corners[::-1])
    assert sorted(mirrored.distances(minsnap.Fleet((curve,)))[0]) == pytest.approx(sorted(held))


@pytest.mark.parametrize(
    ("corners", "margin", "sentence"),
    [
        ([[0, 0], [4, 4], [4, 0], [0, 4]], 0.0, "the sides of the fence cross"),
        ([[0, 0], [4, 0], [1, 1], [0, 4]], 0.0, "points inwards"),
        ([[0, 0], [2, 3], [4, 0], [0, 2], [4, 2]], 0.0, "the sides of the fence cross"),
        ([[0, 0], [4, 0]], 0.0, "give three corners"),
        ([[0, 0], [4, 0], [4, 0], [0, 4]], 0.0, "one point"),
        ([[0, 0], [4, 0], [8, 0]], 0.0, "give a convex polygon"),
        ([[0, 0], [4, 0], [np.nan, 0]], 0.0, "give three corners"),
        (SQUARE, 6.0, "leave nothing inside"),
        (SQUARE, -1.0, "the margin of the fence"),
        (SQUARE, [1.0, 2.0], "the margin of the fence"),
    ],
)
def test_fences_that_cannot_be_are_refused(corners, margin, sentence):
    with pytest.raises(FleetError, match=sentence):
        Fence(corners, margin)


def crossing(fence):
    """Eight that cross in a plane, so that some go around."""
    ring = circle(8, 4.0, 2.0)
    acts = (Act("ring", ring, 0.5), Act("turned", np.roll(ring, 4, axis=0), 0.5, moves=(Move(np.pi / 4),)))
    return Show(ring - (0, 0, 2), acts, minsnap.Separation(0.8), LIMITS, fence=fence, room=((-9, -9, 0), (9, 9, 2.2)))


@pytest.mark.parametrize("to", ["csv", "skyc"])
def test_flights_stay_inside_of_the_fence(to):
    fence = Fence(SQUARE, 1.5)
    show = crossing(fence)
    flown = fly(show, to=to)
    assert fence.margin_of(flown.fleet) >= 0.0
    with pytest.raises(FleetError, match=r"point \d of home is 0\.5 m beyond the margin of wall \d of the fence"):
        fly(crossing(Fence(SQUARE, 2.5)), to=to)


def test_curves_that_leave_the_fence_are_searched_for_again(monkeypatch):
    """Vehicles that go around each other bulge over the wall; with its walls as obstacles they do not."""
    across = np.array([[-4.0, 0.4, 0], [4.0, 0.4, 0]])
    act = Act("across", np.array([[4.0, 0.5, 2.0], [-4.0, 0.5, 2.0]]))
    monkeypatch.setattr("minsnap.shows.group_places.assign", lambda now, points, progress: np.arange(len(points)))
    fence = Fence([[-6, -6], [6, -6], [6, 1.1], [-6, 1.1]])
    show = Show(across, (act,), minsnap.Separation(1.5), LIMITS, fence=fence, room=((-9, -9, 0), (9, 9, 2.2)))
    assert fence.margin_of(fly(show).fleet) >= 0.0
    far = fence.obstacles()[:2]
    monkeypatch.setattr(Fence, "obstacles", lambda self: far)
    with pytest.raises(UnprovedError, match=r"across: the curves found are .* m beyond a margin"):
        fly(show)


def test_moves_beyond_the_fence_are_refused():
    show = crossing(Fence(SQUARE, 1.5))
    act = Act("ring", circle(8, 4.0, 2.0), moves=(Move(along=np.array([[0.0, 0, 0], [1, 0, 0]])),))
    with pytest.raises(FleetError, match=r"a move of 'ring' is 0\.5 m beyond a margin of the fence"):
        fly(Show(show.home, (act,), show.separation, LIMITS, fence=show.fence))


SITE = """
vehicles: 4
separation: 1.0
limits: {speed: 4, acceleration: 3}
origin: {latitude: 47.4733601, longitude: 19.0621591, altitude: 110, orientation: 59}
home: {survey: homes.csv}
fence: {polygon: [[-12, -12], [12, -12], [14, 0], [12, 12], [-12, 12]], margin: [1, 1, 1, 2, 2]}
take_off: 3
acts: [{name: ring, formation: {circle: {radius: 8, height: 10}}, hold: 1}]
"""
HOMES = "lat,lon,alt\n47.4733601,19.0621591,110\n47.4733801,19.0621591,110\n47.4733801,19.0621991,110.1\n"
HOMES += "47.4733601,19.0621991,110\n"


@pytest.mark.slow
def test_the_command_reads_a_site_and_its_files_and_report_say_it(tmp_path, capsys):
    (tmp_path / "show.yaml").write_text(SITE)
    (tmp_path / "homes.csv").write_text(HOMES)
    out, page = tmp_path / "out", tmp_path / "report.html"
    with pytest.raises(SystemExit) as left:
        main(["fleet", str(tmp_path / "show.yaml"), "-o", str(out), "--to", "skyc", "--report", str(page)])
    said = capsys.readouterr().out
    assert not left.value.code and re.search(r"inside the fence\s+(1\.99|2\.00)\d m beyond its margins", said), said
    with zipfile.ZipFile(out / "show.skyc") as archive:
        location = json.loads(archive.read("show.json"))["environment"]["location"]
    assert location == {"origin": [47.4733601, 19.0621591, 110.0], "orientation": 59.0}
    held = read_skyc(out / "show.skyc")
    assert vars(held.origin) == vars(read_show(tmp_path / "show.yaml").origin)
    assert read_fleet(out)(0.0)[2] == pytest.approx(held.origin.local((47.4733801, 19.0621991, 110.1)), abs=0.002)
    html = page.read_text()
    assert "47.4733801, 19.0621991" in html, "the home of each vehicle"
    assert "latitude 47.4733601°" in html and "<h2>Fence</h2>" in html and html.count(", kept</td>") >= 5


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ("survey: homes.csv", "survey: none.csv", "none.csv"),
        ("vehicles: 4", "vehicles: 5", "has 4 places for 5 vehicles"),
        ("polygon: [[-12, -12],", "survey: homes.csv, polygon: [[-12, -12],", "a polygon, or the file of a survey"),
        ("latitude: 47", "latitudes: 47", "did you mean latitude"),
        ("latitude: 47.4733601, ", "", "has no latitude"),
    ],
)
def test_sites_that_cannot_be_are_said_in_a_sentence(tmp_path, old, new, sentence):
    (tmp_path / "show.yaml").write_text(SITE.replace(old, new))
    (tmp_path / "homes.csv").write_text(HOMES)
    with pytest.raises(FileError, match=sentence):
        read_show(tmp_path / "show.yaml")


def test_places_go_to_the_earth_and_back():
    origin = ShowOrigin(47.4733, 19.0621, 110.0, 59.0)
    places = np.array([[0.0, 0.0, 0.0], [40.0, -25.0, 12.0], [-300.0, 200.0, 80.0]])
    assert origin.local(origin.geodetic(places)) == pytest.approx(places, abs=1e-6)


@pytest.mark.parametrize("name", ["show.skyc", "folder"])
def test_files_say_the_origin(tmp_path, name):
    origin = ShowOrigin(47.4733, 19.0621, 110.0, 59.0)
    fleet = minsnap.Fleet((minsnap.plan([(0, 0, 0), (0, 0, 5)], total_time=5.0),))
    minsnap.shows.write_fleet(fleet, tmp_path / name, sheet=ShowSheet(origin=origin))
    assert vars(read_origin(tmp_path / name)) == pytest.approx(vars(origin))


@pytest.mark.parametrize("altitude", [110.0, None])
def test_manifests_have_the_home_of_each_vehicle_on_the_earth(tmp_path, altitude):
    origin, places = ShowOrigin(47.4733, 19.0621, altitude, 59.0), np.array([(0.0, 0, 0), (30.0, -4, 0.5)])
    fleet = minsnap.Fleet(tuple(minsnap.plan([place, place + (0, 0, 5)], total_time=5.0) for place in places))
    minsnap.shows.write_fleet(fleet, tmp_path, sheet=ShowSheet(origin=origin))
    homes = [row["home"] for row in json.loads((tmp_path / "manifest.json").read_text())["vehicles"]]
    known = np.array(
        [[home["latitude"], home["longitude"], home.get("altitude", 0.5 * i)] for i, home in enumerate(homes)]
    )
    assert ("altitude" in homes[0]) is (altitude is not None)
    assert origin.local(known) == pytest.approx(places, abs=1e-4)
    assert len(read_fleet(tmp_path)) == 2
