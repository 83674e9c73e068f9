"""Shows for programs that play them, pictures of acts, and shows that are frames alone."""

import json
import zipfile
from xml.etree import ElementTree

import numpy as np
import pytest
from PIL import Image

import minsnap
from minsnap.cli.app import main
from minsnap.errors import FileError, FleetError
from minsnap.files.formats.skybrush import Lights
from minsnap.files.geodesy import local_positions
from minsnap.shows.csv_show import read_frames, write_csv_show
from minsnap.shows.frame_show import show_of_frames
from minsnap.shows.preview import Picture, draw_preview, pictures_of
from minsnap.shows.show_exports import COLOUR_RATE, POSITION_RATE, export_show
from minsnap.shows.show_yaml import read_show
from minsnap.shows.site import ShowOrigin
from minsnap.shows.skyc import ShowSheet

ORIGIN = ShowOrigin(47.47, 19.06, 110.0, orientation=40.0)


@pytest.fixture(scope="module")
def fleet():
    ways = [[(3.0 * i, 0, 0), (3.0 * i, 1.0 + i, 6), (3.0 * i, 8, 2)] for i in range(3)]
    curves = [minsnap.plan(way, total_time=7.013) for way in ways]
    return minsnap.Fleet(tuple(curves), ("a", "b<", "c"))


@pytest.fixture(scope="module")
def lights():
    colours = np.array([[0, 0, 0], [255, 0, 0], [0, 40, 200]])
    return [Lights(np.array([0.0, 2.0, 5.0]), colours, np.array([False, True, False])), None, None]


def run(*words):
    """Exit status of the command line."""
    with pytest.raises(SystemExit) as left:
        main([str(word) for word in words])
    return left.value.code or 0


def test_a_zip_of_tables_reads_back_as_it_was(tmp_path, fleet, lights):
    write_csv_show(fleet, tmp_path / "show.zip", lights)
    frames = read_frames(tmp_path / "show.zip")
    assert frames.names == ("Drone 1", "Drone 2", "Drone 3")
    for i, (t, places) in enumerate(zip(frames.instants, frames.positions, strict=True)):
        assert t[-1] == pytest.approx(7.013) and np.diff(t)[:-1] == pytest.approx(0.04)
        assert places == pytest.approx(fleet[i](np.minimum(t, fleet.duration)), abs=6e-5)
        expected = np.full((len(t), 3), 255.0) if lights[i] is None else lights[i](t)
        assert frames.colours[i] == pytest.approx(expected, abs=0.51)
    with zipfile.ZipFile(tmp_path / "show.zip") as archive:
        rows = archive.read("Drone 2.csv").decode().splitlines()
    assert rows[0].lower().startswith("time_msec") and all(len(row.split(",")) == 7 for row in rows)
    assert all(cell.isdecimal() for row in rows[1:] for cell in (row.split(",")[0], *row.split(",")[4:]))
    write_csv_show(fleet, tmp_path / "again.zip", lights)
    assert (tmp_path / "again.zip").read_bytes() == (tmp_path / "show.zip").read_bytes()


def played(performance, rate, colours=False):
    """What a player makes of a vehicle of VVIZ: positions step by step, or colours that are held for their frames."""
    described = performance["agentDescription"]
    if colours:
        actions = performance["payloadDescription"][0]["payloadActions"]
        return np.concatenate([[[e["r"], e["g"], e["b"]]] * e.get("frames", 1) for e in actions])
    steps = [[step["dx"], step["dy"], step["dz"]] for step in described["agentTraversal"]]
    return np.array([described["homeX"], described["homeY"], described["homeZ"]]) + np.cumsum(steps, axis=0)


