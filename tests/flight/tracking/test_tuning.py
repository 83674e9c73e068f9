"""Tuning over flights: each misses less, a worse one ends it, and the page shows them side by side."""

import re
from dataclasses import replace

import numpy as np
import pytest

import minsnap
from minsnap.errors import InputError
from minsnap.files.autopilot_logs import write_ulog
from minsnap.files.flight_log import FlightLog
from minsnap.flight import CascadeController, compare, fit_flight, simulate
from minsnap.flight.tracking.log_comparison import ComparedFlight
from minsnap.flight.tracking.simulated_flights import simulated_log
from minsnap.flight.tracking.tracking_plot import leg_instants, write_flight_page
from minsnap.flight.tracking.tuning import best_to_fly, learn_from, tune_in_flight
from minsnap.vehicle import Quadrotor

VEHICLE = Quadrotor.px4_sih()
CORNERS = [(0, 0, 2), (6, 0, 2), (6, 3, 2), (0, 3, 2), (0, 0, 2)]


@pytest.fixture(scope="module")
def plan():
    return minsnap.plan(CORNERS, corridor=0.2, total_time=14.0).sample(20.0)


class Pilot:
    """Flies in simulation and logs as PX4 does; from some flight on with the setpoints held back [s]."""

    def __init__(self, folder, late=99):
        self.folder, self.late, self.sent = folder, late, []

    def fly(self, sent, number):
        self.sent.append(sent)
        delay = 0.1 if number < self.late else 0.9
        flight = simulate(VEHICLE, CascadeController(), sent, setpoint_delay=delay, duration=sent.duration + 1.0)
        log = self.folder / f"{number}.ulg"
        write_ulog(simulated_log(VEHICLE, flight, sent, seed=number), log)
        return log


def test_a_page_of_flights_without_any_error_is_written(plan, tmp_path):
    still = replace(plan, position=np.ones((len(plan), 3)), velocity=None)
    exact = ComparedFlight(compare(still, still), still, still)
    write_flight_page({"one": exact, "other": exact}, tmp_path / "page.html")
    assert "<b>0.000 m</b> from the plan" in (tmp_path / "page.html").read_text()


@pytest.mark.slow
def test_each_flight_misses_the_plan_by_less_and_a_page_shows_it(plan, tmp_path):
    flown = tune_in_flight(plan, Pilot(tmp_path).fly, 3)
    missed = [each.missed for each in flown]
    assert missed[1] < 0.5 * missed[0] and missed[2] < 0.3 * missed[0]
    assert best_to_fly(flown) is flown[2].next
    named = {f"flight {k}": each.flown for k, each in enumerate(flown)}
    write_flight_page(named, tmp_path / "page.html", logs={f"flight {k}": each.log for k, each in enumerate(flown)})
    page = (tmp_path / "page.html").read_text()
    assert f"{missed[0]:.3f}" in page and f"{missed[2]:.3f} m (flight 2)" in page and page.count("<svg") == 2
    legs = re.search(r"<h2>Legs</h2><table>(.*?)</table>", page).group(1)
    assert legs.count("<tr>") == 5 and "–" not in legs
    drags = re.findall(r"<td>flight \d</td><td>([\d.]+) ± ", page)
    assert [float(drag) for drag in drags] == pytest.approx([1.0] * 3, abs=0.02)


def test_a_flight_from_where_the_vehicle_stood_teaches_the_same(plan, tmp_path):
    """Landed a metre off, the vehicle begins the next flight there; setpoints are learned where the plan lies."""
    late = replace(plan, position=np.column_stack([np.interp(plan.t - 0.3, plan.t, x) for x in plan.position.T]))
    late = replace(late, velocity=None, acceleration=None, yaw=None, yaw_rate=None)
    taught = []
    for number, offset in enumerate(([0.0, 0.0, 0.0], [1.1, -0.4, 0.0])):
        there = [replace(each, position=each.position + offset) for each in (plan, late)]
        write_ulog(FlightLog(*there, 0.0), tmp_path / f"{number}.ulg")
        taught.append(learn_from(plan, plan, tmp_path / f"{number}.ulg"))
    assert taught[1].missed == pytest.approx(taught[0].missed, abs=5e-3) and taught[0].missed > 0.1
    np.testing.assert_allclose(taught[1].next.position, taught[0].next.position, atol=0.02)
    assert "it was flown (1.10, -0.40, 0.00) m from where the file lies" in taught[1].flown.remarks()[0]


@pytest.mark.slow
def test_a_flight_that_misses_more_ends_it_and_the_best_is_kept(plan, tmp_path):
    pilot = Pilot(tmp_path, late=2)
    flown = tune_in_flight(plan, pilot.fly, 4)
    assert len(flown) == 2 and flown[1].missed > flown[0].missed
    assert best_to_fly(flown) is pilot.sent[0]
    with pytest.raises(InputError, match="fly at least once"):
        tune_in_flight(plan, pilot.fly, 0)


@pytest.mark.slow
def test_a_log_with_a_wrong_position_is_not_learned_from(plan, tmp_path):
    """Its delay was taken for 1.4 s, and all setpoints were corrected by it."""
    flight = simulate(VEHICLE, CascadeController(), plan, duration=plan.duration + 1.0)
    log = simulated_log(VEHICLE, flight, plan)
    position = log.flight.position.copy()
    position[len(position) // 2, 0] = 1e30
    write_ulog(replace(log, flight=replace(log.flight, position=position)), tmp_path / "1.ulg")
    with pytest.raises(
        InputError, match=r"1.ulg has the vehicle 1e.30 m from the plan at .* a position in it is wrong"
    ):
        learn_from(plan, plan, tmp_path / "1.ulg")
    position[:, 0] = log.flight.position[:, 0] + 1.2 * (log.flight.t > 6.0)
    reset = replace(log, flight=replace(log.flight, position=position))
    write_ulog(reset, tmp_path / "2.ulg")
    with pytest.raises(InputError, match=r"2.ulg: the logged position jumps by 1.2 m at 6.0\d s"):
        learn_from(plan, plan, tmp_path / "2.ulg")
    fit = fit_flight(reset)
    assert fit.delay is None and "jumps" in fit.notes[-1]


def test_legs_lie_between_waypoints_or_where_the_plan_slows_down(plan):
    found = leg_instants(plan)
    given = leg_instants(plan, CORNERS)
    assert len(found) == len(given) == 5
    assert abs(found - given).max() < 1.0
    circle = minsnap.circle(radius=3.0, period=9.0).sample(20.0)
    assert len(leg_instants(circle)) >= 3
