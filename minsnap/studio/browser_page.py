"""What every page of a studio has: viser on one address for its own pages, a clock, cameras, keys, and an end."""

from __future__ import annotations

import contextlib
import io
import socket
import threading
import traceback
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from math import ceil
from pathlib import Path
from tempfile import TemporaryDirectory
from time import monotonic
from typing import TYPE_CHECKING, Any
from urllib.parse import urlsplit

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.optional_packages import optional
from minsnap.errors import LinkError, MinsnapError
from minsnap.plot.animation import Picture, write_film
from minsnap.studio.page_inputs import SCRIPT, follow, sentence, when_changed, when_clicked, when_triggered

if TYPE_CHECKING:
    import viser

LOOPBACK = "127.0.0.1"
"""The address that is listened on unless told otherwise."""

PORT = 8080
"""The port unless told otherwise."""


def start_server(host: str = LOOPBACK, port: int = PORT) -> viser.ViserServer:
    """Start the server of a page.

    Only pages from this server may connect (by the ``Origin`` that a browser sends), so that no other page that the
    browser shows can edit the scene; and no tunnel to a public address can be opened.

    Parameters
    ----------
    host : str
        Address to listen on.
    port : int
        0 for any that is free.

    Raises
    ------
    LinkError
        If it cannot listen there.
    ImportError
        If viser is not there.
    """
    opened = check_server(host, port)
    with contextlib.redirect_stdout(io.StringIO()):
        server = opened(host=host, port=port, verbose=False)
    if port and server.get_port() != port:
        stop_server(server)
        raise _taken(host, port)
    server.request_share_url = lambda verbose=True: None  # type: ignore[method-assign]
    _refuse_other_pages(server, host)
    return server


def check_server(host: str, port: int) -> Callable[..., viser.ViserServer]:
    """Return what opens a server, or raise ImportError where viser is not there, LinkError where it cannot listen."""
    opened: Callable[..., viser.ViserServer] = optional("viser", "the studio needs viser", "studio").ViserServer
    check_free(host, port)
    return opened


def stop_server(server: viser.ViserServer) -> None:
    """Stop a server, without its message."""
    with contextlib.redirect_stdout(io.StringIO()):
        server.stop()


def fold(client: Any, panel: Any) -> None:
    """Fold a panel in one browser; viser folds only panels of one browser there, or in all."""
    handle = client.gui.main_panel
    handle._placement_uuid = panel._placement_uuid
    handle.minimize()


def check_free(host: str, port: int) -> None:
    """Raise LinkError unless this address can be listened on; viser would take the next port silently."""
    try:
        family = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0][0]
        with socket.socket(family, socket.SOCK_STREAM) as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            probe.bind((host, port))
    except OverflowError:
        raise LinkError(f"there is no port {port}: choose one from 1 to 65535", address=f"{host}:{port}") from None
    except OSError as error:
        raise _taken(host, port) from error


def is_own_page(origin: str | None, named: str | None, host: str) -> bool:
    """Whether a connection comes from a page of this server, or from a program.

    Parameters
    ----------
    origin, named : str or None
        Headers ``Origin`` and ``Host`` of the request; programs send no origin.
    host : str
        Address that is listened on.
    """
    if origin is None:
        return True
    if named is None or urlsplit(origin).netloc != named:
        return False
    name = urlsplit(f"//{named}").hostname
    return host not in (LOOPBACK, "localhost", "::1") or name in (LOOPBACK, "localhost", "::1")


def _refuse_other_pages(server: viser.ViserServer, host: str) -> None:
    sockets: Any = server._websock_server

    async def check(client: Any) -> None:
        connection = sockets._live_connections[client.client_id]
        headers = connection.request.headers
        if not is_own_page(headers.get("Origin"), headers.get("Host"), host):
            await connection.close(1008, "this page does not belong to the studio")

    sockets._client_connect_cb.insert(0, check)


def _taken(host: str, port: int) -> LinkError:
    return LinkError(
        f"port {port} of {host} cannot be listened on: another program uses it, or it is not allowed; "
        "choose another with --port",
        address=f"{host}:{port}",
    )


PERIOD = 0.05
"""Seconds between two poses of a flying vehicle."""


DIRECTION = np.array([-0.8, -1.0, 0.9]) / np.linalg.norm([-0.8, -1.0, 0.9])
"""From the scene to the camera: from the front, the left and above."""

FILLED = 0.8
"""Share of the picture that the scene takes."""

NEAREST = 2.0
"""[m]."""

PLOTS, CONTROLS = 250, 310
"""Widths of the panel of plots and of the panel of controls [pixels]."""

NARROW = 1200
"""Width of a window below which it opens with the plots folded, so that the scene has most of it [pixels]."""

PHONE, SHEET = 576, 0.45
"""Width of a window in which the controls are a sheet at the lower edge [pixels], and its share of the height."""


