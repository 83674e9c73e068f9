"""Logs that are read as one: parts into which an autopilot split a flight, and several flights of one vehicle."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import minsnap
from minsnap.errors import InputError
from minsnap.files import joined_logs, read_log, read_samples
from minsnap.files.autopilot_logs import write_ulog
from minsnap.flight import fit_flight
from minsnap.flight.tracking.log_comparison import compare_in_log
from minsnap.flight.tracking.simulated_flights import simulated_log

HERE = Path(__file__).parents[2] / "recorded"


def part(log, start, end):
    """Return the rows of a log between two instants; its clock goes on."""

    def kept(samples):
        return samples[(samples.t >= start) & (samples.t < end)]

    felt = log.inertial
    spans = [(t >= start) & (t < end) for t in (felt.attitude_t, felt.force_t, felt.throttle_t)]
    turned = {"attitude_t": felt.attitude_t[spans[0]], "quaternion": felt.quaternion[spans[0]]}
    pushed = {"force_t": felt.force_t[spans[1]], "specific_force": felt.specific_force[spans[1]]}
    thrust = {"throttle_t": felt.throttle_t[spans[2]], "throttle": felt.throttle[spans[2]]}
    return replace(
        log,
        reference=kept(log.reference),
        flight=kept(log.flight),
        inertial=replace(felt, **turned, **pushed, **thrust),
    )


@pytest.fixture(scope="module")
def split(tmp_path_factory):
    """A flight whose log begins anew on its way, and the two files."""
    folder = tmp_path_factory.mktemp("split")
    path = minsnap.lemniscate(period=8.0, laps=2)
    vehicle = minsnap.vehicle.Quadrotor.px4_sih()
    flight = minsnap.flight.simulate(vehicle, minsnap.flight.CascadeController(), path, setpoint_rate=20.0)
    log = simulated_log(vehicle, flight, path.sample(20.0))
    middle = 0.55 * log.end
    files = [folder / "1.ulg", folder / "2.ulg"]
    for file, span in zip(files, ((0.0, middle), (middle + 0.3, np.inf)), strict=True):
        write_ulog(part(log, *span), file)
    minsnap.write_csv(path.sample(20.0), folder / "plan.csv")
    return log, files, folder / "plan.csv"


def test_a_flight_that_was_split_is_whole_again(split):
    log, files, plan = split
    wanted = read_samples(plan)
    (whole,) = compare_in_log(wanted, log.reference, log.flight)
    (alone,) = compare_in_log(wanted, *(getattr(read_log(files[0]), name) for name in ("reference", "flight")))
    assert alone.place.end is not None
    for order in (files, files[::-1]):
        joined = joined_logs([read_log(file, inertial=True) for file in order])
        (found,) = compare_in_log(wanted, joined.reference, joined.flight)
        assert found.place.end is None
        assert found.comparison.rmse_3d == pytest.approx(whole.comparison.rmse_3d, rel=0.03)
        assert joined.end == pytest.approx(log.end)


def test_flights_of_several_boots_tell_more_together(split):
    log, _, plan = split
    joined = joined_logs([log, log])
    assert (np.diff(joined.flight.t) > 0.0).all() and (np.diff(joined.inertial.force_t) > 0.0).all()
    assert len(compare_in_log(read_samples(plan), joined.reference, joined.flight)) == 2
    one, both = fit_flight(log), fit_flight([log, log])
    for axis in range(2):
        assert both.axes[axis].linear.value == pytest.approx(one.axes[axis].linear.value, rel=0.02)
        assert both.axes[axis].linear.error <= one.axes[axis].linear.error
    assert both.hover.value == pytest.approx(one.hover.value, rel=0.01)
    assert joined_logs([log]) is log
    with pytest.raises(InputError, match="no log to join"):
        joined_logs([])


def test_the_time_on_the_ground_between_two_flights_tells_nothing(split):
    log, *_ = split
    rest, felt = 20.0, log.inertial
    t = log.end + 1.0 + np.arange(int(rest * 50)) / 50.0
    still, standing = np.tile(log.flight.position[-1], (len(t), 1)), np.ones(len(t))
    ground = replace(
        log,
        start=0.0,
        reference=minsnap.Samples(t, still, 0.0 * still, 0.0 * still),
        flight=minsnap.Samples(t, still, 0.0 * still),
        inertial=replace(
            felt,
            attitude_t=t,
            quaternion=np.outer(standing, (1.0, 0.0, 0.0, 0.0)),
            force_t=t,
            specific_force=np.outer(standing, (0.2, 0.0, 9.81)),
            throttle_t=t,
            throttle=0.0 * t,
        ),
    )
    alone, between = fit_flight(log), fit_flight([log, replace(ground, start=log.end + 1.0), log])
    assert between.hover.value == pytest.approx(alone.hover.value, rel=0.02)
    assert between.axes[0].linear.value == pytest.approx(alone.axes[0].linear.value, rel=0.05)
    assert any("in which it hardly moves, are left out" in note for note in between.notes)


def test_the_commands_read_several_logs_as_one(split, call, tmp_path):
    _, files, plan = split
    done = call("compare", plan, *files, "--join", "--json")
    assert done.returncode == 0, done.stderr
    ((name, figures),) = json.loads(done.stdout).items()
    assert name == "1.ulg and 1 more" and "followed_until" not in figures
    fitted = call("fit", *files, "--json", "-o", tmp_path / "mine.yaml")
    assert fitted.returncode == 0, fitted.stderr
    assert json.loads(fitted.stdout)["drag per mass"]["x"]["linear"] is not None
    for arguments, said in (
        (("compare", plan, files[0], "--join"), "two or more logs as one"),
        (("compare", plan, files[0], plan, "--join"), "two or more logs as one"),
        (("fit", *files, "--form", "thrust"), "--form fits one table, and 2 are given"),
    ):
        refused = call(*arguments)
        assert refused.returncode == 2 and said in refused.stderr, refused.stderr
