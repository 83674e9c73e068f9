"""The page of a fleet: all vehicles on one clock, those that come near each other highlighted, and what is proved."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray, IntArray
from minsnap.errors import FleetError
from minsnap.files.formats import Lights
from minsnap.fleet import Fleet, FleetCertificate, certify_fleet
from minsnap.plot.fleet_figures import INSTANTS, least_distances, near_pairs
from minsnap.studio.browser_page import LOOPBACK, PORT, Page, Player, several
from minsnap.studio.file_panel import add_views
from minsnap.studio.ground_view import BY_DAY, BY_NIGHT, GroundView
from minsnap.studio.page_inputs import sentence, table
from minsnap.studio.plan_drawing import ColourArray, data_with_cursor, round_up, speed_colours, thin_lines, time_chart

VEHICLE, PALE, NEAR = (31, 42, 68), (96, 112, 150), (224, 49, 49)
"""Colours of vehicles without a lamp, or whose lamp is dark; of those on a dark page that have none; of near ones."""

NIGHT, DAY = (16, 22, 38), (255, 255, 255)
"""Colours behind a fleet on a dark page, as one with lights begins, and on a light one."""

Colour = tuple[int, int, int]

FADED = {NIGHT: 0.25, DAY: 0.35}
"""How much of the colour of time paths have where there are many; the rest is what is behind them."""

LISTED = 6
"""Pairs that are named while they are near."""

_TIPS = np.array([[1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0], [0, 0, 0.5], [0, 0, -0.5]], dtype=np.float32)
_SIDES = np.array([[i, (i + 1) % 4, 4] for i in range(4)] + [[(i + 1) % 4, i, 5] for i in range(4)])


class FleetStudio(Page):
    """A page that shows and plays a fleet.

    Parameters
    ----------
    fleet : Fleet
        In space; pairs nearer than 1.25 times its ``separation`` are highlighted.
    host, port
        Address to listen on; port 0 is any that is free.
    lights : sequence of Lights or None, optional
        Of each vehicle, which has the colour of its lamp while that shines.

    Raises
    ------
    FleetError
        If the fleet is plane, or there are lights for another number of vehicles.
    LinkError
        If it cannot listen there.
    ImportError
        If viser is not there.
    """

    def __init__(
        self, fleet: Fleet, host: str = LOOPBACK, port: int = PORT, lights: Sequence[Lights | None] | None = None
    ) -> None:
        if fleet.dim != 3:
            raise FleetError(f"the studio shows fleets in space: this one has {fleet.dim} coordinates")
        self.fleet, self._lights = fleet, (None,) * len(fleet) if lights is None else tuple(lights)
        if len(self._lights) != len(fleet):
            raise FleetError(f"there are lights for {len(self._lights)} of {len(fleet)} vehicles: give each its own")
        self.certificate = certify_fleet(fleet, fleet.separation)
        self._places = several(fleet)
        self._dark = any(lamp is not None for lamp in self._lights)
        super().__init__(host, port)
        self._build()
        self._show(0.0)

    def _seen(self) -> FloatArray:
        return self._places

    def _build(self) -> None:
        server, gui = self._server, self._server.gui
        self._ground = GroundView(server)
        self._draw_behind()
        self._draw_vehicles(server.scene)
        gui.add_html(table(facts(self.certificate)) + verdict(self.certificate))
        self._message = gui.add_html("")
        add_views(gui, self)
        self._player = Player(gui, self._show, "Fly")
        self._player.show(self.fleet.duration)
        self.add_recording(gui)
        self._told = gui.add_html("")
        panel = gui.add_panel()
        with panel.add_tab("Plots"):
            self._build_chart(gui)
        self._open(panel)

    def darken(self) -> None:
        """Make the page dark, or light again."""
        super().darken()
        with self._lock:
            self._draw_behind()
        self._show(self.now)

    @property
    def _behind(self) -> Colour:
        return NIGHT if self._dark else DAY

    def _draw_behind(self) -> None:
        """Draw ground, background and paths, whose colours are those of the page."""
        scene = self._server.scene
        self._ground.show("enu", self._places, BY_NIGHT if self._dark else BY_DAY)
        scene.set_background_image(np.full((2, 2, 3), self._behind, dtype=np.uint8) if self._dark else None)
        self._draw_paths(scene)

    def _draw_paths(self, scene: Any) -> None:
        """Draw the paths, coloured by time; paler where they are more than ten."""
        t = np.linspace(0.0, self.fleet.duration, 80)
        few, kept = min(10.0 / len(self.fleet), 1.0), FADED[self._behind]
        kept += few * (1.0 - kept)
        colours = kept * speed_colours(t / self.fleet.duration) + (1.0 - kept) * np.array(self._behind)
        scene.add_glb("/fleet/paths", thin_lines(self.fleet(t), colours), cast_shadow=False, receive_shadow=False)

    def _draw_vehicles(self, scene: Any) -> None:
        apart, extent = self.fleet.separation, float(np.ptp(self._places, axis=0).max())
        size = max(0.01 * extent, 0.0 if apart is None else 0.4 * float(apart.radii_of(len(self.fleet)).min()))
        count = len(self.fleet)
        turned = np.tile([1.0, 0.0, 0.0, 0.0], (count, 1))
        how: dict[str, Any] = {"flat_shading": True, "cast_shadow": False, "receive_shadow": False, "lod": "off"}
        add, places = scene.add_batched_meshes_simple, np.zeros((count, 3))
        self._vehicles = add(
            "/fleet/vehicles", size * _TIPS, _SIDES, turned, places, batched_colors=np.tile(VEHICLE, (count, 1)), **how
        )
        lines: dict[str, Any] = {"thickness": 4.0, "thickness_units": "screen", "visible": False}
        self._lines = scene.add_line_segments("/fleet/near", np.zeros((1, 2, 3)), NEAR, **lines)

    def _build_chart(self, gui: Any) -> None:
        """Plot the least distance of any two against time, beside the separation."""
        pair, apart = self.certificate.pair, self.fleet.separation
        self._chart, self._step = None, -1
        if pair is None or apart is None:
            return
        self._t = np.linspace(0.0, self.fleet.duration, INSTANTS)
        self._least = least_distances(self.fleet, apart, self._t)
        separation, high = apart.between(*pair), round_up(1.05 * float(self._least.max()))
        self._edges = (0.0, high, separation, -high)
        self._chart = time_chart(gui, "least distance [m]", ("nearest pair",), height=220)
        self._chart.scales = {"x": {"time": False, "range": (0.0, self.fleet.duration)}, "y": {"range": (0.0, high)}}

    def _show(self, now: float) -> None:
        """Show the fleet at an instant [s]."""
        with self._lock:
            if self._closed.is_set():
                return
            places = self.fleet(now)
            apart = self.fleet.separation
            near = np.zeros((0, 2), dtype=np.intp) if apart is None else near_pairs(places, apart)
            colours = self._colours(now)
            colours[near.reshape(-1)] = NEAR
            with self._server.atomic():
                self._vehicles.batched_positions = places.astype(np.float32)
                if not np.array_equal(self._vehicles.batched_colors, colours):
                    self._vehicles.batched_colors = colours
                self._lines.visible = bool(len(near))
                if len(near):
                    self._lines.points = places[near].astype(np.float32)
                self._tell(places, near)
                self._point_at(now)

    def _point_at(self, now: float) -> None:
        """Move the cursor of the plot, in whole percents of the flight: the browser draws all of it anew."""
        step = round(100.0 * now / self.fleet.duration)
        if self._chart is not None and step != self._step:
            self._step = step
            self._chart.data = data_with_cursor(self._t, self._least[None], self._edges, now)

    def _colours(self, now: float) -> ColourArray:
        """Return the colour of every vehicle, between its own and that of its lamp by how bright that shines."""
        lamps = np.array([np.zeros(3) if lamp is None else lamp(now) for lamp in self._lights])
        bright = lamps.max(axis=1, keepdims=True) / 255.0
        full = np.divide(lamps, bright, out=np.zeros_like(lamps), where=bright > 0.0)
        unlit = PALE if self._dark and not any(lamp is not None for lamp in self._lights) else VEHICLE
        return np.asarray(np.round(bright * full + (1.0 - bright) * unlit), dtype=np.uint8)

    def _tell(self, places: FloatArray, near: IntArray) -> None:
        """Name the pairs that are near, with their distances, heights divided by the downwash."""
        apart = self.fleet.separation
        flat = places / (1.0, 1.0, 1.0 if apart is None else apart.downwash)
        lengths = np.linalg.norm(flat[near[:, 0]] - flat[near[:, 1]], axis=1)
        rows = [(self.fleet.names_of(near[i].tolist()), f"{lengths[i]:.2f} m") for i in lengths.argsort()[:LISTED]]
        more = [("pairs that are near", str(len(near)))] if self.fleet.separation is not None else []
        content = table(more + rows)
        if self._told.content != content:
            self._told.content = content


def facts(held: FleetCertificate) -> list[tuple[str, str]]:
    """Return names and values of what is proved of a fleet."""
    fleet = held.fleet
    rows = [("vehicles", str(len(fleet))), ("duration", f"{fleet.duration:.2f} s")]
    near = held.closest
    if near is not None:
        rows.append(("least distance", f"{near.distance:.4f} m at {near.instant:.2f} s"))
        rows.append(("of", fleet.names_of(near.pair)))
        rows.append(("separation", f"{near.required:g} m"))
    return rows


def verdict(held: FleetCertificate) -> str:
    """Return as HTML whether all vehicles are apart."""
    if held.separation is None:
        return sentence("no separation is known: minsnap studio FLEET --separation M says which pairs come near")
    if held.ok:
        return sentence("certified at every instant", "good")
    return sentence("two vehicles come nearer than their separation", "refusal")
