"""The add-on for Blender: its storyboard goes to the command, and certified flights come back as keyframes."""

import importlib.util
import runpy
import sys
from pathlib import Path

import pytest

SCRIPT = Path(__file__).parents[1] / "examples" / "blender_addon.py"
ADDON = runpy.run_path(str(SCRIPT), run_name="blender_addon")
COMMAND = [sys.executable, "-m", "minsnap"]
HOME = [[2.0 * i, 0.0, 0.0] for i in range(4)]
LINE = [[0.0, 2.0 * i, 6.0] for i in range(4)]


def distance(rows, other):
    """Least distance of two drones in frames that both have."""
    places = {row[0]: row[1:] for row in other}
    both = [(row[1:], places[row[0]]) for row in rows if row[0] in places]
    return min(sum((a - b) ** 2 for a, b in zip(one, two, strict=True)) ** 0.5 for one, two in both)


def test_the_storyboard_comes_back_as_keyframes_that_reach_it_in_time(tmp_path):
    show = ADDON["show_of"](HOME, [("line", 9.0, LINE)], 1.0, 4.0, 3.0, 1.0)
    frames, printed = ADDON["planned"](show, COMMAND, tmp_path)
    assert "apart at every instant, proved of the files" in printed
    drones = ADDON["keyframes"](frames, 24.0, 1)
    assert [rows[0][1:] for rows in drones] == [tuple(place) for place in HOME] and drones[0][0][0] == 1.0
    arrived = [min(rows, key=lambda row: abs(row[0] - (1.0 + 24.0 * 9.0))) for rows in drones]
    assert sorted(row[1:] for row in arrived) == [tuple(place) for place in LINE]
    for i, rows in enumerate(drones):
        assert len(rows) > 50 and all(distance(rows, other) >= 0.999 for other in drones[:i])


def test_what_the_command_refuses_is_the_sentence_of_the_add_on(tmp_path):
    early = ADDON["show_of"](HOME, [("line", 1.0, LINE)], 1.0, 4.0, 3.0, 1.0)
    near = ADDON["show_of"](HOME, [("line", 9.0, [[0, 0, 5], [0, 0.1, 5], [3, 0, 5], [6, 0, 5]])], 1.0, 4.0, 3.0, 1.0)
    for show, sentence in ((early, "at 1 s"), (near, "points 0 and 1 of act 'line' are 0.100 m apart")):
        with pytest.raises(RuntimeError, match=sentence):
            ADDON["planned"](show, COMMAND, tmp_path)


@pytest.mark.skipif(importlib.util.find_spec("bpy") is None, reason="bpy, Blender as a module, is not installed")
def test_blender_has_the_keyframes():
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    collection = bpy.data.collections.new("Drones")
    scene.collection.children.link(collection)
    for i, (home, goal) in enumerate(zip(HOME, LINE, strict=True)):
        thing = bpy.data.objects.new(f"drone {i}", None)
        collection.objects.link(thing)
        for frame, place in ((1, home), (217, goal)):
            thing.location = place
            thing.keyframe_insert("location", frame=frame)
    scene.timeline_markers.new("line", frame=217)
    ADDON["register"]()
    try:
        said = scene.minsnap
        said.separation, said.speed, said.acceleration, said.hold = 1.0, 4.0, 3.0, 1.0
        said.command = "|".join(COMMAND)
        assert bpy.ops.minsnap.plan() == {"FINISHED"}
        places = ADDON["places_at"](scene, list(collection.objects), 217)
        assert [round(value, 3) for place in sorted(places) for value in place] == sum(LINE, [])
        places = ADDON["places_at"](scene, list(collection.objects), 1)
        assert [round(value, 3) for place in places for value in place] == sum(HOME, [])
        places = ADDON["places_at"](scene, list(collection.objects), scene.frame_end)
        assert max(place[2] for place in places) < 1e-3, "all are on the ground"
        for frame in range(1, scene.frame_end, 5):
            places = ADDON["places_at"](scene, list(collection.objects), frame)
            for i, one in enumerate(places):
                for two in places[:i]:
                    assert sum((a - b) ** 2 for a, b in zip(one, two, strict=True)) ** 0.5 > 0.99
        assert len(bpy.data.actions) == 8, "the old ones are kept"
        said.separation = 9.0
        with pytest.raises(RuntimeError, match="less than the separation of 9 m"):
            bpy.ops.minsnap.plan()
    finally:
        ADDON["unregister"]()
