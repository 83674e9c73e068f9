"""Missions by latitude and longitude: read, and refused in a sentence."""

import copy
import json
import zipfile

import numpy as np
import pytest

from minsnap.errors import FileError
from minsnap.files.geodesy import local_positions
from minsnap.files.geodetic_missions import is_mission, read_mission
from minsnap.files.kml_missions import read_outline
from minsnap.files.waypoints import read_waypoints

HOME = [47.3977419, 8.5455938, 488.0]


def item(command, place, frame=3):
    params = [0, 0, 0, None, *place]
    return {"type": "SimpleItem", "autoContinue": True, "command": command, "frame": frame, "params": params}


PLAN = {
    "fileType": "Plan",
    "version": 1,
    "groundStation": "QGroundControl",
    "mission": {
        "version": 2,
        "plannedHomePosition": HOME,
        "items": [
            item(22, [0, 0, 10.0]),
            item(178, [0, 0, 0], frame=2),
            item(16, [47.398, 8.5456, 15.0]),
            item(16, [47.398, 8.5456, 15.0]),
            item(82, [47.3981, 8.546, 510.0], frame=0),
            item(20, [0, 0, 0], frame=2),
        ],
    },
}


def written(tmp_path, content):
    file = tmp_path / "mission.plan"
    file.write_text(json.dumps(content))
    return file


def test_items_that_fly_somewhere_are_waypoints_about_home(tmp_path):
    mission = read_mission(written(tmp_path, PLAN))
    places = [[*HOME[:2], 498.0], [47.398, 8.5456, 503.0], [47.3981, 8.546, 510.0]]
    assert mission.points == pytest.approx(local_positions(places, HOME))
    assert mission.points[0] == pytest.approx([0.0, 0.0, 10.0], abs=1e-8)
    assert mission.home.tolist() == HOME
    assert np.array_equal(read_waypoints(tmp_path / "mission.plan").points, mission.points)


def test_the_transects_of_a_survey_are_waypoints(tmp_path):
    plan = copy.deepcopy(PLAN)
    inner = [item(16, [47.399, 8.545, 20.0]), item(16, [47.399, 8.546, 20.0])]
    survey = {"type": "ComplexItem", "complexItemType": "survey", "TransectStyleComplexItem": {"Items": inner}}
    plan["mission"]["items"].append(survey)
    assert len(read_mission(written(tmp_path, plan)).points) == 5


def test_what_is_not_flown_of_a_mission_is_said(tmp_path):
    """Holds, headings, jumps, changes of speed and the fence were dropped without a word."""
    plan = copy.deepcopy(PLAN)
    items = plan["mission"]["items"]
    items += [
        item(16, [47.399, 8.545, 20.0]),
        item(177, [0, 0, 0]),
        item(19, [47.4, 8.546, 20.0]),
        item(530, [0, 0, 0]),
    ]
    items[2]["params"][:4] = items[6]["params"][:4] = [5, 0, 0, 90.0]
    plan["geoFence"] = {"circles": [], "polygons": [{"polygon": []}]}
    listed = "DO_CHANGE_SPEED, hold (2 times), yaw (2 times), RTL, DO_JUMP, loitering, command 530, geofence"
    assert read_mission(written(tmp_path, plan)).left_out == f"the path leaves out of the mission: {listed}"
    plan["mission"]["items"] = [items[0], items[3]]
    assert read_mission(written(tmp_path, plan | {"geoFence": {}})).left_out == ""


def changed(path, value):
    plan = copy.deepcopy(PLAN)
    place = plan
    for key in path[:-1]:
        place = place[key]
    place[path[-1]] = value
    return plan


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ([1, 2], "no QGroundControl plan"),
        (changed(["fileType"], "Fence"), "no QGroundControl plan"),
        (changed(["mission", "plannedHomePosition"], [47.0, 8.0]), "plannedHomePosition"),
        (changed(["mission", "items", 2, "frame"], 10), "frame 10"),
        (changed(["mission", "items", 2, "params", 4], 91.0), "item 2"),
        (changed(["mission", "items", 2, "params", 5], "8.5"), "item 2"),
        (changed(["mission", "items", 2, "params"], [1]), "seven"),
        (changed(["mission", "items"], PLAN["mission"]["items"][:2]), "1 different positions"),
        (
            changed(["mission", "items", 1], {"type": "ComplexItem", "complexItemType": "StructureScan"}),
            "StructureScan",
        ),
        (changed(["mission", "items", 1], {"type": "ComplexItem", "complexItemType": "vtolLandingPattern"}), "landing"),
        (changed(["mission", "items", 1], 7), "item 1"),
    ],
)
def test_what_cannot_be_converted_is_refused_with_its_place(tmp_path, content, said):
    with pytest.raises(FileError, match=said):
        read_mission(written(tmp_path, content))


