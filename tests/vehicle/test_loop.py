import numpy as np
import pytest
from loop_flights import flown

import minsnap
from minsnap import Loop
from minsnap.errors import FileError, VehicleError
from minsnap.vehicle.autopilot_gains import loop_parameters

PLAIN = {"position_gain": 1.0, "velocity_gain": 3.0, "lag": 0.1, "delay": 0.0, "drag": 0.0}


def test_px4s_default_gains_give_the_known_width_of_the_tube():
    loop = Loop.px4(lag=0.1)
    assert loop.error_gain == pytest.approx(0.93, abs=0.01)
    assert Loop.px4().error_gain == pytest.approx(0.951, abs=1e-3)
    assert loop.drag == (0.3, 0.3)
    assert Loop.px4().widths(2.0, 3.0).error == pytest.approx(2.0 * Loop.px4().wind_gain)


def test_the_bound_is_the_integral_of_the_response_where_that_is_known():
    """Without a sign change the integral of h is the error that a constant acceleration leaves: 1 / (kp kv)."""
    loop = Loop(**PLAIN)
    assert loop.error_gain == pytest.approx(1.0 / 3.0, rel=1e-3)
    assert loop.error_gain >= 1.0 / 3.0


def test_no_wind_no_width_and_twice_the_wind_twice_the_width():
    loop = Loop.ardupilot(drag=0.4)
    still, one, two = (loop.widths(wind, 3.0) for wind in (0.0, 1.5, 3.0))
    assert (still.error, still.rate, still.command) == (0.0, 0.0, 0.0)
    for name in ("error", "rate", "command"):
        assert getattr(two, name) == pytest.approx(2.0 * getattr(one, name))


def test_more_doubt_about_the_drag_makes_a_wider_tube():
    sure, unsure, none = (Loop.px4(drag_error=error).widths(1.0, 4.0).error for error in (0.0, 0.1, 5.0))
    assert sure < unsure
    assert none == np.inf


@pytest.mark.parametrize("loop", [Loop.px4(), Loop.ardupilot(), Loop.px4(delay=0.0)], ids=["px4", "copter", "no_delay"])
def test_a_thousand_gusts_stay_within_the_width_and_the_worst_one_reaches_it(loop):
    step, seconds = 0.004, 24.0
    t, worst = loop.worst_gust(seconds, 1.0 / step)
    draw = np.random.default_rng(5)
    switched = np.sign(np.sin(draw.uniform(0.1, 12.0, 499) * t[:, None] + draw.uniform(0.0, 6.0, 499)))
    shifted = np.stack([np.roll(worst, int(shift)) for shift in draw.integers(0, len(t), 400)], axis=1)
    noise = np.clip(np.cumsum(draw.normal(0.0, 0.2, (len(t), 100)), axis=0), -1.0, 1.0)
    gusts = np.concatenate((worst[:, None], switched, shifted, noise), axis=1)
    assert gusts.shape[1] == 1000
    axis = loop.axes[0]
    gains = axis.position_gain, axis.velocity_gain, axis.velocity_integral, axis.velocity_derivative
    errors = np.abs(flown(gains, axis.drag, axis.lag, axis.delay, axis.drag * gusts, step)).max(axis=0)
    width = loop.widths(1.0, 0.0).error
    assert errors.max() <= 1.005 * width  # the steps of this test are not exact
    assert errors[0] >= 0.999 * errors.max()
    assert errors[0] >= width / 1.05


def test_a_loop_that_is_not_stable_is_refused():
    with pytest.raises(VehicleError, match="not stable"):
        Loop.px4(delay=1.0)
    with pytest.raises(VehicleError, match="not stable"):
        Loop(position_gain=5.0, velocity_gain=1.0, lag=0.5)


