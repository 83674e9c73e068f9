"""The page of the studio in a real browser: open, drag, what cannot be done, undo, save, two browsers."""

import io
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from page_browser import PATIENCE, chromium, on_screen, open_page
from PIL import Image

import minsnap
from minsnap.studio import Studio
from minsnap.studio.browser_page import FilmSettings
from minsnap.studio.documents import EXAMPLES, example_scene
from minsnap.studio.file_panel import as_python

pytest.importorskip("viser")
pytestmark = pytest.mark.slow

EXAMPLE = example_scene()


@pytest.fixture(scope="module")
def studio(tmp_path_factory):
    page = Studio(EXAMPLE, str(tmp_path_factory.mktemp("work")), port=0)
    yield page
    page.close()


@pytest.fixture(scope="module")
def browser():
    with chromium() as running:
        yield running


@pytest.fixture(scope="module")
def opened(browser, studio):
    page = open_page(browser, studio.url)
    yield page
    page.close()


@pytest.fixture
def page(opened, studio):
    """The page, with the scene of the example."""
    studio.edit(lambda request: EXAMPLE)
    assert studio.wait(60.0)
    opened.get_by_role("tab", name="Route").click()
    shows(opened, f"{studio.trajectory.cost():.6g}")
    return opened


def shows(page, text):
    """Wait until the page shows a text."""
    page.get_by_text(text).first.wait_for(timeout=PATIENCE)


def cost(page):
    """Return the cost on the page."""
    return page.locator("tr", has_text="cost").locator("td").nth(1).inner_text().split()[0]


def coordinate(page, waypoint, axis):
    """Return the field of a coordinate; the first field of the page is that of the time."""
    return page.locator("input[inputmode='decimal']:visible").nth(1 + 3 * waypoint + axis)


def file_name(page):
    """Return the field of the name of files: the only one on its tab that takes any text."""
    return page.locator("input.mantine-TextInput-input:visible")


def enter(field, text):
    field.fill(text)
    field.press("Enter")


def eventually(condition, seconds=120.0):
    """Wait until a condition holds; return whether it does."""
    end = time.monotonic() + seconds
    while not (holds := condition()) and time.monotonic() < end:
        time.sleep(0.05)
    return holds


def picture(page):
    """Return the scene as it is drawn, without what lies above it."""
    box = page.locator("canvas[data-engine]").bounding_box()
    below = {"x": box["x"], "y": box["y"] + 160, "width": box["width"], "height": box["height"] - 160}
    return np.asarray(Image.open(io.BytesIO(page.screenshot(clip=below))).convert("RGB"), dtype=np.int16)


def is_red(pixels):
    return (pixels[..., 0] - pixels[..., 1:].max(axis=-1) > 60) & (pixels[..., 0] > 150)


def test_the_page_has_a_canvas_and_names_the_corridor_and_asks_no_other_server(page):
    assert page.locator("canvas[data-engine]").count() == 1
    assert page.get_by_role("tab", name="Corridor").count() == 1
    shows(page, "corridor margin")
    assert page.foreign == []


def test_a_waypoint_that_is_typed_moves_the_curve_and_its_cost(page, studio):
    before, drawn = cost(page), picture(page)
    enter(coordinate(page, 1, 1), "2")
    assert eventually(lambda: studio.request.waypoints[1] == (8.0, 2.0, 1.0))
    assert studio.wait(60.0)
    same = minsnap.plan(studio.request.waypoints, total_time=12.0, corridor=0.3)
    assert np.array_equal(studio.trajectory.control_points, same.control_points)
    shows(page, f"{same.cost():.6g}")
    assert cost(page) != before
    assert eventually(lambda: (np.abs(picture(page) - drawn).max(axis=-1) > 40).sum() > 300)


@pytest.mark.parametrize(
    ("text", "read"),
    [("12,5", 12.5), ("-0,25", -0.25), (" 3.5 ", 3.5), ("\u22122.5", -2.5), ("1.234,5", 8.0), ("1e1", 8.0)],
)
def test_a_number_that_is_put_in_as_a_whole_is_read_or_refused(page, studio, text, read):
    field = coordinate(page, 1, 0)
    assert eventually(lambda: field.input_value() == "8")
    field.press("Control+a")
    page.keyboard.insert_text(text)
    assert eventually(lambda: field.input_value() == f"{read:g}" and studio.request.waypoints[1][0] == read)


