"""Who may connect to a page, and inputs in which nothing is evaluated."""

import asyncio
import socket
import urllib.request
from dataclasses import replace

import pytest

import minsnap
from minsnap.errors import InputError, LinkError
from minsnap.studio import Studio, show
from minsnap.studio.browser_page import is_own_page
from minsnap.studio.documents import example_scene
from minsnap.studio.page_inputs import copyable, sentence, table

HERE = "127.0.0.1"


def has_ipv6():
    """Whether the loopback of IPv6 can be listened on."""
    try:
        with socket.create_server(("::1", 0), family=socket.AF_INET6):
            return True
    except OSError:
        return False


@pytest.mark.parametrize(
    ("origin", "named", "host", "allowed"),
    [
        (None, "127.0.0.1:8123", HERE, True),
        ("http://127.0.0.1:8123", "127.0.0.1:8123", HERE, True),
        ("http://localhost:8123", "localhost:8123", HERE, True),
        ("http://elsewhere.example", "127.0.0.1:8123", HERE, False),
        ("http://rebound.example:8123", "rebound.example:8123", HERE, False),
        ("http://127.0.0.1:9999", "127.0.0.1:8123", HERE, False),
        ("null", "127.0.0.1:8123", HERE, False),
        ("http://lab.example:8123", "lab.example:8123", "0.0.0.0", True),
        ("http://other.example", "lab.example:8123", "0.0.0.0", False),
    ],
)
def test_only_pages_of_the_server_itself_may_connect(origin, named, host, allowed):
    assert is_own_page(origin, named, host) is allowed


@pytest.fixture
def studio(tmp_path):
    pytest.importorskip("viser")
    page = Studio(example_scene(), str(tmp_path), port=0)
    yield page
    page.close()


def test_another_page_is_turned_away_and_a_program_is_not(studio):
    websockets = pytest.importorskip("websockets")
    import viser

    async def first_message(origin):
        how = {"subprotocols": [f"viser-v{viser.__version__}"], "max_size": None, "origin": origin}
        async with websockets.connect(studio.url.replace("http", "ws"), **how) as socket:
            return await asyncio.wait_for(socket.recv(), 30.0)

    assert asyncio.run(first_message(None))
    assert asyncio.run(first_message(studio.url))
    with pytest.raises(websockets.exceptions.ConnectionClosedError, match="1008"):
        asyncio.run(first_message("http://elsewhere.example"))


@pytest.mark.skipif(not has_ipv6(), reason="this machine has no IPv6")
def test_the_address_of_ipv6_can_be_opened(tmp_path):
    pytest.importorskip("viser")
    page = Studio(example_scene(), str(tmp_path), host="::1", port=0)
    try:
        with urllib.request.urlopen(page.url, timeout=30.0) as answer:
            assert page.url.startswith("http://[::1]:") and answer.status == 200
    finally:
        page.close()


def test_a_refused_scene_says_why(studio):
    """The end of the task that opened the file took the sentence away."""
    studio.attempt(lambda: studio.edit(lambda request: replace(request, waypoints=request.waypoints[:1])))
    assert "at least 2 waypoints, not 1" in studio._status._message.content and studio._status._message.visible
    studio.edit(lambda request: replace(request, total_time=11.0))
    assert not studio._status._message.visible


def test_no_tunnel_to_the_outside_can_be_asked_for(studio):
    assert studio._server.request_share_url() is None


def test_a_port_that_is_taken_is_refused(studio, tmp_path):
    port = int(studio.url.rsplit(":", 1)[1])
    with pytest.raises(LinkError, match=f"port {port}"):
        Studio(example_scene(), str(tmp_path), port=port)


def test_show_shows_a_plan_as_it_is_until_it_is_edited(tmp_path, capsys):
    pytest.importorskip("viser")
    curve = minsnap.plan([(0, 0, 1), (4, 0, 1), (4, 3, 2)], durations=[3.0, 3.0], start={"velocity": (1, 0, 0)})
    page = show(curve, corridor=0.5, folder=tmp_path, browser=False, block=False)
    try:
        assert page.url in capsys.readouterr().out
        assert page.trajectory is curve and page.request.corridor == (0.5, 0.5)
        page.edit(lambda request: type(request)(request.waypoints, total_time=7.0, corridor=(0.4, 0.4)))
        assert page.wait(60.0)
        same = minsnap.plan([(0, 0, 1), (4, 0, 1), (4, 3, 2)], total_time=7.0, corridor=0.4)
        assert (page.trajectory.control_points == same.control_points).all()
    finally:
        page.close()


def test_what_cannot_be_shown_is_refused(tmp_path):
    plane = minsnap.plan([(0, 0), (4, 0)], durations=[3.0])
    for curve, how in ((minsnap.circle(), {}), (plane, {})):
        with pytest.raises(InputError):
            show(curve, folder=tmp_path, browser=False, block=False, **how)
    space = minsnap.plan([(0, 0, 1), (4, 0, 1)], durations=[3.0])
    with pytest.raises(InputError, match="HalfSpaces"):
        show(space, corridor=minsnap.HalfSpaces((0, 0, 1), 3.0), folder=tmp_path, browser=False, block=False)


@pytest.mark.parametrize("write", [sentence, copyable, lambda text: table([(text, text)])])
def test_text_is_written_as_text(write):
    html = write("<img src=x onerror=alert(1)> & {7 * 6}")
    assert "<img" not in html and "&lt;img" in html