def test_broken_text_is_refused(tmp_path):
    (tmp_path / "mission.plan").write_text("{")
    with pytest.raises(FileError, match="JSON"):
        read_mission(tmp_path / "mission.plan")


def test_a_number_that_no_double_holds_is_refused(tmp_path):
    for home in ([10**400, 8.0, 1.0], [47.0, 8.0, -(10**400)]):
        with pytest.raises(FileError, match="plannedHomePosition"):
            read_mission(written(tmp_path, changed(["mission", "plannedHomePosition"], home)))


def test_take_off_and_landing_of_a_vtol_are_positions(tmp_path):
    """Of a plan with commands 84 and 85 alone it was said that it has no positions."""
    plan = copy.deepcopy(PLAN)
    landing = {"landingApproachCoordinate": [47.399, 8.546, 40.0], "landCoordinate": [47.3995, 8.546, 0.0]}
    complex_item = {"type": "ComplexItem", "complexItemType": "vtolLandingPattern", "altitudesAreRelative": True}
    plan["mission"]["items"] = [item(84, [47.398, 8.5456, 30.0]), item(85, [47.3985, 8.546, 0.0])]
    assert len(read_mission(written(tmp_path, plan)).points) == 2
    plan["mission"]["items"].append(complex_item | landing)
    assert read_mission(written(tmp_path, plan)).points[:, 2] == pytest.approx([30.0, 0.0, 40.0, 0.0], abs=0.1)


def test_changes_of_speed_are_kept_for_each_leg(tmp_path):
    plan = copy.deepcopy(PLAN)
    for at, speed in ((2, 4.0), (6, 7.0)):
        change = item(178, [0, 0, 0], frame=2)
        change["params"][:2] = [1, speed]
        plan["mission"]["items"].insert(at, change)
    mission = read_mission(written(tmp_path, plan))
    assert len(mission.points) == 3 and mission.speeds == pytest.approx([4.0, 4.0])
    assert "DO_CHANGE_SPEED" in mission.left_out  # the one that says no speed


WPL = """QGC WPL 110
0\t1\t0\t16\t0\t0\t0\t0\t47.3977419\t8.5455938\t488\t1
1\t0\t3\t22\t0\t0\t0\t0\t0\t0\t10\t1
2\t0\t0\t178\t1\t6\t0\t0\t0\t0\t0\t1
3\t0\t3\t16\t2\t0\t0\t0\t47.398\t8.5456\t15\t1
4\t0\t0\t82\t0\t0\t0\t0\t47.3981\t8.546\t510\t1
5\t0\t0\t20\t0\t0\t0\t0\t0\t0\t0\t1
"""


@pytest.mark.parametrize("name", ["a.waypoints", "a.txt", "a.mission.txt"])
def test_the_text_of_ardupilot_has_home_in_its_first_row(tmp_path, name):
    (tmp_path / name).write_text(WPL)
    mission = read_mission(tmp_path / name)
    places = [[*HOME[:2], 498.0], [47.398, 8.5456, 503.0], [47.3981, 8.546, 510.0]]
    assert mission.points == pytest.approx(local_positions(places, HOME)) and mission.home.tolist() == HOME
    assert mission.speeds == pytest.approx([6.0, 6.0])
    assert mission.left_out == "the path leaves out of the mission: hold, RTL"
    moved = read_mission(tmp_path / name, (47.398, 8.5456, 500.0))
    assert moved.points[1] == pytest.approx([0.0, 0.0, 3.0], abs=1e-8)


def test_it_agrees_with_the_reader_of_mavlink(tmp_path):
    mavwp = pytest.importorskip("pymavlink.mavwp")
    (tmp_path / "a.waypoints").write_text(WPL)
    loader = mavwp.MAVWPLoader()
    assert loader.load(str(tmp_path / "a.waypoints")) == 6
    points = [loader.wp(i) for i in (3, 4)]
    mission = read_mission(tmp_path / "a.waypoints")
    places = [[wp.x, wp.y, wp.z + (HOME[2] if wp.frame == 3 else 0.0)] for wp in points]
    assert mission.points[1:] == pytest.approx(local_positions(places, HOME), abs=1e-6)


