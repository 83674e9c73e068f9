"""What other packages raise leaves no public call as it is: one sentence of the library, and the right status."""

import importlib
import inspect
import subprocess
import sys

import numpy as np
import pytest

import minsnap
import minsnap.plot
import minsnap.vehicle
from minsnap import Gate, InputError, MinsnapError
from minsnap.corridors import gate_passages
from minsnap.errors import CorridorError, LinkError, WaypointError
from minsnap.files.formats.robot_messages import px4_setpoints

POINTS = np.array([(0.0, 0.0, 1.0), (3.0, 0.0, 1.0), (3.0, 2.0, 1.5)])
CURVE = minsnap.plan(POINTS, total_time=5.0)
PACKAGES = ["", "corridors", "fleet", "flight", "plot", "paths.routes", "paths.missions", "shows", "vehicle"]
APART = {"Relay", "open_source", "show", "stream"}
"""Calls that open a port or a page."""


class Followed:
    """What torch does of a tensor whose gradients are followed: no array, and its own words."""

    requires_grad = True

    def __array__(self, *_, **__):
        raise RuntimeError("Can't call numpy() on Tensor that requires grad. Use tensor.detach().numpy() instead.")

    def __len__(self):
        return 3

    def __iter__(self):
        return iter([Followed()] * 3)


