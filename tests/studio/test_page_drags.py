"""Drags, as a browser sends them over its websocket, and what every page then shows; without a browser."""

import asyncio
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest

from minsnap.studio import Studio
from minsnap.studio.documents import example_scene
from minsnap.studio.edits import set_limit, with_boxes, with_room, with_time

viser = pytest.importorskip("viser")

EXAMPLE = with_boxes(with_room(example_scene(), True), True)


@pytest.fixture
def studio(tmp_path):
    page = Studio(EXAMPLE, str(tmp_path), port=0)
    assert page.wait(60.0)
    yield page
    page.close()


def send(studio, *messages, until):
    """Send messages as a browser does, and stay connected until they have had their effect; return whether it came."""
    import msgspec
    import websockets

    async def talk():
        protocol = [f"viser-v{viser.__version__}"]
        async with websockets.connect(studio.url.replace("http", "ws"), subprotocols=protocol, max_size=None) as socket:
            for message in messages:
                await socket.send(msgspec.msgpack.encode(message))
            end = time.monotonic() + 60.0
            while not until() and time.monotonic() < end:
                await asyncio.sleep(0.02)

    asyncio.run(talk())
    return until()


CAMERA = {
    "type": "ViewerCameraMessage",
    "wxyz": (1.0, 0.0, 0.0, 0.0),
    **{"position": (-9.0, 0.0, 5.0), "look_at": (0.0, 0.0, 1.0), "up_direction": (0.0, 0.0, 1.0)},
    **{"fov": 1.0, "near": 0.1, "far": 100.0, "image_height": 600, "image_width": 1200},
}
"""What a page sends first: viser counts it from then on."""


def drag(name, *positions):
    """Return the messages of a drag of a handle through positions."""
    ends = {"name": name, "owner": ""}
    moves = [
        {"type": "TransformControlsUpdateMessage", "wxyz": (1.0, 0.0, 0.0, 0.0), "position": place, **ends}
        for place in positions
    ]
    start, end = ({"type": f"TransformControlsDrag{phase}Message", **ends} for phase in ("Start", "End"))
    return start, *moves, end


def test_a_dragged_waypoint_is_planned_and_the_drag_is_one_step(studio):
    moves = drag("/waypoints/1", (8.0, 0.1, 1.0), (8.1, 0.2, 1.1), (8.2, 0.3, 1.2))
    assert send(studio, *moves, until=lambda: studio.request.waypoints[1] == (8.2, 0.3, 1.2))
    assert studio.wait(60.0)
    assert studio.trajectory(studio.trajectory.leg_breaks)[1] == pytest.approx([8.2, 0.3, 1.2])
    studio.undo()
    assert studio.request == EXAMPLE


def test_plots_are_folded_in_a_narrow_window_that_opens_and_not_where_one_connects_again(studio, monkeypatch):
    """The picture of a wide window is narrow between its panels, which are there when it connects again."""
    told = []
    monkeypatch.setattr("minsnap.studio.browser_page.fold", lambda client, panel: told.append("folded"))
    monkeypatch.setattr("minsnap.studio.browser_page.keep_framed", lambda *how: told.append("framed"))
    there = CAMERA | {"image_width": 672}
    assert send(studio, there, until=lambda: told == ["framed"])
    there |= {"position": (3.0, 3.0, 3.0)}  # where the pages of viser open
    assert send(studio, there, until=lambda: told == ["framed", "folded", "framed"])


def test_a_drag_whose_end_is_not_told_neither_holds_its_handle_nor_joins_the_next_one(studio):
    """Touches can be cancelled: the waypoint then stayed where it was let go, whatever the document said."""
    handle = studio._waypoints._gizmos.handles[1]
    cancelled = drag("/waypoints/1", (8.0, 0.1, 1.0))[:-1]
    assert send(studio, *cancelled, until=lambda: studio.request.waypoints[1] == (8.0, 0.1, 1.0))
    studio.undo()
    assert tuple(handle.position) == EXAMPLE.waypoints[1]
    for place in ((8.1, 0.2, 1.1), (8.2, 0.3, 1.2)):
        moves = drag("/waypoints/1", place)[:-1]
        assert send(studio, *moves, until=lambda place=place: studio.request.waypoints[1] == place)
    studio.undo()
    assert studio.request.waypoints[1] == (8.1, 0.2, 1.1)


def test_an_input_follows_the_document_again_where_its_edit_is_refused(studio):
    studio.edit(lambda request: with_time(request, "limits", (), {"speed": 3.0}))
    [(speed, _)] = [(box, shown) for box, shown in studio._time._inputs._bound if box.label == "speed [m/s]"]
    speed.value = False  # as a browser sets it before the edit is refused
    studio.edit(lambda request: set_limit(request, "speed", None))
    assert speed.value is True and studio.request.limits == (("speed", 3.0),)


def test_every_field_of_a_measure_takes_decimals(studio):
    """The page leaves the point out of a number for a field without any: an angle of 22.5 degrees became 225."""
    studio.edit(lambda request: replace(request, yaw=(0.3,) * len(request.waypoints)))
    fields = [field for field in studio._server.gui._gui_input_handle_from_uuid.values() if hasattr(field, "precision")]
    assert len(fields) > 20 and all(field.precision > 1 for field in fields if not isinstance(field.value, int))


def typed(field, value):
    """Return the message of a value that is typed into a field."""
    return {"type": "GuiUpdateMessage", "uuid": field._impl.uuid, "updates": {"value": value}}


def test_a_waypoint_that_is_not_there_is_not_chosen(studio):
    field = studio._route._chosen
    assert send(studio, CAMERA, typed(field, 99), until=lambda: field.value == len(EXAMPLE.waypoints) - 1)