def test_a_text_without_home_has_it_below_its_first_place(tmp_path):
    lines = [line for line in WPL.splitlines() if not line.startswith(("0", "1", "4"))]
    (tmp_path / "a.waypoints").write_text("\n".join([*lines, "4 0 3 16 0 0 0 0 47.399 8.5456 15 1"]))
    mission = read_mission(tmp_path / "a.waypoints")
    assert mission.home == pytest.approx([47.398, 8.5456, 0.0]) and mission.points[0] == pytest.approx(
        [0, 0, 15.0], abs=1e-8
    )


LINE = "8.5456,47.398,{0} 8.546,47.3981,{1}\n8.547,47.3982,{1}"


def kml(inner, mode="<altitudeMode>absolute</altitudeMode>"):
    return f'<?xml version="1.0"?><kml xmlns="http://www.opengis.net/kml/2.2"><Document>{inner.format(mode)}</Document></kml>'


def line(text):
    return f"<Placemark><LineString>{{0}}<coordinates>{text}</coordinates></LineString></Placemark>"


def test_a_line_of_google_earth(tmp_path):
    file = tmp_path / "a.kml"
    file.write_text(kml(line(LINE.format(500, 510))))
    mission = read_mission(file)
    assert mission.home.tolist() == [47.398, 8.5456, 0.0]
    assert mission.points[:, 2] == pytest.approx([500.0, 510.0, 510.0], abs=0.01)
    above = read_mission(file, (47.398, 8.5456, 490.0)).points
    assert above[0] == pytest.approx([0.0, 0.0, 10.0], abs=1e-8)
    file.write_text(kml(line(LINE.format(10, 20)), "<altitudeMode>relativeToGround</altitudeMode>"))
    ground = read_mission(file, (47.398, 8.5456, 490.0))
    assert ground.points[0] == pytest.approx([0.0, 0.0, 10.0], abs=1e-8) and "the ground" in ground.left_out
    places = "".join(f"<Placemark><Point>{{0}}<coordinates>{place}</coordinates></Point></Placemark>"
                     for place in LINE.format(500, 510).split())  # fmt: skip
    file.write_text(kml(places))
    assert read_mission(file).points == pytest.approx(mission.points)


def wayline(mode="relativeToStartPoint"):
    marks = "".join(
        f"<Placemark><Point><coordinates>{place}</coordinates></Point><wpml:index>{i}</wpml:index>"
        f"<wpml:executeHeight>{30 + i}</wpml:executeHeight><wpml:waypointSpeed>{speed}</wpml:waypointSpeed></Placemark>"
        for i, (place, speed) in enumerate((("8.5456,47.398", 5), ("8.546,47.3981", 3), ("8.547,47.3982", 2)))
    )
    return (
        '<kml xmlns="http://www.opengis.net/kml/2.2" xmlns:wpml="http://www.dji.com/wpmz/1.0.6"><Document><Folder>'
        f"<wpml:executeHeightMode>{mode}</wpml:executeHeightMode><wpml:autoFlightSpeed>9</wpml:autoFlightSpeed>"
        f"{marks}</Folder></Document></kml>"
    )


def packed(path, members):
    with zipfile.ZipFile(path, "w") as archive:
        for name, text in members.items():
            archive.writestr(name, text)
    return path


def test_a_wayline_of_dji(tmp_path):
    """Its speed at a waypoint is that from there on."""
    start = "<Document><wpml:missionConfig><wpml:takeOffRefPoint>47.3977,8.5456,480</wpml:takeOffRefPoint>"
    template = wayline().replace("<Document>", start + "</wpml:missionConfig>")
    file = packed(tmp_path / "a.kmz", {"wpmz/template.kml": template, "wpmz/waylines.wpml": wayline()})
    mission = read_mission(file)
    assert mission.home == pytest.approx([47.3977, 8.5456, 480.0]) and mission.speeds == pytest.approx([5.0, 3.0])
    assert mission.points[:, 2] == pytest.approx([30.0, 31.0, 32.0], abs=0.01)
    alone = read_mission(packed(tmp_path / "b.kmz", {"wpmz/waylines.wpml": wayline("WGS84")}))
    assert alone.points[0] == pytest.approx([0.0, 0.0, 30.0], abs=1e-8)
    earth = read_mission(packed(tmp_path / "c.kmz", {"doc.kml": kml(line(LINE.format(1, 2)))}))
    assert len(earth.points) == 3


