"""Files of plans keep what certifies them again: obstacles, gates, tolerances, pins and stops."""

import json

import numpy as np
import pytest

import minsnap
from minsnap import Ball, Cuboid, Cylinder, Ellipsoid, Gate, Limits
from minsnap.errors import FileError
from minsnap.files.flown_margins import find_flown_margins
from minsnap.files.formats.polynomials import read_polynomials, write_polynomials
from minsnap.files.plan_file import PassedStop

GATE = Gate((3, 0, 1), (1, 0, 0), 1.0, crossing=1, margin=0.2)
PLACES = [(0, 0, 1), GATE, (6, 1, 1), (8, 0, 1)]
AVOID = [Cylinder((4.5, -1.0), 0.3), Cylinder((1.0, 3.0), 0.5, high=2.0), Ellipsoid((6, 3, 1), (1, 0.5, 0.5))]
AVOID += [Cuboid((-np.inf, -np.inf, -9), (np.inf, np.inf, -1))]
BALLS = Ball([0.0, 0.0, 0.3, 0.0])
END = {"velocity": (1.0, 0.0, 0.0)}


@pytest.fixture(scope="module")
def plan():
    return minsnap.plan(PLACES, limits=Limits(speed=3.0), waypoint_tolerance=BALLS, avoid=AVOID, end=END)


@pytest.fixture
def write(plan, tmp_path):
    """Write the plan with all that it keeps, changed by hand, and read it."""

    def written(change=lambda content: None, name="plan.json", **others):
        file = tmp_path / name
        facts = {"waypoints": PLACES, "limits": Limits(speed=3.0), "avoid": AVOID, "tolerance": BALLS, "pins": {3: END}}
        write_polynomials(plan, file, **facts | others)
        if name.endswith(".json"):
            content = json.loads(file.read_text())
            change(content)
            file.write_text(json.dumps(content))
        return read_polynomials(file)

    return written


@pytest.mark.parametrize("name", ["plan.json", "plan.yaml"])
def test_all_that_a_plan_keeps_reads_back_and_is_certified_again(write, plan, name):
    again = write(name=name)
    assert [one.numbers().tolist() for one in again.avoid] == [one.numbers().tolist() for one in AVOID]
    assert again.tolerance.radius.tolist() == [0.0, 0.0, 0.3, 0.0]
    assert again.pins[3]["velocity"].tolist() == [1.0, 0.0, 0.0]
    assert [type(place) is Gate for place in again.places] == [False, True, False, False]
    proof, problems = again.certified()
    own = minsnap.certify(plan, PLACES, limits=Limits(speed=3.0), tolerance=BALLS, avoid=AVOID)
    assert proof.ok and problems == [] and proof.obstacle_margin == own.obstacle_margin
    assert again.passages[0].clearance >= 0.2 - 1e-7


def _moved_gate(content):
    for corner in content["openings"][0]["corners"]:
        corner[1] += 3.0


BESIDE = {"stops": [{"position": [6.0, 2.0, 1.0], "ball": 0.5}]}
CHANGES = {
    "m inside obstacle 0 at": lambda c: c["avoid"].insert(0, {"cylinder": [3.0, 0.0, 0.3]}),
    "gate 1 0 times": _moved_gate,
    "gate 1 against its direction": lambda c: c["openings"][0].update(crossing=-1),
    "its margin is 0.45 m": lambda c: c["openings"][0].update(margin=0.45),
    "outside of the tolerance": lambda c: c.update(waypoint_tolerance={"ball": [0.0, 0.0, 0.01, 0.0]}),
    "another velocity than its file says at waypoint 3": lambda c: c["pins"][0].update(velocity=[2.0, 0.0, 0.0]),
    "misses waypoint 0 by": lambda c: c.update(BESIDE),
}


@pytest.mark.parametrize("said", CHANGES)
def test_a_plan_that_does_not_keep_what_its_file_says_is_told(write, said):
    problems = write(CHANGES[said]).certified()[1]
    assert any(said in problem for problem in problems), problems


def test_files_without_these_are_read_as_before(write):
    def old(content):
        for name in ("avoid", "waypoint_tolerance", "pins", "stops"):
            del content[name]
        content["waypoints"][1] = [3.0, 0.1, 1.0]  # where the curve passes the gate, as they had it
        content["certificate"]["waypoint_error"] = 1.0
        del content["certificate"]["obstacle_margin"]

    again = write(old)
    assert again.certified()[1] == [] and again.avoid == () and again.places is again.waypoints


@pytest.mark.parametrize(
    "change",
    [{"avoid": [{"sphere": [1, 2, 3]}]}, {"avoid": [{"cylinder": [1, 2]}]}, {"pins": [{"waypoint": 9}]}]
    + [{"pins": [{"waypoint": 1, "speed": [1, 0, 0]}]}, {"stops": [{"position": [1, 2]}]}, {"avoid": 3}]
    + [{"waypoint_tolerance": {"ball": "x"}}, {"certificate": {"max_speed": "fast"}}],
    ids=str,
)
def test_what_they_are_not_is_refused_in_a_sentence(write, change):
    with pytest.raises(FileError, match=r"plan\.json"):
        write(lambda content: content.update(change))


def test_an_obstacle_without_a_description_is_refused(write):
    class Mine:
        def numbers(self):
            return Cylinder((0, 9), 1.0).numbers()

    with pytest.raises(FileError, match="an obstacle of kind Mine has no description"):
        write(avoid=[Mine()])


def test_what_a_flight_kept_is_that_of_its_samples(write, plan):
    stored = write(corridor=1.0)
    flight = plan.sample(500.0)
    kept = find_flown_margins(stored, flight)
    proved = stored.proof.corridor_margin  # of each leg to its ends, where a sample counts to the better of two
    assert kept.stayed_inside and proved - 1e-9 <= kept.corridor.margin <= proved + 0.05
    assert kept.obstacle.value == pytest.approx(stored.proof.obstacle_margin, abs=1e-2)
    assert kept.gates[0].clearance == pytest.approx(stored.passages[0].clearance, abs=1e-3)
    aside = find_flown_margins(stored, minsnap.Samples(flight.t, flight.position + [0.0, 1.2, 0.0]))
    assert aside.stayed_inside is False and aside.gates[0].clearance < 0.0 and aside.corridor.margin < 0.0
    short = find_flown_margins(stored, flight[: len(flight) // 8])
    assert short.gates[0].clearance < -0.5
    assert find_flown_margins(write(gates={}, avoid=None), flight).stayed_inside is None


def test_a_stop_is_missed_by_its_distance_outside_of_its_ball_or_box():
    places = np.array([[0.0, 0.0, 1.0], [3.0, 0.4, 1.0]])
    assert PassedStop(np.array([3.0, 0.0, 1.0])).missed(places) == pytest.approx(0.4)
    assert PassedStop(np.array([3.0, 0.0, 1.0]), ball=0.5).missed(places) <= 0.0
    assert PassedStop(np.array([3.3, 0.0, 1.0]), box=0.3).missed(places) == pytest.approx(0.1)