@pytest.mark.parametrize("seconds", [100.0, 0.2])
def test_a_value_typed_beyond_the_ends_of_its_slider_stays(studio, seconds):
    """The page sets a field that is left to the end that its value is beyond: 100 s were planned, and then 60 s."""
    [total] = [box for box, _ in studio._time._inputs._bound if box.label == "Total [s]"]
    assert send(studio, CAMERA, typed(total, seconds), until=lambda: studio.request.total_time == seconds)
    assert total.min <= seconds <= total.max


@pytest.mark.parametrize(("typed_time", "shown"), [(-3.25, 0.0), (5.5, 5.5), (99.0, 12.0)])
def test_a_time_is_within_the_plan(studio, typed_time, shown):
    assert send(studio, CAMERA, typed(studio._player._slider, typed_time), until=lambda: studio.now == shown)


def test_a_dragged_face_moves_its_wall_alone(studio):
    studio._walls.choose("room")
    higher = (EXAMPLE.room[0], (*EXAMPLE.room[1][:2], 3.5))
    moves = drag("/faces/21", (4.0, 2.0, 2.5), (4.0, 2.0, 3.5))
    assert send(studio, *moves, until=lambda: studio.request.room == higher)
    studio._walls.choose("box 1")
    assert send(studio, *drag("/faces/00", (6.5, 2.0, 1.0)), until=lambda: studio.request.boxes[1][0][0] == 6.5)
    assert studio.request.boxes[2:] == EXAMPLE.boxes[2:] and studio.request.boxes[0] == EXAMPLE.boxes[0]
    assert studio.wait(60.0)
    assert studio.trajectory is not None


@pytest.mark.slow
def test_faces_are_chosen_while_plans_are_shown(studio):
    """The page chooses in the server's thread; a face drawn by both threads stayed behind as one that was removed."""

    def choose():
        for which in ("room", "box 1") * 50:
            studio._walls.choose(which)

    def show():
        for _ in range(200):
            studio._walls.show(studio._shown)

    with ThreadPoolExecutor(2) as pool:
        for job in (pool.submit(choose), pool.submit(show)):
            job.result()


@pytest.mark.slow
@pytest.mark.parametrize(("name", "view"), [("/faces/21", "_walls"), ("/waypoints/1", "_waypoints")])
def test_a_plan_that_arrives_during_a_drag_does_not_move_what_a_hand_holds(studio, name, view):
    studio._walls.choose("room")
    assert studio.wait(60.0)
    handle = studio._server.scene._handle_from_transform_controls_name[name]

    def arrived():
        return 2.9 in (studio.request.room[1][2], studio.request.waypoints[1][2])

    with ThreadPoolExecutor() as browsers:
        with studio._working.lock:
            sent = browsers.submit(send, studio, *drag(name, (4.0, 2.0, 2.9)), until=arrived)
            while handle.position[2] != 2.9 and not sent.done():
                time.sleep(0.01)
            getattr(studio, view).show(studio._working.state)
        assert sent.result()
    assert handle.position[2] == 2.9


def test_walls_waypoints_and_rows_follow_edits_of_every_kind(studio):
    from minsnap.studio.edits import delete_waypoint, insert_waypoint

    studio.edit(lambda request: insert_waypoint(request, 1))
    studio.edit(lambda request: delete_waypoint(delete_waypoint(request, 4), 3))
    assert studio.wait(60.0)
    gizmos = studio._waypoints._gizmos.handles
    assert len(gizmos) == len(studio.request.waypoints) == 4
    assert [tuple(gizmos[i].position) for i in range(4)] == list(studio.request.waypoints)
    assert sorted(studio._walls._boxes) == ["box 0", "box 1", "box 2", "room"]
    assert np.array_equal([row.value for (row,) in studio._route._rows.handles], studio.request.waypoints)
    assert len(studio._corridor._rows.handles) == studio.request.legs


def press(studio, label):
    """Do what the key of a command does."""
    commands = studio._server.gui._command_handle_from_uuid.values()
    (act,) = next(command for command in commands if command.label == label)._impl.trigger_cb
    asyncio.run(act(None))


def test_a_new_waypoint_is_chosen_and_keys_delete_undo_and_redo(studio):
    studio._route.choose(1)
    studio._route.reorder("Add")
    assert len(studio.request.waypoints) == 6
    assert studio._route._chosen.value == 2 == studio._waypoints._chosen
    press(studio, "Delete the waypoint")
    assert studio.request.waypoints == EXAMPLE.waypoints
    press(studio, "Undo")
    assert len(studio.request.waypoints) == 6
    press(studio, "Redo")
    assert studio.request.waypoints == EXAMPLE.waypoints
    studio._route.choose(99)
    assert studio._route._chosen.value == len(EXAMPLE.waypoints) - 1


def test_waypoints_at_one_place_have_one_label(studio):
    assert [label.text for label in studio._waypoints._labels] == ["0, 4", "1", "2", "3", ""]
    assert [label.visible for label in studio._waypoints._labels] == [True] * 4 + [False]


def test_an_unexpected_name_or_message_does_no_harm(studio):
    strange = [*drag("/waypoints/77", (1.0, 1.0, 1.0)), *drag("/plan/path", (1.0, 1.0, 1.0))]
    moves = drag("/waypoints/1", (8.0, 0.1, 1.0))
    assert send(studio, *strange, *moves, until=lambda: studio.request.waypoints[1] == (8.0, 0.1, 1.0))
    studio.undo()
    assert studio.request == EXAMPLE
    assert studio.wait(60.0)
