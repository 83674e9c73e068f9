"""The parts of the panel that tell: facts of the plan and what cannot be done; files, and the plan as text to copy."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import degrees
from pathlib import Path
from typing import Any

from minsnap.basics.limit_kinds import KIND
from minsnap.certificate import Certificate
from minsnap.files import FILE_ONLY, FileRequest, request_text
from minsnap.studio.documents import ENDINGS, EXAMPLES, EXPORTS, WorkingFolder, open_upload, save_as
from minsnap.studio.ground_view import ENDINGS as OBSTACLE_ENDINGS
from minsnap.studio.ground_view import PICTURES, Obstacles, floor, read_obstacles
from minsnap.studio.obstacle_view import CLEARANCE
from minsnap.studio.page_inputs import Editor, Viewed, copyable, precise, sentence, table, when_changed, when_clicked
from minsnap.studio.path_view import FLIGHT, GHOST
from minsnap.studio.plan_drawing import legend
from minsnap.studio.workbench import BenchState, Present
from minsnap.trajectory import Trajectory, cost_unit

END = "END_OF_REQUEST"
"""The line that ends the text of the request in a shell."""


def as_python(request: FileRequest) -> str:
    """Return a script that plans a request and leaves it in ``trajectory``; numbers are written exactly."""
    avoided = ", ".join(f"named_obstacle({name!r}, {numbers!r})" for name, numbers in request.avoid)
    own = {"limits": _limits(request), "corridor": _walls(request), "avoid": f"[{avoided}]" if avoided else None}
    usual = vars(FileRequest(request.waypoints))
    values = {n: repr(list(v) if isinstance(v, tuple) else v) for n, v in vars(request).items() if v != usual[n]}
    values |= {"search": f"minsnap.{request.search!r}"} if request.search else {}
    lines = [f"    {n}={value}," for n, value in (values | own).items() if value is not None and n not in FILE_ONLY]
    gates = {index: f"minsnap.Gate.polygon{tuple(gate)!r}" for index, *gate in request.openings}
    points = [f"    {gates.get(i, repr(point))}," for i, point in enumerate(request.waypoints)]
    head = ["import minsnap"] + (["from minsnap.vehicle import Quadrotor"] if request.rotors is not None else [])
    head += ["from minsnap.corridors.keep_out import named_obstacle"] if request.avoid else []
    return "\n".join(
        [*head, "", "waypoints = [", *points, "]", "trajectory = minsnap.plan(", "    waypoints,", *lines, ")", ""]
    )


def as_command(request: FileRequest) -> str:
    """Return shell commands that write the request to ``setpoints.yaml`` and plan it into ``setpoints.csv``."""
    frame = f" --frame {request.frame}" if request.frame != "enu" else ""
    written = f"cat > setpoints.yaml <<'{END}'\n{request_text(request)}{END}\n"
    return f"{written}minsnap plan setpoints.yaml{frame} -o setpoints.csv\n"


def _limits(request: FileRequest) -> str | None:
    fields = ", ".join(f"{name}={value!r}" for name, value in request.limits)
    if request.rotors is None:
        return f"minsnap.Limits({fields})" if fields else None
    vehicle = f"Quadrotor.{request.vehicle}(), reserve={request.rotors!r}"
    return f"minsnap.Limits.of({vehicle}{', ' if fields else ''}{fields})"


def _walls(request: FileRequest) -> str | None:
    corridor = _corridor(request)
    if request.room is None:
        return corridor
    room = f"minsnap.Room{request.room!r}"
    return room if corridor is None else f"[{corridor}, {room}]"


def _corridor(request: FileRequest) -> str | None:
    widths = request.corridor
    tube = None if widths is None else repr(widths[0] if len(set(widths)) == 1 else list(widths))
    if request.boxes is None:
        return tube
    lower, upper = (repr([corners[side] for corners in request.boxes]) for side in (0, 1))
    boxes = f"minsnap.Boxes({lower}, {upper})"
    return boxes if tube is None else f"[minsnap.Tube({list(widths or ())!r}), {boxes}]"


def without_obstacles(request: FileRequest) -> FileRequest:
    """Return a document that keeps out of nothing."""
    return replace(request, avoid=())


def add_upload(
    gui: Any, editor: Editor, label: str, endings: tuple[str, ...], act: Callable[[str, bytes], None]
) -> None:
    """Add a button that takes a file of the browser, and does something with its name and content."""
    button = gui.add_upload_button(label, mime_type=",".join(endings))

    async def uploaded(event: Any) -> None:
        value = event.target.value
        editor.later(lambda: act(value.name, value.content))

    button.on_upload(uploaded)


def add_opening(gui: Any, editor: Editor, folder: WorkingFolder, label: str) -> None:
    """Add a button that opens a scene of a file of the browser."""
    act = lambda name, content: take_up(editor, open_upload(name, content, folder))  # noqa: E731
    add_upload(gui, editor, label, ENDINGS, act)


def take_up(editor: Editor, request: FileRequest) -> None:
    """Edit another scene from now on, and see all of it."""
    editor.edit(lambda before: request)
    editor.frame()


WELCOME = (
    "Drag a waypoint: the path is planned again, and what stands above is proved for all of the flight. "
    "Begin with an example, or with a file of your own."
)


def add_welcome(gui: Any, editor: Editor, folder: WorkingFolder) -> None:
    """Add what a page without a file begins with: examples, and a button that opens a file."""
    gui.add_html(sentence(WELCOME))

    def offer(name: str, scene: Callable[[], FileRequest]) -> None:
        when_clicked(gui.add_button(name, color="gray"), lambda client: take_up(editor, scene()))

    for name, scene in EXAMPLES.items():
        offer(name, scene)
    add_opening(gui, editor, folder, "Open mine (YAML, CSV, .plan, .json)")


class FilePanel:
    """Opening and saving.

    Parameters
    ----------
    gui : viser.GuiApi
        Where it is added, in the present container.
    editor : Editor
        What an opened file replaces the document of.
    folder : WorkingFolder
        Where files are saved.
    state : callable
        Returns what is shown.
    obstacles : callable
        Keeps out of obstacles of a file, with some room around them [m], and shows them.
    """

    def __init__(
        self,
        gui: Any,
        editor: Editor,
        folder: WorkingFolder,
        state: Present,
        obstacles: Callable[[Obstacles, float], None],
    ) -> None:
        self._gui, self._editor, self._folder, self._state = gui, editor, folder, state
        self._obstacles = obstacles
        add_opening(gui, editor, folder, "Open a scene (YAML, CSV, .plan)")
        self._upload("Avoid obstacles (.npz, CSV)", (".npz", ".csv"), self._shown(OBSTACLE_ENDINGS, read_obstacles))
        self._clearance = precise(gui.add_number("Room around them [m]", CLEARANCE, min=0.0, step=0.05))
        when_clicked(gui.add_button("Remove all obstacles"), lambda client: editor.edit(without_obstacles))
        laid = self._shown(PICTURES, lambda path: floor(path, self._pixel.value, self._corner.value))
        self._upload("Show a floor (PNG, JPEG, PGM)", PICTURES, laid)
        self._pixel = precise(gui.add_number("Metres a pixel", 0.05, min=1e-4, step=0.01))
        self._corner = precise(gui.add_vector2("Lower left corner [m]", (0.0, 0.0), step=0.5))
        gui.add_divider()
        self._kind = gui.add_dropdown("Write", tuple(EXPORTS))
        self._name = gui.add_text("File name", "scene")
        when_clicked(gui.add_button("Save in the working folder"), lambda client: editor.later(self._save))
        when_clicked(gui.add_button("Download"), lambda client: editor.later(lambda: self._download(client)))
        self._saved = gui.add_html(sentence(f"the working folder is {folder.path}"))
        gui.add_divider()
        when_clicked(gui.add_button("Copy as Python"), lambda client: self._tell(client, as_python, "Python"))
        when_clicked(gui.add_button("Copy as command line"), lambda client: self._tell(client, as_command, "Shell"))

    def _upload(self, label: str, endings: tuple[str, ...], act: Callable[[str, bytes], None]) -> None:
        add_upload(self._gui, self._editor, label, endings, act)

    def _shown(self, endings: tuple[str, ...], read: Callable[[Path], Obstacles]) -> Callable[[str, bytes], None]:
        def show(name: str, content: bytes) -> None:
            ending = next((known for known in endings if name.lower().endswith(known)), endings[0])
            with self._folder.uploaded(name, ending, content) as path:
                self._obstacles(read(path), float(self._clearance.value))

        return show

    def _save(self) -> None:
        kind = self._kind.value
        target = self._folder.target(kind, self._name.value)
        lost = save_as(kind, self._state(), target)
        self._saved.content = sentence(f"{target.name} is written to {self._folder.path}. {lost}", "good")

    def _download(self, client: Any) -> None:
        kind = self._kind.value
        name = self._folder.destination(self._name.value, EXPORTS[kind][0]).name
        with self._folder.scratch(EXPORTS[kind][0]) as path:
            save_as(kind, self._state(), path)
            client.send_file_download(name, path.read_bytes(), save_immediately=True)

    def _tell(self, client: Any, words: Callable[[Any], str], title: str) -> None:
        def tell() -> None:
            with client.gui.add_modal(title) as window:
                client.gui.add_html(copyable(words(self._state().request)))
                when_clicked(client.gui.add_button("Close"), lambda client: window.close())

        self._editor.attempt(tell)


def add_views(gui: Any, page: Viewed) -> None:
    """Add the buttons that show the whole scene, and make the page dark."""
    views = {"Whole scene": page.frame, "Dark": page.darken}
    when_changed(gui.add_button_group("View", tuple(views)), lambda what: page.attempt(views[what]))


SEARCHING = "searching a better plan; the last good one is shown"


class StatusPanel:
    """Facts of the plan.

    Parameters
    ----------
    gui : viser.GuiApi
        Where it is added, in the present container.
    editor : Editor
        What undo and redo act on.
    """

    def __init__(self, gui: Any, editor: Editor) -> None:
        self._facts = gui.add_html("")
        self._told = gui.add_html(sentence(SEARCHING))
        self._message = gui.add_html("", visible=False)
        does = {"Undo": editor.undo, "Redo": editor.redo}
        when_changed(gui.add_button_group("Last edit", tuple(does)), lambda what: editor.attempt(does[what]))
        add_views(gui, editor)
        self._legend = gui.add_html(legend(0.0))

    def show(self, state: BenchState) -> None:
        """Show what holds of the plan, and what cannot be done."""
        if state.planned is not None:
            self._facts.content = table(facts(state))
        self._told.content = told(state)

    def explain(self, top: float, ghost: bool, flown: bool) -> None:
        """Show what the lines of the scene are; ``top`` is the greatest speed of the path [m/s]."""
        keys = [("before the last edit", GHOST)] * ghost + [("simulated", FLIGHT)] * flown
        self._legend.content = legend(top, *keys)

    def say(self, text: str, kind: str = "refusal") -> None:
        """Show a sentence about the last request; nothing where it is empty."""
        self._message.content = sentence(text, kind)
        self._message.visible = bool(text)


def told(state: BenchState) -> str:
    """Return the line below the facts, as HTML: refusal, search, or that all holds."""
    if state.refusal:
        stays = " The last good plan is shown." if state.planned is not None else ""
        return sentence(f"{state.refusal[:1].upper()}{state.refusal[1:]}.{stays}", "refusal")
    if state.searching or state.planned is None:
        return sentence(SEARCHING)
    if state.planned.certificate.ok:
        return sentence(f"certified at every instant, planned in {state.planned.milliseconds:.0f} ms", "good")
    return sentence("the certificate does not hold: see its figures", "refusal")


def facts(state: BenchState) -> list[tuple[str, str]]:
    """Return names and values of the plan that is shown: time, cost, and the figures of its certificate."""
    assert state.planned is not None
    return facts_of(state.planned.trajectory, state.planned.certificate)


def facts_of(curve: Trajectory, holds: Certificate) -> list[tuple[str, str]]:
    """Return names and values of a plan: time, cost, and the figures of its certificate."""
    margin = "no corridor" if holds.corridor_margin is None else _inside(holds.corridor_margin)
    return [
        ("duration", f"{curve.duration:.3f} s"),
        ("cost", f"{curve.cost():.6g} {cost_unit(curve.cost_order)}"),
        ("corridor margin", margin),
        *([] if holds.obstacle_margin is None else [("obstacle margin", f"{holds.obstacle_margin:.3g} m")]),
        ("greatest speed", f"{holds.max_speed:.3f} m/s"),
        ("greatest acceleration", f"{holds.max_acceleration:.3f} m/s²"),
        ("greatest jerk", f"{holds.max_jerk:.3f} m/s³"),
        *_uses(holds),
    ]


def _inside(margin: float) -> str:
    """Return how far inside its walls a plan is [m]; one of least cost often touches them."""
    return "inside, under 1 mm" if 0.0 <= margin < 1e-3 else f"{margin:.3g} m inside"


def _uses(holds: Certificate) -> list[tuple[str, str]]:
    """Return the extreme of what each limit bounds; of rotors, ``fraction`` is the share of their room from hover."""
    rows = []
    for used in holds.utilisation:
        kind = KIND[used.name]
        scale, unit = (degrees(1.0), "°") if kind.degrees else (1.0, f" {kind.unit}")
        share = f"{used.value:.3g} of at least" if kind.least else f"{100.0 * used.value / used.limit:.1f} % of"
        rows.append((kind.label, f"{share} {scale * used.limit:.3g}{unit}, on leg {used.leg}"))
    return rows
