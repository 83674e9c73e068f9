"""An add-on for Blender: formations of a storyboard go to minsnap, and certified flights come back as keyframes.

In Blender, Edit > Preferences > Add-ons > Install from Disk, this file; the panel is in the sidebar of the 3D view.
Drones are the objects of a collection. They stand at home in the scene's first frame, and each marker of the timeline
is a formation: where the objects are in its frame. All arrive at that frame, and the time between is flown on curves
that are proved apart. The objects get new actions, and the old ones are kept.

minsnap is installed in a Python of its own; the panel has the place of its command, and words behind it after bars,
such as python|-m|minsnap. Run as a script without Blender this plans a storyboard of nine drones, and writes the
keyframes as JSON.
"""

import csv
import io
import json
import re
import shutil
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

try:
    import bpy
except ImportError:  # outside of Blender the planning part works alone
    bpy = None

bl_info = {
    "name": "minsnap: certified drone shows",
    "author": "minsnap",
    "version": (1, 0, 0),
    "blender": (3, 6, 0),
    "location": "3D View > Sidebar > minsnap",
    "description": "Flights between formations, proved apart, as keyframes",
    "category": "Animation",
}


def show_of(home, formations, separation, speed, acceleration, hold, downwash=1.0, take_off=3.0):
    """Return a show for ``minsnap fleet``.

    ``home`` is a list of points [m], ``formations`` one of (name, when all have arrived [s], points).
    """
    acts = [
        {"name": name, "at": round(at, 4), "hold": hold, "formation": {"points": points}}
        for name, at, points in formations
    ]
    return {
        "vehicles": len(home),
        "separation": separation,
        "downwash": downwash,
        "limits": {"speed": speed, "acceleration": acceleration},
        "home": {"points": home},
        "take_off": take_off,
        "acts": acts,
    }


def planned(show, command, folder):
    """Plan a show; return the zip of its flights and what the command printed. A RuntimeError says what is wrong."""
    file, frames = Path(folder) / "show.yaml", Path(folder) / "frames.zip"
    file.write_text(json.dumps(show), encoding="utf-8")  # JSON is YAML
    words = [*command, "fleet", str(file), "-o", str(Path(folder) / "out"), "--export", str(frames)]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    if done.returncode:
        said = (done.stderr or done.stdout).strip().splitlines() or [f"the command ended with {done.returncode}"]
        raise RuntimeError(said[-1])
    return frames, done.stdout


def keyframes(frames, fps, first):
    """Return (frame, x, y, z) of each drone from a zip of CSV, without those that lie on straight lines."""
    with zipfile.ZipFile(frames) as archive:
        names = sorted(archive.namelist(), key=lambda name: [int(part) for part in re.findall(r"\d+", name)])
        tables = [list(csv.reader(io.StringIO(archive.read(name).decode())))[1:] for name in names]
    drones = []
    for table in tables:
        rows = [(first + fps * float(row[0]) / 1e3, *(float(cell) for cell in row[1:4])) for row in table]
        drones.append([row for i, row in enumerate(rows) if not _between(rows, i)])
    return drones


def _between(rows, i):
    """Whether a row is where its neighbours are: a drone that stands needs two keyframes."""
    return 0 < i < len(rows) - 1 and rows[i - 1][1:] == rows[i][1:] == rows[i + 1][1:]


