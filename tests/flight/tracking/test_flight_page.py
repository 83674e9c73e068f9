"""The page of compared flights: laps and gates of a plan, and which flight of a log it is about."""

import numpy as np

import minsnap
from minsnap.files.plan_file import PlanFile
from minsnap.flight.tracking.comparison import compare
from minsnap.flight.tracking.log_comparison import ComparedFlight
from minsnap.flight.tracking.tracking_plot import gate_table, lap_instants, write_flight_page
from minsnap.trajectory.samples import Samples

GATE = minsnap.Gate((4, 0, 1), (1, 0, 0), 1.0, 1.0)
LAP = [(0, 0, 1), GATE, (6, 3, 1), (0, 3, 1)]
PATH = minsnap.plan([*LAP, *LAP, *LAP, LAP[0]], total_time=40.0)


def plan_file(**more):
    return PlanFile(PATH, gates={1: GATE}, **more)


def flown(shift, late=0.2):
    """A flight that is late, and moved aside by some metres."""
    wanted = PATH.sample(20.0)
    flight = Samples(wanted.t + late, wanted.position + np.array(shift))
    return ComparedFlight(compare(wanted, flight), wanted, flight)


def test_laps_begin_at_the_first_gate_or_stop():
    assert len(lap_instants(plan_file())) == 3
    assert np.allclose(PATH(lap_instants(plan_file()))[:, 0], 4.0, atol=1e-6)
    plain = PlanFile(PATH, waypoints=PATH(PATH.leg_breaks))
    assert len(lap_instants(plain)) == 4
    once = minsnap.plan([(0, 0, 1), (3, 0, 1)], total_time=3.0)
    assert len(lap_instants(PlanFile(once))) == 0


def test_the_page_says_how_late_and_how_far_from_its_edges_each_gate_was_passed(tmp_path):
    flights = {"near": flown((0.0, 0.1, 0.0)), "wide": flown((0.0, 0.9, 0.0))}
    table = gate_table(plan_file(), flights)
    assert table.count("+0.20") == 6
    assert 3 <= table.count("missed by") < 6, "the wide one each time"
    write_flight_page(flights, tmp_path / "page.html", plan=plan_file())
    page = (tmp_path / "page.html").read_text()
    assert "Laps" in page and "Gates" in page and "Legs" in page
    assert gate_table(PlanFile(PATH), flights) == ""


def test_a_table_of_a_crazyflie_is_compared_by_its_columns(call, tmp_path):
    minsnap.write_csv(PATH, "plan.csv")
    samples = PATH.sample(50.0)
    rows = [
        f"{1000.0 * t + 51234:.0f},{p[0]:.4f},{p[1] + 0.05:.4f},{p[2]:.4f}"
        for t, p in zip(samples.t, samples.position, strict=True)
    ]
    head = "timestamp,stateEstimate.x,stateEstimate.y,stateEstimate.z"
    (tmp_path / "cf.csv").write_text("\n".join([head, *rows]) + "\n")
    named = "t=timestamp:ms,x=stateEstimate.x,y=stateEstimate.y,z=stateEstimate.z"
    done = call("compare", "plan.csv", "cf.csv", "--columns", named, "--align")
    assert done.returncode == 0
    assert " 0.0500 " in done.stdout
    assert "no tables" not in done.stderr


def test_one_flight_of_a_log_is_chosen(call, tmp_path):
    minsnap.write_csv(PATH, "plan.csv")
    call("simulate", "plan.csv", "--log", "flown.ulg")
    assert call("compare", "plan.csv", "flown.ulg", "--flight", 1).returncode == 0
    other = call("compare", "plan.csv", "flown.ulg", "--flight", 2)
    assert other.returncode == 2
    assert "holds 1 of the file (#1 at" in other.stderr