def public_calls(package):
    """Return the functions and classes of a package, with the number of their arguments that are needed."""
    module = importlib.import_module(f"minsnap.{package}".rstrip("."))
    for name in module.__all__:
        called = getattr(module, name)
        if name not in APART and (inspect.isfunction(called) or inspect.isclass(called)):
            parameters = inspect.signature(called).parameters.values()
            kinds = inspect.Parameter.POSITIONAL_ONLY, inspect.Parameter.POSITIONAL_OR_KEYWORD
            yield name, called, max(1, sum(p.default is p.empty and p.kind in kinds for p in parameters))


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("package", PACKAGES)
def test_tensors_with_gradients_are_answered_in_one_sentence_by_every_public_call(package, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    found = []
    for name, called, count in public_calls(package):
        for arguments in ([Followed()] * count, [POINTS] + [Followed()] * max(count - 1, 1), [CURVE, Followed()]):
            try:
                called(*arguments)
            except (MinsnapError, TypeError, AttributeError) as refused:
                assert "\n" not in str(refused), name
            except Exception as error:  # that is what is looked for
                found.append((name, type(error).__name__, str(error)[:80]))
    assert not found, found


def test_tensors_with_gradients_are_answered_with_detach():
    for call in (
        lambda: minsnap.plan(Followed(), [1.0, 1.0]),
        lambda: minsnap.plan(POINTS, durations=Followed()),
        lambda: minsnap.plan_many([POINTS, [Followed()] * 3], durations=[1.0, 1.0]),
        lambda: minsnap.certify(CURVE, waypoints=Followed()),
        lambda: CURVE(Followed()),
        lambda: minsnap.Cylinder(Followed(), 1.0),
    ):
        with pytest.raises(InputError, match=r"a tensor with gradients .* \.detach\(\)"):
            call()


def test_a_corridor_without_a_hull_is_told_as_the_librarys_own(monkeypatch):
    from scipy.spatial import QhullError

    def fails(*_):
        raise QhullError("QH6013 input is less than\nmore")

    monkeypatch.setattr("minsnap.plot.geometry._body", fails)
    with pytest.raises(CorridorError, match="corridor of leg 0 cannot be drawn"):
        minsnap.plot.plot_path(CURVE, corridor=0.3)


def test_warnings_name_the_line_of_the_caller():
    asked = {
        "yaw": lambda: minsnap.plan(POINTS, [2.0, 2.0], yaw=90.0),
        "millimetres": lambda: minsnap.plan([(0, 0, 1), (8_000_000, 0, 1)], [40.0]),
        "limits": lambda: minsnap.Limits(max_thrust=20),
        "searched": lambda: minsnap.plan(POINTS, limits=minsnap.Limits(speed=3.0), yaw=90.0),
    }
    for name, call in asked.items():
        with pytest.warns(minsnap.errors.MagnitudeWarning) as told:
            call()
        assert {one.filename for one in told} == {__file__}, name


def test_waypoints_of_a_figure_are_numbers():
    for wrong in ([1, 2, "x"], 3, "abc", [Followed()] * 2, {"a": 1}):
        with pytest.raises(MinsnapError, match=r"waypoints (must be numbers|have shape)|gradients|Waypoints"):
            minsnap.plot.plot_path(CURVE, waypoints=wrong)


def test_what_a_figure_is_drawn_on_is_of_matplotlib():
    for drawn in (lambda: minsnap.plot.plot_path(CURVE, 3), lambda: minsnap.plot.plot_path(CURVE, ax="new")):
        with pytest.raises(InputError, match="ax must be Axes of matplotlib, not"):
            drawn()
    with pytest.raises(InputError, match="figure must be a Figure of matplotlib, not list"):
        minsnap.plot.plot_overview(CURVE, figure=[1])


def test_gates_are_found_among_waypoints_with_their_places():
    course = [(0, 0, 1), Gate((3, 0, 1), (1, 0, 0), 1.0), (6, 1, 1), Gate((8, 0, 1), (1, 0, 0), 1.0), (9, 0, 1)]
    curve = minsnap.plan(course, limits=minsnap.Limits(speed=3.0, acceleration=5.0))
    assert [passed.gate for passed in gate_passages(curve, course)] == [1, 3]
    assert [passed.gate for passed in gate_passages(curve, [course[1], course[3]])] == [0, 1]
    assert [passed.gate for passed in gate_passages(curve, {7: course[3]})] == [7]
    for wrong in (3, [course[1], "gate"], {1: (3, 0, 1)}, [None]):
        with pytest.raises(WaypointError, match="give"):
            gate_passages(curve, wrong)


def test_messages_of_px4_take_a_path():
    messages = px4_setpoints(CURVE)
    assert len(messages) == len(CURVE.sample(20.0)) and (messages == px4_setpoints(CURVE.sample(20.0))).all()
    with pytest.raises(InputError, match="samples or a path"):
        px4_setpoints(POINTS)


@pytest.mark.parametrize("kind", ["no dongle", "no driver", "the dongle is pulled"])
def test_a_crazyradio_that_is_not_there_is_one_sentence(kind, monkeypatch):
    crtp = pytest.importorskip("cflib.crtp")
    from minsnap.flight.crtp_link import RadioLink

    class Driver:
        def send_packet(self, packet):
            raise OSError("[Errno 19] No such device (it may have been disconnected)")

        def receive_packet(self, timeout):
            raise OSError("[Errno 19] No such device")

    def opened(uri, *_):
        if kind == "no dongle":
            raise Exception("Cannot find a Crazyradio Dongle")
        return None if kind == "no driver" else Driver()

    monkeypatch.setattr(crtp, "init_drivers", lambda **_: None)
    monkeypatch.setattr(crtp, "get_link_driver", opened)
    with pytest.raises(LinkError, match="plug in the Crazyradio") as told:
        link = RadioLink("radio://0/80/2M/E7E7E7E701")
        link.send(b"\xff")
    assert "\n" not in str(told.value)
    if kind == "the dongle is pulled":
        with pytest.raises(LinkError, match=r"cannot be reached: \[Errno 19\]"):
            link.receive(0.1)


def test_upload_without_a_dongle_is_status_2(tmp_path, capsys, monkeypatch):
    crtp = pytest.importorskip("cflib.crtp")
    from minsnap.cli import main
    from minsnap.files.convert import write_any

    def missing(*_):
        raise Exception("Cannot find a Crazyradio Dongle")

    monkeypatch.setattr(crtp, "init_drivers", lambda **_: None)
    monkeypatch.setattr(crtp, "get_link_driver", missing)
    write_any(CURVE, tmp_path / "a.traj")
    with pytest.raises(SystemExit) as left:
        main(["upload", str(tmp_path / "a.traj"), "--uri", "radio://0/80/2M/E7E7E7E701"])
    said = capsys.readouterr().err.strip().splitlines()
    assert left.value.code == 2 and "Cannot find a Crazyradio Dongle; plug in" in said[-1]
    assert not any("Traceback" in line for line in said)


def test_a_folder_that_is_missing_is_named(tmp_path):
    with pytest.raises(MinsnapError, match=r"there is no folder .*nowhere; make it first"):
        minsnap.write_csv(CURVE, tmp_path / "nowhere" / "a.csv")
    for name, said in (("nowhere", "there is no such file or folder"), (".", "is a folder, and no file of a path")):
        with pytest.raises(MinsnapError, match=said):
            importlib.import_module("minsnap.files.convert").read_any(tmp_path / name)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["corridors.gate_passages", "vehicle.Quadrotor", "flight.simulate", "batch.Spec"])
def test_a_package_is_there_as_soon_as_the_library_is(name):
    asked = [sys.executable, "-c", f"import minsnap; minsnap.{name}"]
    assert subprocess.run(asked, capture_output=True, check=False).returncode == 0
