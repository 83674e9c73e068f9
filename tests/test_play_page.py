"""The page that plans in the browser, in Chromium: the plans of the native core to the bit, dragged, and copied."""

import functools
import gzip
import http.server
import importlib.util
import io
import json
import shutil
import subprocess
import sys
import threading
from pathlib import Path

import numpy as np
import pytest
from page_browser import PATIENCE, chromium, is_foreign

import minsnap

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "play"
FILES = ("index.html", "page.css", "page.js", "minsnap.js", "minsnap.wasm")

IN_NODE = """
import { load } from "minsnap";
const minsnap = await load();
const waypoints = [[0, 0, 1], [8, 0, 1], [8, 4, 2]];
const plan = minsnap.plan({ waypoints, limits: { speed: 3, acceleration: 5, jerk: 30 }, corridor: 0.3 });
const durations = [...minsnap.curve().durations], points = [...minsnap.curve().points];
console.log(JSON.stringify({ ...plan, durations, points, version: minsnap.version }));
"""

SPEC = importlib.util.spec_from_file_location("web_core", ROOT / "release" / "web_core.py")
web_core = importlib.util.module_from_spec(SPEC)
sys.path.insert(0, str(ROOT / "release"))
SPEC.loader.exec_module(web_core)

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not web_core.is_current(), reason="the core of the page is not compiled: make page"),
]


class Quiet(http.server.SimpleHTTPRequestHandler):
    """Serves files and says nothing."""

    def log_message(self, *arguments):
        pass


@pytest.fixture(scope="module")
def url():
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Quiet, directory=str(PAGE)))
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    yield f"http://127.0.0.1:{server.server_port}/"
    server.shutdown()
    server.server_close()
    thread.join()


@pytest.fixture(scope="module")
def browser():
    with chromium() as running:
        yield running


@pytest.fixture
def page(browser, url):
    page = browser.new_page(viewport={"width": 1200, "height": 900})
    page.set_default_timeout(PATIENCE)
    page.foreign, page.wrong = [], []
    page.on("request", lambda request: page.foreign.append(request.url) if is_foreign(request.url, url) else None)
    page.on("pageerror", lambda error: page.wrong.append(str(error)))
    page.goto(url)
    certified(page)
    yield page
    assert not page.foreign and not page.wrong
    page.close()


def certified(page):
    page.get_by_text("certified at every instant").wait_for()


def in_page(page):
    """Durations and control points of the page's plan."""
    found = page.evaluate(
        "(() => { const c = window.minsnap.core.curve(); return [Array.from(c.durations), Array.from(c.points)]; })()"
    )
    return np.array(found[0]), np.array(found[1]).reshape(-1, 8, 3)


def from_python(page):
    """The plan of the text that the page copies, by this library."""
    text = page.evaluate("window.minsnap.python()")
    names = {}
    exec(text, names)
    return names["trajectory"]


def same(page):
    durations, points = in_page(page)
    own = from_python(page)
    return np.array_equal(durations, own.durations) and np.array_equal(points, own.control_points)


def test_plans_are_those_of_the_native_core_to_the_bit(page):
    assert same(page)
    bound = float(page.get_by_text("this one is at most").inner_text().split(" s")[0])
    assert 0.9 * from_python(page).duration < bound <= from_python(page).duration


def test_a_waypoint_is_dragged_added_and_removed(page):
    before = page.locator("#answer").inner_text()
    box = page.locator("[data-waypoint='2']").bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x - 60, y + 40, steps=4)
    page.mouse.up()
    page.wait_for_function("before => document.getElementById('answer').textContent !== before", arg=before)
    certified(page)
    moved = page.evaluate("window.minsnap.question.waypoints[2]")
    assert moved[0] < 8.0 and moved[1] < 4.0 and same(page)
    page.locator("#map").click(position={"x": 20, "y": 20})
    assert page.evaluate("window.minsnap.question.waypoints.length") == 6
    page.locator("[data-waypoint='5']").dblclick()
    assert page.evaluate("window.minsnap.question.waypoints.length") == 5 and same(page)


def test_limits_and_pieces_are_those_of_the_page(page):
    page.locator("#corridor").fill("0")
    page.locator("#max_thrust").fill("1.6")
    page.locator("#pieces").select_option("2")
    certified(page)
    text = page.evaluate("window.minsnap.python()")
    assert "corridor" not in text and "max_thrust=1.6" in text and "pieces=2" in text and same(page)
    page.locator("#total_time").fill("12")
    page.locator("#pieces").select_option("chosen")
    certified(page)
    assert same(page) and page.evaluate("window.minsnap.answer().duration") == pytest.approx(12.0)


def test_setpoints_are_read_by_this_library(page):
    read = np.loadtxt(io.StringIO(page.evaluate("window.minsnap.csv()")), delimiter=",", skiprows=1)
    own = from_python(page).sample(rate=20.0)
    assert read.shape[1] == 12 and np.array_equal(read[:, 0], np.arange(len(read)) / 20.0)
    assert np.array_equal(read[:, 1:4], own.position[: len(read)]) and len(read) == len(own.t)


@pytest.mark.parametrize(
    ("field", "value", "sentence"),
    [
        ("speed", "-1", "the limit speed is -1"),
        ("corridor", "-2", "half-width of leg 0"),
        ("max_thrust", "0.5", "no vehicle holds altitude"),
    ],
)
def test_what_cannot_be_planned_has_its_sentence(page, field, value, sentence):
    page.locator(f"#{field}").fill(value)
    page.get_by_text(sentence).wait_for()
    page.locator(f"#{field}").fill("2")
    certified(page)


def test_the_page_is_small():
    assert sum(len(gzip.compress((PAGE / name).read_bytes())) for name in FILES) < 1_500_000


@pytest.mark.skipif(shutil.which("node") is None, reason="there is no node")
def test_the_package_plans_in_node_as_python_does(tmp_path):
    package = json.loads((PAGE / "package.json").read_text(encoding="utf-8"))
    place = tmp_path / "node_modules" / package["name"]
    place.mkdir(parents=True)
    for name in ("package.json", *package["files"]):
        shutil.copy(PAGE / name, place)
    (tmp_path / "ask.mjs").write_text(IN_NODE, encoding="utf-8")
    done = subprocess.run(["node", "ask.mjs"], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    answer = json.loads(done.stdout)
    limits = minsnap.Limits(speed=3, acceleration=5, jerk=30)
    own = minsnap.plan([[0, 0, 1], [8, 0, 1], [8, 4, 2]], limits=limits, corridor=0.3)
    assert answer["certified"] and answer["version"] == minsnap.__version__
    assert answer["durations"] == own.durations.tolist() and answer["points"] == own.control_points.ravel().tolist()
