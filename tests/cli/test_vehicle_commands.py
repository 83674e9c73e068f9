import json
import struct
from dataclasses import replace

import numpy as np
import pytest
from flown_logs import Measured, ulog_of

import minsnap
from minsnap.flight import CascadeController, simulate
from minsnap.flight.thesis import PUBLISHED_PARASITIC
from minsnap.vehicle import RPM, BodyDrag, Quadrotor


@pytest.mark.slow
def test_the_experiment_prints_the_table_and_draws_the_figure(call, tmp_path) -> None:
    done = call("experiment", "line", "--repeat", 1, "--compensate", "both", "--plot", "line.png")
    assert done.returncode == 0, done.stderr
    assert "tracking of 1 straight lines" in done.stdout and "with consistent" in done.stdout
    assert (tmp_path / "line.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.slow
def test_the_experiment_as_json_takes_every_option(call) -> None:
    done = call(
        *("experiment", "circle", "--repeat", 1, "--compensate", "on", "--model", "exact", "--smooth", "--json"),
        *("--controller", "lee", "--vehicle", "crazyflie", "--delay", 0.01, "--noise", 0.001, "--gust", 0.2),
        *("--wind", 0.5, 0, 0, "--seed", 3, "--rate", 50, "--pose-rate", 100),
    )
    assert done.returncode == 0, done.stderr
    (run,) = json.loads(done.stdout)["runs"]
    assert run["compensation"] == "exact" and 0 < run["whole"]["rmse_3d"] < 1.0


@pytest.mark.slow
def test_flights_of_an_experiment_can_be_compared_again(call, tmp_path) -> None:
    done = call("experiment", "line", "--repeat", 2, "--smooth", "--model", "exact", "-o", "flown", "--json")
    assert done.returncode == 0, done.stderr
    assert sorted(file.name for file in (tmp_path / "flown").iterdir()) == [
        "line_reference.csv",
        "line_with_exact.csv",
        "line_without_compensation.csv",
    ]
    again = call("compare", "flown/line_reference.csv", "flown/line_with_exact.csv", "--json")
    whole = json.loads(again.stdout)["line_with_exact.csv"]
    delays = [run["whole"]["delay"] for run in json.loads(done.stdout)["runs"]]
    assert whole["delay"] == pytest.approx(delays[1], abs=1e-3)


@pytest.mark.slow
def test_the_experiment_flies_a_described_vehicle(call, tmp_path) -> None:
    Quadrotor.dji_f330().to_yaml(tmp_path / "mine.yaml")
    done = call("experiment", "line", "--repeat", 1, "--compensate", "off", "--vehicle", "mine.yaml")
    assert done.returncode == 0 and "without" in done.stdout


@pytest.mark.slow
@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["star"], "no course is called 'star'"),
        (["line", "--compensate", "maybe"], "--compensate is 'maybe'"),
        (["line", "--controller", "pid"], "--controller is 'pid'"),
        (["line", "--model", "best"], "no model of compensation"),
        (["line", "--references", "all"], "references is 'all'"),
        (["line", "--vehicle", "none.yaml"], "none.yaml cannot be read"),
        (["line", "--plot", "line.txt"], "line.txt"),
        (["line", "--repeat", "0"], "repetitions"),
    ],
)
def test_bad_usage_of_the_experiment_is_one_sentence(call, arguments, says) -> None:
    done = call("experiment", *arguments)
    assert done.returncode == 2 and says in done.stderr and done.stderr.count("\n") == 1


def test_a_diverging_experiment_exits_with_1(call, tmp_path) -> None:
    weak = Quadrotor.dji_f330()
    weak.to_yaml(tmp_path / "weak.yaml")
    text = (tmp_path / "weak.yaml").read_text().replace("motor_time_constant: 0.04", "motor_time_constant: 0.6")
    (tmp_path / "weak.yaml").write_text(text)
    done = call("experiment", "circle", "--repeat", 2, "--controller", "lee", "--vehicle", "weak.yaml")
    assert done.returncode == 1 and "diverged at t = " in done.stderr