LITCHI = """latitude,longitude,altitude(m),heading(deg),curvesize(m),rotationdir,gimbalmode,altitudemode,speed(m/s)
47.398,8.5456,30,0,0,0,0,{0},5
47.3981,8.546,31,0,0,0,0,{0},0
47.3982,8.547,32,0,0,0,0,{0},2
"""


def test_a_mission_of_litchi_and_a_table_by_latitude(tmp_path):
    (tmp_path / "litchi.csv").write_text(LITCHI.format(0))
    mission = read_mission(tmp_path / "litchi.csv", (47.398, 8.5456, 480.0))
    assert mission.points[0] == pytest.approx([0.0, 0.0, 30.0], abs=1e-8)
    assert mission.speeds == pytest.approx([5.0, np.nan], nan_ok=True)
    (tmp_path / "table.csv").write_text("Lat;Lon;Altitude (m)\n47,398;8,5456;500\n47,3981;8,546;510\n")
    assert read_mission(tmp_path / "table.csv").points[0] == pytest.approx([0.0, 0.0, 500.0], abs=1e-8)
    assert read_waypoints(tmp_path / "table.csv", (47.398, 8.5456, 490.0)).points[0, 2] == pytest.approx(10.0)
    assert not is_mission(tmp_path / "none.csv") and is_mission("a.plan")


TRACK = [("47.398", "8.5456", "500"), ("47.3981", "8.546", "510"), ("47.3982", "8.547", "510")]


def gpx(line="trk", place="trkpt", rows=TRACK, more="", after=""):
    """A file of one line of places, in segments if it is a track, or of places alone; and what follows it."""
    places = [f'<{place} lat="{lat}" lon="{lon}"><ele>{ele}</ele>{more}</{place}>' for lat, lon, ele in rows]
    if line == "trk":
        places = [f"<trkseg>{''.join(part)}</trkseg>" for part in (places[:2], places[2:])]
    inner = "".join(places) if line is None else f"<{line}><name>home</name>{''.join(places)}</{line}>"
    head = '<?xml version="1.0"?><gpx version="1.1" xmlns="http://www.topografix.com/GPX/1/1"><metadata/>'
    return f"{head}{inner}{after}</gpx>"


@pytest.mark.parametrize(("kind", "place"), [("trk", "trkpt"), ("rte", "rtept"), (None, "wpt")])
def test_a_gpx_is_the_same_mission_as_a_kml(tmp_path, kind, place):
    drawn = line(" ".join(f"{lon},{lat},{ele}" for lat, lon, ele in TRACK))
    (tmp_path / "a.kml").write_text(kml(drawn))
    (tmp_path / "a.gpx").write_text(gpx(kind, place))
    mission, other = read_mission(tmp_path / "a.gpx"), read_mission(tmp_path / "a.kml")
    assert (mission.points == other.points).all() and (mission.home == other.home).all()
    assert read_waypoints(tmp_path / "a.gpx", (47.398, 8.5456, 490.0)).points[0, 2] == pytest.approx(10.0)


def test_what_a_gpx_holds_beside_its_positions_is_said(tmp_path):
    """Gaps of a track are flown straight, and the recorded times are not."""
    stray = '<wpt lat="47" lon="8"><ele>1</ele></wpt>'
    (tmp_path / "a.gpx").write_text(gpx(more="<time>2026-11-30T05:00:00Z</time>", after=2 * stray))
    mission = read_mission(tmp_path / "a.gpx")
    assert mission.left_out.endswith("out of the mission: gaps between segments, times, waypoints (2 times)")
    assert len(mission.points) == 3
    (tmp_path / "b.gpx").write_text(gpx("rte", "rtept", after="<trk/><trk/>"))
    assert read_mission(tmp_path / "b.gpx").left_out.endswith(": tracks (2 times)")
    (tmp_path / "c.gpx").write_text(gpx("rte", "rtept"))
    assert not read_mission(tmp_path / "c.gpx").left_out


ROUND = (
    "<Polygon><outerBoundaryIs><LinearRing><coordinates>8,47,0 8.1,47,0 8.1,47.1,0 8,47,0</coordinates></LinearRing>"
)


