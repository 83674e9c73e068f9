"""Lines as glTF: read by the rules of its specification, and seen in a browser."""

import io
import json
import struct
import time

import numpy as np
import pytest
from page_browser import chromium, on_screen, open_page
from PIL import Image

import minsnap
from minsnap.studio.plan_drawing import thin_lines


def read_glb(content):
    """Return the primitive of a binary glTF and its arrays, by sections 3.6 and 4.4 of glTF 2.0."""
    magic, version, length = struct.unpack_from("<4sII", content)
    size, kind = struct.unpack_from("<I4s", content, 12)
    binary, named = struct.unpack_from("<I4s", content, 20 + size)
    assert (magic, version, length, kind, named) == (b"glTF", 2, len(content), b"JSON", b"BIN\0")
    assert size % 4 == binary % 4 == 0 and 28 + size + binary == length
    layout, data = json.loads(content[20 : 20 + size]), content[28 + size :]
    assert layout["buffers"] == [{"byteLength": len(data)}]

    def array(accessor):
        view = layout["bufferViews"][accessor["bufferView"]]
        assert view["byteOffset"] % 4 == 0
        part = data[view["byteOffset"] : view["byteOffset"] + view["byteLength"]]
        width = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}[accessor["type"]]
        return np.frombuffer(part, {5126: "<f4", 5121: "u1", 5125: "<u4"}[accessor["componentType"]]).reshape(-1, width)

    return layout["meshes"][0]["primitives"][0], [array(entry) for entry in layout["accessors"]], layout["accessors"]


def test_every_line_goes_through_its_points_and_no_other():
    points = np.random.default_rng(3).normal(0.0, 5.0, (3, 5, 3))
    colours = np.array([(0, 0, 0), (255, 0, 0), (188, 188, 188), (10, 128, 255), (255, 255, 255)], dtype=float)
    primitive, (places, shades, pairs), about = read_glb(thin_lines(points, colours))
    assert primitive == {"attributes": {"POSITION": 0, "COLOR_0": 1}, "indices": 2, "mode": 1}
    assert places.reshape(3, 5, 3) == pytest.approx(points, rel=1e-6) and len(shades) == 15
    drawn = places[pairs.reshape(3, 4, 2)]
    assert drawn == pytest.approx(np.stack([points[:, :-1], points[:, 1:]], axis=2), rel=1e-6)
    assert [entry["count"] for entry in about] == [15, 15, 24]
    assert about[0]["min"] == places.min(axis=0).tolist() and about[0]["max"] == places.max(axis=0).tolist()
    assert (shades.reshape(3, 5, 4) == shades[:5]).all() and (shades[:, 3] == 255).all()
    assert shades[[0, 1, 4], 0].tolist() == [0, 255, 255] and abs(int(shades[2, 0]) - 128) <= 1, "half as much light"


@pytest.mark.slow
def test_a_browser_draws_the_path_of_a_vehicle_where_it_flies():
    pytest.importorskip("viser")
    from minsnap.studio import FleetStudio

    curve = minsnap.plan([(0, 0, 1), (3, 1, 3), (6, 0, 1)], total_time=6.0)
    other = minsnap.plan([(0, 3, 1), (6, 3, 1)], total_time=6.0)
    studio = FleetStudio(minsnap.Fleet([curve, other], separation=minsnap.Separation(0.5)), port=0)
    try:
        with chromium() as browser:
            page = open_page(browser, studio.url)
            end = time.monotonic() + 120.0
            while not (seen := _on_path(page, studio, curve)) and time.monotonic() < end:
                time.sleep(0.5)
            assert seen
    finally:
        studio.close()


def _on_path(page, studio, curve):
    """Whether the picture is not the ground's where the curve is seen, at each of nine instants."""
    camera = next(iter(studio._server.get_clients().values())).camera
    picture = np.asarray(Image.open(io.BytesIO(page.screenshot())).convert("RGB"), dtype=int)
    for t in np.linspace(1.5, 4.5, 9):
        x, y = (round(value) for value in on_screen(page, camera, curve(t)))
        near = picture[y - 4 : y + 5, x - 4 : x + 5].reshape(-1, 3)
        if np.ptp(near, axis=1).max() < 30:
            return False
    return True