@pytest.fixture
def flights(tmp_path):
    path = minsnap.lemniscate()
    minsnap.write_csv(path, tmp_path / "plan.csv")
    late = minsnap.Samples(*[getattr(path.sample(20.0), name) for name in ("t", "position", "velocity")])
    minsnap.write_csv(minsnap.Samples(late.t + 0.25, late.position, late.velocity), tmp_path / "late.csv")
    return path


def test_compare_prints_a_row_a_flight(call, flights, tmp_path) -> None:
    done = call("compare", "plan.csv", "plan.csv", "late.csv", "--plot", "compare.svg")
    assert done.returncode == 0, done.stderr
    rows = done.stdout.splitlines()
    assert rows[1].split()[:4] == ["flight", "x", "y", "z"] and [row.split()[0] for row in rows[2:]] == [
        "plan.csv",
        "late.csv",
    ]
    assert float(rows[2].split()[4]) < 1e-3 < float(rows[3].split()[4])
    assert (tmp_path / "compare.svg").exists()


def test_compare_as_json_finds_the_delay(call, flights) -> None:
    found = json.loads(call("compare", "plan.csv", "late.csv", "--json").stdout)["late.csv"]
    assert found["delay"] == pytest.approx(0.25, abs=2e-3) and found["path_rmse"] < 1e-3
    aligned = json.loads(call("compare", "plan.csv", "late.csv", "--align", "--json").stdout)["late.csv"]
    assert aligned["offset"] == pytest.approx(-0.25, abs=2e-3) and aligned["rmse_3d"] < 1e-2


@pytest.fixture
def log(tmp_path, flights):
    """A PX4 log of the same flight: its clock began 5 s before, its axes are north, east, down."""
    t = np.arange(0, flights.duration, 0.02)
    east, north, up = flights(t).T
    rows = np.stack([north, east, -up], axis=1)
    fields = "vehicle_local_position:uint64_t timestamp;float x;float y;float z;"
    messages = [("B", bytes(40)), ("F", fields.encode()), ("A", struct.pack("<BH", 0, 0) + b"vehicle_local_position")]
    for stamp, row in zip(t, rows, strict=True):
        messages.append(("D", struct.pack("<HQ3f", 0, round((stamp + 5.0) * 1e6), *row)))
    raw = b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 0)
    raw += b"".join(struct.pack("<HB", len(payload), ord(kind)) + payload for kind, payload in messages)
    (tmp_path / "flight.ulg").write_bytes(raw)
    return raw


def test_compare_takes_logs_and_says_what_is_damaged(call, log, tmp_path) -> None:
    found = json.loads(call("compare", "plan.csv", "flight.ulg", "--align", "--json").stdout)["flight.ulg"]
    assert found["rmse_3d"] < 2e-3
    (tmp_path / "cut.ulg").write_bytes(log[:-5])
    done = call("compare", "plan.csv", "cut.ulg")
    assert done.returncode == 2 and "holds no setpoints, so when the flight began is not known" in done.stderr
    done = call("compare", "plan.csv", "cut.ulg", "--align", "--json")
    assert done.returncode == 0 and "cut.ulg" in done.stderr and "could be read" in done.stderr
    done = call("compare", "flight.ulg", "plan.csv")
    assert done.returncode == 2 and "holds no setpoints" in done.stderr


def test_compare_reads_setpoints_in_their_own_axes(call, log, flights, tmp_path) -> None:
    minsnap.write_csv(flights, tmp_path / "ned.csv", frame="ned")
    done = call("compare", "ned.csv", "flight.ulg", "--align", "--frame", "ned", "--json")
    assert json.loads(done.stdout)["flight.ulg"]["rmse_3d"] < 2e-3
    assert call("compare", "ned.csv", "flight.ulg", "--frame", "up").returncode == 2


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["plan.csv", "none.csv"], "none.csv cannot be read"),
        (["plan.csv", "flight.txt"], "flight.txt is no flight by its ending"),
        (["plan.csv"], "Missing argument"),
    ],
)
def test_bad_usage_of_compare_is_one_sentence(call, flights, arguments, says) -> None:
    done = call("compare", *arguments)
    assert done.returncode == 2 and says in done.stderr and done.stderr.count("\n") == 1