def test_the_space_bar_presses_a_button_that_the_keyboard_has_reached(page, studio):
    """It made the vehicle fly instead."""
    page.get_by_role("textbox", name="Waypoint", exact=True).focus()
    page.keyboard.press("Tab")
    page.keyboard.press("Space")
    assert eventually(lambda: len(studio.request.waypoints) == len(EXAMPLE.waypoints) + 1)
    assert not studio._player._box.value


def drag(page, start, end):
    """Press at a place of the page [pixels], move to another in steps, and let go."""
    page.mouse.move(*start)
    page.mouse.down()
    for share in np.linspace(0.2, 1.0, 5):
        page.mouse.move(*(np.array(start) + share * np.subtract(end, start)))
    page.mouse.up()


def lit(page, place):
    """Return whether the handle at a place of the page is drawn yellow, as it is below the pointer."""
    area = {"x": place[0] - 3.0, "y": place[1] - 3.0, "width": 6.0, "height": 6.0}
    pixels = np.asarray(Image.open(io.BytesIO(page.screenshot(clip=area))).convert("RGB"), dtype=np.int16)
    return (pixels[..., :2].min(axis=-1) - pixels[..., 2] > 60).any()


def test_a_waypoint_is_dragged_along_an_arrow(page, studio):
    """It is pressed when it is lit, so below the pointer: a drag that begins beside it turns the camera."""
    camera = next(iter(studio._server.get_clients().values())).camera

    def places():
        """Return where the arrow is taken and where it is let go: the camera may still move."""
        return [on_screen(page, camera, np.add(EXAMPLE.waypoints[3], [0.0, 0.0, up])) for up in (0.4, 1.4)]

    def pointed_at():
        page.mouse.move(*places()[0])
        return eventually(lambda: lit(page, places()[0]), 20.0)

    assert eventually(pointed_at)
    drag(page, *places())
    assert eventually(lambda: abs(studio.request.waypoints[3][2] - 2.0) < 0.3)
    assert studio.request.waypoints[3][:2] == EXAMPLE.waypoints[3][:2]
    assert studio.request.waypoints[:3] == EXAMPLE.waypoints[:3]
    assert eventually(lambda: page.get_by_text(f"{studio.trajectory.cost():.6g}").count())  # the drag may go on
    page.get_by_text("Undo").click()
    assert eventually(lambda: studio.request == EXAMPLE)


def test_what_cannot_be_done_is_told_beside_its_leg_and_undone(page, studio):
    studio.edit(lambda request: replace(request, total_time=None, durations=(4.0, 2.0, 4.0, 2.0)))
    assert studio.wait(60.0)
    good, drawn = studio.trajectory, picture(page)
    page.get_by_role("tab", name="Time").click()
    page.get_by_label("Continuous derivatives").click()
    page.get_by_role("option", name="6", exact=True).click()
    assert eventually(lambda: studio.request.continuity == 6)
    with pytest.raises(minsnap.InfeasibleError) as refused:
        minsnap.plan(**studio.request.request().arguments())
    sentence = str(refused.value)
    shows(page, sentence[1:])
    assert studio.trajectory is good
    assert eventually(lambda: is_red(picture(page)).sum() > is_red(drawn).sum() + 200)
    page.get_by_role("tab", name="Corridor").click()
    assert eventually(lambda: page.get_by_text(sentence[1:]).count() == 2)
    page.get_by_text("Undo").click()
    shows(page, "certified at every instant")
    assert studio.request.continuity is None
    page.get_by_text("Undo").click()
    assert eventually(lambda: studio.request == EXAMPLE)
    page.get_by_text("Redo").click()
    assert eventually(lambda: studio.request.durations == (4.0, 2.0, 4.0, 2.0))


def test_the_saved_setpoints_are_byte_by_byte_those_of_the_library(page, studio, tmp_path):
    page.get_by_role("tab", name="Files").click()
    enter(file_name(page), "from the page")
    page.get_by_text("Save in the working folder").click()
    saved = studio.folder / "from the page.csv"
    assert eventually(saved.exists)
    minsnap.write_csv(minsnap.plan(EXAMPLE.waypoints, total_time=12.0, corridor=0.3), tmp_path / "same.csv")
    assert saved.read_bytes() == (tmp_path / "same.csv").read_bytes()
    with page.expect_download() as download:
        page.get_by_text("Download", exact=True).click()
    assert Path(download.value.path()).read_bytes() == saved.read_bytes()