def test_vviz_plays_as_the_fleet_flies(tmp_path, fleet, lights):
    sheet = ShowSheet("Ring", cues=((1.5, "up"),), origin=ORIGIN)
    export_show(fleet, tmp_path / "show.vviz", lights, sheet=sheet)
    content = json.loads((tmp_path / "show.vviz").read_text())
    assert content["version"] == "1.0" and content["coordinateFrame"] == "ogl"
    assert content["globalReferenceFrame"] == {"lat": 47.47, "lon": 19.06, "alt": 110.0}
    assert content["eventTags"] == [{"time": 1.5, "tagType": "Act", "tagID": "up"}]
    for i, performance in enumerate(content["performances"]):
        places = played(performance, POSITION_RATE)
        t = np.minimum(np.arange(len(places)) / POSITION_RATE, fleet.duration)
        assert places[:, [0, 2, 1]] == pytest.approx(fleet[i](t), abs=6e-4), "roundings do not add up"
        shown = played(performance, COLOUR_RATE, colours=True)
        at = np.arange(len(shown)) / COLOUR_RATE
        expected = np.full((len(at), 3), 255.0) if lights[i] is None else lights[i](at)
        assert np.abs(shown - expected)[:-1].max() <= 0.51


def test_google_earth_has_a_track_of_each_vehicle_at_its_place(tmp_path, fleet, lights):
    export_show(fleet, tmp_path / "show.kmz", lights, sheet=ShowSheet("Ring & more", origin=ORIGIN))
    with zipfile.ZipFile(tmp_path / "show.kmz") as archive:
        root = ElementTree.fromstring(archive.read("doc.kml"))
    space = {"k": "http://www.opengis.net/kml/2.2", "gx": "http://www.google.com/kml/ext/2.2"}
    for styles in root.iterfind(".//k:Style", space):  # KML 2.2 has them in this order, and readers that check it
        assert [each.tag.partition("}")[2] for each in styles] == ["IconStyle", "LabelStyle", "LineStyle"]
    assert [mark.find("k:name", space).text for mark in root.iter(f"{{{space['k']}}}Placemark")] == ["a", "b<", "c"]
    for i, track in enumerate(root.iter(f"{{{space['gx']}}}Track")):
        coords = np.array([list(map(float, each.text.split())) for each in track.findall("gx:coord", space)])
        whens = [each.text for each in track.findall("k:when", space)]
        assert whens[:2] == ["2000-01-01T00:00:00.000Z", "2000-01-01T00:00:00.250Z"] and len(whens) == len(coords)
        east_north_up = local_positions(coords[:, [1, 0, 2]], (47.47, 19.06, 110.0))
        t = np.minimum(np.arange(len(coords)) / 4.0, fleet.duration)
        place = fleet[i](t)
        angle = np.radians(90.0 - 40.0)
        level = place[:, 0] * np.exp(1j * angle) + place[:, 1] * np.exp(1j * (angle + np.pi / 2))
        assert east_north_up == pytest.approx(np.column_stack((level.real, level.imag, place[:, 2])), abs=2e-3)
    assert ORIGIN.local(ORIGIN.geodetic([[3.0, -2.0, 5.0]])) == pytest.approx(np.array([[3.0, -2.0, 5.0]]), abs=1e-6)


def test_exports_that_cannot_be_are_refused(tmp_path, fleet):
    with pytest.raises(FileError, match=r"does not end in \.zip, \.vviz, \.kmz"):
        export_show(fleet, tmp_path / "show.dss")
    with pytest.raises(FileError, match="needs a place on the earth: give the show an origin"):
        export_show(fleet, tmp_path / "show.kmz")
    assert not list(tmp_path.iterdir())


YAML = """
vehicles: 5
separation: 1
limits: {speed: 4, acceleration: 3}
home: {grid: {spacing: 2}}
origin: {latitude: 47.47, longitude: 19.06}
acts:
  - {name: ring, formation: {circle: {radius: 4, height: 6}}, colour: red, hold: 1}
  - {name: line, vehicles: 3, formation: {text: {words: I, size: 8, height: 4}}, colour: {from: lime, to: black}}
"""


