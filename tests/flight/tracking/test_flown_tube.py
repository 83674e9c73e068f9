"""Flights beside the tube of their loop: recorded ones, simulated ones, and what the command says."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import minsnap
from minsnap.errors import FitError, VehicleError
from minsnap.files.convert import read_samples
from minsnap.files.flights import load_log
from minsnap.flight import CascadeController, fit_flight, plot_flight_fit, simulate, simulated_log
from minsnap.flight.tracking.body_drag_fit import AxisDrag, FittedNumber, fitted
from minsnap.flight.tracking.flight_fit import FlightFit
from minsnap.flight.tracking.flown_tube import fit_loop, hold_in_tube
from minsnap.flight.tracking.log_comparison import compare_in_log
from minsnap.flight.tracking.tracking_plot import plot_comparison
from minsnap.plot import save_figure
from minsnap.vehicle import Quadrotor

RECORDED = Path(__file__).parents[2] / "recorded"
TRANSPORT = 0.125
"""Of the recorded flights: 0.1 s, and half the period of their setpoints [s]."""


def compared(name, ending="ulg"):
    log = load_log(RECORDED / f"{name}.{ending}")
    return compare_in_log(read_samples(RECORDED / f"{name}.json"), log.reference, log.flight)[0]


@pytest.mark.parametrize("name", ["mission", "led", "stopped"])
def test_recorded_flights_stay_in_the_tube_of_their_fitted_loop(name, tmp_path):
    loop = minsnap.Loop.from_fit(fit_flight(RECORDED / f"{name}.ulg"), minsnap.Loop.px4(latency=TRANSPORT))
    assert loop.drag_error[0] > 0.1
    held = hold_in_tube(compared(name), loop, 0.0)
    assert held.inside
    assert held.error <= held.tube.error
    assert "stayed in its tube" in held.sentence
    save_figure(plot_comparison({name: compared(name)}, tubes={name: held}), tmp_path / "held.png")


def flown(course, sent=None):
    """A flight of PX4's simulated vehicle, compared with its plan."""
    plan = minsnap.plan(course, limits=minsnap.Limits(speed=3.0, acceleration=4.0, jerk=15.0)).sample(20.0)
    given = plan if sent is None else sent(plan)
    flight = simulate(Quadrotor.px4_sih(), CascadeController(), given)
    log = simulated_log(Quadrotor.px4_sih(), flight, given)
    return compare_in_log(given, log.reference, log.flight, planned=None if sent is None else plan)[-1]


@pytest.fixture(scope="module")
def known():
    """A flight, and the loop whose lag is fitted to it: an autopilot that follows sooner than its gain says."""
    one = flown([(0, 0, 2), (7, 0, 2), (7, 4, 3), (0, 4, 2)])
    slow = minsnap.Loop.px4(drag=1.0, lag=(0.45, 0.05), model_error=0.0)
    return one, slow, fit_loop(one, slow)


def test_a_loop_is_fitted_to_a_flight_and_holds_others(known):
    one, slow, loop = known
    assert loop.lag[0] < 0.3 and loop.lag[1] == slow.lag[1] and 0.0 < loop.model_error < 0.3
    assert not hold_in_tube(one, slow, 0.0).inside
    assert hold_in_tube(one, loop, 0.0).inside
    assert hold_in_tube(flown([(0, 0, 2), (5, 5, 2), (0, 8, 2), (-4, 3, 3)]), loop, 0.0).inside


def test_a_tuned_flight_is_held_against_what_was_sent(known):
    """It was held against the plan, from which its setpoints differ by half a metre."""

    def ahead(plan):
        moved = plan.position + 0.5 * np.sin(np.pi * plan.t / plan.duration)[:, None] ** 4 * [0.0, 1.0, 0.0]
        return replace(plan, position=moved, velocity=np.gradient(moved, plan.t, axis=0), jerk=None, snap=None)

    one = flown([(0, 0, 2), (7, 0, 2), (7, 4, 3), (0, 4, 2)], ahead)
    held = hold_in_tube(one, known[2], 0.0)
    assert held.inside
    assert held.error <= held.allowed < 1.5 * held.error + held.reach
    assert not hold_in_tube(replace(one, sent=None), known[2], 0.0).inside