@dataclass(frozen=True)
class FilmSettings:
    """How a flight is recorded.

    Parameters
    ----------
    rate : float
        Pictures a second [Hz].
    most : int
        Pictures at most.
    widest : int
        Greatest width of a picture [pixels].
    patience : float
        For one picture of a browser [s].
    """

    rate: float = 12.0
    most: int = 360
    widest: int = 800
    patience: float = 60.0


FILM = FilmSettings()

Key = tuple[str, str, str | None, Callable[[], None]]
"""What a key does, its name, its modifier, and the function that does it."""


class Player:
    """A time in the duration of the plan.

    Parameters
    ----------
    gui : viser.GuiApi
        Where its inputs are added, in the present container.
    moved : callable
        Called with the time [s] when it has changed.
    label : str
        Of the box that lets it run.

    Attributes
    ----------
    now, duration : float
        The time, and how long what is flown takes [s].
    """

    def __init__(self, gui: Any, moved: Callable[[float], None], label: str = "Fly the plan") -> None:
        self._moved = moved
        self.now, self.duration = 0.0, 1.0
        self._slider = gui.add_slider("Time [s]", min=0.0, max=1.0, step=0.01, initial_value=0.0)
        when_changed(self._slider, self._set)
        self._flying = threading.Event()
        self._closed = threading.Event()
        self._box = when_changed(gui.add_checkbox(label, False), self._fly)
        self._thread = threading.Thread(target=self._run, name="studio clock", daemon=True)
        self._thread.start()

    def show(self, duration: float) -> None:
        """Take up the duration of another plan [s]; the time stays where it is, or at the end."""
        self.duration = duration
        self.now = min(self.now, duration)
        most = ceil(100.0 * duration - 1e-6) / 100.0
        if self._slider.max != most:
            if self._slider.value > most:
                self._slider.value = round(self.now, 2)
            self._slider.max = most

    def seek(self, now: float) -> None:
        """Go to a time [s]."""
        self._set(now)
        follow(self._slider, round(self.now, 2))

    def switch(self) -> None:
        """Fly, or stop."""
        self._box.value = not self._box.value
        self._fly(self._box.value)

    def close(self) -> None:
        """End the thread."""
        self._closed.set()
        self._flying.set()
        self._thread.join(1.0)

    def _set(self, now: float) -> None:
        self.now = min(max(float(now), 0.0), self.duration)
        self._moved(self.now)

    def _fly(self, wanted: bool) -> None:
        (self._flying.set if wanted else self._flying.clear)()

    def _run(self) -> None:
        before = monotonic()
        while not self._closed.wait(PERIOD):
            waited = not self._flying.is_set()
            self._flying.wait()
            if self._closed.is_set():
                return
            elapsed, before = (0.0 if waited else monotonic() - before), monotonic()
            self.seek((self.now + elapsed) % self.duration)