def test_parameters_of_both_autopilots_by_their_names():
    loop = Loop.px4({"MPC_XY_P": 1.2, "MPC_TILTMAX_AIR": 30.0, "MPC_THR_HOVER": 0.4, "MC_ROLL_P": 8.0, "SYS_ID": 1})
    assert loop.position_gain == (1.2, 1.0)
    assert loop.lag[0] == pytest.approx(0.125)
    assert loop.tilt == pytest.approx(np.radians(30.0))
    assert loop.max_thrust == pytest.approx(2.5)
    old, new = (
        Loop.ardupilot({"PSC_VELXY_P": 1.5, "ANGLE_MAX": 4500}),
        Loop.ardupilot({"PSC_NE_VEL_P": 1.5, "ATC_ANGLE_MAX": 45.0}),
    )
    assert old == new
    assert {"ANGLE_MAX", "ATC_ANGLE_MAX"} <= set(loop_parameters("ardupilot")), "both are asked of a vehicle"
    assert old.of_error
    assert old.velocity_gain[0] == 1.5


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda: Loop.px4({"MPC_XY_P": "fast"}), "MPC_XY_P"),
        (lambda: Loop.px4([1.0]), "mapping"),
        (lambda: Loop.px4({"MPC_THR_HOVER": 1.2}), "cannot hover"),
        (lambda: Loop.px4(gain=1.0), "a loop has no gain"),
        (lambda: Loop(position_gain=(1.0, 2.0, 3.0), velocity_gain=2.0), "two for horizontal and vertical"),
        (lambda: Loop(position_gain=1.0, velocity_gain=-2.0), "velocity_gain"),
        (lambda: Loop(**PLAIN | {"drag": float("nan")}), "drag"),
        (lambda: Loop(**PLAIN, tilt=2.0), "the tilt"),
        (lambda: Loop(**PLAIN, lead=20.0), "the lead"),
        (lambda: Loop(**PLAIN, model_error=-1.0), "model_error"),
    ],
)
def test_what_is_no_loop_is_refused(call, said):
    with pytest.raises(VehicleError, match=said):
        call()


def test_a_loop_is_the_same_from_its_file(tmp_path):
    loop = Loop.ardupilot(drag=(0.25, 0.4), lead=0.1)
    loop.to_yaml(tmp_path / "loop.yaml")
    assert Loop.from_yaml(tmp_path / "loop.yaml") == loop
    (tmp_path / "mine.yaml").write_text("autopilot: px4\nparameters: {MPC_XY_P: 1.2}\ndrag: 0.5\n")
    assert Loop.from_yaml(tmp_path / "mine.yaml") == Loop.px4({"MPC_XY_P": 1.2}, drag=0.5)


@pytest.mark.parametrize(
    "text", ["autopilot: betaflight\n", "position_gain: 1\n", "gains: 3\n", "- 1\n", "parameters: {MPC_XY_P: 1}\n"]
)
def test_a_file_that_is_no_loop_is_refused(tmp_path, text):
    (tmp_path / "loop.yaml").write_text(text)
    with pytest.raises(VehicleError):
        Loop.from_yaml(tmp_path / "loop.yaml")


def test_a_file_that_is_missing_is_refused(tmp_path):
    with pytest.raises(FileError):
        Loop.from_yaml(tmp_path / "none.yaml")


SMOOTH = minsnap.plan([(0, 0), (3, 0), (3, 2)], total_time=6.0)
CUBIC = minsnap.plan([(0, 0), (3, 0)], total_time=3.0, degree=3)
JUMPS = CUBIC.then(minsnap.plan([(3, 0), (3, 2)], total_time=3.0, degree=3))


@pytest.mark.parametrize("path", [SMOOTH, JUMPS], ids=["smooth", "jumps"])
def test_the_flight_in_still_air_is_that_of_the_loop_step_by_step(path):
    from minsnap.vehicle.expected_flight import expected_flight

    loop = Loop.px4(drag=0.5, offset_drag=0.2, latency=0.06, lead=0.02)
    flight = expected_flight(loop, path)
    step = 1e-3
    t = np.arange(0.0, 8.0, step)
    axis = loop.axes[0]
    gains = axis.position_gain, axis.velocity_gain, axis.velocity_integral, axis.velocity_derivative
    late = np.clip(t - 0.04, 0.0, 6.0)
    inside = (t > 0.04) & (t < 6.04)
    for which in (0, 1):
        asked = np.stack([path(late)[:, which], np.where(inside, path(late, 1)[:, which], 0.0)], axis=1)
        feed = np.where(inside, path(late, 2)[:, which], 0.0) + 0.2 * asked[:, 1]
        stepped = flown(gains, axis.drag, axis.lag, axis.delay, np.zeros((len(t), 1)), step, asked, feed)[:, 0]
        assert np.abs(flight.at(t)[:, which] - stepped).max() < 5e-3
    errors = np.linalg.norm(flight.at(t) - path(np.clip(t, 0.0, 6.0)), axis=1)
    assert errors.max() <= flight.lag <= 1.05 * errors.max()
