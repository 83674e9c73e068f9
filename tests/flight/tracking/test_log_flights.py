"""Flights found in a log by its own setpoints: on a clock that runs differently, among climbs, holds and landings."""

import numpy as np
import pytest

import minsnap
from minsnap.errors import InputError
from minsnap.flight.tracking.comparison import jump_remarks
from minsnap.flight.tracking.log_comparison import compare_in_log, find_flights
from minsnap.flight.tracking.tracking_plot import plot_comparison
from minsnap.trajectory.samples import Samples

FILE = minsnap.lemniscate().sample(20.0)
HOLD, CLIMB = 5.0, 4.0


def course(t, starts, duration=FILE.duration, shift=(0.0, 0.0, 0.0)):
    """Position asked for at the instants of a log: on the ground, climbing, holding, flying, landing."""
    first, last = FILE.position[0] + (0, 0, 1.5), FILE.position[-1] + (0, 0, 1.5)
    knots, values = [0.0, 2.0, 2.0 + CLIMB], [first * (1, 1, 0), first * (1, 1, 0), first]
    for start in starts:
        knots += list(start + FILE.t * duration / FILE.duration)
        values += list(FILE.position + (0, 0, 1.5))
    knots += [starts[-1] + duration + 3.0, starts[-1] + duration + 6.0]
    values += [last, last * (1, 1, 0)]
    return np.stack([np.interp(t, knots, column) for column in np.array(values).T], axis=1) + shift


FILE_IN_AIR = Samples(FILE.t, FILE.position + (0, 0, 1.5), FILE.velocity)


def log_of(starts, rate=1.0, late=0.0, shift=(0.0, 0.0, 0.0), error=(0.0, 0.0, 0.0), boot=0.0):
    """Setpoints and positions of a log whose clock runs ``rate`` times slower than the file's."""
    duration = FILE.duration / rate
    end = starts[-1] + duration + 8.0
    asked, seen = np.arange(0.0, end, 0.05 / rate), np.arange(0.0, end, 0.02)
    setpoints = Samples(asked + boot, course(asked, starts, duration, shift=shift))
    flown = Samples(seen + boot, course(seen - late / rate, starts, duration, shift=shift) + error)
    return setpoints, flown


@pytest.mark.parametrize("rate", [1.0, 1.013, 0.98])
def test_all_flights_are_found_at_their_time(rate):
    starts = [9.0, 9.0 + FILE.duration / rate + HOLD]
    setpoints, _ = log_of(starts, rate, boot=100.0)
    found = find_flights(FILE_IN_AIR, setpoints)
    assert [one.start for one in found] == pytest.approx([100.0 + start for start in starts], abs=0.03)
    assert [one.rate for one in found] == pytest.approx([rate] * 2, abs=2e-3)
    assert max(one.mismatch for one in found) < 0.02 and not any(one.shift.any() for one in found)


def test_positions_that_end_before_the_setpoints_are_said():
    setpoints, flown = log_of([9.0])
    (whole,) = compare_in_log(FILE_IN_AIR, setpoints, flown)
    (part,) = compare_in_log(FILE_IN_AIR, setpoints, flown[flown.t < 9.0 + 3.0])
    assert whole.remarks() == [] and "positions are known from 0.0" in part.remarks()[0]


def test_setpoints_that_last_for_days_are_those_of_a_wrong_time():
    """A search through all of them did not end."""
    setpoints, flown = log_of([9.0])
    t = setpoints.t.copy()
    t[-1] += 1e6
    with pytest.raises(InputError, match="the log's setpoints last 1e.06 s: one of its times is wrong"):
        compare_in_log(FILE_IN_AIR, Samples(t, setpoints.position), flown)


def test_lateness_stays_an_error_and_is_told_apart():
    setpoints, flown = log_of([9.0], rate=1.013, late=0.25, error=(0.0, 0.0, 0.1))
    (one,) = compare_in_log(FILE_IN_AIR, setpoints, flown)
    t = np.arange(0.0, FILE.duration, 0.005)
    there = np.stack([np.interp(t, FILE.t, column) for column in FILE.position.T], 1)
    late = np.stack([np.interp(t - 0.25, FILE.t, column) for column in FILE.position.T], 1) + [0, 0, 0.1]
    expected = np.sqrt(((late - there) ** 2).sum(axis=1).mean())
    assert one.comparison.rmse_3d == pytest.approx(expected, rel=0.03)
    assert one.comparison.delay == pytest.approx(0.25, abs=0.03)
    assert one.comparison.across_rmse == pytest.approx(0.1, abs=0.06) and one.comparison.along_rmse > 0.2
    assert np.median(one.comparison.along) < 0, "behind"
    assert one.remarks() == ["the log's clock runs 1.3 % slow: flown times are those of the file"]


