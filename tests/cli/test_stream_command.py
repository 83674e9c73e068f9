"""Streaming and relaying as processes, against a stand-in that speaks MAVLink."""

import json
import math
import os
import pty
import signal
import subprocess
import sys
import time

import pytest
from flying import excursion, in_ned
from standin import OFFBOARD, POSCTL, PointMass, StandIn, mavutil

from minsnap import write_csv
from minsnap.cli.flight_commands import EnterKey

pytestmark = pytest.mark.slow
PATH = excursion(1.0, reach=0.2)
START = in_ned(PATH.position[0])
COMMAND = [sys.executable, "-m", "minsnap"]


@pytest.fixture
def vehicle():
    with StandIn(body=PointMass(START)) as standin:
        yield standin


@pytest.fixture
def path(tmp_path):
    write_csv(PATH, tmp_path / "path.csv")
    return tmp_path / "path.csv"


def link(vehicle):
    return f"udpout:127.0.0.1:{vehicle.port}"


def started(*arguments, stdin=subprocess.DEVNULL):
    command = [*COMMAND, *map(str, arguments)]
    how = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    return subprocess.Popen(
        command, stdin=stdin, preexec_fn=lambda: signal.signal(signal.SIGHUP, signal.SIG_DFL), **how
    )


def test_a_whole_flight_by_itself(process, path, tmp_path):
    with StandIn(body=PointMass((0.0, 0.0, -1.0)), armed=False) as vehicle:
        log = tmp_path / "log.csv"
        done = process("stream", path, "--connect", link(vehicle), "--trigger", "now", "--arm", "--land", "--log", log)
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("completed\n21 setpoints of the flight")
    assert "at 20.0" in done.stdout or "at 19.9" in done.stdout
    for event in ("system 1 answers (px4", "streaming the start at 20 Hz", "flying", "holding the end", "done"):
        assert event in done.stderr
    assert log.read_text().count("\n") > 100


def test_enter_counts_once_it_is_asked_for(monkeypatch):
    """One that was typed before the prompt, such as a second one on the command line, used to let the flight go."""
    ours, theirs = pty.openpty()
    with open(theirs) as terminal:
        monkeypatch.setattr(sys, "stdin", terminal)
        key, asked = EnterKey(), []
        for flights in (1, 2):
            os.write(ours, b"\n\nabc\n")
            key.begin(asked.append)
            assert not any(key() for _ in range(10)) and len(asked) == flights
            os.write(ours, b"\n")
            assert key()
    os.close(ours)


def test_enter_lets_go_and_a_bar_is_drawn_on_a_terminal(vehicle, path):
    ours, theirs = pty.openpty()
    command = [*COMMAND, "stream", str(path), "--connect", link(vehicle)]
    with subprocess.Popen(command, stdin=theirs, stdout=subprocess.PIPE, stderr=theirs) as running:
        vehicle.enter()
        vehicle.until(lambda v: len(v.setpoints) > 60)
        assert all(m.vx == m.vy == 0 for _, m in vehicle.setpoints)
        os.write(ours, b"\n")
        vehicle.until(lambda v: any(m.vx or m.vy for _, m in v.setpoints))
        vehicle.until(lambda v: len(v.setpoints) > 95)
        vehicle.enter(POSCTL)
        assert running.wait(60) == 0
        running.stdout.read()
    drawn = os.read(ours, 65536).decode()
    assert "press Enter to fly" in drawn and "m from its setpoint" in drawn and "[####" in drawn
    os.close(ours)
    os.close(theirs)


@pytest.mark.parametrize("sent", [[signal.SIGINT], [signal.SIGHUP] * 2])
def test_ctrl_c_or_a_closed_terminal_holds_until_the_mode_is_left(vehicle, path, sent):
    with started("stream", path, "--connect", link(vehicle), "--trigger", "mode") as running:
        vehicle.until(lambda v: len(v.setpoints) > 42)
        vehicle.enter(OFFBOARD)
        vehicle.until(lambda v: any(m.vx or m.vy for _, m in v.setpoints))
        for number in sent:
            running.send_signal(number)
            time.sleep(0.5)
        assert running.poll() is None and not vehicle.failsafes
        vehicle.enter(POSCTL)
        said, _ = running.communicate(timeout=60)
    assert running.returncode == 1 and said.startswith("not completed: stopped by the user")