@pytest.mark.parametrize("name", ["../up", "/tmp/absolute", "{7*6}<img src=x onerror=alert(1)>"])
def test_names_that_lead_out_are_refused_and_nothing_typed_is_evaluated(page, studio, name):
    there = sorted(studio.folder.parent.rglob("*"))
    page.get_by_role("tab", name="Files").click()
    enter(file_name(page), name)
    page.get_by_text("Save in the working folder").click()
    shows(page, f"'{name}' is no name of a file")
    assert page.locator("img[src='x']").count() == 0
    assert sorted(studio.folder.parent.rglob("*")) == there


def test_a_file_is_opened_through_the_dialog(page, studio):
    content = b"x,y,z,duration\n0,0,1,\n5,0,1,5\n5,5,2,4\n"
    page.get_by_role("tab", name="Files").click()
    with page.expect_file_chooser() as chooser:
        page.get_by_text("Open a scene").click()
    chooser.value.set_files({"name": "course.csv", "mimeType": "text/csv", "buffer": content})
    assert eventually(lambda: studio.request.durations == (5.0, 4.0))
    assert studio.wait(60.0)
    page.get_by_role("tab", name="Route").click()
    shows(page, "9.000 s")


def test_the_plan_is_copied_by_one_click(page, studio):
    """A dialog had another button to copy."""
    page.context.grant_permissions(["clipboard-read", "clipboard-write"])
    page.get_by_role("tab", name="Files").click()
    page.get_by_role("button", name="Copy as Python").click()
    page.get_by_text("copied", exact=True).wait_for(timeout=PATIENCE)
    assert page.evaluate("navigator.clipboard.readText()") == as_python(studio.request)
    page.get_by_role("button", name="Close").click()


def test_a_page_without_a_file_begins_with_examples_and_is_darkened(browser, tmp_path):
    begun = Studio(EXAMPLE, str(tmp_path), port=0, welcome=True)
    page = open_page(browser, begun.url, width=390, height=844)
    for name, scene in {name: example() for name, example in EXAMPLES.items()}.items():
        page.get_by_role("button", name=name).click()
        assert eventually(lambda wanted=scene: begun.request == wanted)
    background = "getComputedStyle(document.querySelector('canvas').closest('[style*=background]')).backgroundColor"
    before = page.evaluate(background)
    page.get_by_role("button", name="Dark").click()
    assert eventually(lambda: page.evaluate(background) != before)
    page.close()
    begun.close()


def test_the_vehicle_flies_and_the_simulated_flight_is_told(page, studio):
    page.get_by_role("tab", name="Vehicle").click()
    page.get_by_text("Fly in simulation").click()
    shows(page, "root mean square error")
    studio.seek(6.0)
    assert studio.now == 6.0


def test_two_browsers_see_the_same_scene_and_one_may_close(page, studio, browser):
    other = open_page(browser, studio.url, width=800, height=420)
    enter(coordinate(other, 2, 2), "2.5")
    assert eventually(lambda: coordinate(page, 2, 2).input_value() == "2.5")
    other.close()
    enter(coordinate(page, 2, 2), "1.5")
    assert eventually(lambda: studio.request.waypoints[2] == (8.0, 4.0, 1.5))
    assert studio.wait(60.0)
    shows(page, f"{studio.trajectory.cost():.6g}")


def test_a_flight_is_recorded_as_the_camera_sees_it(page, studio, monkeypatch):
    monkeypatch.setattr("minsnap.studio.browser_page.FILM", FilmSettings(most=3, widest=240))
    page.get_by_role("tab", name="Files").click()
    with page.expect_download() as download:
        page.get_by_text("Record the flight").click()
    with Image.open(download.value.path()) as film:
        assert (film.n_frames, film.width) == (3, 240)
        first = np.asarray(film.convert("RGB"), dtype=np.int16)
        film.seek(1)
        assert np.abs(np.asarray(film.convert("RGB"), dtype=np.int16) - first).max() > 40