def test_a_flight_from_another_origin_is_compared_where_the_file_lies():
    setpoints, flown = log_of([9.0], shift=(3.0, 1.0, 0.0))
    (one,) = compare_in_log(FILE_IN_AIR, setpoints, flown)
    assert one.comparison.rmse_3d < 0.02
    assert one.remarks() == ["it was flown (3.00, 1.00, 0.00) m from where the file lies, and is moved there"]
    assert np.abs(one.reference.position - FILE_IN_AIR.position).max() == 0.0
    assert np.abs(np.median(one.flight.position, axis=0) - np.median(FILE_IN_AIR.position, axis=0)).max() < 0.1


def test_a_constant_offset_of_more_than_a_metre_is_said():
    setpoints, flown = log_of([9.0], error=(0.0, 2.0, 0.0))
    (one,) = compare_in_log(FILE_IN_AIR, setpoints, flown)
    (said,) = one.remarks()
    assert "the whole flight lies (" in said and ", 2.00, " in said and "do origin and frame agree?" in said


@pytest.mark.parametrize("changed", [lambda p: p[:, [1, 0, 2]] * (1, 1, -1), lambda p: 0.3 * p])
def test_another_file_or_frame_is_refused(changed):
    setpoints, flown = log_of([9.0])
    with pytest.raises(InputError, match="the log's setpoints do not follow the file"):
        compare_in_log(FILE_IN_AIR, Samples(setpoints.t, changed(setpoints.position)), flown)


def test_a_flight_that_the_log_does_not_show_is_said():
    setpoints, flown = log_of([9.0])
    with pytest.raises(InputError, match=r"the log holds no positions during the flight that begins at [89]\."):
        compare_in_log(FILE_IN_AIR, setpoints, Samples(flown.t[:100], flown.position[:100]))


def test_the_figure_has_every_coordinate_and_the_error():
    setpoints, flown = log_of([9.0], late=0.2)
    (one,) = compare_in_log(FILE_IN_AIR, setpoints, flown)
    figure = plot_comparison({"flight": one})
    assert [ax.get_ylabel() for ax in figure.axes] == ["y [m]", "x [m]", "y [m]", "z [m]", "error [m]"]


@pytest.mark.parametrize("stop", [0.3, 0.6, 0.8])
def test_a_flight_that_was_stopped_is_compared_until_then(stop):
    setpoints, flown = log_of([9.0], late=0.2)
    end = 9.0 + stop * FILE.duration
    held = [
        np.where((part.t < end)[:, None], part.position, course(np.array([end]), [9.0])) for part in (setpoints, flown)
    ]
    (one,) = compare_in_log(FILE_IN_AIR, Samples(setpoints.t, held[0]), Samples(flown.t, held[1]))
    assert one.place.end == pytest.approx(stop * FILE.duration, abs=0.4)
    assert one.comparison.t[-1] <= one.place.end and 0.05 < one.comparison.rmse_3d < 0.6
    assert np.median(one.comparison.along) < 0
    said = one.remarks()[0]
    assert f"{100 * one.place.end / FILE.duration:.0f} %): that part is compared" in said


