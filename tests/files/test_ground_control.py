"""Missions of QGroundControl."""

import copy
import json

import numpy as np
import pytest

from minsnap.errors import FileError
from minsnap.files.geodesy import local_positions
from minsnap.files.waypoints import read_mission, read_waypoints

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
        (changed(["mission", "items", 1], {"type": "ComplexItem", "complexItemType": "fwLandingPattern"}), "fwLanding"),
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