if bpy is not None:

    class MinsnapSettings(bpy.types.PropertyGroup):
        """What is planned, and within which limits."""

        drones: bpy.props.StringProperty(name="Drones", default="Drones", description="Collection of the drones")
        separation: bpy.props.FloatProperty(name="Separation", default=1.5, min=0.01, unit="LENGTH")
        downwash: bpy.props.FloatProperty(
            name="Downwash", default=1.0, min=1.0, description="Heights are divided by it"
        )
        speed: bpy.props.FloatProperty(name="Speed", default=5.0, min=0.01, unit="VELOCITY")
        acceleration: bpy.props.FloatProperty(name="Acceleration", default=3.0, min=0.01, unit="ACCELERATION")
        hold: bpy.props.FloatProperty(name="Hold", default=2.0, min=0.0, description="After each marker [s]")
        take_off: bpy.props.FloatProperty(name="Take-off", default=3.0, min=0.0, unit="LENGTH")
        command: bpy.props.StringProperty(name="Command", default="minsnap", subtype="FILE_PATH")

    def places_at(scene, objects, frame):
        """Return where objects are in a frame, in world coordinates [m]."""
        scene.frame_set(round(frame))
        return [[round(value, 4) for value in each.matrix_world.translation] for each in objects]

    def read_storyboard(scene):
        """Return the drones, their homes, and the formation of each marker after the first frame."""
        collection = bpy.data.collections.get(scene.minsnap.drones)
        objects = [] if collection is None else sorted(collection.objects, key=lambda each: each.name)
        if not objects:
            raise RuntimeError(f"there is no collection {scene.minsnap.drones!r} with drones in it")
        now, first = scene.frame_current, scene.frame_start
        markers = sorted((mark for mark in scene.timeline_markers if mark.frame > first), key=lambda mark: mark.frame)
        if not markers:
            raise RuntimeError("the timeline has no markers after the first frame: add one for each formation")
        fps = scene.render.fps / scene.render.fps_base
        home = places_at(scene, objects, first)
        formations = [(m.name, (m.frame - first) / fps, places_at(scene, objects, m.frame)) for m in markers]
        scene.frame_set(now)
        return objects, home, formations, fps

    def write_keyframes(objects, drones, name="minsnap"):
        """Give each object an action with keyframes of its location; its old action is kept."""
        for thing, rows in zip(objects, drones, strict=True):
            data = thing.animation_data or thing.animation_data_create()
            if data.action is not None:
                data.action.use_fake_user = True
            data.action = None
            parent = None if thing.parent is None else thing.parent.matrix_world.inverted()
            for frame, *place in rows:
                thing.location = place if parent is None else parent @ type(thing.location)(place)
                thing.keyframe_insert("location", frame=frame)
            data.action.name = f"{name} {thing.name}"

    class MinsnapPlan(bpy.types.Operator):
        """Plan the flights between the formations at the markers, and prove them apart."""

        bl_idname = "minsnap.plan"
        bl_label = "Plan certified flights"
        bl_options = {"REGISTER", "UNDO"}

        def execute(self, context):
            """Plan, and write keyframes."""
            said, scene = context.scene.minsnap, context.scene
            try:
                command = said.command.split("|")  # with words behind it, such as python|-m|minsnap
                if shutil.which(command[0]) is None:
                    raise RuntimeError(f"the command {command[0]} is not found: install minsnap, or give its place")
                objects, home, formations, fps = read_storyboard(scene)
                limits = (said.separation, said.speed, said.acceleration, said.hold, said.downwash, said.take_off)
                with tempfile.TemporaryDirectory() as folder:
                    frames, printed = planned(show_of(home, formations, *limits), command, folder)
                    drones = keyframes(frames, fps, scene.frame_start)
            except RuntimeError as error:
                self.report({"ERROR"}, str(error))
                return {"CANCELLED"}
            write_keyframes(objects, drones)
            scene.frame_end = max(scene.frame_end, round(max(rows[-1][0] for rows in drones)))
            least = [line for line in printed.splitlines() if line.startswith("least distance")]
            self.report({"INFO"}, (least or printed.splitlines()[-1:])[0])
            return {"FINISHED"}

    class MinsnapPanel(bpy.types.Panel):
        """The panel in the sidebar."""

        bl_idname = "MINSNAP_PT_show"
        bl_label = "minsnap"
        bl_space_type, bl_region_type, bl_category = "VIEW_3D", "UI", "minsnap"

        def draw(self, context):
            """Draw the settings and the button."""
            for name in ("drones", "separation", "downwash", "speed", "acceleration", "hold", "take_off", "command"):
                self.layout.prop(context.scene.minsnap, name)
            self.layout.operator(MinsnapPlan.bl_idname)

    CLASSES = (MinsnapSettings, MinsnapPlan, MinsnapPanel)

    def register():
        """Add the panel to Blender."""
        for each in CLASSES:
            bpy.utils.register_class(each)
        bpy.types.Scene.minsnap = bpy.props.PointerProperty(type=MinsnapSettings)

    def unregister():
        """Take it away again."""
        del bpy.types.Scene.minsnap
        for each in reversed(CLASSES):
            bpy.utils.unregister_class(each)


def main(folder):
    """Plan a storyboard of nine drones: a square, a row on edge, and home."""
    home = [[2.0 * (i % 3) - 2.0, 2.0 * (i // 3) - 2.0, 0.0] for i in range(9)]
    square = [[2.5 * (i % 3) - 2.5, 0.0, 5.0 + 2.5 * (i // 3)] for i in range(9)]
    row = [[0.0, 2.0 * i - 8.0, 6.0 + abs(i - 4.0)] for i in range(9)]
    show = show_of(home, [("square", 8.0, square), ("row", 16.0, row)], 1.2, 4.0, 3.0, 1.0)
    folder.mkdir(parents=True, exist_ok=True)
    frames, printed = planned(show, [sys.executable, "-m", "minsnap"], folder)
    drones = keyframes(frames, 24.0, 1)
    (folder / "keyframes.json").write_text(json.dumps(drones))
    print(f"{printed}{sum(map(len, drones))} keyframes of {len(drones)} drones")


if __name__ == "__main__":
    if bpy is None:
        main(Path(sys.argv[1] if len(sys.argv) > 1 else "out"))
    else:
        register()