def framing(points: FloatArray, fov: float, aspect: float, hidden: float = 0.0) -> tuple[FloatArray, FloatArray]:
    """Return where the camera stands and what it looks at, so that points (n, 3) [m] are all within the picture.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
        [m].
    fov : float
        Vertical angle of view [rad].
    aspect : float
        Width of the picture by its height.
    hidden : float
        Share of the picture, from its lower edge, that a panel lies over.
    """
    center = 0.5 * (points.min(axis=0) + points.max(axis=0))
    right = np.cross(-DIRECTION, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    offsets = points - center
    half = FILLED * np.tan(0.5 * fov)
    across = np.abs(offsets @ right) / (half * aspect)
    up = np.cross(right, -DIRECTION)
    upwards = np.abs(offsets @ up) / (half * (1.0 - hidden))
    away = max(float((np.maximum(across, upwards) + offsets @ DIRECTION).max()), NEAREST)
    center = center - hidden * np.tan(0.5 * fov) * away * up
    return center + away * DIRECTION, center


def frame(client: Any, points: FloatArray) -> FloatArray:
    """Let the camera of a browser see points, shape (n, 3) [m]; return where it stands."""
    camera = client.camera  # the picture of a hidden page has no pixels
    width, height = max(camera.image_width, 1), max(camera.image_height, 1)
    place, center = framing(points, camera.fov, width / height, SHEET if width < PHONE else 0.0)
    with client.atomic():
        camera.position, camera.look_at = place, center
    return place


def keep_framed(client: Any, points: Callable[[], FloatArray], opening: FloatArray) -> None:
    """Let a camera see points, again whenever its picture has another size, until its user moves it.

    A slow page goes to the place that pages open with, ``opening``, after it was told where to stand: from there it is
    told again.
    """
    camera = client.camera
    place, size = frame(client, points()), (camera.image_width, camera.image_height)

    def stands_at(where: FloatArray) -> bool:
        return np.allclose(camera.position, where, rtol=1e-3, atol=1e-3)

    async def changed(event: Any) -> None:
        nonlocal place, size
        now = (camera.image_width, camera.image_height)
        if now != size if stands_at(place) else stands_at(opening):
            place, size = frame(client, points()), now

    camera.on_update(changed)


class Page:
    """A page for every browser that opens its address; host and port are those of :func:`start_server`."""

    _player: Player
    _message: Any
    _dark: bool = False

    def __init__(self, host: str, port: int) -> None:
        self._server: Any = start_server(host, port)
        self.url = f"http://{f'[{host}]' if ':' in host else host}:{self._server.get_port()}"
        self._closed = threading.Event()
        self._lock = threading.RLock()
        gui = self._server.gui
        self._dress()
        gui.set_panel_label("minsnap studio")
        gui.main_panel.dock_right()
        gui.main_panel.set_width(CONTROLS)
        gui.add_html(SCRIPT)
        self._server.scene.configure_default_lights(cast_shadow=False)

    def _dress(self) -> None:
        """Give the page its theme, light or dark."""
        how = {"show_logo": False, "show_share_button": False, "dark_mode": self._dark}
        self._server.gui.configure_theme(**how)

    def darken(self) -> None:
        """Make the page dark, or light again."""
        self._dark = not self._dark
        self._dress()

    @property
    def now(self) -> float:
        """The time of the vehicles and of the cursors [s]."""
        return self._player.now

    def seek(self, now: float) -> None:
        """Show the vehicles and the cursors at an instant [s]."""
        self._player.seek(now)

    def frame(self) -> None:
        """Let the cameras of all browsers see the whole scene."""
        for client in self._server.get_clients().values():
            frame(client, self._seen())

    def say(self, text: str) -> None:
        """Show a sentence about the last request; nothing where it is empty."""
        self._message.content = sentence(text, "refusal")

    def attempt(self, act: Callable[[], None]) -> None:
        """Do something; show on the page why it is refused, also where a part of it shows that itself."""
        self._say("")
        try:
            act()
        except (MinsnapError, OSError, ImportError) as error:
            self._say(f"{error}")
        except Exception:
            traceback.print_exc()
            self._say("this failed in an unexpected way: the terminal says more")

    def _say(self, text: str) -> None:
        with self._lock:
            if not self._closed.is_set():
                self.say(text)

    def later(self, act: Callable[[], None]) -> None:
        """Do something in a thread of its own; show on the page why it is refused."""
        threading.Thread(target=self.attempt, args=(act,), name="studio task", daemon=True).start()

    def record(self, client: Any) -> None:
        """Fly once, as the camera of a browser sees it now, and let it save the film."""
        camera, duration = client.camera, self._player.duration
        width = min(camera.image_width, FILM.widest)
        how = {"wxyz": camera.wxyz, "position": camera.position, "fov": camera.fov, "timeout": FILM.patience}
        count = min(int(FILM.rate * duration) + 2, FILM.most)

        def pictures() -> Iterator[Picture]:
            for now in np.linspace(0.0, duration, count):
                self.seek(float(now))
                yield client.get_render(round(width * camera.image_height / camera.image_width), width, **how)

        with TemporaryDirectory() as folder:
            file = Path(folder) / "flight.gif"
            write_film(pictures(), file, (count - 1) / duration)
            client.send_file_download(file.name, file.read_bytes(), save_immediately=True)

    def add_recording(self, gui: Any) -> None:
        """Add the button that records."""
        button = gui.add_button("Record the flight (GIF)")
        when_clicked(button, lambda client: self.later(lambda: self.record(client)))

    def wait_until_closed(self, timeout: float | None = None) -> bool:
        """Wait until the studio is closed; return whether it is."""
        return self._closed.wait(timeout)

    def close(self) -> None:
        """End the page."""
        with self._lock:  # what is being shown comes to its end, and nothing is shown from now on
            if self._closed.is_set():
                return
            self._closed.set()
        self._player.close()
        self._end()
        stop_server(self._server)

    def _end(self) -> None:
        """End what else runs."""

    def _seen(self) -> FloatArray:
        """Return what a camera is to see, shape (n, 3) [m]."""
        raise NotImplementedError

    def _open(self, plots: Any, *keys: Key) -> None:
        """Dock the panel of plots, frame the scene in every browser that opens, and give keys their meaning."""
        plots.dock_left()
        plots.set_width(PLOTS)
        camera = self._server.initial_camera
        untold = camera.position
        camera.position, camera.look_at = opening, _ = framing(self._seen(), camera.fov, 1.0)

        async def opened(client: Any) -> None:
            is_new = np.allclose(client.camera.position, untold)  # else it connects again, and its panels are there
            if is_new and client.camera.image_width < NARROW:
                fold(client, plots)
            keep_framed(client, self._seen, opening)

        self._server.on_client_connect(opened)
        common: tuple[Key, ...] = (
            ("Fly or stop", "space", None, self._player.switch),
            ("See the whole scene", "F", None, self.frame),
        )
        for label, key, modifier, act in (*keys, *common):
            command = self._server.gui.add_command(label, hotkey=key, modifier=modifier)
            when_triggered(command, partial(self.attempt, act))


def several(curve: Any, count: int = 50) -> FloatArray:
    """Return places along a curve, or along those of a fleet, shape (n, 3) [m]."""
    return np.asarray(curve(np.linspace(0.0, curve.duration, count))).reshape(-1, 3)