def test_a_jump_of_the_estimate_is_said_and_no_offset_of_the_whole_flight():
    """It was told as an offset of the whole flight, and tune learned it."""
    setpoints, flown = log_of([9.0])
    reset = Samples(flown.t, flown.position + 1.5 * (flown.t > 9.0 + 0.3 * FILE.duration)[:, None] * (1, 0, 0))
    (one,) = compare_in_log(FILE_IN_AIR, setpoints, reset)
    (remark,) = one.remarks()
    assert f"jumps by 1.5 m at {0.3 * FILE.duration:.1f}" in remark
    speed = np.gradient(flown.position, flown.t, axis=0)
    for late in (None, speed):
        assert not jump_remarks(Samples(flown.t, flown.position, late)) and not jump_remarks(flown[::20])
    t = np.arange(0.0, 40.0, 0.25)  # a circle of 8.3 m at 10 m/s, of few positions with noise
    circle = np.stack([8.3 * np.cos(1.2 * t), 8.3 * np.sin(1.2 * t), 0.0 * t], axis=1)
    noise = np.random.default_rng(0).normal(0.0, 0.02, circle.shape)
    assert not jump_remarks(Samples(t, circle + noise))
    assert jump_remarks(Samples(t, circle + noise + 2.0 * (t > 20.0)[:, None]))
    glitch = flown.position + 8.0 * (np.arange(len(flown)) == 400)[:, None]
    assert "jumps by" in jump_remarks(Samples(flown.t, glitch, speed))[0]


def test_setpoints_that_leave_the_file_do_not_change_its_clock():
    """The clock was said to run 0.9 % slow where the setpoints moved by the estimator's reset."""
    setpoints, flown = log_of([9.0])
    away = 1.2 * (setpoints.t > 9.0 + 0.43 * FILE.duration)[:, None] * (0, 1, 0)
    (one,) = compare_in_log(FILE_IN_AIR, Samples(setpoints.t, setpoints.position + away), flown)
    assert one.place.rate == pytest.approx(1.0, abs=1e-3)
    assert one.place.end == pytest.approx(0.43 * FILE.duration, abs=0.1)


def test_a_flight_that_was_paused_and_held_is_compared_until_the_pause():
    """The time of the pause counted as flown, with an error of metres."""
    setpoints, flown = log_of([9.0], late=0.2)
    stop = 9.0 + 0.4 * FILE.duration
    position = np.where((setpoints.t < stop)[:, None], setpoints.position, course(np.array([stop]), [9.0]))
    sent = Samples(setpoints.t, position)[(setpoints.t < stop) | (setpoints.t > stop + 1.5)]
    (one,) = compare_in_log(FILE_IN_AIR, sent, flown)
    assert one.place.end == pytest.approx(0.4 * FILE.duration, abs=0.1)


def test_a_log_that_ends_in_flight_is_compared_until_then():
    setpoints, flown = log_of([9.0], late=0.1)
    kept = [Samples(part.t[part.t < 14.0], part.position[part.t < 14.0]) for part in (setpoints, flown)]
    (one,) = compare_in_log(FILE_IN_AIR, *kept)
    assert one.place.end == pytest.approx(5.0, abs=0.1) and one.comparison.rmse_3d < 0.5


def test_a_fast_flight_whose_instants_are_uneven_is_found():
    """Setpoints were logged up to 0.1 s after they were sent: 0.057 m in root mean square and more, at 5 m/s."""
    path = minsnap.circle(radius=6.0, period=7.5, laps=2)
    file, noise = path.sample(20.0), np.random.default_rng(4)
    t = np.arange(0.0, path.duration + 10.0, 0.05)
    asked = path(np.clip(t - 5.0 + noise.uniform(-0.04, 0.04, len(t)), 0.0, path.duration))
    (one,) = compare_in_log(file, Samples(t, asked), Samples(t, path(np.clip(t - 5.2, 0.0, path.duration))))
    assert one.place.mismatch > 0.057 and one.place.end is None
    assert one.comparison.delay == pytest.approx(0.2, abs=0.02)


@pytest.mark.parametrize("rate", [20.0, 10.0, 4.0])
def test_setpoints_that_a_log_repeats_until_the_next_take_nothing_from_the_delay(rate):
    """The file was found half a step later, and the delay was so much smaller."""
    t = np.arange(0.0, FILE.duration + 1.0, 0.02)
    place = lambda at: np.stack([np.interp(at, FILE.t, column) for column in FILE_IN_AIR.position.T], axis=1)  # noqa: E731
    held, flown = Samples(t, place(np.floor(t * rate + 1e-9) / rate)), Samples(t, place(t - 0.25))
    (found,) = compare_in_log(FILE_IN_AIR, held, flown)
    assert found.comparison.delay == pytest.approx(0.25, abs=0.008)
