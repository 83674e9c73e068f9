"""The part of the panel about files: open, save, download, and the plan as Python or as a command."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from minsnap.studio.documents import ENDINGS, EXPORTS, open_upload, save_as
from minsnap.studio.obstacles import ENDINGS as OBSTACLE_ENDINGS
from minsnap.studio.obstacles import PICTURES, Obstacles, floor, read_obstacles
from minsnap.studio.page_inputs import Editor, copyable, sentence, when_clicked
from minsnap.studio.reproduction import as_command, as_python
from minsnap.studio.workbench import BenchState
from minsnap.studio.working_folder import WorkingFolder


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
        Shows obstacles.
    """

    def __init__(
        self,
        gui: Any,
        editor: Editor,
        folder: WorkingFolder,
        state: Callable[[], BenchState],
        obstacles: Callable[[Obstacles], None],
    ) -> None:
        self._gui, self._editor, self._folder, self._state = gui, editor, folder, state
        self._obstacles = obstacles
        self._upload("Open a scene (YAML, CSV, .plan)", ENDINGS, self._open)
        self._upload("Show obstacles (.npz, CSV)", (".npz", ".csv"), self._load)
        self._upload("Show a floor (PNG, JPEG, PGM)", PICTURES, self._lay)
        self._pixel = gui.add_number("Metres a pixel", 0.05, min=1e-4, step=0.01)
        self._corner = gui.add_vector2("Lower left corner [m]", (0.0, 0.0), step=0.5)
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
        button = self._gui.add_upload_button(label, mime_type=",".join(endings))

        async def uploaded(event: Any) -> None:
            value = event.target.value
            self._editor.later(lambda: act(value.name, value.content))

        button.on_upload(uploaded)

    def _open(self, name: str, content: bytes) -> None:
        request = open_upload(name, content, self._folder)
        self._editor.edit(lambda before: request)
        self._editor.frame()

    def _load(self, name: str, content: bytes) -> None:
        ending = next((known for known in OBSTACLE_ENDINGS if name.lower().endswith(known)), ".npz")
        with self._folder.scratch(ending, name) as path:
            path.write_bytes(content)
            self._obstacles(read_obstacles(path))

    def _lay(self, name: str, content: bytes) -> None:
        ending = next((known for known in PICTURES if name.lower().endswith(known)), ".png")
        with self._folder.scratch(ending, name) as path:
            path.write_bytes(content)
            self._obstacles(floor(path, self._pixel.value, self._corner.value))

    def _save(self) -> None:
        kind, state = self._kind.value, self._state()
        target = self._folder.destination(self._name.value, EXPORTS[kind].ending)
        lost = save_as(kind, state.planned, state.request, target)
        self._saved.content = sentence(f"{target.name} is written to {self._folder.path}. {lost}", "good")

    def _download(self, client: Any) -> None:
        kind, state = self._kind.value, self._state()
        name = self._folder.destination(self._name.value, EXPORTS[kind].ending).name
        with self._folder.scratch(EXPORTS[kind].ending) as path:
            save_as(kind, state.planned, state.request, path)
            client.send_file_download(name, path.read_bytes(), save_immediately=True)

    def _tell(self, client: Any, words: Callable[[Any], str], title: str) -> None:
        def tell() -> None:
            with client.gui.add_modal(title) as window:
                client.gui.add_html(copyable(words(self._state().request)))
                when_clicked(client.gui.add_button("Close"), lambda client: window.close())

        self._editor.attempt(tell)