def write(path, **columns: np.ndarray) -> None:
    np.savetxt(
        path, np.column_stack(list(columns.values())), delimiter=",", header=",".join(columns), comments="", fmt="%.17g"
    )


def test_fit_finds_a_thrust_coefficient(call, tmp_path) -> None:
    speed = np.linspace(2000, 6000, 20)
    write(tmp_path / "bench.csv", speed_rpm=speed, thrust=7.456e-8 * speed**2)
    done = call("fit", "bench.csv", "--form", "thrust", "--plot", "bench.png")
    assert done.returncode == 0, done.stderr
    assert "[N/RPM^2]" in done.stdout and "7.456e-08" in done.stdout and (tmp_path / "bench.png").exists()
    terms = json.loads(call("fit", "bench.csv", "--form", "thrust", "--json").stdout)["terms"]
    assert terms[0]["value"] == pytest.approx(7.456e-8 / RPM**2, rel=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("form", ["parasitic", "reduced", "linear", "consistent"])
def test_fit_finds_drag_surfaces(call, tmp_path, form) -> None:
    pitch, speed = (axis.ravel() for axis in np.meshgrid(np.linspace(-20, 20, 9), np.linspace(7, 28, 9)))
    write(
        tmp_path / "tunnel.csv",
        pitch_deg=pitch,
        velocity=speed,
        drag=PUBLISHED_PARASITIC(pitch_deg=pitch, velocity=speed),
    )
    done = call("fit", "tunnel.csv", "--form", form, "--plot", "tunnel.png")
    assert done.returncode == 0, done.stderr
    assert "81 points" in done.stdout and "velocity from 7 to 28" in done.stdout and (tmp_path / "tunnel.png").exists()


def test_fit_says_what_is_missing(call, tmp_path) -> None:
    write(tmp_path / "bench.csv", speed=np.arange(3.0), thrust=np.arange(3.0))
    done = call("fit", "bench.csv", "--form", "thrust")
    assert done.returncode == 2 and "no column speed_rpm" in done.stderr
    done = call("fit", "bench.csv", "--form", "lift")
    assert done.returncode == 2 and "no form is called 'lift'" in done.stderr


@pytest.mark.slow
def test_fit_to_a_flight_writes_a_vehicle_and_a_figure(call, tmp_path):
    vehicle = replace(Quadrotor.px4_sih(), drag=BodyDrag((0.8, 0.8, 0.8)))
    path = minsnap.plan([(0, 0, 2), (6, 0, 2), (6, 4, 3), (0, 4, 1), (0, 0, 2)], total_time=12.0, corridor=0.5)
    (tmp_path / "flight.ulg").write_bytes(ulog_of(Measured(vehicle, simulate(vehicle, CascadeController(), path))))
    done = call("fit", "flight.ulg", "-o", "mine.yaml", "--plot", "fit.png", "--mass", 2)
    assert done.returncode == 0, done.stderr
    assert "drag along x           0." in done.stdout and "note: wind is not told" in done.stdout
    assert (tmp_path / "fit.png").read_bytes().startswith(b"\x89PNG")
    mine = Quadrotor.from_yaml(tmp_path / "mine.yaml")
    assert mine.mass == 2.0 and mine.drag.linear == pytest.approx([1.6] * 3, abs=0.05)
    told = json.loads(call("fit", "flight.ulg", "--json").stdout)
    assert told["drag per mass"]["x"]["linear"]["value"] == pytest.approx(0.8, abs=0.02)
    again = call("fit", "flight.ulg", "--base", "mine.yaml", "-o", "other.yaml")
    assert again.returncode == 0 and Quadrotor.from_yaml(tmp_path / "other.yaml").mass == 2.0


def test_fit_refuses_what_has_no_effect(call, tmp_path):
    (tmp_path / "a.csv").write_text("speed_rpm,thrust\n1,2\n")
    done = call("fit", "a.csv", "--form", "thrust", "--mass", 1)
    assert done.returncode == 2 and "are for logs of flights" in done.stderr
    done = call("fit", "a.csv")
    assert done.returncode == 2 and "is no log of a flight" in done.stderr