def test_the_outline_of_an_area(tmp_path):
    (tmp_path / "a.kml").write_text(kml(f"<Placemark>{ROUND}</outerBoundaryIs></Polygon></Placemark>"))
    assert read_outline(tmp_path / "a.kml").tolist() == [[47.0, 8.0], [47.0, 8.1], [47.1, 8.1]]
    (tmp_path / "b.kml").write_text(kml(line(LINE.format(1, 2))))
    with pytest.raises(FileError, match="has 0 polygons: an area is one"):
        read_outline(tmp_path / "b.kml")


BAD = {
    "a.waypoints": [
        (WPL.replace("QGC WPL 110", "WPL"), "its first line is not QGC WPL 110"),
        (WPL.replace("\t15\t1", "\t15"), "line 5 is no item of a mission: it has to be twelve numbers"),
        (WPL.replace("3\t0\t3\t16", "3\t0\t10\t16"), "line 5 gives its altitude in frame 10"),
        (WPL.replace("47.398\t", "97.398\t"), "line 5 has the coordinates"),
        (WPL.replace("47.398\t", "nan\t"), "line 5 has the coordinates"),
        ("QGC WPL 110\n", "0 different positions"),
    ],
    "a.kml": [
        ("no xml", "is not KML"),
        ("<gpx></gpx>", "is not KML: its root is 'gpx'"),
        ("<!DOCTYPE a [<!ENTITY b 'c'>]><kml>&b;</kml>", "defines a document type"),
        (kml(""), "0 different positions"),
        (kml(line(LINE.format(0, 0)), ""), "has no altitude mode: make its altitudes absolute"),
        (kml(line(LINE.format(0, 0)) * 2), "has 2 lines: a mission is one"),
        (kml(line("8.5,47.3,1,2")), "they are longitude,latitude,height"),
        (kml(line("8.5,97.3,1")), "has the coordinates"),
        (wayline("realTimeFollowSurface"), "use relativeToStartPoint or WGS84"),
        (wayline().replace("<wpml:executeHeight>31</wpml:executeHeight>", ""), "waypoint 1 has the coordinates"),
    ],
    "a.gpx": [
        ("no xml", "is not GPX"),
        ("<kml></kml>", "is not GPX: its root is 'kml'"),
        ("<!DOCTYPE a><gpx/>", "defines a document type"),
        ("<gpx/>", "0 different positions"),
        ("<gpx><trk/><trk/></gpx>", "has 2 tracks: a mission is one"),
        (gpx().replace("<ele>510</ele>", ""), "place 1 has no height: give each an <ele>"),
        (gpx().replace('lat="47.3981"', 'lat="north"'), "place 1 has the coordinates"),
        (gpx().replace('lat="47.3981"', ""), "place 1 has the coordinates"),
        (gpx().replace("<ele>500</ele>", "<ele>5_00</ele>"), "place 0 has the coordinates"),
    ],
    "a.csv": [
        (LITCHI.format(1), "waypoint 0 gives its altitude above the ground"),
        ("lat,lon\n1,2\n", "no column is known as alt"),
        ("lat,lon,alt\n1,200,3\n1,2,3\n", "place 0 has the coordinates"),
        ("lat,lon,alt\n1,x,3\n", "lon is 'x', not a finite number"),
    ],
}


@pytest.mark.parametrize(("name", "text", "said"), [(name, *case) for name, cases in BAD.items() for case in cases])
def test_what_is_wrong_of_other_missions_is_one_sentence(tmp_path, name, text, said):
    (tmp_path / name).write_text(text)
    with pytest.raises(FileError, match=said) as refused:
        read_mission(tmp_path / name)
    assert "\n" not in str(refused.value)


def test_archives_that_are_none(tmp_path):
    (tmp_path / "a.kmz").write_bytes(b"PK no archive")
    with pytest.raises(FileError, match="is not a KMZ archive"):
        read_mission(tmp_path / "a.kmz")
    with pytest.raises(FileError, match="holds no .kml"):
        read_mission(packed(tmp_path / "b.kmz", {"a.txt": "x"}))
    with zipfile.ZipFile(tmp_path / "c.kmz", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("doc.kml", b" " * 70_000_000)
    with pytest.raises(FileError, match="unpacks to more than"):
        read_mission(tmp_path / "c.kmz")
    (tmp_path / "d.csv").write_text("x,y\n0,0\n1,1\n")
    with pytest.raises(FileError, match="is no mission"):
        read_mission(tmp_path / "d.csv")
    with pytest.raises(FileError, match="has no latitudes and longitudes: leave the origin out"):
        read_waypoints(tmp_path / "d.csv", (47.0, 8.0, 0.0))