def test_a_preview_has_the_lights_where_the_audience_sees_them(tmp_path, capsys):
    (tmp_path / "show.yaml").write_text(YAML)
    pictures = pictures_of(read_show(tmp_path / "show.yaml"))
    assert [picture.title for picture in pictures] == ["ring", "line"]
    assert pictures[0].colours == pytest.approx(np.tile([255, 0, 0], (5, 1)))
    assert pictures[1].colours[:, 1].max() == pytest.approx(255.0) and not pictures[1].colours[:, 0].any()
    assert run("fleet", tmp_path / "show.yaml", "--preview", tmp_path / "acts.png") == 0
    assert "acts.png shows the acts" in capsys.readouterr().err and len(list(tmp_path.iterdir())) == 2
    pixels = np.asarray(Image.open(tmp_path / "acts.png").convert("RGB")).astype(int)
    left, right = np.split(pixels, [pixels.shape[1] // 2], axis=1)
    assert np.median(pixels.reshape(-1, 3), axis=0) == pytest.approx([5, 7, 15]), "a dark sky"
    assert (left[..., 0] > 200).sum() > 50 and (right[..., 0] > 200).sum() == 0
    assert (right[..., 1] > 200).sum() > 10
    figure = draw_preview([Picture("one", np.array([[0.0, 0.0, 5.0]]), np.array([[255.0, 255.0, 255.0]]))])
    assert len(figure.axes) == 1
    with pytest.raises(FleetError, match="without acts"):
        draw_preview([])


GROUPS = """
vehicles: 7
separation: 1
limits: {speed: 4, acceleration: 3}
home: {grid: {spacing: 2}}
acts:
  - {name: ring, formation: {circle: {radius: 4, height: 6}}, colour: red, hold: 1}
  - groups:
      - {name: a, vehicles: 3, acts: [
          {name: one, formation: {circle: {radius: 2, height: 6}}, shift: [-5, 0, 0], colour: lime, hold: 9},
          {name: two, formation: {circle: {radius: 2, height: 9}}, shift: [-5, 0, 0], colour: blue}]}
      - {name: b, vehicles: 3, acts: [
          {name: low, formation: {circle: {radius: 2, height: 6}}, shift: [5, 0, 0], colour: white, hold: 1},
          {name: high, formation: {circle: {radius: 2, height: 9}}, shift: [5, 0, 0], colour: white}]}
"""


def test_groups_that_fly_at_once_are_in_one_picture(tmp_path):
    """Each act of a group had a picture of its own, without the others."""
    (tmp_path / "show.yaml").write_text(GROUPS)
    pictures = pictures_of(read_show(tmp_path / "show.yaml"))
    assert [picture.title for picture in pictures] == ["ring", "one, low", "one, high", "two, high"]
    for picture in pictures[1:]:
        left, right = (np.abs(picture.points[:, 0] - x) < 2.1 for x in (-5.0, 5.0))
        assert len(picture.points) == 7 and (left.sum(), right.sum()) == (3, 3)
        (stays,) = np.flatnonzero(~left & ~right)
        assert picture.colours[stays] == pytest.approx([255, 0, 0]), "the one of no group is where it was"
        assert np.abs(pictures[0].points - picture.points[stays]).max(axis=1).min() < 1e-12


def test_pictures_have_one_scale_and_say_it(tmp_path):
    (tmp_path / "show.yaml").write_text(GROUPS)
    figure = draw_preview(pictures_of(read_show(tmp_path / "show.yaml")))
    figure.canvas.draw()
    assert len({(axes.get_xlim(), axes.get_ylim()) for axes in figure.axes}) == 1
    for axes in figure.axes:
        (bar,), (words,) = axes.lines, axes.texts
        assert f"{np.ptp(bar.get_xdata()):g} m" == words.get_text()
        assert 0.1 < np.ptp(bar.get_xdata()) / np.ptp(axes.get_xlim()) <= 0.3
    lowest = figure.axes[-1]
    assert lowest.get_xlabel() == "x [m]" and figure.axes[0].get_ylabel() == "height [m]"
    point = np.array([[3.0, 0.0, 7.0]])
    (axes,) = draw_preview([Picture("far", point, np.full((1, 3), 255.0))]).axes
    assert np.asarray(axes.collections[0].get_offsets()) == pytest.approx(point[:, ::2]), (
        "in the middle, places are true"
    )


def test_the_command_says_what_a_preview_and_frames_need(tmp_path, capsys, fleet):
    (tmp_path / "show.yaml").write_text(YAML)
    write_csv_show(fleet, tmp_path / "show.zip")
    for words, sentence in (
        (("show.yaml",), "give -o FOLDER, or --preview FILE alone"),
        (("show.yaml", "-o", "out", "--separation", "2"), "--separation is of frames"),
        (("show.zip", "-o", "out"), "which say no separation: give --separation M"),
        (("show.zip", "-o", "out", "--separation", "4"), "come within 3.000 m of 4 m"),
        (("show.zip", "-o", "out", "--separation", "1", "--max-speed", "1"), "of 1: give it slower: "),
        (("show.zip", "-o", "out", "--separation", "1", "--slower", "0"), "slower of an animation is 0"),
        (("show.yaml", "-o", "out", "--export", "a.dss"), "does not end in .zip, .vviz, .kmz"),
        (("show.yaml", "--preview", "show.yaml"), "is the file that is read"),
        (("show.zip", "-o", "out", "--separation", "1", "--export", "a.kmz"), "needs a place on the earth"),
    ):
        given = [str(tmp_path / word) if "." in word else word for word in words]
        assert run("fleet", *given) == 2
        assert sentence in capsys.readouterr().err
    assert {file.name for file in tmp_path.iterdir()} == {"show.yaml", "show.zip"}


def test_check_reads_a_zip_as_the_curves_through_its_frames_and_nothing_flies_it(tmp_path, capsys, fleet):
    write_csv_show(fleet, tmp_path / "show.zip")
    assert run("check", tmp_path / "show.zip", "--separation", 2.9) == 0
    assert "3.0000 m" in capsys.readouterr().out
    assert run("check", tmp_path / "show.zip", "--separation", 3.1) == 1
    with pytest.raises(FileError, match="holds frames, and nothing is certain between them"):
        minsnap.shows.read_fleet(tmp_path / "show.zip")


@pytest.mark.slow
def test_frames_become_a_certified_show_and_go_out_again(tmp_path, capsys, fleet, lights):
    write_csv_show(fleet, tmp_path / "in.zip", lights)
    out = tmp_path / "out"
    words = ("--separation", 1, "--max-speed", 9, "--max-acceleration", 9, "--export", tmp_path / "again.zip")
    assert run("fleet", tmp_path / "in.zip", "-o", out, *words) == 0
    printed = capsys.readouterr().out
    assert "apart at every instant, proved of the files" in printed
    held = minsnap.shows.read_fleet(out)
    t = np.linspace(0.0, fleet.duration, 60)
    for one, two in zip(fleet, held, strict=True):
        assert np.linalg.norm(one(t) - two(np.minimum(t, two.duration)), axis=1).max() < 0.03
    again = read_frames(tmp_path / "again.zip")
    assert again.colours[0] == pytest.approx(read_frames(tmp_path / "in.zip").colours[0], abs=8.0)


def test_frames_alone_are_a_show_from_the_first_to_the_last(tmp_path, fleet):
    write_csv_show(fleet, tmp_path / "in.zip")
    show, flown = show_of_frames(tmp_path / "in.zip", minsnap.Separation(1.0), minsnap.Limits())
    assert show.home == pytest.approx(fleet(0.0), abs=0.02)
    sheet = flown.sheet(show, "in")
    assert list(sheet.segments) == ["show"] and sheet.cues == ((0.0, "in"),)
    assert len({curve.duration for curve in flown.fleet}) == 1
