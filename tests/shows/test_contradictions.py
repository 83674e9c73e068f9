"""What a show says twice and differently, or without effect, is refused in a sentence before anything is planned."""

import pytest

import minsnap
from minsnap.errors import MinsnapError
from minsnap.shows.show import fly
from minsnap.shows.show_yaml import read_show

SHOW = """
vehicles: 6
separation: 1
limits: {speed: 3, acceleration: 2}
home: {grid: {spacing: 2}}
"""
NEAR = SHOW.replace("spacing: 2", "spacing: 0.6") + "ground: 0.5\n"
RING = "formation: {circle: {radius: 4, height: 8}}"
PAIR = "formation: {points: [[0, 0, 5], [3, 0, 5]]}"
TEXT = "formation: {text: {words: I, size: 20, height: 5, %s}}"


def of_act(entries):
    return f"{SHOW}acts: [{{{entries}}}]"


def of_group(entries, name="a"):
    return of_act(f"groups: [{{name: a, vehicles: 2, acts: [{{{PAIR}}}]}}, {{name: {name}, vehicles: 3, {entries}}}]")


@pytest.fixture(autouse=True)
def nothing_is_planned(monkeypatch):
    def planned(*_, **__):
        raise AssertionError("planned")

    monkeypatch.setattr("minsnap.shows.show_course.plan_fleet", planned)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        (of_act(f"vehicles: 14, {PAIR}"), "act 1 has 14 vehicles, and there are 6"),
        (of_act(f"vehicles: 5, {PAIR}"), "act 1 has 5 vehicles and 2 points"),
        (of_act("vehicles: 3, formation: {file: places.csv}"), "act 1 has 3 vehicles and 2 points"),
        (of_act(RING).replace("{grid: {spacing: 2}}", "{points: [[0, 0, 0]]}"), "home has 1 places for 6 vehicles"),
        (of_group(f"acts: [{{vehicles: 2, {RING}}}]", "b"), "act 1 of b of act 1 has 2 vehicles, and the group 3"),
        (of_group(f"acts: [{{{PAIR}}}]", "b"), "act 1 of b of act 1 has 3 vehicles and 2 points"),
        (of_group(f"acts: [{{{RING}}}]"), "two groups of act 1 are called 'a'"),
        (of_act(f"name: ' ', {RING}"), "the name of act 1 is empty"),
        (of_act(f"fade: true, {RING}"), "act 1 has fade and no colour"),
        (of_act(f"hold: 4, lights: [{{after: 5, colour: red}}], {RING}"), "5 s after its arrival, and it lasts 4 s"),
        (of_act(f"colour: {{from: red, to: blue}}, {RING}"), "all of its points have the same z"),
        (of_act("colour: {from: red, to: blue, along: y}, " + TEXT % "outlines: false"), "such as along: z"),
        (of_act(TEXT % "font: DejaVu Sans, outlines: false"), "leave out outlines: false"),
        (of_act(f"moves: [{{seconds: 5}}], {RING}"), "a move of act 1 moves nothing"),
        (of_act(f"name: x, moves: [{{along: [[0, 0, 0]]}}], {RING}"), "a move of act 'x': a trajectory needs"),
        (of_act(f"delay: 2, seconds: 9, {RING}"), "no flight there takes less than 10.00 s"),
        (of_act(f"colr: red, {RING}"), "acts 1: 'colr' is not known: did you mean colour?"),
        (f"{of_act(RING)}\nland: any\nreturn_home: false", "leave out at whose home they land"),
        (f"{of_act(RING)}\ntake_off: {{layer: 4}}", "no homes are so near that they are left in turn"),
        (f"{NEAR}acts: [{{{RING}}}]\nlayers: 3", "left in turn, each group at a height of its own: leave layers out"),
        (f"{of_act(RING)}\nroom: [[9, 9, 9], [-9, -9, 0]]", "the first corner of the room is not below the second"),
        (f"{of_act(RING)}\nroom: [[-9, -9, 0], [9, 9, 9]]\ntake_off: 12", "of the end of take_off is 3 m outside"),
        (f"{of_act(RING)}\nseed: -1", "seed is -1"),
        (of_act(RING) + SHOW, "is there twice"),
    ],
)
def test_what_does_not_go_together_is_said(tmp_path, text, sentence):
    (tmp_path / "places.csv").write_text("x,y,z\n0,0,5\n3,0,5\n")
    (tmp_path / "show.yaml").write_text(text)
    with pytest.raises(MinsnapError) as said:
        fly(read_show(tmp_path / "show.yaml"), tmp_path / "flights")
    assert sentence in f"{said.value}" and "\n" not in f"{said.value}"
    assert not (tmp_path / "flights").exists()


@pytest.mark.parametrize(
    "text",
    [
        of_act(f"vehicles: 2, {PAIR}"),
        of_group("acts: [{vehicles: 3, formation: {circle: {radius: 4, height: 12}}}]", "b"),
        of_act(f"colour: {{from: red, to: blue, period: 4}}, {RING}"),
        of_act(f"hold: 4, moves: [{{turn: 90, seconds: 9}}], lights: [{{after: 13, colour: red}}], {RING}"),
        f"{of_act(RING)}\nland: {{speed: 1}}\nreturn_home: false",
    ],
)
def test_what_goes_together_is_planned(tmp_path, text):
    (tmp_path / "show.yaml").write_text(text)
    with pytest.raises(AssertionError, match="planned"):
        fly(read_show(tmp_path / "show.yaml"))


def test_an_act_that_is_called_as_a_flight_of_the_show_has_one_cue():
    """Cues of acts called return, take-off and landing were those of the flights of these names too."""
    from minsnap.shows.acts import Act, Show
    from minsnap.shows.formations import circle, grid
    from minsnap.shows.show import FlownShow
    from minsnap.shows.timeline import Stage

    acts = tuple(Act(name, circle(4, 4.0, 8.0)) for name in ("return", "landing"))
    show = Show(grid(4, 2.0), acts, minsnap.Separation(1.0), minsnap.Limits(speed=3.0))
    names = ("take-off", "return", "landing", "return", "landing")
    stages = tuple(Stage(name, 5.0 * i, 5.0 * i + 3.0, 5.0 * i + 5.0, "") for i, name in enumerate(names))
    fleet = minsnap.Fleet((minsnap.plan([(0, 0, 0), (1, 0, 0)], total_time=25.0),))
    assert FlownShow(fleet, (), stages).sheet(show, "x").cues == ((8.0, "return"), (13.0, "landing"))
