"""Surveys: lines as straight and as steady as is said, all of the area, turns outside and within the limits."""

import numpy as np
import pytest

import minsnap
from minsnap.errors import ShapeError

FIELD = np.array([(0, 0), (100, 20), (120, 90), (30, 120), (-20, 60)], dtype=float)
SHAPES = {
    "field": FIELD,
    "square": [(0, 0), (60, 0), (60, 40), (0, 40)],
    "triangle": [(0, 0), (50, 5), (10, 40), (0, 0)],
}
NOTCHED = [(0, 0), (60, 0), (60, 40), (30, 15), (0, 40)]


def covered(found, spacing, outline):
    """Whether every place of an area is within half a spacing of a line."""
    corners, rng = np.asarray(outline, dtype=float), np.random.default_rng(4)
    shares = rng.dirichlet(np.ones(len(corners)), 400)
    places = shares @ corners  # inside, where the outline is convex
    least = np.full(len(places), np.inf)
    for a, b in found.lines[:, :, :2]:
        along = (b - a) / np.linalg.norm(b - a)
        share = np.clip((places - a) @ along, 0.0, np.linalg.norm(b - a))
        least = np.minimum(least, np.linalg.norm(places - a - share[:, None] * along, axis=1))
    return least.max() <= 0.5 * spacing + 1e-9


@pytest.mark.parametrize("name", SHAPES)
@pytest.mark.parametrize("angle", [None, 0.3, 2.0])
def test_lines_are_straight_steady_and_cover_the_area(name, angle):
    outline = SHAPES[name]
    found = minsnap.plan_survey(outline, spacing=9.0, height=25.0, speed=4.0, angle=angle)
    curve = found.trajectory
    for line, span in zip(found.lines, found.spans, strict=True):
        t = np.linspace(*span, 41)
        on = line[0] + np.linspace(0.0, 1.0, 41)[:, None] * (line[1] - line[0])
        assert np.abs(curve(t) - on).max() <= 1e-9
        assert np.abs(np.linalg.norm(curve(t, 1), axis=1) - 4.0).max() <= 1e-9
    cert = minsnap.certify(curve, limits=found.limits)
    assert cert.ok and cert.continuity >= 3
    assert np.linalg.norm(curve(0.0, 1)) < 1e-9 and np.linalg.norm(curve(curve.duration, 1)) < 1e-9
    assert covered(found, 9.0, outline) and found.outside >= -1e-9
    if angle is not None:
        way = found.lines[0, 1] - found.lines[0, 0]
        assert way[:2] / np.linalg.norm(way) == pytest.approx([np.cos(angle), np.sin(angle)])


def test_turns_stay_beyond_the_ends_of_their_lines():
    found = minsnap.plan_survey(FIELD, spacing=20.0, height=40.0, speed=8.0)
    for i in range(len(found.lines) - 1):
        turn = found.trajectory(np.linspace(found.spans[i, 1], found.spans[i + 1, 0], 201))
        way = found.lines[i, 1] - found.lines[i, 0]
        assert ((turn - found.lines[i, 1]) @ way >= -1e-6).all()


def test_lines_run_along_the_side_for_which_they_are_fewest():
    found = minsnap.plan_survey([(0, 0), (0, 90), (20, 90), (20, 0)], spacing=10.0, height=10.0)
    assert len(found.lines) == 2 and found.lines[0, 0, 0] == pytest.approx(found.lines[0, 1, 0])
    assert found.speed == 3.0 and found.limits.speed == 3.0


def test_a_notch_is_flown_over_from_the_first_crossing_to_the_last():
    found = minsnap.plan_survey(NOTCHED, spacing=10.0, height=10.0, angle=0.0)
    assert np.abs(np.diff(found.lines[:, :, 0], axis=1)).min() >= 59.9


def test_a_facade_is_flown_level_with_the_nose_at_it():
    found = minsnap.plan_facade((0, 0), (30, 0), 5, 25, 4, distance=-6.0, speed=2.0, margin=1.0)
    assert len(found.lines) == 5 and found.lines[:, 0, 2] == pytest.approx([7, 11, 15, 19, 23])
    assert found.lines[..., 1] == pytest.approx(-6.0) and found.trajectory.yaw(3.0) == pytest.approx(np.pi / 2)
    assert sorted(found.lines[0, :, 0]) == pytest.approx([-1.0, 31.0])
    assert minsnap.certify(found.trajectory, limits=found.limits).ok


def test_quicker_turns_shorten_the_flight():
    times = [
        minsnap.plan_survey(SHAPES["square"], 10.0, 30.0, limits=minsnap.Limits(speed=5, acceleration=a, jerk=40))
        for a in (1.0, 3.0, 9.0)
    ]
    assert times[0].trajectory.duration > times[1].trajectory.duration > times[2].trajectory.duration


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        ({"outline": [(0, 0), (1, 1)]}, "the outline of 2 corners has no area"),
        ({"outline": [(0, 0), (1, 1), (2, 2)]}, "has no area"),
        ({"outline": "no"}, "give the corners of an area"),
        ({"spacing": 0.0}, "the spacing"),
        ({"spacing": 1e-3}, "at most 2000 are planned"),
        ({"height": float("nan")}, "the height"),
        ({"angle": "north"}, "the angle"),
        ({"speed": -1.0}, "the speed"),
        ({"speed": 9.0, "limits": minsnap.Limits(speed=5.0)}, "above the limit of 5"),
        ({"margin": -1.0}, "the margin is -1"),
    ],
)
def test_what_makes_no_sense_is_one_sentence(asked, said):
    with pytest.raises(ShapeError, match=said) as refused:
        minsnap.plan_survey(**{"outline": SHAPES["square"], "spacing": 10.0, "height": 10.0} | asked)
    assert "\n" not in str(refused.value)


def test_a_wall_without_length_or_height_is_refused():
    with pytest.raises(ShapeError, match="give two different places"):
        minsnap.plan_facade((0, 0), (0, 0), 1, 2, 1)
    with pytest.raises(ShapeError, match="give the lower height first"):
        minsnap.plan_facade((0, 0), (5, 0), 2, 2, 1)