def test_orders_are_taken_while_it_flies_and_the_end_of_the_input_finishes(tmp_path):
    course = tmp_path / "course.yaml"
    course.write_text("waypoints: [[0, 0, 1.5], [2, 0, 1.5], [4, 1, 1.5]]\nlimits: {speed: 1.5, acceleration: 2}\n")
    with StandIn(body=PointMass((0.0, 0.0, -1.5))) as vehicle:
        options = ("--connect", link(vehicle), "--no-preflight", "--trigger", "mode", "--listen")
        with started("stream", course, *options, stdin=subprocess.PIPE) as running:
            vehicle.until(lambda v: len(v.setpoints) > 42)
            vehicle.enter(OFFBOARD)
            vehicle.until(lambda v: any(m.vx or m.vy for _, m in v.setpoints))
            running.stdin.write('{"goal": [1.5, 1, 1.5]}\n')
            running.stdin.flush()
            answer = json.loads(running.stdout.readline())
            running.stdin.close()
            running.stdin = None
            vehicle.until(lambda v: all(m.vx == 0.0 and abs(m.x - 1.0) < 1e-6 for _, m in v.setpoints[-10:]))
            vehicle.enter(POSCTL)
            _, said = running.communicate(timeout=60)
    assert answer["ok"] and answer["end"] == pytest.approx([1.5, 1.0, 1.5]), said
    assert running.returncode == 0 and "holding the end" in said and "\ncompleted" in said


def told(running, line):
    """Tell a process a line and return its answer."""
    running.stdin.write(line)
    running.stdin.flush()
    return json.loads(running.stdout.readline())


def test_what_a_sensor_tells_is_flown_through_and_its_end_stops_the_flight(tmp_path):
    course = tmp_path / "way.yaml"
    course.write_text("waypoints: [[0, 0, 1.5], [30, 0, 1.5]]\nlimits: {speed: 1.5, acceleration: 2, jerk: 15}\n")
    angle = [2 * math.pi * k / 240 for k in range(240)]
    rays = [[6 * math.cos(each), 6 * math.sin(each)] for each in angle]
    line = json.dumps({"position": [0, 0], "rays": rays, "points": [[3.0, 0.0]]}) + "\n"
    with StandIn(body=PointMass((0.0, 0.0, -1.5))) as vehicle:
        options = ("--connect", link(vehicle), "--no-preflight", "--trigger", "mode", "--explore", "--plane")
        with started("stream", course, *options, "--sensing", 6, "--lost", 60, stdin=subprocess.PIPE) as running:
            vehicle.until(lambda v: len(v.setpoints) > 42)
            answers = [told(running, line)]
            vehicle.enter(OFFBOARD)
            while "splice" not in answers[-1] and len(answers) < 100:
                answers.append(told(running, line))
                time.sleep(0.1)
            vehicle.until(lambda v: any(m.vx or m.vy for _, m in v.setpoints))
            running.stdin.close()
            running.stdin = None
            vehicle.until(lambda v: len({(m.x, m.y) for _, m in v.setpoints[-10:]}) == 1)
            vehicle.enter(POSCTL)
            _, said = running.communicate(timeout=60)
    places = [(m.y, m.x) for _, m in vehicle.setpoints]
    assert running.returncode == 0 and "holding the end" in said, said
    assert answers[0]["ok"] and not answers[0]["flying"] and answers[-1]["certified"] and not answers[-1]["goal"]
    assert answers[-1]["end"][0] > 3.0 and min(math.dist(place, (3.0, 0.0)) for place in places) > 0.3
    assert 0.1 < places[-1][0] < answers[-1]["end"][0] + 1e-6


