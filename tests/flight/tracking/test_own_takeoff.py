"""Missions from the ground that ArduCopter begins with its own take-off: compared and learned from where they join."""

from dataclasses import replace

import numpy as np
import pytest

import minsnap
from minsnap.files.flight_log import FlightLog
from minsnap.files.frames import map_vectors
from minsnap.flight.mavlink.setpoints import tabulate
from minsnap.flight.tracking.log_comparison import compare_in_log
from minsnap.flight.tracking.own_takeoff import joins_at
from minsnap.flight.tracking.tuning import learn_from
from minsnap.trajectory.samples import Samples

LIMITS = minsnap.Limits(speed=2.0, acceleration=2.0, jerk=20.0)
MISSIONS = {"short": (1.0, 1.0, 1), "low": (0.8, 2.0, 1), "usual": (2.0, 4.0, 1), "long": (5.0, 4.0, 6)}


def mission(height, length, laps):
    stops = (minsnap.Stop((0, 0, height)), minsnap.Stop((length, 0, height)), minsnap.Stop((length, 3, height)))
    course = minsnap.Course(stops * laps, takeoff=True, limits=LIMITS)
    return minsnap.plan_mission(course).trajectory.sample(20.0)


def sent_for(file, height, lag=0.0):
    """What is sent for it after a take-off to half a metre, or half of the climb, and where the vehicle was then."""
    rows = tabulate(file).lifted(min(0.5, height / 2.0)).rows
    place = map_vectors(rows[:, :3], "ned", "enu")
    place = np.concatenate([np.tile(place[0], (60, 1)), place, np.tile(place[-1], (60, 1))])
    t = np.arange(len(place)) / 20.0
    flown = np.stack([np.interp(t - lag, t, column) for column in place.T], axis=1)
    return Samples(t, place), Samples(t, flown)


@pytest.mark.parametrize("name", MISSIONS)
def test_a_mission_is_found_whole_from_where_it_joins_its_file(name):
    """Short ones were told to follow no file, longer ones to have been flown 0.7 m higher."""
    file = mission(*MISSIONS[name])
    (found,) = compare_in_log(file, *sent_for(file, MISSIONS[name][0]))
    assert found.place.begin == pytest.approx(joins_at(file), abs=1e-9) and found.place.end is None
    assert not found.place.shift.any() and found.comparison.max_error < 0.02
    assert "took off by itself" in found.remarks()[0] and len(found.remarks()) == 1


@pytest.mark.parametrize("name", MISSIONS)
def test_a_mission_that_is_flown_from_the_ground_is_compared_from_there(name):
    file = mission(*MISSIONS[name])
    (found,) = compare_in_log(file, file, file)
    assert found.place.begin == 0.0 and found.place.end is None and found.remarks() == []


def test_nothing_is_learned_of_a_climb_that_the_autopilot_flew(monkeypatch):
    file = mission(*MISSIONS["usual"])
    sent, flown = sent_for(file, 2.0, lag=0.2)
    log = FlightLog(sent, flown, 0.0)
    monkeypatch.setattr("minsnap.flight.tracking.tuning.load_log", lambda _: log)
    learned = learn_from(file, file, "flight.bin").next
    early = file.t < 0.5 * joins_at(file)
    assert np.abs(learned.position[early] - file.position[early]).max() < 0.1
    assert np.abs(learned.position - file.position).max() > 0.2


def test_files_in_the_plane_or_that_do_not_climb_join_at_once():
    still = replace(mission(2.0, 4.0, 1), yaw=None)
    assert joins_at(still[still.t > 5.0]) == 0.0
    assert joins_at(Samples(still.t, still.position[:, :2])) == 0.0