def test_a_loop_has_the_gains_of_the_autopilot_that_logged_the_flight():
    """ArduCopter's logs were given PX4's, without a word."""
    for ending, usual in (("ulg", minsnap.Loop.px4()), ("bin", minsnap.Loop.ardupilot())):
        loop = minsnap.Loop.from_fit(fit_flight(RECORDED / f"led.{ending}"))
        assert (loop.position_gain, loop.lag, loop.of_error) == (usual.position_gain, usual.lag, usual.of_error)


def test_a_flight_that_leaves_its_tube_is_told_and_one_that_saturates_has_none():
    held = hold_in_tube(compared("mission"), minsnap.Loop.px4(), 0.5)
    assert not held.inside
    assert "it left its tube" in held.sentence
    none = hold_in_tube(compared("mission"), minsnap.Loop.px4(tilt=0.05), 0.5)
    assert not none.inside
    assert "no tube" in none.sentence
    with pytest.raises(VehicleError):
        hold_in_tube(compared("mission"), minsnap.Loop.px4(), -1.0)


def test_the_command_holds_logs_against_their_tube(call, tmp_path):
    known = "compare", RECORDED / "mission.json", RECORDED / "mission.ulg"
    (tmp_path / "mine.yaml").write_text("autopilot: px4\ndrag: 0.92\ndrag_error: 0.2\nlatency: 0.125\n")
    held = call(*known, "--tube", "mine.yaml", "--report", "page.html", "--plot", "held.png")
    assert held.returncode == 0
    assert "stayed in its tube" in held.stdout
    assert "stayed in its tube" in (tmp_path / "page.html").read_text()
    left = call(*known, "--tube", "px4", "--wind", 0.5, "--json")
    assert left.returncode == 1
    assert json.loads(left.stdout)["mission.ulg"]["tube"]["inside"] is False
    assert "give --tube" in call(*known, "--wind", 2).stderr
    fitted = call(*known, "--tube", "mine.yaml", "--fit-loop", "fitted.yaml")
    assert fitted.returncode == 0 and minsnap.Loop.from_yaml(tmp_path / "fitted.yaml").model_error > 0.03
    assert "give --tube with it" in call(*known, "--fit-loop", "fitted.yaml").stderr
    both = call(*known, RECORDED / "mission.bin", "--tube", "px4", "--fit-loop", "fitted.yaml")
    assert "choose one" in both.stderr


def test_stated_errors_cover_the_truth_where_residuals_wander():
    """Sixty flights of a minute with residuals that wander for five seconds."""
    from scipy.signal import lfilter

    rate, truth, share = 50.0, 0.8, []
    t = np.arange(0.0, 60.0, 1.0 / rate)
    for seed in range(60):
        draw = np.random.default_rng(seed)
        kept = np.exp(-1.0 / (5.0 * rate))
        wander = 0.3 * np.sqrt(1.0 - kept**2) * lfilter([1.0], [1.0, -kept], draw.normal(size=len(t)))
        speed = 2.0 * np.sin(2.0 * np.pi * t / 20.0 + draw.uniform(0.0, 6.0))
        force = truth * speed + wander
        numbers, _ = fitted(
            lambda values, known=(speed, force): (known[1] - values[0] * known[0] - values[1])[:, None],
            np.zeros(2),
            rate,
        )
        share.append((numbers[0].value - truth) / numbers[0].error)
    assert 0.6 < np.sqrt(np.mean(np.square(share))) < 1.5
    assert np.mean(np.abs(share) < 2.0) > 0.85


def fit_with(linear, quadratic=None):
    axes = tuple(AxisDrag(1.0, FittedNumber(*linear), quadratic and FittedNumber(*quadratic)) for _ in range(3))
    return FlightFit(axes, None, None, (), np.zeros((4, 3)), np.zeros((4, 3)), np.zeros((4, 3)))


def test_coefficients_that_no_vehicle_has_are_refused_in_one_sentence(tmp_path):
    for fit in (fit_with((-0.71, 0.1)), fit_with((0.5, 0.01), (-0.2, 0.05))):
        for call in (lambda fit=fit: fit.vehicle(), lambda fit=fit: minsnap.Loop.from_fit(fit)):
            with pytest.raises(FitError, match=r"no vehicle has a negative one"):
                call()
    near = fit_with((-0.05, 0.1))
    assert (near.vehicle().drag.linear == 0.0).all()
    assert minsnap.Loop.from_fit(near).drag_error[0] == pytest.approx(0.2)
    assert plot_flight_fit(near)