def test_what_explores_is_refused_in_a_sentence(call, path, tmp_path, vehicle):
    course = tmp_path / "way.yaml"
    course.write_text("waypoints: [[0, 0, 1.5], [3, 0, 1.5], [3, 3, 1.5]]\n")
    plain = ("--connect", link(vehicle), "--trigger", "mode")
    for arguments, words in (
        ((path, "--explore"), "is no course: --explore plans from what is flown"),
        ((course, "--explore"), "two waypoints, its start and its goal, and limits alone"),
        ((course, "--explore", "--origin", "current"), "in the axes of the course"),
        ((course, "--explore", "--listen"), "takes orders, or what a sensor tells"),
        ((course, "--explore", "--room", "0,0,0,1,1,1"), "--room is of orders in flight"),
        ((course, "--listen", "--lost", "2"), "--lost is of what a sensor tells in flight"),
        ((path, "--plane"), "--plane is of what a sensor tells in flight: give --explore with it"),
    ):
        refused = call("stream", *arguments, *plain)
        assert refused.returncode == 2 and words in refused.stderr, refused.stderr
    enter = call("stream", course, "--explore", "--connect", link(vehicle))
    assert enter.returncode == 2 and "--explore reads lines from the standard input" in enter.stderr
    assert vehicle.setpoints == []


def test_refusals_have_their_status_and_sentence(call, path, vehicle):
    vehicle.body.position = [3.0, 0.0, -1.5]
    far = call("stream", path, "--connect", link(vehicle))
    assert far.returncode == 1 and "3.00 m from the start, more than the 1 m allowed: bring it there" in far.stderr
    assert call("stream", path, "--connect", "nonsense").returncode == 2
    silent = call("stream", path, "--connect", "udpin:0", "--wait", "0.3")
    assert silent.returncode == 2 and "no heartbeat of a vehicle within 0.3 s on udpin:127.0.0.1:0" in silent.stderr
    wrong = call("stream", path, "--connect", link(vehicle), "--system", "9", "--wait", "1.5")
    assert wrong.returncode == 2 and "no heartbeat of system 9 within 1.5 s" in wrong.stderr
    assert "heard only system 1" in wrong.stderr
    slow = call("stream", path, "--connect", "udpin:0", "--rate", "1.5")
    assert slow.returncode == 2 and "1.5 Hz is too slow: PX4 needs at least 2 setpoints per second" in slow.stderr
    heard = call("stream", path, "--connect", "udpin:0", "--listen")
    assert heard.returncode == 2 and "is no course" in heard.stderr
    for option, value in (("--room", "0,0,0,1,1,1"), ("--port", "9")):
        alone = call("stream", path, "--connect", "udpin:0", option, value)
        assert alone.returncode == 2 and f"{option} is of orders in flight: give --listen with it" in alone.stderr
    odd = call("stream", path, "--connect", "udpin:0", "--trigger", "shout")
    assert odd.returncode == 2 and "choose enter, mode or now" in odd.stderr
    assert vehicle.setpoints == []


def test_an_inconsistent_file_is_not_flown(call, tmp_path, vehicle):
    bad = tmp_path / "bad.csv"
    write_csv(type(PATH)(PATH.t, PATH.position, -PATH.velocity), bad)
    done = call("stream", bad, "--connect", link(vehicle))
    assert done.returncode == 1 and "not fit to fly: x and vx disagree" in done.stderr
    assert vehicle.setpoints == []


def test_a_relayed_file_arrives(process, tmp_path):
    receiver = mavutil.mavlink_connection("udpin:127.0.0.1:0")
    poses = tmp_path / "poses.csv"
    poses.write_text("t,x,y,z,yaw\n" + "".join(f"{k / 50},{k / 50},0,1,0\n" for k in range(26)))
    port = receiver.port.getsockname()[1]
    done = process("relay", "--from", f"csv:{poses}", "--to", f"udpout:127.0.0.1:{port}", "--frame", "flu")
    assert done.returncode == 0, done.stderr
    kinds = set()
    while (message := receiver.recv_msg()) is not None:
        kinds.add(message.get_type())
    receiver.close()
    assert kinds == {"HEARTBEAT", "VISION_POSITION_ESTIMATE"}
    assert "poses at" in done.stdout and "Hz" in done.stdout
