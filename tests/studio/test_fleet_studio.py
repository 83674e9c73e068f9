"""The page of a fleet: where vehicles are, which pairs are highlighted, what is proved; without a browser."""

import numpy as np
import pytest

import minsnap
import minsnap.shows
from minsnap.cli.fleet_commands import _fleet
from minsnap.errors import FleetError, InputError
from minsnap.files.formats.skybrush import Lights
from minsnap.studio import FleetStudio, show
from minsnap.studio.fleet_studio import NEAR, PALE, VEHICLE, facts, verdict
from minsnap.studio.ground_view import BY_DAY, BY_NIGHT

viser = pytest.importorskip("viser")

FLEET = minsnap.Fleet(
    [
        minsnap.plan([(-1, 0, 1), (1, 0, 1)], total_time=2.0),
        minsnap.plan([(0, -1, 2.5), (0, 1, 2.5)], total_time=2.0),
        minsnap.plan([(9, 0, 1), (9, 2, 1)], total_time=1.0),
    ],
    names=("ada", "<b>bob", "cyd"),
    separation=minsnap.Separation(0.7, downwash=2.0),
)


@pytest.fixture
def page():
    opened = show(FLEET, browser=False, block=False)
    yield opened
    opened.close()


def test_vehicles_are_where_the_fleet_is_and_near_ones_are_red_and_named(page):
    for now, near in ((0.0, False), (1.0, True), (1.9, False)):
        page.seek(now)
        assert page._vehicles.batched_positions == pytest.approx(FLEET(now), abs=1e-6)
        assert page._vehicles.batched_colors.tolist() == [list(NEAR if near else VEHICLE)] * 2 + [list(VEHICLE)]
        assert page._lines.visible is near
        assert ("ada and &lt;b&gt;bob" in page._told.content) is near
    assert page.now == 1.9


def test_the_page_is_darkened_and_light_again(page):
    assert not page._dark and page._ground._place[2] == BY_DAY
    for dark, lines, colour in ((True, BY_NIGHT, PALE), (False, BY_DAY, VEHICLE)):
        page.darken()
        page.seek(0.0)
        assert page._dark is dark and page._ground._place[2] == lines
        assert page._vehicles.batched_colors.tolist() == [list(colour)] * 3


def test_what_is_proved_stands_on_the_page(page):
    held = minsnap.certify_fleet(FLEET, FLEET.separation)
    assert dict(facts(page.certificate))["least distance"] == f"{held.least_distance:.4f} m at {held.instant:.2f} s"
    assert "certified at every instant" in verdict(page.certificate)
    nearer = minsnap.certify_fleet(FLEET, minsnap.Separation(0.8, downwash=2.0))
    assert "nearer than their separation" in verdict(nearer) and dict(facts(nearer))["separation"] == "0.8 m"


def test_the_chart_is_the_least_distance_with_what_is_asked(page):
    page.seek(1.0)
    times, least, asked, _, cursor = page._chart.data
    assert least[np.argmax(cursor)] == pytest.approx(0.75, abs=1e-3) and set(asked) == {0.7}
    assert times[np.argmax(cursor)] == 1.0


def test_fleets_come_from_folders_and_shows_and_nothing_else(tmp_path):
    minsnap.shows.write_fleet(FLEET, tmp_path / "fleet")
    held, dark = _fleet(tmp_path / "fleet", 0.5, 3.0, tmp_path / "none")
    assert dark is None
    assert (held(1.0) == FLEET(1.0)).all() and (held.separation.distance, held.separation.downwash) == (0.5, 3.0)
    (tmp_path / "show.yaml").write_text(
        "{vehicles: 2, separation: 0.5, limits: {speed: 3, acceleration: 3}, home: {grid: {spacing: 2}}, "
        "acts: [{formation: {circle: {radius: 2, height: 3}}, hold: 4, colour: [255, 0, 0]}]}"
    )
    flown, lights = _fleet(tmp_path / "show.yaml", None, None, tmp_path / "none")
    minsnap.shows.write_fleet(flown, tmp_path / "show.skyc", lights=lights)
    _, again = _fleet(tmp_path / "show.skyc", None, None, tmp_path / "none")
    now = np.linspace(0.0, flown.duration, 40)[:-1]
    assert len(flown) == 2 and any(lamp(t).tolist() == [255, 0, 0] for lamp in lights for t in now)
    assert [lamp(now).tolist() for lamp in again] == [lamp(now).tolist() for lamp in lights]
    (tmp_path / "way.csv").write_text("x,y,z\n0,0,1\n1,0,1\n")
    assert _fleet(tmp_path / "way.csv", None, None, tmp_path / "none") is None
    with pytest.raises(InputError, match="one vehicle"):
        _fleet(tmp_path / "way.csv", 1.0, 1.0, tmp_path / "none")


def test_vehicles_have_the_colours_of_their_lamps_while_these_shine():
    lamp = Lights([0.2, 1.0, 1.8], [(255, 0, 0), (0, 0, 255), (0, 0, 0)], [False, True, False])
    opened = FleetStudio(FLEET, port=0, lights=(None, None, lamp))
    try:
        for now, colour in ((0.0, VEHICLE), (0.2, (255, 0, 0)), (1.0, (0, 0, 255)), (1.9, VEHICLE)):
            opened.seek(now)
            assert tuple(opened._vehicles.batched_colors[2]) == colour
        assert tuple(opened._vehicles.batched_colors[0]) == VEHICLE
        opened.seek(0.6)
        mixed = (128 + VEHICLE[0] // 2, VEHICLE[1] // 2, 128 + VEHICLE[2] // 2)
        assert np.abs(opened._vehicles.batched_colors[2].astype(int) - mixed).max() <= 1
    finally:
        opened.close()
    with pytest.raises(FleetError, match="1 of 3 vehicles"):
        FleetStudio(FLEET, port=0, lights=(lamp,))


def test_plane_fleets_are_refused():
    with pytest.raises(FleetError, match="in space"):
        FleetStudio(minsnap.Fleet([minsnap.plan([(0, 0), (1, 0)], total_time=1.0)]), port=0)
