"""Scenes of plans that are there: every wall and limit that a scene holds, and a sentence for all others."""

import dataclasses

import numpy as np
import pytest

import minsnap
from minsnap.errors import CorridorError, InputError, LimitError, YawError
from minsnap.files.formats.polynomials import write_polynomials
from minsnap.studio.documents import open_scene, scene_of
from minsnap.studio.edits import set_reserve
from minsnap.studio.studio import show
from minsnap.vehicle import Quadrotor

CORNERS = ((0.0, 0.0, 1.0), (4.0, 0.0, 1.0), (4.0, 3.0, 1.5))
LOWER, UPPER = ((-1.0, -1.0, 0.0), (3.0, -1.0, 0.0)), ((5.0, 1.0, 2.0), (5.0, 4.0, 2.5))
ROOM = ((-2.0, -2.0, 0.0), (6.0, 5.0, 3.0))
CRAZYFLIE = minsnap.Limits.of(Quadrotor.crazyflie(), reserve=0.25, speed=2.0)


@pytest.fixture(scope="module")
def curve():
    return minsnap.plan(CORNERS, durations=(4.0, 3.0), corridor=[minsnap.Boxes(LOWER, UPPER), minsnap.Room(*ROOM)])


def test_every_wall_of_a_scene_gives_the_same_plan_again(curve):
    walls = [minsnap.Tube((0.3, 0.4)), minsnap.Boxes(LOWER, UPPER), minsnap.Room(*ROOM)]
    scene = scene_of(curve, corridor=walls)
    assert (scene.corridor, scene.room) == ((0.3, 0.4), ROOM)
    assert scene.boxes == ((LOWER[0], UPPER[0]), (LOWER[1], UPPER[1]))
    assert scene == scene_of(curve, corridor=[*walls[:2], minsnap.Room(*ROOM)])
    alone = scene_of(curve, corridor=[walls[1], minsnap.Room(*ROOM)])
    assert np.array_equal(minsnap.plan(**alone.request().arguments()).control_points, curve.control_points)


@pytest.mark.parametrize(
    "walls",
    [
        minsnap.RoundTube(0.3),
        minsnap.Tube(np.full((2, 3), 0.3)),
        minsnap.Room((-np.inf, -np.inf, 0.0), (np.inf, np.inf, 3.0)),
        minsnap.HalfSpaces((0.0, 0.0, 1.0), 3.0),
        [minsnap.Tube(0.3), minsnap.Tube(0.2)],
    ],
)
def test_a_wall_that_a_scene_cannot_hold_is_refused(curve, walls, tmp_path):
    with pytest.raises(CorridorError, match=r"a scene (of 2 legs cannot hold this|has one tube)"):
        show(curve, corridor=walls, browser=False)
    write_polynomials(curve, tmp_path / "a.json", corridor=walls)
    with pytest.raises(CorridorError, match="a scene"):
        open_scene(tmp_path / "a.json")


def test_limits_of_rotors_are_those_of_a_preset(curve):
    scene = scene_of(curve, limits=CRAZYFLIE)
    assert (scene.limits, scene.rotors, scene.vehicle) == ((("speed", 2.0),), 0.25, "crazyflie")
    assert scene.bounds.given() == CRAZYFLIE.given()
    tighter = minsnap.Limits.of(Quadrotor.crazyflie(), max_thrust=1.2)
    assert scene_of(curve, limits=tighter).bounds.given() == tighter.given()
    with pytest.raises(InputError, match="are those of crazyflie, not of px4_sih"):
        show(curve, limits=CRAZYFLIE, vehicle="px4_sih", browser=False)


def test_limits_that_a_scene_cannot_hold_are_refused(curve):
    heavier = dataclasses.replace(Quadrotor.crazyflie(), mass=0.035)
    for bad in (
        minsnap.Limits.of(heavier),
        minsnap.Limits(speed=2.0, norm="axis"),
        minsnap.Limits(tilt=0.5, gravity=3.7),
    ):
        with pytest.raises(LimitError, match="a scene holds"):
            scene_of(curve, limits=bad)


@pytest.mark.parametrize("yaw", [None, 0.4, (0.0, 0.5, 1.0), "velocity", "tilt"])
def test_a_plan_that_is_opened_keeps_its_heading(tmp_path, yaw):
    planned = minsnap.plan(CORNERS, durations=(4.0, 3.0), yaw=yaw)
    write_polynomials(planned, tmp_path / "a.json")
    assert open_scene(tmp_path / "a.json").yaw == (pytest.approx(yaw) if isinstance(yaw, tuple) else yaw)


def test_a_heading_towards_a_point_is_refused(tmp_path):
    planned = minsnap.plan(CORNERS, durations=(4.0, 3.0), yaw=minsnap.LookAt((1.0, 8.0, 1.0)))
    write_polynomials(planned, tmp_path / "a.json")
    with pytest.raises(YawError, match="no heading towards a point"):
        open_scene(tmp_path / "a.json")


def test_a_plan_in_boxes_is_shown_and_planned_again_in_them(curve):
    pytest.importorskip("viser")
    page = show(
        curve, corridor=[minsnap.Boxes(LOWER, UPPER), minsnap.Room(*ROOM)], limits=CRAZYFLIE, browser=False, block=False
    )
    try:
        assert page.trajectory is curve and page._time._reserve.visible and page._time._reserve.value == 0.25
        page.edit(lambda request: request)
        page.edit(lambda request: set_reserve(request, 0.4))
        assert page.wait(60.0) and page.request.rotors == 0.4
        assert page.trajectory is not curve
        assert minsnap.certify(page.trajectory, corridor=page.request.walls, limits=page.request.bounds).ok
    finally:
        page.close()
